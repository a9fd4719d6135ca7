"""Every fault of the bus as a scenario: how it is made, how it ends, and what must be said of it.

The scenarios are played one after another on one and the same bus process: each has to end in
operation, without a restart, or the next one would have nothing to disturb. Used by
``benchmarks/faults.py`` and by the system tests, which run this file as a program inside a private
network namespace: ``python benchmarks/fault_scenarios.py RESULT.json faults [NAME ...]``, or
``... exact`` for one camera and answers lost in known cycles, ``... starts COUNT`` for rapid
starts and stops, or ``... restarts COUNT`` for restarts of cameras and bus in operation.
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.acquisition.bus_process import (
    BUS_PRIORITY,
    EthercatSource,
    RemoteObjects,
    take_priority,
)
from ocmm_core.acquisition.frames import (
    AcquisitionState,
    AcquisitionStatus,
    AcquisitionWorker,
    FrameRing,
    RingHeaderField,
    StopReason,
    read_status,
)
from ocmm_core.documents import write_atomic
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.cycle import BusSettings
from ocmm_core.fieldbus.device import CALIBRATION, CameraIdentity
from ocmm_core.fieldbus.report import Alarm, BusPhase, decode_report
from ocmm_core.simulation.bus import (
    CAMERAS,
    CORRUPT_WITH_SUM,
    FAR,
    HOST,
    NEAR,
    FaultKind,
    FaultRig,
    FrameKind,
    FrameWatch,
    LineRule,
    Trick,
    Watched,
    Way,
)
from ocmm_core.simulation.slave import AL_SYNC, INIT, PREOP, SAFEOP

LEFT, RIGHT = CameraIdentity("left", 1001, 1), CameraIdentity("right", 1002, 2)
SPARE = CameraIdentity("spare", 1003, 3)
CYCLE_NS = 1_000_000
FLAG_CYCLES = 3
"""From then on no exposure may be accepted that a fault makes doubtful."""
GIVE_UP_S = 10.0
_SETTLE_S = 0.1
_GROUP_NS = 1_100_000_000
"""Events that are alike and nearer than a second are one."""
_CALM_S = 1.5
"""A busy computer disturbs the bus again and again; it is not waited for any longer."""
_NO_FAULT = ("bus.operation", Alarm.HOST_BUSY)
_POLL_S = 0.002
_LOOKS = 8
_RESTART_KINDS = 10
"""Of ten restarts one is of the process of the cameras, one of the bus process."""
_FIRST_STATION = 0x1001
DEVICE_NAME_OBJECT = 0x1008
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


class Outcome(msgspec.Struct, kw_only=True):
    """What became of a scenario.

    Attributes
    ----------
    name
        Of the scenario.
    reported
        Codes of the events, in order.
    named
        One of the alarms came that the scenario asks for.
    flagged_cycles
        From the fault to the first sign of any alarm; None where none came.
    accepted
        Frames given out that were exposed while the fault lasted, from the third cycle on.
    stopped_ms
        From the fault to the last frames given out while it lasted.
    back_s
        From the end of the fault until frames flow in operation again; None: not within the limit.
    frames, frames_lost
        Given out, and lost for good.
    stale, mixed, garbled, disordered
        Frames that must not have been given out.
    elapsed, good, late, lost, bad
        Cycles from before the fault until after it.
    cycles_spoiled
        Cycles of which the cable took an answer or a question, by its own log.
    stray
        Answers that nobody waited for any more, as the bus process counted them.
    recoveries
        How often operation was reached again.
    phases
        That were seen.
    running
        The bus process was there all the time.
    message
        The last sentence of the bus process.
    answer
        What came of the question to a camera.
    """

    name: str
    reported: list[str]
    named: bool
    flagged_cycles: float | None
    accepted: int
    stopped_ms: float
    back_s: float | None
    frames: int
    frames_lost: int
    stale: int
    mixed: int
    garbled: int
    disordered: int
    elapsed: int
    good: int
    late: int
    lost: int
    bad: int
    cycles_spoiled: int
    stray: int
    recoveries: int
    phases: list[str]
    running: bool
    message: str
    answer: str = ""

    @property
    def wrong(self) -> int:
        """Return how many frames must not have been given out."""
        return self.stale + self.mixed + self.garbled + self.disordered


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


def _cable(
    name: str, rule: LineRule, alarms: tuple[Alarm, ...], *, stops: bool = False, s: float = 0.5
) -> Scenario:
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


_PROCESS = (FrameKind.PROCESS,)
Do = FaultKind
_GONE = (Alarm.SILENT, Alarm.CAMERA_MISSING, Alarm.LOST_ANSWERS, Alarm.LINK_DOWN)
_PART = (Alarm.CAMERA_MISSING, Alarm.WORKING_COUNTER, Alarm.RESTARTED, Alarm.LEFT_OPERATION)
_LOST = (Alarm.LOST_ANSWERS,)
_LATE = (Alarm.LATE_ANSWERS, Alarm.STRAY_ANSWERS, Alarm.LOST_ANSWERS)

SCENARIOS: tuple[Scenario, ...] = (
    Scenario("link down, master's end", link(HOST, up=False), link(HOST, up=True),
             (Alarm.LINK_DOWN,)),
    Scenario("link down, cameras' end", link(NEAR, up=False), link(NEAR, up=True),
             (Alarm.LINK_DOWN,)),
    Scenario("cable cut further on", link(FAR, up=False), link(FAR, up=True), _GONE),
    Scenario("cameras' own link down", link(CAMERAS, up=False), link(CAMERAS, up=True), _GONE),
    Scenario("adapter removed and back", _adapter_gone,
             _call(FaultRig.make_near_cable, early=False), (Alarm.LINK_DOWN,)),
    Scenario("all cameras killed and restarted", _call(FaultRig.kill_cameras, early=True),
             _call(FaultRig.start_cameras, early=False), _GONE),
    Scenario("first camera off and on", fault(Do.POWER_OFF, 0), fault(Do.POWER_ON, 0), _GONE),
    Scenario("last camera off and on", fault(Do.POWER_OFF, 1), fault(Do.POWER_ON, 1), _PART),
    _at_once("camera restarts", fault(Do.RESTART, 1), (*_GONE, *_PART)),
    _toggled("camera silent", Do.MUTE, _PART),
    Scenario("camera unplugged and back", fault(Do.UNPLUG, 1), fault(Do.PLUG, 1), _PART),
    _toggled("camera frozen, full working counter", Do.FREEZE, (Alarm.FROZEN,)),
    _at_once("watchdog: master stands still 300 ms",
             _call(lambda rig: rig.stall_bus(0.3), early=False), (Alarm.WATCHDOG,)),
    _at_once("camera falls to SAFEOP", fault(Do.FALL_BACK, 1, SAFEOP, AL_SYNC), (Alarm.SYNC,)),
    _at_once("camera drops to PREOP", fault(Do.FALL_BACK, 1, PREOP, 0x001D),
             (Alarm.LEFT_OPERATION, *_PART)),
    _at_once("camera drops to INIT", fault(Do.FALL_BACK, 0, INIT, 0), _PART),
    _cable("loss 5 %", LineRule(do=Trick.DROP, share=0.05), _LOST, s=1.0),
    _cable("requests lost 2 %", LineRule(do=Trick.DROP, way=Way.REQUEST, share=0.02), _LOST),
    _cable("duplicates 20 %", LineRule(do=Trick.DUPLICATE, share=0.2), ()),
    _cable("late answers", LineRule(do=Trick.DELAY, value=1500, share=0.1, kinds=_PROCESS), _LATE),
    _cable("out-of-order answers", LineRule(do=Trick.HOLD, share=0.1), _LATE),
    _cable("reordered requests", LineRule(do=Trick.HOLD, share=0.1, way=Way.REQUEST), _LATE),
    _cable("old answers again", LineRule(do=Trick.REPLAY, share=0.1, kinds=_PROCESS), _LATE),
    _cable("working counter too high", LineRule(do=Trick.COUNTER, share=0.2, kinds=_PROCESS),
           (Alarm.WORKING_COUNTER,)),
    _cable("working counter too low",
           LineRule(do=Trick.COUNTER, value=-1, share=0.2, kinds=_PROCESS),
           (Alarm.WORKING_COUNTER,)),
    _cable("corrupted on the cable", LineRule(do=Trick.FLIP_DATA, share=0.2, kinds=_PROCESS),
           (Alarm.PAYLOAD,)),
    _cable("any bits wrong", LineRule(do=Trick.FLIP, value=2, share=0.1), ()),
    _cable("requests with wrong bits",
           LineRule(do=Trick.FLIP, way=Way.REQUEST, share=0.02, kinds=_PROCESS), ()),
    _cable("total silence", LineRule(do=Trick.DROP), _GONE, stops=True),
    Scenario("camera's data corrupted", fault(Do.CORRUPT, 1, 1), fault(Do.CORRUPT, 1, 0),
             (Alarm.PAYLOAD,)),
    Scenario("camera's header corrupted, check sum right", fault(Do.CORRUPT, 1, CORRUPT_WITH_SUM),
             fault(Do.CORRUPT, 1, 0),
             (Alarm.PAYLOAD, Alarm.FRAME_RATE, Alarm.GAP, Alarm.FROZEN, Alarm.RESTARTED,
              Alarm.CONFIGURATION, Alarm.SYNC, Alarm.LEFT_OPERATION)),
    _at_once("duplicate station address", fault(Do.STATION, 1, _FIRST_STATION),
             (Alarm.DUPLICATE_ADDRESS,)),
    _at_once("cables of the cameras exchanged while off", fault(Do.SWAP, 0, 1),
             (*_GONE, *_PART)),
    _at_once("cables exchanged back", fault(Do.SWAP, 0, 1), (*_GONE, *_PART)),
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
)  # fmt: skip


class Player:
    """Plays scenarios on a rig whose bus process runs.

    Parameters
    ----------
    rig
        In operation.
    """

    def __init__(self, rig: FaultRig) -> None:
        if rig.ring is None:
            raise ValueError("the bus process of the rig is not started")
        self._rig = rig
        self._ring = rig.ring
        self._watch = FrameWatch(rig.ring)

    def healthy(self, seen: Watched, since_ns: int) -> float | None:
        """Wait until frames exposed later flow in operation; return the time when they came, s."""
        deadline = time.monotonic() + GIVE_UP_S
        came: float | None = None
        while time.monotonic() < deadline and self._running():
            fresh = self._look(seen) and seen.exposed_between(since_ns, time.monotonic_ns())
            if fresh and came is None:
                came = time.monotonic()
            report = self._watch.report
            if came is not None and report is not None and report.phase is BusPhase.OPERATION:
                return came
            time.sleep(_POLL_S)
        return None

    def watch(self, seen: Watched, seconds: float) -> None:
        """Take in what comes."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._look(seen)
            time.sleep(_POLL_S)

    def play(self, scenario: Scenario) -> Outcome:
        """Play one scenario from operation to operation."""
        before_it = Watched()
        if self.healthy(before_it, time.monotonic_ns()) is None:
            raise TimeoutError(f"not in operation before '{scenario.name}'")
        self.watch(before_it, _SETTLE_S)
        # These come with many faults.
        deadline = time.monotonic() + _CALM_S
        while self._recently((*scenario.alarms, *_GONE)) and time.monotonic() < deadline:
            self.watch(before_it, _SETTLE_S)
        self._rig.line_log(new_log=True)
        status = read_status(self._ring)
        stray, recoveries = self._counts()
        seen = Watched()
        begin = scenario.begin(self._rig)
        answers: list[str] = []
        asking: threading.Thread | None = None
        if scenario.asks is not None:
            ask = scenario.asks
            asking = threading.Thread(target=lambda: answers.append(ask(self._rig)))
            asking.start()
        self.watch(seen, scenario.lasts_s)
        last_ns = self._ring.word(RingHeaderField.LAST_FRAMES_NS)
        end = scenario.end(self._rig) if scenario.lasts_s else begin
        came = self.healthy(seen, end.monotonic_ns)
        self.watch(seen, _SETTLE_S)
        log = self._rig.line_log()
        after = read_status(self._ring)
        stray_after, recoveries_after = self._counts()
        if asking is not None:
            asking.join()
        first = [
            event.utc_ns - (log.first_utc_ns or begin.utc_ns)
            for event in seen.events
            if event.code not in _NO_FAULT
        ]
        return Outcome(
            name=scenario.name,
            reported=[event.code for event in seen.events],
            named=not scenario.alarms
            or any(event.code in scenario.alarms for event in seen.events + seen.grown),
            flagged_cycles=min(first) / CYCLE_NS if first else None,
            accepted=seen.exposed_between(
                begin.monotonic_ns + FLAG_CYCLES * CYCLE_NS, end.monotonic_ns
            )
            if end.monotonic_ns > begin.monotonic_ns + FLAG_CYCLES * CYCLE_NS
            else 0,
            stopped_ms=max(0.0, (last_ns - begin.monotonic_ns) * 1e-6),
            back_s=None if came is None else came - end.monotonic_ns * 1e-9,
            frames=seen.frames,
            frames_lost=seen.lost,
            stale=seen.stale,
            mixed=seen.mixed,
            garbled=seen.garbled,
            disordered=seen.disordered,
            cycles_spoiled=len({touched.heartbeat for touched in log.touched}),
            stray=stray_after - stray,
            recoveries=recoveries_after - recoveries,
            phases=[phase.value for phase in seen.phases],
            running=self._running(),
            message=after.message,
            answer="".join(answers),
            **_cycles(status, after),
        )

    def _recently(self, alarms: tuple[Alarm, ...]) -> bool:
        """Return whether one of these would be taken for the same event as before."""
        since_ns = time.monotonic_ns() - _GROUP_NS
        return any(self._watch.last_sign_ns.get(alarm, 0) > since_ns for alarm in alarms)

    def _look(self, seen: Watched) -> int:
        return self._watch.look(seen)

    def _counts(self) -> tuple[int, int]:
        report = self._watch.report
        return (0, 0) if report is None else (report.stray_answers, report.recoveries)

    def _running(self) -> bool:
        return self._ring.word(RingHeaderField.STATE) != AcquisitionState.STOPPED


