"""The camera bus: brings the cameras of the rig to operation and runs its cycles."""

from __future__ import annotations

import struct
import time
from collections.abc import Sequence
from dataclasses import dataclass

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.camera_objects import CONFIGURATION
from ocmm_core.fieldbus.camera_slave import (
    COUNTER_MODULUS,
    OUTPUT_STRUCT,
    CameraConfig,
    Control,
    Header,
)
from ocmm_core.fieldbus.health import Answer, Schedule
from ocmm_core.fieldbus.identity import CameraIdentity, assign
from ocmm_core.fieldbus.interface import check_interface
from ocmm_core.fieldbus.mapping import check_mapping
from ocmm_core.fieldbus.master import INIT, OP, PREOP, SAFEOP, Master

_STATE_CHECK_CYCLES = 32
_START_TIMEOUT_NS = 2_000_000
_CLOCK_LIMIT_NS = 1000
_CLOCK_READINGS = 20
_CLOCK_TIMEOUT_S = 3.0
_CLOCK_PAUSE_S = 0.001
_LEAD_NS = 60_000_000
"""From programming the first exposure until it happens; the states change in this time."""

_TIME = 0x0910
_TIME_DIFFERENCE = 0x092C
_SYNC_UNIT = 0x0980
_SYNC_ACTIVATION = 0x0981
_SYNC0_START = 0x0990
_SYNC_CYCLES = 0x09A0
_SYNC_OFF, _SYNC_BOTH = b"\x00", b"\x07"


@dataclass(frozen=True, slots=True)
class BusSettings:
    """Which cameras are expected where, and how fast they run.

    Attributes
    ----------
    interface
        Network interface of the bus.
    cameras
        Cameras of the rig, in its order.
    frame_period_ns, cycle_period_ns
        Between two exposures, and between two bus cycles.
    force
        Use the interface although the computer uses it for its network.
    """

    interface: str
    cameras: tuple[CameraIdentity, ...]
    frame_period_ns: int
    cycle_period_ns: int
    force: bool = False


@dataclass(frozen=True, slots=True)
class Exchange:
    """What one cycle brought: the answer to be judged and the raw inputs, in rig order."""

    answer: Answer
    inputs: tuple[bytes, ...]


