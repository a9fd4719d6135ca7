"""Spot finder of one camera, frame by frame: options, status values, results.

Each slot, of eight or up to 64, has a window that follows its LED; its light gives a position with
variance, or a status with the reason. The loops are in `centroid` (one window), `windows`
(tracking) and `search` (detection).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import _centroid as centroid
from ocmm_core.camera import _search as search
from ocmm_core.camera import _windows as windows
from ocmm_core.camera._rig import USUAL_SLOTS
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Int

NO_BLACK: NDArray[np.uint16] = np.zeros((0, 0), np.uint16)


@dataclass(frozen=True, slots=True)
class FinderState:
    """State of a camera between frames; the arrays are updated in place."""

    slots: Float
    """(S, N_SLOT): columns in `windows`."""
    cursor: Int
    """(2,) int64: position of the search, see `search`."""

    @classmethod
    def fresh(cls, n_slots: int = USUAL_SLOTS) -> FinderState:
        """Return the state after switch-on."""
        slots = np.zeros((n_slots, windows.N_SLOT))
        slots[:, [windows.HOME_U, windows.HOME_V]] = np.nan
        return cls(slots, np.full(2, 0, dtype=np.int64))

    def copy(self) -> FinderState:
        """Return an independent copy."""
        return FinderState(self.slots.copy(), self.cursor.copy())


class SpotFinder:
    """Find and follow spots, frame by frame; one for each camera, for one thread.

    ``start`` has the search regions of the first slots, in order; further slots stay free. Without
    any, all slots search everywhere. ``n_slots``: `MAX_SLOTS` at most.
    """

    def __init__(
        self,
        width: int,
        height: int,
        options: SpotOptions | None = None,
        start: tuple[Window, ...] = (),
        n_slots: int = USUAL_SLOTS,
    ) -> None:
        self.n_slots = n_slots
        self.width, self.height = width, height
        self.options = options or SpotOptions()
        self.packed = self.options.packed()
        self.anywhere = not start
        self.regions = _regions(start or (Window(0, 0, width, height),), width, height, n_slots)
        self.state = FinderState.fresh(n_slots)
        """May be replaced by an earlier `copy` to restore it."""

    def windows(self) -> tuple[Window | None, ...]:
        """Return the windows of the next frame by slot; None for a free slot."""
        corners = np.empty((self.n_slots, 2), np.int64)
        windows.predict_windows(self.state.slots, self.packed, self.width, self.height, corners)
        size = self.options.window
        return tuple(
            Window(int(left), int(top), size, size) if left >= 0 else None for left, top in corners
        )

    def find(self, image: NDArray[np.uint16], black: NDArray[np.uint16] = NO_BLACK) -> SpotBlock:
        """Return the result of a frame (height, width): only windows and search, less ``black``."""
        slots, size, step = self.state.slots, self.options.window, self.options.search_step
        corners = np.empty((self.n_slots, 2), np.int64)
        windows.predict_windows(slots, self.packed, self.width, self.height, corners)
        pixels = np.zeros((self.n_slots, size, size), np.uint16)
        for slot, (left, top) in enumerate(corners):
            if left >= 0:
                pixels[slot] = image[top : top + size, left : left + size]
        readings = np.empty((self.n_slots, centroid.N_READING))
        windows.measure_windows(pixels, corners, black, slots, self.packed, readings)
        search_in = (slots, self.regions, self.anywhere, self.packed)
        lines = np.empty((self.options.search_lines, 3), np.int64)
        count = search.plan(*search_in, self.state.cursor, lines)
        samples = np.empty((count, self.width), np.uint16)
        search.sample(image, lines, step, samples)
        search.scan(samples, lines, count, black, *search_in)
        block = SpotBlock.empty(1, self.n_slots)
        valid, block.saturated[0] = windows.report(
            readings, block.uv[0], block.variance[0], block.status[0]
        )
        # The sign is the bit of the last of 64 slots.
        block.valid[0] = valid & (1 << self.n_slots) - 1
        return block


def _regions(start: tuple[Window, ...], width: int, height: int, n_slots: int) -> Int:
    if len(start) > n_slots:
        raise InputError(
            "camera.windows",
            f"There are {len(start)} windows, but a camera has {n_slots}.",
            "Remove windows.",
        )
    for window in start:
        if (
            min(window.left, window.top) < 0
            or min(window.width, window.height) < 1
            or window.left + window.width > width
            or window.top + window.height > height
        ):
            raise InputError(
                "camera.windows",
                f"The window of {window.width} x {window.height} px at ({window.left}, "
                f"{window.top}) does not lie on the sensor of {width} x {height} px.",
                "Give windows that lie on the sensor.",
            )
    rows = [(window.left, window.top, window.width, window.height) for window in start]
    return np.array(rows, dtype=np.int64)


_SEARCH_PIXELS_PER_S = 16.4e6
"""Pixels read by the search outside the windows: half of the sensor's 33 MHz (thesis 2.1)."""
_HOLD_NS = 100_000_000
_SMALLEST_WINDOW, _LARGEST_WINDOW = 12, 64