def _cycles(before: AcquisitionStatus, after: AcquisitionStatus) -> dict[str, int]:
    names = ("elapsed", "good", "late", "lost", "bad")
    return {name: getattr(after, name) - getattr(before, name) for name in names}


def play_all(names: list[str], out: Path) -> None:
    """Play scenarios and write their outcomes; after one that does not end well, start anew."""
    chosen = [scenario for scenario in SCENARIOS if not names or scenario.name in names]
    outcomes: list[Outcome] = []
    while chosen:
        with (
            tempfile.TemporaryDirectory() as folder,
            FaultRig(
                Path(folder), (LEFT, RIGHT), (LEFT, RIGHT, SPARE), unplugged=(2,), seed=len(chosen)
            ) as rig,
        ):
            rig.start_bus()
            player = Player(rig)
            while chosen:
                outcomes.append(player.play(chosen.pop(0)))
                write_atomic(out, msgspec.json.encode(outcomes))
                if outcomes[-1].back_s is None:
                    break


def play_exact(out: Path) -> None:
    """Let answers of one camera get lost; a cycle is one frame then, and the counts are exact."""
    scenario = _cable(
        "1 % of the answers lost, one camera",
        LineRule(do=Trick.DROP, share=0.01, kinds=_PROCESS),
        _LOST,
        s=3.0,
    )
    with tempfile.TemporaryDirectory() as folder, FaultRig(Path(folder), (LEFT,), seed=3) as rig:
        rig.start_bus()
        write_atomic(out, msgspec.json.encode([Player(rig).play(scenario)]))