class CameraBus:
    """The bus with its cameras; one thread owns it from open to close.

    Parameters
    ----------
    settings
        What to open and what to find there.
    """

    def __init__(self, settings: BusSettings) -> None:
        self._settings = settings
        self._master: Master | None = None
        self._places: tuple[int, ...] = ()
        self._cycles = 0
        self._operational = False
        self._schedule: Schedule | None = None

    @property
    def schedule(self) -> Schedule:
        """Return when the cameras expose; known once the bus is open."""
        if self._schedule is None:
            raise _closed()
        return self._schedule

    def open(self) -> None:
        """Find, check, configure and synchronise the cameras and bring them to operation.

        Raises
        ------
        BusError
            With the camera, the state or the object at fault, and what to do.
        """
        settings = self._settings
        check_interface(settings.interface, force=settings.force)
        master = self._master = Master(settings.interface)
        try:
            self._places = assign(master.scan(), settings.cameras)
            crc = self._configure(master)
            master.map()
            self._settle_clocks(master)
            start_ns = self._program_exposures(master)
            self._schedule = Schedule(start_ns, settings.frame_period_ns, crc)
            master.request(SAFEOP)
            master.reach(SAFEOP)
            for place in self._places:
                master.set_output(place, OUTPUT_STRUCT.pack(0, 0, 0, 0))
            master.first_cycle()
            master.request(OP)
            master.reach(OP, lambda: master.cycle(_START_TIMEOUT_NS))
            self._operational = True
        except BaseException:
            self.close()
            raise

    def exchange(self, next_frames: Sequence[int], timeout_ns: int) -> Exchange:
        """Send outputs, wait for the answer and return it unjudged.

        Parameters
        ----------
        next_frames
            For each camera, the exposure number of the first frame that is still wanted; all
            before it are acknowledged.
        timeout_ns
            How long to wait for the answer.

        Raises
        ------
        BusError
            A camera has left the states in which its identity is certain.
        """
        master = self._master
        if master is None:
            raise _closed()
        self._cycles += 1
        for place, frame in zip(self._places, next_frames, strict=True):
            master.set_output(
                place,
                OUTPUT_STRUCT.pack(
                    Control.STREAM, 0, (frame - 1) % COUNTER_MODULUS, self._cycles % COUNTER_MODULUS
                ),
            )
        working_counter = master.cycle(timeout_ns)
        inputs: tuple[bytes, ...] = ()
        if working_counter > 0:
            inputs = master.inputs(self._places)
            if self._cycles % _STATE_CHECK_CYCLES == 0 or not self._operational:
                self._watch_states(master)
        answer = Answer(
            working_counter,
            master.expected_working_counter,
            self._operational,
            master.clock_ns,
            tuple(Header.decode(content) for content in inputs),
        )
        return Exchange(answer, inputs)

    def close(self) -> None:
        """Leave the cameras in INIT and give the interface back; may be called twice."""
        if self._master is not None:
            self._master.close()
            self._master = None
        self._operational = False

    def _configure(self, master: Master) -> int:
        """Check the mapping, set object 0x8000, read it back; return the check sum to expect."""
        config = CameraConfig(frame_period_ns=self._settings.frame_period_ns)
        values = (
            (1, struct.pack("<I", config.frame_period_ns)),
            (2, struct.pack("<I", config.exposure_ns)),
            (3, struct.pack("<H", config.threshold)),
        )
        for place, camera in zip(self._places, self._settings.cameras, strict=True):
            label = f"'{camera.name}'"
            check_mapping(
                camera.name,
                lambda index, sub, place=place, label=label: master.read_object(  # type: ignore[misc]  # mypy cannot infer a lambda with bound defaults
                    place, label, index, sub
                ),
            )
            for sub, value in values:
                master.write_object(place, label, CONFIGURATION, sub, value)
                if master.read_object(place, label, CONFIGURATION, sub) != value:
                    raise BusError(
                        "bus.configuration",
                        f"Camera {label} did not keep its configuration.",
                        "Switch the camera off and on and start again.",
                    )
        return config.crc()

    def _settle_clocks(self, master: Master) -> None:
        """Pass the reference time on until every camera's clock follows it."""
        deadline = time.monotonic() + _CLOCK_TIMEOUT_S
        calm = 0
        while calm < _CLOCK_READINGS:
            master.pump_clock()
            worst_ns, worst = 0, ""
            for place, camera in zip(self._places, self._settings.cameras, strict=True):
                raw = master.read_register(place, f"'{camera.name}'", _TIME_DIFFERENCE, 4)
                # The highest bit is the sign.
                difference = int.from_bytes(raw, "little") & 0x7FFFFFFF
                if difference > worst_ns:
                    worst_ns, worst = difference, camera.name
            calm = calm + 1 if worst_ns < _CLOCK_LIMIT_NS else 0
            if time.monotonic() > deadline:
                raise BusError(
                    "bus.clock",
                    f"The clock of camera '{worst}' does not follow the bus ({worst_ns} ns off).",
                    "Check cables and devices between the cameras; use no ordinary switch.",
                )
            time.sleep(_CLOCK_PAUSE_S)

    def _program_exposures(self, master: Master) -> int:
        """Program the same first exposure into all cameras and return its time."""
        period, cycle = self._settings.frame_period_ns, self._settings.cycle_period_ns
        now = int.from_bytes(
            master.read_register(self._places[0], "on the bus", _TIME, 8), "little"
        )
        start = (now + _LEAD_NS) // cycle * cycle
        for place, camera in zip(self._places, self._settings.cameras, strict=True):
            label = f"'{camera.name}'"
            for register, content in (
                (_SYNC_ACTIVATION, _SYNC_OFF),
                (_SYNC_UNIT, b"\x00"),
                (_SYNC0_START, struct.pack("<Q", start)),
                (_SYNC_CYCLES, struct.pack("<II", period, cycle - period)),
                (_SYNC_ACTIVATION, _SYNC_BOTH),
            ):
                master.write_register(place, label, register, content)
            if master.read_register(place, label, _SYNC0_START, 8) != struct.pack("<Q", start):
                raise BusError(
                    "bus.clock",
                    f"Camera {label} did not take the time of the first exposure.",
                    "Switch the camera off and on and start again.",
                )
        return start

    def _watch_states(self, master: Master) -> None:
        """Look at the states; bring cameras that only fell back to SAFEOP into OP again."""
        states = master.states()
        self._operational = all(now.state == OP and not now.error for now in states)
        for place, camera in zip(self._places, self._settings.cameras, strict=True):
            now = states[place]
            if now.state in (INIT, PREOP):
                raise BusError(
                    "bus.restarted",
                    f"Camera '{camera.name}' was restarted while it was measuring.",
                    "Start the acquisition again, so that all cameras are checked anew.",
                )
            if now.state == SAFEOP:
                master.lift(place, now)


def _closed() -> BusError:
    return BusError("bus.closed", "The camera bus is not open.", "Open it first.")