class SpotStatus(IntEnum):
    """Status of a slot in one frame; only GOOD has a position."""

    GOOD = centroid.GOOD
    FREE = centroid.FREE
    DARK = centroid.DARK
    """Nothing in the window is brighter than the threshold."""
    EDGE = centroid.EDGE
    """The spot touches the edge of the window."""
    CROWDED = centroid.CROWDED
    """There are two spots in the window."""
    SATURATED = centroid.SATURATED
    """The spot is overexposed; its window keeps following it."""
    SMALL = centroid.SMALL
    LARGE = centroid.LARGE
    ELONGATED = centroid.ELONGATED
    """A reflection, or two LEDs in one."""
    DIM = centroid.DIM
    """The position would be less certain than allowed."""
    SHARED = centroid.SHARED
    """Another window holds the same spot."""
    JUMPED = centroid.JUMPED
    """The light of the spot is not that of the slot's LED."""
    UNCONFIRMED = centroid.UNCONFIRMED
    """Not yet seen in enough frames."""


@dataclass(frozen=True, slots=True)
class Window:
    """A rectangle of pixels: its first pixel and its size, px."""

    left: int
    top: int
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class SpotOptions:
    """Detection and validation of spots; lengths in px, light in counts of the converter."""

    threshold: float = 200.0
    """Of spots above background: five read noises, passed by dark pixels once a minute at most."""
    read_noise: float = 40.0
    """Standard deviation of a dark pixel from frame to frame."""
    dark_spread: float = 60.0
    """Standard deviation of the dark signal between pixels; noise without a black image."""
    black_frames: int = 64
    """Number of frames averaged in a black image."""
    response_spread: float = 0.01
    """Relative standard deviation of the response to light from pixel to pixel."""
    electrons_per_count: float = 1.0
    full_scale: float = 16383.0
    """A pixel with this value is overexposed."""
    weight_sigma: float = 1.3
    """Of the Gaussian weight; best near 1.3 times that of the spot."""
    min_pixels: int = 4
    max_pixels: int = 64
    """`min_pixels`, `max_pixels`: Above the threshold."""
    max_elongation: float = 1.25
    """Largest axis ratio without noise; two equal LEDs are told apart from 2 px on, or by light."""
    max_sigma: float = 0.15
    """Less certain positions are not reported."""
    window: int = 16
    """Width and height of a window."""
    separation: float = 3.0
    """Spots of two slots nearer than this are the same spot."""
    flux_low: float = 0.5
    flux_high: float = 1.6
    """`flux_low`, `flux_high`: Permitted light relative to this LED's usual one."""
    confirm: int = 3
    """Frames until a new spot is reported."""
    hold: int = 800
    """Frames for which a window waits for its LED before the slot is released."""
    search_step: int = 2
    search_lines: int = 2
    """`search_step`, `search_lines`: every n-th line and pixel; this many lines a frame."""

    def __post_init__(self) -> None:
        """Refuse invalid options; raise InputError."""
        for name in ("threshold", "electrons_per_count", "weight_sigma", "max_sigma",
                     "black_frames", "confirm", "search_step", "search_lines"):  # fmt: skip
            if not getattr(self, name) > 0:
                raise InputError(
                    "camera.spots",
                    f"Field '{name}' of the spot options is {getattr(self, name)}, "
                    "but must be greater than zero.",
                    "Correct that field.",
                )
        if not _SMALLEST_WINDOW <= self.window <= _LARGEST_WINDOW:
            raise InputError(
                "camera.spots",
                f"The windows are {self.window} px wide.",
                f"Give {_SMALLEST_WINDOW} to {_LARGEST_WINDOW} px.",
            )

    def at_period(self, frame_period_ns: int, width: int) -> SpotOptions:
        """Return these options with times adapted to frame period and sensor width, px."""
        samples = _SEARCH_PIXELS_PER_S * frame_period_ns * 1e-9
        return replace(
            self,
            hold=max(1, round(_HOLD_NS / frame_period_ns)),
            search_lines=max(1, int(samples / (width / self.search_step))),
        )

    def packed(self) -> Float:
        """Return the numbers in kernel form, (N_OPTIONS,)."""
        return np.array(
            [
                self.threshold, self.read_noise, self.dark_spread, self.black_frames,
                self.response_spread, self.electrons_per_count,
                self.full_scale, self.weight_sigma, self.min_pixels, self.max_pixels,
                self.max_elongation, self.max_sigma, self.window, self.separation,
                self.flux_low, self.flux_high, self.confirm, self.hold,
                self.search_step, self.search_lines,
            ],
            dtype=np.float64,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class SpotBlock:
    """Result of a camera for consecutive frames."""

    valid: NDArray[np.uint64]
    """(n,) uint64: bit s is set if slot s holds a spot."""
    saturated: NDArray[np.bool_]
    """(n,) bool: a spot is overexposed."""
    status: NDArray[np.uint8]
    """(n, S) uint8: `SpotStatus`."""
    uv: Float
    variance: Float
    """`uv`, `variance`: (n, S, 2), px and px^2; NaN where not valid."""

    @classmethod
    def empty(cls, n: int, n_slots: int = USUAL_SLOTS) -> SpotBlock:
        """Return arrays for ``n`` frames."""
        return cls(
            valid=np.zeros(n, np.uint64),
            saturated=np.zeros(n, np.bool_),
            status=np.full((n, n_slots), SpotStatus.FREE, np.uint8),
            uv=np.full((n, n_slots, 2), np.nan),
            variance=np.full((n, n_slots, 2), np.nan),
        )

    def __len__(self) -> int:
        return len(self.valid)
