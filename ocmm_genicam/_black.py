"""Black images of cameras: dark signal of each pixel, and hot pixels, which never count as light.

A file holds one line of JSON and the compressed counts of the whole sensor.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ocmm_core.camera import NO_BLACK
from ocmm_core.documents import read_bytes, write_atomic
from ocmm_core.errors import AcquisitionError, InputError, StorageError
from ocmm_core.geometry import Float, Int
from ocmm_genicam._client import Camera, PixelFormat
from ocmm_genicam._set_up import SetUp, settings_of

_SCHEMA, _SUFFIX = "ocmm.black/1", ".ocmmblack"
_HOT_SHARE = 1.0 / 4.0
"""Share of the least signal of a spot; a mean this far above the others is a hot pixel."""
_RESTLESS = 6.0
"""A pixel that scatters this many times as much as most is a hot pixel."""
_MOST_HOT, _LIT_SHARE = 0.01, 0.1
_LIT_PX, _LIT_COUNT = 5, 6
"""More hot pixels than this within this number of rows and columns are the image of a light."""
_MOST_BYTES = 1 << 28
BLACK_IMAGES = 32
"""Images that a black image is the mean of."""


class _Head(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    schema: str
    serial: str
    pixel_format: str
    exposure_us: float
    gain: float
    size: tuple[int, int]
    hot: list[tuple[int, int]]


@dataclass(frozen=True, slots=True)
class Mending:
    """Dark signal and hot pixels of the part of a sensor that is sent."""

    black: NDArray[np.uint16]
    """(h, w); empty if it was taken with another exposure time, gain or pixel format."""
    hot: Int
    sides: Int
    """`hot`, (n,), and `sides`, (2, n): pixels of the flat image, and their good neighbours."""

    def mend(self, counts: NDArray[np.uint16]) -> None:
        """Replace hot pixels by the mean of their neighbours in the row."""
        flat = counts.reshape(-1)
        flat[self.hot] = flat[self.sides].mean(axis=0)


def black_path(folder: Path, serial: str) -> Path:
    """Return the file of a camera's black image in the folder of its rig."""
    return folder / ("black-" + "".join(filter(str.isalnum, serial)) + _SUFFIX)


def write_black(path: Path, camera: Camera, pixels: PixelFormat, images: Float) -> int:
    """Write the black image of ``images`` (n, h, w) and return its number of hot pixels.

    AcquisitionError if they show light, StorageError if it cannot be written.
    """
    mean = images.mean(axis=0)
    usual, spread = float(np.median(mean)), images.std(axis=0)
    limit = pixels.spot_options().threshold * _HOT_SHARE
    restless = max(_RESTLESS * float(np.median(spread)), limit / 2.0)
    hot = (mean > usual + limit) | (spread > restless)
    near = ndimage.convolve(hot.astype(np.uint8), np.ones((_LIT_PX, _LIT_PX), np.uint8))
    row, column = np.unravel_index(np.argmax(near), near.shape)
    if near.max() > _LIT_COUNT or usual > _LIT_SHARE * pixels.full_scale or hot.mean() > _MOST_HOT:
        raise AcquisitionError(
            "genicam.black_lit",
            f"Camera {camera.serial} sees light while its black image is taken, brightest around "
            f"({column}, {row}).",
            "Switch off the LEDs, cover the lens, and take the black image again.",
        )
    places = [(int(row), int(column)) for row, column in np.argwhere(hot)]
    size = (mean.shape[1], mean.shape[0])
    head = _Head(_SCHEMA, camera.serial, pixels.name, *settings_of(camera), size, places)
    content = zlib.compress(np.rint(mean).astype("<u2").tobytes())
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomic(path, msgspec.json.encode(head) + b"\n" + content)
    except OSError as error:
        raise StorageError(
            "genicam.black_folder", f"{path}: cannot be written ({error.strerror}).",
            "Free space, or give another folder of calibrations.",
        ) from error  # fmt: skip
    return len(places)


def read_mending(path: Path, camera: Camera, set_up: SetUp) -> Mending:
    """Return the dark signal of a camera, none without a file; InputError if it is damaged."""
    if not path.is_file():
        return Mending(NO_BLACK, np.zeros(0, np.int64), np.zeros((2, 0), np.int64))
    window = set_up.window
    try:
        line, _, packed = read_bytes(path).partition(b"\n")
        head = msgspec.json.decode(line, type=_Head)
        width, height = head.size
        counts = np.frombuffer(zlib.decompressobj().decompress(packed, _MOST_BYTES), "<u2")
        counts = counts.reshape(height, width)
        hot = np.zeros((height, width), bool)
        hot[tuple(np.array(head.hot, int).reshape(-1, 2).T)] = True
        if (head.schema, head.serial) != (_SCHEMA, camera.serial):
            raise ValueError(head.serial)
    except (ValueError, IndexError, zlib.error, msgspec.MsgspecError) as error:
        raise InputError(
            "genicam.black_file",
            f"{path}: this is no black image of camera {camera.serial} ({error}).",
            "Take the black image again on the page Cameras, or delete the file.",
        ) from error
    part = np.s_[window.top : window.top + window.height, window.left : window.left + window.width]
    before = (head.exposure_us, head.gain)
    alike = np.allclose(before, settings_of(camera), rtol=0.01, atol=1e-3, equal_nan=True)
    alike = alike and head.pixel_format == set_up.pixels.name
    black = np.ascontiguousarray(counts[part]).astype(np.uint16) if alike else NO_BLACK
    rows, columns = np.nonzero(hot[part])
    places = zip(rows.tolist(), columns.tolist(), strict=True)
    sides = np.array([_sides(hot[part][row], column) for row, column in places], np.int64)
    mending = Mending(
        black, rows * window.width + columns,
        rows * window.width + sides.reshape(-1, 2).T,
    )  # fmt: skip
    if alike:
        mending.mend(black)
    return mending


def _sides(hot: NDArray[np.bool_], column: int) -> tuple[int, int]:
    """Return the nearest good pixels on both sides in a row; both the same at its ends."""
    good = np.flatnonzero(~hot)
    after = int(np.searchsorted(good, column))
    return int(good[max(after - 1, 0)]), int(good[min(after, len(good) - 1)])
