"""The software cameras as a program: one segment of cameras that answers on an interface.

It reads its configuration as one line of JSON, from standard input (then it ends when standard
input ends) or from a file (then it ends on SIGTERM), and says ``ready`` once it answers.
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

from ocmm_core.acquisition.bus_process import CAMERA_PRIORITY, take_priority
from ocmm_core.camera import CameraModel
from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError, InternalError
from ocmm_core.failure import EXIT_INTERNAL, contained
from ocmm_core.fieldbus.described import DeviceDescription
from ocmm_core.fieldbus.device import CameraIdentity, Intrinsics
from ocmm_core.simulation.bus._camera_time import SteppedCameraTime
from ocmm_core.simulation.bus._chain import Chain, Unit
from ocmm_core.simulation.bus._faults import Faults
from ocmm_core.simulation.bus._wire import Wire
from ocmm_core.simulation.slave import CHUNK_FRAMES, CameraFrames, ClockPattern, TestPattern

READY = "ready"
EXIT_FAILED = 2


class SegmentConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Which software cameras stand on one wire."""

    interface: str
    second_interface: str = ""
    """`interface`, `second_interface`: Network interface that they answer on; the second one closes
    a ring, empty: none."""
    cameras: tuple[CameraIdentity, ...]
    """In the order in which a frame passes them."""
    provider: msgspec.Raw
    """What they see, as JSON: ``{"pattern": "test"}``, ``{"pattern": "clock"}``, a script of the
    virtual rig (`RigScript`), one that is computed pixel by pixel (`PixelScript`), or one of a rig
    that is calibrated (`CalibratingScript`)."""
    sees: tuple[int, ...] = ()
    """For each of them, the number of the camera of the rig whose picture it shows; empty: in the
    same order."""
    drop: float = 0.0
    """Part of the answers that get lost while the cameras are in operation, 0 to 1."""
    seed: int = 0
    """Which answers get lost."""
    control: str = ""
    """Path of the socket over which faults can be made while they run, see `faults.CameraDeed`;
    empty: none."""
    switched_on: int = 0
    """How often the cameras were switched on before."""
    ring_path: str = ""
    """Ring of a bus process whose time waits for this computer; empty: a time that does not."""
    device: DeviceDescription | None = None
    lenses: tuple[Intrinsics, ...] = ()
    """`device`, `lenses`: Description of cameras that are not ours, and what each of them corrects
    with."""

    def to_json(self) -> bytes:
        """Return the configuration as one line of JSON."""
        return msgspec.json.encode(self) + b"\n"


class _Pattern(msgspec.Struct, forbid_unknown_fields=True):
    pattern: Literal["test", "clock"]


def input_ended() -> bool:
    """Return whether standard input has ended, which means that the parent process has."""
    source = sys.stdin.fileno()
    while select.select([source], [], [], 0.0)[0]:
        if not os.read(source, 4096):
            return True
    return False


def make_provider(text: bytes) -> CameraFrames:
    """Return what ``text`` describes: a pattern, or the virtual rig of a script."""
    try:
        pattern = msgspec.json.decode(text, type=_Pattern)
    except msgspec.DecodeError:
        # The physics needs a compiler; the test pattern must not pay for that.
        from ocmm_core.simulation.calibration_scenes import CalibratingScript
        from ocmm_core.simulation.scene import PixelScript, RigScript, decode_script

        fields = msgspec.json.decode(text)
        names = fields if isinstance(fields, dict) else {}
        if "calibrating" in names:
            return decode_script(text, CalibratingScript).build()
        if "pixels" in names:
            return decode_script(text, PixelScript).build()
        return decode_script(text, RigScript).build()
    return TestPattern() if pattern.pattern == "test" else ClockPattern()


def make_wire(config: SegmentConfig) -> Wire:
    """Return the segment of ``config``, ready to run and warmed up."""
    if not config.cameras:
        raise InputError(
            "simulation.segment", "Field 'cameras' names no software camera.", "Name one at least."
        )
    provider = make_provider(bytes(config.provider))
    sees = config.sees or tuple(range(len(config.cameras)))
    for camera in sees:
        # The first call may compile code, which takes longer than a master waits.
        provider.camera_frames(camera, 0, CHUNK_FRAMES)
    lenses: list[CameraModel | None] = [lens.model() for lens in config.lenses]
    lenses = lenses or [None] * len(sees)
    units = [
        Unit(camera, identity, provider, config.switched_on, config.device, lens)
        for camera, identity, lens in zip(sees, config.cameras, lenses, strict=True)
    ]
    return Wire(
        config.interface,
        Chain(units, ends=2 if config.second_interface else 1),
        Faults(config.drop, config.seed),
        config.second_interface,
        config.control,
        SteppedCameraTime(config.ring_path) if config.ring_path else None,
    )


def main() -> None:
    """Run the software cameras: ``python -m ocmm_core.simulation.bus._camera_process [CONFIG]``."""
    try:
        _run(sys.argv[1:])
    except Exception as error:
        told = contained(error, "The program of the software cameras")
        sys.stderr.write(f"{told}\n")
        sys.exit(EXIT_INTERNAL if isinstance(told, InternalError) else EXIT_FAILED)


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
