"""Program of the software cameras: one segment of cameras on an interface.

The configuration is one line of JSON from standard input (the program ends with it) or a file (it
ends on SIGTERM). Prints ``ready`` once the cameras answer.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
from pathlib import Path
from typing import Literal

import msgspec

from ocmm_core.acquisition.bus_process import CAMERA_PRIORITY, ProcessConfig, take_priority
from ocmm_core.camera import CameraModel
from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError
from ocmm_core.failure import exit_with
from ocmm_core.fieldbus.described import DeviceDescription
from ocmm_core.fieldbus.device import CameraIdentity, Intrinsics
from ocmm_sim.bus._chain import Chain, Unit
from ocmm_sim.bus._wire import SteppedCameraTime, Wire
from ocmm_sim.slave import CHUNK_FRAMES, CameraFrames, TestPattern

READY = "ready"


class SegmentConfig(ProcessConfig, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Software cameras on one wire."""

    interface: str
    second_interface: str = ""
    """`interface`, `second_interface`: of the cameras; the second closes a ring, empty: none."""
    cameras: tuple[CameraIdentity, ...]
    provider: msgspec.Raw
    """Camera view as JSON: ``{"pattern": "test"}``, `RigScript`, `PixelScript` or
    `CalibratingScript`."""
    sees: tuple[int, ...] = ()
    """Number of the rig camera whose image each one shows; empty: same order."""
    switched_on: int = 0
    ring_path: str = ""
    """Ring of a bus process whose time waits for this computer; empty: real time."""
    device: DeviceDescription | None = None
    lenses: tuple[Intrinsics, ...] = ()
    """`device`, `lenses`: description of cameras of other makers, and their correction lenses."""


class _Pattern(msgspec.Struct, forbid_unknown_fields=True):
    pattern: Literal["test"]


def input_ended() -> bool:
    """Return whether standard input has ended, as when the parent process ends."""
    source = sys.stdin.fileno()
    while select.select([source], [], [], 0.0)[0]:
        if not os.read(source, 4096):
            return True
    return False


def make_provider(text: bytes) -> CameraFrames:
    """Return the described provider: a pattern, or the virtual rig of a script."""
    try:
        msgspec.json.decode(text, type=_Pattern)
    except msgspec.DecodeError:
        # The physics needs a compiler; test patterns avoid importing it.
        from ocmm_sim.calibration_scenes import CalibratingScript
        from ocmm_sim.scene import PixelScript, RigScript, decode_script

        fields = msgspec.json.decode(text)
        names = fields if isinstance(fields, dict) else {}
        if "calibrating" in names:
            return decode_script(text, CalibratingScript).build()
        if "pixels" in names:
            return decode_script(text, PixelScript).build()
        return decode_script(text, RigScript).build()
    return TestPattern()


def make_units(
    config: SegmentConfig, provider: CameraFrames, kind: type[Unit] = Unit
) -> list[Unit]:
    """Return the cameras of `config`, warmed up."""
    if not config.cameras:
        raise InputError(
            "simulation.segment", "Field 'cameras' names no software camera.", "Name one at least."
        )
    sees = config.sees or tuple(range(len(config.cameras)))
    for camera in sees:
        # The first call may compile, which takes longer than a master waits.
        provider.camera_frames(camera, 0, CHUNK_FRAMES)
    lenses: list[CameraModel | None] = [lens.model() for lens in config.lenses]
    lenses = lenses or [None] * len(sees)
    return [
        kind(camera, identity, provider, config.switched_on, config.device, lens)
        for camera, identity, lens in zip(sees, config.cameras, lenses, strict=True)
    ]


def make_wire(config: SegmentConfig) -> Wire:
    """Return the segment of `config`, warmed up."""
    units = make_units(config, make_provider(bytes(config.provider)))
    return Wire(
        config.interface,
        Chain(units, ends=2 if config.second_interface else 1),
        config.second_interface,
        SteppedCameraTime(config.ring_path) if config.ring_path else None,
    )


def main() -> None:
    """Run the software cameras: ``python -m ..._camera_process [CONFIG]``."""
    try:
        _run(sys.argv[1:])
    except Exception as error:
        exit_with(error, "The program of the software cameras")


def _run(arguments: list[str]) -> None:
    from_parent = not arguments
    content = sys.stdin.buffer.readline() if from_parent else read_bytes(Path(arguments[0]))
    try:
        config = msgspec.json.decode(content, type=SegmentConfig)
    except msgspec.DecodeError as error:
        raise InputError(
            "simulation.segment",
            f"Invalid configuration of the software cameras: {error}.",
            "Start them from OCMM.",
        ) from error
    ended = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda _number, _frame: ended.set())
    wire = make_wire(config)
    take_priority(CAMERA_PRIORITY)
    try:
        sys.stdout.write(f"{READY}\n")
        sys.stdout.flush()
        wire.run(lambda: ended.is_set() or (from_parent and input_ended()))
    finally:
        wire.close()


if __name__ == "__main__":
    main()
