"""Viewfinder: pictures, brightness and focus of all cameras while they are set up.

All cameras get one exposure time, because their time stamps must mean the same moment. Aravis can
crash on malformed packets, so that `ViewfinderProcess` does the same in a separate process.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import SpotFinder
from ocmm_core.errors import AcquisitionError
from ocmm_core.geometry import Float
from ocmm_genicam._black import BLACK_IMAGES, black_path, write_black
from ocmm_genicam._client import COMPLETE, Camera, Cameras, Image, scaled, unpack
from ocmm_genicam._link import loads_of
from ocmm_genicam._set_up import (
    Expected,
    has_decibels,
    set_exposure,
    set_gain,
    set_up,
    settings_of,
    store,
)

WANTED = 0.7
"""Brightest pixel of the brightest LED, by the full scale."""
_DARK, _BRIGHT = 0.35, 0.9
_SETTLED = 0.1
_STEPS, _TRIES = 12, 2
_MOST_STEP = 8.0
_SHARES = (1.0, 0.5, 0.25)
"""Parts of a step that are tried if an exposure time is refused."""
_FRESH_S, _PICTURE_S = 1.0, 3.0
_LATE_IMAGES = 3
_SEARCHES = 4
_SHOWN_PX = 640
_HALF_PX = 7
_CANDIDATES = 1000
_LIT = 0.3


class Brightness(StrEnum):
    """Verdict on the brightest LED since the last change of exposure or gain."""

    UNSEEN = "no LED"
    DARK = "too dark"
    GOOD = "good"
    BRIGHT = "too bright"


@dataclass(frozen=True, slots=True)
class CameraLook:
    """What one camera sees, and how it is set."""

    serial: str
    model: str
    exposure_us: float
    gain: float
    """As its maker counts it; NaN without one."""
    picture: NDArray[np.uint8]
    """(h, w): the brightest of ``factor`` x ``factor`` pixels, its root; empty without an image."""
    factor: int
    spots_px: Float
    """(n, 2): places in the whole image."""
    width_px: float
    """Median standard deviation of the spots along a row; NaN without one."""
    brightest: float
    """Brightest pixel of the spots since the last change, by the full scale; NaN without one."""
    focus: float
    """Energy of the edges over the largest one so far, 0 to 1; NaN without an image."""
    images: int
    incomplete: int
    load: str = ""
    """Images of all cameras of its network card in MB/s, capacity of the card, and its name."""

    @property
    def brightness(self) -> Brightness:
        if math.isnan(self.brightest):
            return Brightness.UNSEEN
        if self.brightest < _DARK:
            return Brightness.DARK
        return Brightness.GOOD if self.brightest <= _BRIGHT else Brightness.BRIGHT


class _View:
    """One camera with its last picture."""

    def __init__(self, camera: Camera, expected: Expected) -> None:
        self.camera, self.expected = camera, expected
        self.set_up = set_up(camera, expected)
        self.pixels = self.set_up.pixels
        self.load = ""
        self._options = replace(self.pixels.spot_options(), search_lines=expected.height)
        self._brightest, self._sharpest = math.nan, 0.0
        self._images = self._incomplete = self._skips = 0

    def forget(self) -> None:
        """Begin again after a change; the next images may be from before it."""
        self._brightest, self._skips = math.nan, _LATE_IMAGES

    def fresh(self, within_s: float) -> NDArray[np.uint16] | None:
        """Return the counts (height, width) of an image taken after this call; None without one."""
        while self.camera.next_image(0.0) is not None:
            pass
        return self.following(within_s)

    def following(self, within_s: float) -> NDArray[np.uint16] | None:
        """Return the counts of the next image; None without one."""
        deadline = time.monotonic() + within_s
        while (left := deadline - time.monotonic()) > 0.0:
            image = self.camera.next_image(left)
            if image is None:
                return None
            if self._is_whole(image):
                self._images += 1
                if self._skips:
                    self._skips -= 1
                    deadline = time.monotonic() + within_s
                    continue
                return unpack(self.pixels, image.data, image.width, image.height)
            self._incomplete += 1
        return None

    def look(self, counts: NDArray[np.uint16] | None) -> CameraLook:
        exposure_us, gain = settings_of(self.camera)
        empty = CameraLook(
            self.camera.serial, self.camera.model, exposure_us, gain, np.zeros((0, 0), np.uint8), 1,
            np.zeros((0, 2)), math.nan, math.nan, math.nan, self._images, self._incomplete,
            self.load,
        )  # fmt: skip
        if counts is None:
            return empty
        # A spot that is found by the search fills a window of the next image.
        finder = SpotFinder(self.expected.width, self.expected.height, self._options)
        found = [finder.find(counts) for _ in range(_SEARCHES)][-1]
        valid = int(found.valid[0])
        places = found.uv[0][[bool(valid >> slot & 1) for slot in range(found.uv.shape[1])]]
        full_scale = self.pixels.full_scale
        spots = [_spot(counts, u, v) for u, v in places.tolist()]
        if not spots and _is_glaring(counts, full_scale):
            self._brightest = 1.0
        for peak, _ in spots:
            self._brightest = np.fmax(self._brightest, min(peak / full_scale, 1.0))
        edges = np.diff(counts[::2].astype(np.float32), axis=1)
        energy = float(np.mean(edges * edges))
        self._sharpest = max(self._sharpest, energy)
        factor = max(1, -(-max(counts.shape) // _SHOWN_PX))
        height, width = (size // factor for size in counts.shape)
        blocks = counts[: height * factor, : width * factor].reshape(height, factor, width, factor)
        share = np.minimum(blocks.max(axis=(1, 3)) / full_scale, 1.0)
        return replace(
            empty, picture=(255.0 * np.sqrt(share)).astype(np.uint8), factor=factor,
            spots_px=places,
            width_px=float(np.median([width for _, width in spots])) if spots else math.nan,
            brightest=float(self._brightest),
            focus=energy / self._sharpest if self._sharpest else math.nan,
        )  # fmt: skip

    def _is_whole(self, image: Image) -> bool:
        return (
            image.status == COMPLETE
            and self.set_up.is_of(image)
            and len(image.data) >= self.set_up.size
        )


class Viewfinder:
    """The cameras of a rig, in its order; for one thread.

    AcquisitionError: a camera is absent, used by others, or cannot be set up.
    """

    def __init__(
        self, cameras: Cameras, serials: Sequence[str], expected: Sequence[Expected]
    ) -> None:
        self._views: list[_View] = []
        try:
            for serial, one in zip(serials, expected, strict=True):
                camera = cameras.open(serial)
                try:
                    self._views.append(_View(camera, one))
                except BaseException:
                    camera.close()
                    raise
            loads = loads_of(
                [view.camera for view in self._views], [view.set_up for view in self._views],
                expected[0].period_ns,
            )  # fmt: skip
            for view, load in zip(self._views, loads, strict=True):
                view.load = str(load)
                view.camera.start()
        except BaseException:
            self.close()
            raise

    def look(self, within_s: float = _FRESH_S) -> tuple[CameraLook, ...]:
        """Return the newest images and their verdicts; one without image after ``within_s``."""
        return tuple(view.look(view.fresh(within_s)) for view in self._views)

    def pictures(self, within_s: float = _PICTURE_S) -> list[NDArray[np.uint16]]:
        """Return one image of each camera, (height, width), full scale 65535, one after the other.

        AcquisitionError if a camera sends none.
        """
        found = []
        for view in self._views:
            counts = view.fresh(within_s)
            if counts is None:
                raise _no_image(view.camera.serial, within_s)
            found.append(scaled(counts, view.pixels.full_scale))
        return found

    def black(self, folder: Path) -> tuple[int, ...]:
        """Write the black image of each camera; return their numbers of hot pixels.

        AcquisitionError if a camera sees light, or sends no images.
        """
        found = []
        for view in self._views:
            images: list[Float] = []
            while len(images) < BLACK_IMAGES:
                counts = view.following(_PICTURE_S) if images else view.fresh(_PICTURE_S)
                if counts is None:
                    raise _no_image(view.camera.serial, _PICTURE_S)
                images.append(counts.astype(np.float32))
            path = black_path(folder, view.camera.serial)
            found.append(write_black(path, view.camera, view.pixels, np.stack(images)))
        return tuple(found)

    def expose(self, exposure_us: float) -> None:
        """Set the exposure time of all cameras; they keep the old one if one of them refuses.

        AcquisitionError: out of its range, or too long for the frame rate of the rig.
        """
        self._set_all(
            0, lambda view, value: set_exposure(view.camera, view.expected, value), exposure_us
        )

    def gain(self, value: float) -> None:
        """Set the gain of all cameras; they keep the old one if one of them refuses."""
        self._set_all(1, lambda view, value: set_gain(view.camera, value), value)

    def settle(self) -> tuple[CameraLook, ...]:
        """Set exposure and gain by which the brightest LED of all fills `WANTED` of a pixel.

        The gain is the lowest with which the exposure time fits into the frame rate of the rig.
        AcquisitionError: no LED is seen, or both are out of range.
        """
        tries, begun_us = 0, settings_of(self._views[0].camera)[0]
        for _ in range(_STEPS):
            self._forget()
            found = self.look()
            shares = [one.brightest for one in found if not math.isnan(one.brightest)]
            if not shares:
                # Faint ones may show with a longer exposure.
                again = tries < _TRIES
                with contextlib.suppress(AcquisitionError):
                    self.expose(found[0].exposure_us * _MOST_STEP if again else begun_us)
                if again:
                    tries += 1
                    continue
                raise AcquisitionError(
                    "genicam.no_led",
                    "No camera sees an LED.",
                    "Hold the probe in front of the cameras, switch its LEDs on, and open the "
                    "lens; set a longer exposure by hand if they are faint.",
                )
            brightest = max(shares)
            if abs(brightest - WANTED) <= _SETTLED * WANTED:
                return found
            # The brightness of an overexposed spot is unknown.
            step = WANTED / brightest if brightest < 0.98 else 0.4
            self._brighten(min(max(step, 1.0 / _MOST_STEP), _MOST_STEP), found[0])
        return self.look()

    def _brighten(self, step: float, look: CameraLook) -> None:
        """Multiply the light by a factor: by gain what no exposure time can give."""
        gain, change = look.gain, 20.0 * math.log10(step)
        in_decibels = all(has_decibels(view.camera) for view in self._views)
        if step < 1.0 and in_decibels and gain > 0.0:
            self.gain(max(gain + change, 0.0))
            return
        for share in _SHARES:
            try:
                self.expose(look.exposure_us * step**share)
            except AcquisitionError:
                if step < 1.0 or (share == _SHARES[-1] and not in_decibels):
                    raise
            else:
                return
        self.gain(gain + change)

    def _set_all(self, place: int, change: Callable[[_View, float], None], value: float) -> None:
        """Change a setting of all cameras, or of none."""
        before = [settings_of(view.camera)[place] for view in self._views]
        try:
            for view in self._views:
                change(view, value)
        except AcquisitionError:
            for view, old in zip(self._views, before, strict=True):
                with contextlib.suppress(AcquisitionError):
                    change(view, old)
            raise
        finally:
            self._forget()

    def store(self) -> None:
        """Store the settings in the cameras, to be loaded at power-up; AcquisitionError."""
        for view in self._views:
            store(view.camera)

    def close(self) -> None:
        """Release all cameras; idempotent."""
        for view in self._views:
            view.camera.close()

    def _forget(self) -> None:
        for view in self._views:
            view.forget()


def _no_image(serial: str, within_s: float) -> AcquisitionError:
    return AcquisitionError(
        "genicam.no_image",
        f"Camera {serial} sent no complete image for {within_s:.1f} s.",
        "Check its cable and trigger; if images are incomplete, set jumbo frames (MTU 9000) on "
        "network card and switch.",
    )


def _is_glaring(counts: NDArray[np.uint16], full_scale: int) -> bool:
    """Return whether there is an overexposed spot, which the finder refuses; no hot pixel."""
    for row, column in np.argwhere(counts >= full_scale)[:_CANDIDATES].tolist():
        around = counts[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
        if np.count_nonzero(around > _LIT * full_scale) > 2:
            return True
    return False


def _spot(counts: NDArray[np.uint16], u: float, v: float) -> tuple[float, float]:
    """Return the brightest count of a spot, and its standard deviation along a row, px."""
    row, column = round(v), round(u)
    top, left = max(row - _HALF_PX, 0), max(column - _HALF_PX, 0)
    part = counts[top : row + _HALF_PX + 1, left : column + _HALF_PX + 1].astype(np.float64)
    light = np.maximum(part - np.median(part), 0.0)
    # Noise far from the middle would count most.
    light[light < 0.05 * light.max()] = 0.0
    across = light.sum(axis=0)
    if not across.any():
        return float(part.max()), math.nan
    at = np.arange(len(across)) + left
    middle = float(at @ across / across.sum())
    return float(part.max()), float(np.sqrt((at - middle) ** 2 @ across / across.sum()))
