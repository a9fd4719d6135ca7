"""Cameras and files of simultaneous pictures."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ocmm_cli.terminal import encoder_for
from ocmm_core.acquisition.frames import SourceDescription
from ocmm_core.camera import Rig
from ocmm_core.documents import files_of_folder, write_new
from ocmm_core.errors import InputError, StorageError
from ocmm_genicam import AravisCameras, Expected, GenicamSource, require_cameras_of

_PREFIX = "genicam:"
_VIEW = re.compile(r"(\d{3,})-\d+\.png")
_SILENCE_S = 1.5


def genicam_source(source: str, rig: Rig) -> GenicamSource:
    """Return the cameras of a source, closed; InputError unless they are those of the rig."""
    serials = tuple(one.strip() for one in source.removeprefix(_PREFIX).split(","))
    if not source.startswith(_PREFIX) or serials == ("virtual",):
        raise InputError(
            "pictures.source",
            f"Pictures of all cameras at one moment come from {_PREFIX}SERIAL,SERIAL, not from "
            f"{source!r}.",
            "Take those of other cameras one by one while the board rests, with ocmm bus snapshot.",
        )
    require_cameras_of(rig, serials)
    period_ns = round(1e9 / rig.frame_rate_hz)
    described = SourceDescription(
        source, tuple(camera.serial for camera in rig.cameras), period_ns, period_ns, live=True,
        simulated=False,
    )  # fmt: skip
    expected = [
        Expected(camera.name, camera.width, camera.height, period_ns) for camera in rig.cameras
    ]
    return GenicamSource(described, AravisCameras(), serials, expected, _SILENCE_S)


def next_view(folder: Path) -> int:
    """Return the number of the next view in a folder, and make it; StorageError if it cannot."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(
            "pictures.folder", f"{folder}: the folder cannot be used ({error.strerror}).",
            "Give another folder.",
        ) from error  # fmt: skip
    names = [path.name for path in files_of_folder(folder, ".png")]
    return max((int(found[1]) for one in names if (found := _VIEW.fullmatch(one))), default=0) + 1


def write_view(folder: Path, number: int, rig: Rig, pictures: Sequence[NDArray[np.uint16]]) -> None:
    """Write the pictures of a view as VIEW-SERIAL.png; StorageError if one cannot be written."""
    for camera, picture in zip(rig.cameras, pictures, strict=True):
        path = folder / f"{number:03d}-{camera.serial}.png"
        try:
            write_new(path, encoder_for(path)(picture))
        except OSError as error:
            raise StorageError(
                "pictures.write", f"{path}: the picture was not written ({error.strerror}).",
                "Check the disk, then start the command again: it continues after the last view.",
            ) from error  # fmt: skip