class Starts(msgspec.Struct, kw_only=True):
    """What became of rapid starts and stops.

    Attributes
    ----------
    count
        How many.
    ended
        How many ended when asked, by that and in time.
    measured
        How many had come as far as giving out frames.
    frames, wrong
        Given out in all of them, and those that must not have been.
    slowest_stop_s
        From the request to the end.
    descriptors, threads
        More than before the first start.
    works
        The last one was left alone, and gave out frames.
    messages
        What those said that ended otherwise than by being asked to.
    """

    count: int = 0
    ended: int = 0
    measured: int = 0
    frames: int = 0
    wrong: int = 0
    slowest_stop_s: float = 0.0
    descriptors: int = 0
    threads: int = 0
    works: bool = False
    messages: list[str] = msgspec.field(default_factory=list)


def play_starts(count: int, out: Path) -> None:
    """Start and stop the acquisition again and again, often before it is in operation."""
    random = np.random.default_rng(5)
    result = Starts(count=count)
    with tempfile.TemporaryDirectory() as folder, FaultRig(Path(folder), (LEFT, RIGHT)) as rig:
        before: tuple[int, int] | None = None
        for number in range(count + 1):
            last = number == count
            _start_once(result, 3.0 if last else float(random.uniform(0.0, 0.9)), last=last)
            now_open = (len(list(Path("/proc/self/fd").iterdir())), threading.active_count())
            before = before or now_open
            result.descriptors = now_open[0] - before[0]
            result.threads = now_open[1] - before[1]
        rig.line_log()
    write_atomic(out, msgspec.json.encode(result))


