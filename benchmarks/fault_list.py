"""The faults of the bus: cause, end, and expected report."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import msgspec

from benchmarks.camera_faults import COPIED, CORRUPT_WITH_SUM, EXCHANGED, FaultKind
from benchmarks.fault_rig import CAMERAS, FAR, HOST, NEAR, FaultRig
from benchmarks.faulty_line import FrameKind, LineDirection, LineRule, Trick
from ocmm_core.acquisition.bus_process import RemoteObjects
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device import CALIBRATION, CameraIdentity
from ocmm_core.fieldbus.report import Alarm
from ocmm_core.fieldbus.wire import Command, Datagram, encode_frame
from ocmm_sim.slave import AL_SYNC, INIT, PREOP, SAFEOP

LEFT, RIGHT = CameraIdentity("left", 1001, 1), CameraIdentity("right", 1002, 2)
SPARE = CameraIdentity("spare", 1003, 3)
DEVICE_NAME_OBJECT = 0x1008
_FIRST_STATION = 0x1001
_NOTE = 5
_LONG_NOTE = bytes(33 + n % 90 for n in range(1000))


class Moment(msgspec.Struct, frozen=True):
    """When something was done: by the clock of this computer since its start, and in UTC."""

    monotonic_ns: int
    utc_ns: int


Step = Callable[[FaultRig], Moment]


@dataclass(frozen=True, slots=True)
class Scenario:
    """One fault.

    Attributes
    ----------
    name
        For people.
    begin, end
        Make it and undo it.
    alarms
        One of these has to be reported; empty: the fault is harmless, and none has to be.
    stops
        No frame can be right while it lasts, so none may be given out.
    lasts_s
        How long.
    asks
        What is asked meanwhile of a camera, through the bus process; returns what came of it.
    answer
        What has to come of it.
    """

    name: str
    begin: Step
    end: Step
    alarms: tuple[Alarm, ...]
    stops: bool = True
    lasts_s: float = 0.3
    asks: Callable[[FaultRig], str] | None = None
    answer: str = ""


def now() -> Moment:
    """Return the present moment."""
    return Moment(time.monotonic_ns(), time.time_ns())


def fault(do: FaultKind, camera: int = 0, value: int = 0, code: int = 0) -> Step:
    """Return the step that does something to a camera."""

    def step(rig: FaultRig) -> Moment:
        answer = rig.command(do, camera, value, code)
        return Moment(answer.monotonic_ns, answer.utc_ns)

    return step


def line(*rules: LineRule) -> Step:
    """Return the step that gives the cable these rules."""

    def step(rig: FaultRig) -> Moment:
        log = rig.line(*rules)
        return Moment(log.monotonic_ns, log.utc_ns)

    return step


def link(name: str, *, up: bool) -> Step:
    """Return the step that switches an interface on or off."""

    def step(rig: FaultRig) -> Moment:
        before = now()
        rig.link(name, up=up)
        # The end of a fault is when it is certainly over, its begin when it may have begun.
        return now() if up else before

    return step


def _call(action: Callable[[FaultRig], object], *, early: bool) -> Step:
    def step(rig: FaultRig) -> Moment:
        before = now()
        action(rig)
        return before if early else now()

    return step


def _adapter_gone(rig: FaultRig) -> Moment:
    gone_ns = rig.delete_near_cable()
    present = now()
    return Moment(gone_ns, present.utc_ns - present.monotonic_ns + gone_ns)


def _nothing(_rig: FaultRig) -> Moment:
    return now()


def _toggled(name: str, do: FaultKind, alarms: tuple[Alarm, ...], camera: int = 1) -> Scenario:
    return Scenario(name, fault(do, camera, 1), fault(do, camera, 0), alarms)


def _at_once(name: str, step: Step, alarms: tuple[Alarm, ...], *, stops: bool = False) -> Scenario:
    return Scenario(name, step, _nothing, alarms, stops=stops, lasts_s=0.0)


def cable(
    name: str, rule: LineRule, alarms: tuple[Alarm, ...], *, stops: bool = False, s: float = 0.5
) -> Scenario:
    """Return the scenario of a disturbed cable."""
    return Scenario(name, line(rule), line(), alarms, stops=stops, lasts_s=s)


def _read_forbidden(rig: FaultRig) -> str:
    return _object(rig, lambda camera: camera.write(DEVICE_NAME_OBJECT, 0, b"x" * 17))


def _write_long(rig: FaultRig) -> str:
    def there_and_back(camera: RemoteObjects) -> None:
        for text in (_LONG_NOTE, _LONG_NOTE[::-1]):
            camera.write(CALIBRATION, _NOTE, text)
            if camera.read(CALIBRATION, _NOTE) != text:
                raise BusError("rig.note", "The note came back changed.", "")

    return _object(rig, there_and_back)


def _read_hung(rig: FaultRig) -> str:
    return _object(rig, lambda camera: camera.read(DEVICE_NAME_OBJECT, 0))


def _object(rig: FaultRig, action: Callable[[RemoteObjects], object]) -> str:
    """Return the code of the error, or "done"."""
    if rig.bus is None:
        return "no bus process"
    try:
        action(RemoteObjects(rig.bus, RIGHT.name, timeout_s=3.0))
    except BusError as error:
        return error.code
    return "done"


def _both_restart(rig: FaultRig) -> Moment:
    before = now()
    for camera in (0, 1):
        rig.command(FaultKind.RESTART, camera)
    return before


def _flap_thrice(rig: FaultRig) -> Moment:
    before = now()
    for _ in range(3):
        rig.link(NEAR, up=False)
        time.sleep(0.02)
        rig.link(NEAR, up=True)
        time.sleep(0.02)
    return before


class _SecondMaster:
    """Frames of another master at the master's end of the cable, every 2 ms."""

    def __init__(self) -> None:
        self._ended, self._began = threading.Event(), threading.Event()
        self._thread: threading.Thread | None = None

    def begin(self) -> None:
        """Begin to send."""
        self._ended.clear()
        self._began.clear()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        self._began.wait()

    def end(self) -> None:
        """End it."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        frame = encode_frame(3, [Datagram(Command.BRD, 0, 0x0130, bytes(2))])
        # The master library's own source address: it shows only that the frame passed no camera.
        frame = frame[:6] + b"\x01" * 6 + frame[12:]
        with socket.socket(socket.AF_PACKET, socket.SOCK_RAW) as channel:
            channel.bind((NEAR, 0))
            while not self._ended.is_set():
                with contextlib.suppress(OSError):
                    channel.send(frame)
                self._began.set()
                self._ended.wait(0.002)


_SECOND = _SecondMaster()


def _second_master_begins(_rig: FaultRig) -> Moment:
    _SECOND.begin()
    return now()


def _second_master_ends(_rig: FaultRig) -> Moment:
    _SECOND.end()
    return now()


_PROCESS = (FrameKind.PROCESS,)
Do = FaultKind
gone = (Alarm.SILENT, Alarm.CAMERA_MISSING, Alarm.LOST_ANSWERS, Alarm.LINK_DOWN)
_PART = (Alarm.CAMERA_MISSING, Alarm.WORKING_COUNTER, Alarm.RESTARTED, Alarm.LEFT_OPERATION)
_LOST = (Alarm.LOST_ANSWERS,)
_LATE = (Alarm.LATE_ANSWERS, Alarm.STRAY_ANSWERS, Alarm.LOST_ANSWERS)

SCENARIOS: tuple[Scenario, ...] = (
    Scenario("link down, master's end", link(HOST, up=False), link(HOST, up=True),
             (Alarm.LINK_DOWN,)),
    Scenario("link down, cameras' end", link(NEAR, up=False), link(NEAR, up=True),
             (Alarm.LINK_DOWN,)),
    Scenario("cable cut further on", link(FAR, up=False), link(FAR, up=True), gone),
    Scenario("cameras' own link down", link(CAMERAS, up=False), link(CAMERAS, up=True), gone),
    Scenario("adapter removed and back", _adapter_gone,
             _call(FaultRig.make_near_cable, early=False), (Alarm.LINK_DOWN,)),
    Scenario("all cameras killed and restarted", _call(FaultRig.kill_cameras, early=True),
             _call(FaultRig.start_cameras, early=False), gone),
    Scenario("first camera off and on", fault(Do.POWER_OFF, 0), fault(Do.POWER_ON, 0), gone),
    Scenario("last camera off and on", fault(Do.POWER_OFF, 1), fault(Do.POWER_ON, 1), _PART),
    _at_once("camera restarts", fault(Do.RESTART, 1), (*gone, *_PART)),
    _toggled("camera silent", Do.MUTE, _PART),
    Scenario("camera unplugged and back", fault(Do.UNPLUG, 1), fault(Do.PLUG, 1), _PART),
    _toggled("camera frozen, full working counter", Do.FREEZE, (Alarm.FROZEN,)),
    _at_once("watchdog: master stands still 300 ms",
             _call(lambda rig: rig.stall_bus(0.3), early=False), (Alarm.WATCHDOG,)),
    _at_once("camera falls to SAFEOP", fault(Do.FALL_BACK, 1, SAFEOP, AL_SYNC), (Alarm.SYNC,)),
    _at_once("camera drops to PREOP", fault(Do.FALL_BACK, 1, PREOP, 0x001D),
             (Alarm.LEFT_OPERATION, *_PART)),
    _at_once("camera drops to INIT", fault(Do.FALL_BACK, 0, INIT, 0), _PART),
    cable("loss 5 %", LineRule(do=Trick.DROP, share=0.05), _LOST, s=1.0),
    cable("requests lost 2 %",
          LineRule(do=Trick.DROP, way=LineDirection.REQUEST, share=0.02), _LOST),
    cable("duplicates 20 %", LineRule(do=Trick.DUPLICATE, share=0.2), ()),
    cable("late answers", LineRule(do=Trick.DELAY, value=1500, share=0.1, kinds=_PROCESS), _LATE),
    cable("out-of-order answers", LineRule(do=Trick.HOLD, share=0.1), _LATE),
    cable("reordered requests",
          LineRule(do=Trick.HOLD, share=0.1, way=LineDirection.REQUEST), _LATE),
    cable("old answers again", LineRule(do=Trick.REPLAY, share=0.1, kinds=_PROCESS), _LATE),
    cable("working counter too high", LineRule(do=Trick.COUNTER, share=0.2, kinds=_PROCESS),
           (Alarm.WORKING_COUNTER,)),
    cable("working counter too low",
           LineRule(do=Trick.COUNTER, value=-1, share=0.2, kinds=_PROCESS),
           (Alarm.WORKING_COUNTER,)),
    cable("corrupted on the cable", LineRule(do=Trick.FLIP_DATA, share=0.2, kinds=_PROCESS),
           (Alarm.PAYLOAD,)),
    cable("any bits wrong", LineRule(do=Trick.FLIP, value=2, share=0.1), ()),
    cable("requests with wrong bits",
           LineRule(do=Trick.FLIP, way=LineDirection.REQUEST, share=0.02, kinds=_PROCESS), ()),
    cable("total silence", LineRule(do=Trick.DROP), gone, stops=True),
    Scenario("camera's data corrupted", fault(Do.CORRUPT, 1, 1), fault(Do.CORRUPT, 1, 0),
             (Alarm.PAYLOAD,)),
    Scenario("camera's header corrupted, check sum right", fault(Do.CORRUPT, 1, CORRUPT_WITH_SUM),
             fault(Do.CORRUPT, 1, 0),
             (Alarm.PAYLOAD, Alarm.FRAME_RATE, Alarm.GAP, Alarm.FROZEN, Alarm.RESTARTED,
              Alarm.CONFIGURATION, Alarm.SYNC, Alarm.LEFT_OPERATION)),
    _at_once("duplicate station address", fault(Do.STATION, 1, _FIRST_STATION),
             (Alarm.DUPLICATE_ADDRESS,)),
    _at_once("cables of the cameras exchanged while off", fault(Do.SWAP, 0, 1),
             (*gone, *_PART)),
    _at_once("cables exchanged back", fault(Do.SWAP, 0, 1), (*gone, *_PART)),
    Scenario("another camera in its place", fault(Do.SERIAL, 1, 4711),
             fault(Do.SERIAL, 1, 1002), (Alarm.CAMERAS,), lasts_s=0.8),
    Scenario("alias of the other camera", fault(Do.ALIAS, 1, 1), fault(Do.ALIAS, 1, 2),
             (Alarm.ALIAS, Alarm.DUPLICATE), lasts_s=0.8),
    Scenario("one camera too many", fault(Do.PLUG, 2), fault(Do.UNPLUG, 2),
             (Alarm.CAMERAS, Alarm.FOREIGN_DEVICE), stops=False, lasts_s=0.8),
    Scenario("one camera at another frame rate", fault(Do.FRAME_PERIOD, 1, 130_000),
             fault(Do.FRAME_PERIOD, 1, 0), (Alarm.FRAME_RATE,)),
    _at_once("emergency message", fault(Do.EMERGENCY, 1, 0x4210), (Alarm.EMERGENCY,)),
    Scenario("request to a camera whose mailbox hangs", fault(Do.HANG_MAILBOX, 1, 1),
             fault(Do.HANG_MAILBOX, 1, 0), (Alarm.OBJECT_TIMEOUT,), stops=False, lasts_s=1.0,
             asks=_read_hung, answer=Alarm.OBJECT_TIMEOUT),
    Scenario("request that is refused", _nothing, _nothing, (), stops=False,
             asks=_read_forbidden, answer=Alarm.OBJECT_REFUSED),
    Scenario("long value in segments", _nothing, _nothing, (), stops=False, asks=_write_long,
             answer="done"),
    _at_once("clock of the first camera jumps", fault(Do.CLOCK_JUMP, 0, 5_000_000),
             (Alarm.CLOCK_JUMP,)),
    _at_once("clock of the last camera jumps", fault(Do.CLOCK_JUMP, 1, -3_000_000),
             (Alarm.CLOCK_JUMP,)),
    _at_once("clock of the last camera jumps by one frame", fault(Do.CLOCK_JUMP, 1, 125_000),
             (Alarm.CLOCK_JUMP,)),
    Scenario("bus clock 200 ppm fast", fault(Do.CLOCK_RATE, 0, 200_000),
             fault(Do.CLOCK_RATE, 0, 0), (), stops=False, lasts_s=1.0),
    Scenario("clock of the last camera 200 ppm slow", fault(Do.CLOCK_RATE, 1, -200_000),
             fault(Do.CLOCK_RATE, 1, 0), (), stops=False, lasts_s=1.0),
    _toggled("first camera silent", Do.MUTE, (*gone, *_PART), camera=0),
    _toggled("first camera frozen, full working counter", Do.FREEZE, (Alarm.FROZEN,), camera=0),
    _at_once("first camera falls to SAFEOP", fault(Do.FALL_BACK, 0, SAFEOP, AL_SYNC),
             (Alarm.SYNC,)),
    _at_once("last camera drops to INIT", fault(Do.FALL_BACK, 1, INIT, 0), _PART),
    _at_once("watchdog: master stands still 150 ms",
             _call(lambda rig: rig.stall_bus(0.15), early=False), (Alarm.WATCHDOG,)),
    Scenario("both cameras restart", _both_restart, _nothing, (*gone, *_PART), stops=False,
             lasts_s=0.0),
    Scenario("another camera in the first place", fault(Do.SERIAL, 0, 4711),
             fault(Do.SERIAL, 0, 1001), (Alarm.CAMERAS,), lasts_s=0.8),
    Scenario("first camera has the alias of the last", fault(Do.ALIAS, 0, 2),
             fault(Do.ALIAS, 0, 1), (Alarm.ALIAS, Alarm.DUPLICATE), lasts_s=0.8),
    Scenario("first camera at another frame rate", fault(Do.FRAME_PERIOD, 0, 130_000),
             fault(Do.FRAME_PERIOD, 0, 0), (Alarm.FRAME_RATE,)),
    Scenario("first camera's data corrupted", fault(Do.CORRUPT, 0, 1), fault(Do.CORRUPT, 0, 0),
             (Alarm.PAYLOAD,)),
    _at_once("clock of the first camera jumps back", fault(Do.CLOCK_JUMP, 0, -2_000_000),
             (Alarm.CLOCK_JUMP,)),
    _at_once("emergency of the sensor", fault(Do.EMERGENCY, 0, 0x5030), (Alarm.EMERGENCY,)),
    cable("loss 50 %", LineRule(do=Trick.DROP, share=0.5), _LOST),
    cable("all answers 3 ms late", LineRule(do=Trick.DELAY, value=3000, kinds=_PROCESS), _LATE,
           stops=True),
    Scenario("inputs of the first camera in the place of the last", fault(Do.CORRUPT, 1, COPIED),
             fault(Do.CORRUPT, 1, 0), (Alarm.EXCHANGED,)),
    Scenario("inputs of both cameras exchanged", fault(Do.CORRUPT, 0, EXCHANGED),
             fault(Do.CORRUPT, 0, 0), (Alarm.EXCHANGED,)),
    Scenario("another master on the bus", _second_master_begins, _second_master_ends,
             (Alarm.SECOND_MASTER,)),
    _at_once("link flaps three times", _flap_thrice, (Alarm.LINK_DOWN,)),
)  # fmt: skip
