"""Spot finder of one camera, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import _centroid as centroid
from ocmm_core.camera import _search as search
from ocmm_core.camera import _windows as windows
from ocmm_core.camera._rig import USUAL_SLOTS
from ocmm_core.camera._spots import SpotBlock, SpotOptions, Window
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

    def take(self, image: NDArray[np.uint16], black: NDArray[np.uint16] = NO_BLACK) -> SpotBlock:
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
        samples = np.zeros((len(lines), self.width), np.uint16)
        for line, (left, row, n) in zip(samples, lines[:count], strict=False):
            line[:n] = image[row, left : left + n * step : step]
        search.look(samples, lines, count, black, *search_in)
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