def _start_once(result: Starts, seconds: float, *, last: bool) -> None:
    ring = FrameRing.create(2)
    try:
        settings = BusSettings(HOST, (LEFT, RIGHT), 125_000, CYCLE_NS)
        worker = AcquisitionWorker(EthercatSource(settings), ring)
        watch, seen = FrameWatch(ring), Watched()
        worker.start()
        end = time.monotonic() + seconds
        while time.monotonic() < end and not (last and seen.frames):
            watch.look(seen)
            time.sleep(_POLL_S)
        asked = time.monotonic()
        worker.request_stop()
        in_time = worker.join(GIVE_UP_S)
        watch.look(seen)
        status = read_status(ring)
        requested = status.stop_reason is StopReason.REQUESTED
        if not requested:
            result.messages.append(status.message)
        result.ended += 0 if last else int(in_time and requested)
        result.works |= last and seen.frames > 0
        result.slowest_stop_s = max(result.slowest_stop_s, time.monotonic() - asked)
        result.measured += bool(seen.frames)
        result.frames += seen.frames
        result.wrong += seen.wrong
    finally:
        ring.close()


class Restarts(msgspec.Struct, kw_only=True):
    """What became of restarts of cameras and bus.

    Attributes
    ----------
    count, of_cameras, of_the_bus
        How many; the latter two of whole processes, which were killed.
    looks, torn
        How often the books were read meanwhile, and how often not every cycle had one account.
    elapsed, passed
        Cycles in the books, and those that the computer's clock tells.
    back
        How often operation was reached again.
    message
        What the bus process said where it was not.
    """

    count: int = 0
    of_cameras: int = 0
    of_the_bus: int = 0
    looks: int = 0
    torn: int = 0
    elapsed: int = 0
    passed: float = 0.0
    back: int = 0
    message: str = ""


def play_restarts(count: int, out: Path) -> None:
    """Restart cameras and bus again and again, and read the books all the time."""
    result = Restarts(count=count)
    with tempfile.TemporaryDirectory() as folder, FaultRig(Path(folder), (LEFT, RIGHT)) as rig:
        books = _BookWatch(rig, result)
        books.begin()
        for number in range(count):
            if not books.back():
                break
            kind = number % _RESTART_KINDS
            if kind == _RESTART_KINDS - 1:
                # Killed in the middle of whatever it does: its last page must be whole.
                books.end(kill=number % 2 == 0)
                result.of_the_bus += 1
                books.begin()
            elif kind == 0:
                rig.kill_cameras()
                books.disturbed()
                rig.start_cameras()
                result.of_cameras += 1
            else:
                rig.command(FaultKind.RESTART, number % 2)
                books.disturbed()
        books.back()
        books.end()
    write_atomic(out, msgspec.json.encode(result))


class _BookWatch:
    """Reads the books of one bus process after the other."""

    def __init__(self, rig: FaultRig, result: Restarts) -> None:
        self._rig = rig
        self._result = result
        self._first: tuple[int, int] = (0, 0)
        self._wanted = 0

    def begin(self) -> None:
        """Start the bus process."""
        self._rig.start_bus()
        self._wanted = 0
        self._first = (self._look().elapsed, time.monotonic_ns())

    def disturbed(self) -> None:
        """Expect the bus to be brought up once more."""
        self._wanted = self._recoveries() + 1

    def back(self) -> bool:
        """Wait for operation, and read the books meanwhile; say whether it came."""
        deadline = time.monotonic() + GIVE_UP_S
        while time.monotonic() < deadline:
            if self._recoveries() >= self._wanted:
                self._result.back += 1
                return True
            for _ in range(_LOOKS):
                self._look()
            time.sleep(_POLL_S)
        ring = self._rig.ring
        self._result.message = "" if ring is None else read_status(ring).message
        return False

    def _recoveries(self) -> int:
        content = b"" if self._rig.ring is None else self._rig.ring.report()
        report = decode_report(content) if content else None
        return 0 if report is None else report.recoveries

    def end(self, *, kill: bool = False) -> None:
        """Kill the bus process, or ask it to end; its books must still be whole."""
        elapsed, at_ns = self._first
        last = self._look()
        self._result.elapsed += last.elapsed - elapsed
        self._result.passed += (time.monotonic_ns() - at_ns) / CYCLE_NS
        bus = self._rig.bus
        if kill and bus is not None and bus.pid is not None:
            os.kill(bus.pid, signal.SIGKILL)
            bus.join(GIVE_UP_S)
        elif bus is not None:
            bus.request_stop()
            bus.join(GIVE_UP_S)
        self._look()
        self._rig.stop_bus()

    def _look(self) -> AcquisitionStatus:
        ring = self._rig.ring
        if ring is None:
            raise BusError("rig.bus", "The bus process is not there.", "Start it.")
        status = read_status(ring)
        self._result.looks += 1
        counted = status.good + status.late + status.lost + status.bad
        self._result.torn += counted != status.elapsed
        return status


def main() -> None:
    """Do what the arguments say; see the module."""
    out, what, *rest = Path(sys.argv[1]), *sys.argv[2:]
    if what == "faults":
        play_all(rest, out)
    elif what == "exact":
        play_exact(out)
    elif what == "restarts":
        play_restarts(int(rest[0]), out)
    else:
        take_priority(BUS_PRIORITY)
        play_starts(int(rest[0]), out)


if __name__ == "__main__":
    main()
