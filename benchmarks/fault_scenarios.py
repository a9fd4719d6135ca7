"""Every fault of the bus as a scenario, played one after another on one and the same bus process.

Each has to end in operation, without a restart, or the next one would have nothing to disturb.
Used by ``benchmarks/faults.py`` and by the system tests, which run this file as a program inside a
private network namespace: ``python benchmarks/fault_scenarios.py RESULT.json faults [NAME ...]``
(or ``quick``, without the pauses that keep the events of one fault apart from those of the next),
``... exact`` for one camera and answers lost in known cycles, ``... starts COUNT`` for rapid starts
and stops, ``... restarts COUNT`` for restarts of cameras and bus in operation, ``... flaps COUNT``
for links that go away and come back, or ``... identity COUNT`` for inputs that are not what they
seem. The faults are in `fault_list`.
"""

from __future__ import annotations

import sys
import tempfile
import threading
import time
from pathlib import Path

import msgspec

from benchmarks.fault_identity import play_identity
from benchmarks.fault_list import LEFT, RIGHT, SCENARIOS, SPARE, Scenario, cable, gone
from benchmarks.fault_restarts import CYCLE_NS, GIVE_UP_S, play_flaps, play_restarts, play_starts
from benchmarks.fault_rig import FaultRig
from benchmarks.faulty_line import FrameKind, LineRule, Trick
from ocmm_core.acquisition.bus_process import BUS_PRIORITY, take_priority
from ocmm_core.acquisition.frames import (
    AcquisitionState,
    AcquisitionStatus,
    RingHeaderField,
    read_status,
)
from ocmm_core.documents import write_atomic
from ocmm_core.fieldbus.report import Alarm, BusPhase
from tests.system.frame_watch import FrameWatch, Watched

FLAG_CYCLES = 3
"""From then on no exposure may be accepted that a fault makes doubtful."""
_SETTLE_S, _SETTLE_QUICK_S = 0.1, 0.05
_GROUP_NS = 1_100_000_000
"""Events that are alike and nearer than a second are one."""
_CALM_S = 1.5
"""A busy computer disturbs the bus again and again; it is not waited for any longer."""
_NO_FAULT = ("bus.operation", Alarm.HOST_BUSY)
_POLL_S = 0.002
_FOLLOWS = {"cables exchanged back": "cables of the cameras exchanged while off"}
"""What only undoes another one."""


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
        """Return the number of frames that must not have been given out."""
        return self.stale + self.mixed + self.garbled + self.disordered


class Player:
    """Plays scenarios on a rig whose bus process runs.

    Parameters
    ----------
    rig
        In operation.
    careful
        Wait before each until its events cannot be taken for those of the one before.
    """

    def __init__(self, rig: FaultRig, *, careful: bool = True) -> None:
        if rig.ring is None:
            raise ValueError("the bus process of the rig is not started")
        self._rig = rig
        self._careful = careful
        self._settle_s = _SETTLE_S if careful else _SETTLE_QUICK_S
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
        """Read frames for a time."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._look(seen)
            time.sleep(_POLL_S)

    def play(self, scenario: Scenario) -> Outcome:
        """Play one scenario from operation to operation."""
        before_it = Watched()
        if self.healthy(before_it, time.monotonic_ns()) is None:
            raise TimeoutError(f"not in operation before '{scenario.name}'")
        self.watch(before_it, self._settle_s)
        # Those of `gone` come with many faults.
        deadline = time.monotonic() + _CALM_S * self._careful
        while self.recently((*scenario.alarms, *gone)) and time.monotonic() < deadline:
            self.watch(before_it, self._settle_s)
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
        self.watch(seen, self._settle_s)
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

    def recently(self, alarms: tuple[Alarm, ...]) -> bool:
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


def play_all(names: list[str], out: Path, *, careful: bool = True) -> None:
    """Play scenarios and write their outcomes; restart after one that does not end well."""
    chosen = [scenario for scenario in SCENARIOS if not names or scenario.name in names]
    order = [scenario.name for scenario in chosen]
    outcomes: list[Outcome] = []
    while chosen:
        with (
            tempfile.TemporaryDirectory() as folder,
            FaultRig(
                Path(folder), (LEFT, RIGHT), (LEFT, RIGHT, SPARE), unplugged=(2,), seed=len(chosen)
            ) as rig,
        ):
            rig.start_bus()
            player = Player(rig, careful=careful)
            while chosen:
                outcomes.append(player.play(_next(chosen, player)))
                found = sorted(outcomes, key=lambda outcome: order.index(outcome.name))
                write_atomic(out, msgspec.json.encode(found))
                if outcomes[-1].back_s is None:
                    break


def _next(chosen: list[Scenario], player: Player) -> Scenario:
    """Take the first scenario whose alarms were not heard just now, or the first of all."""
    left = {scenario.name for scenario in chosen}
    ready = [scenario for scenario in chosen if _FOLLOWS.get(scenario.name) not in left]
    quiet = [scenario for scenario in ready if not player.recently(scenario.alarms)]
    found = (quiet or ready)[0]
    chosen.remove(found)
    return found


def play_exact(out: Path) -> None:
    """Lose answers of one camera; a cycle is one frame then, and the counts are exact."""
    scenario = cable(
        "1 % of the answers lost, one camera",
        LineRule(do=Trick.DROP, share=0.01, kinds=(FrameKind.PROCESS,)),
        (Alarm.LOST_ANSWERS,),
        s=3.0,
    )
    with tempfile.TemporaryDirectory() as folder, FaultRig(Path(folder), (LEFT,), seed=3) as rig:
        rig.start_bus()
        write_atomic(out, msgspec.json.encode([Player(rig).play(scenario)]))


def main() -> None:
    """Run the program; see the module for its arguments."""
    out, what, *rest = Path(sys.argv[1]), *sys.argv[2:]
    counted = {"restarts": play_restarts, "flaps": play_flaps, "identity": play_identity}
    if what in ("faults", "quick"):
        play_all(rest, out, careful=what == "faults")
    elif what == "exact":
        play_exact(out)
    elif what in counted:
        counted[what](int(rest[0]), out)
    else:
        take_priority(BUS_PRIORITY)
        play_starts(int(rest[0]), out)


if __name__ == "__main__":
    main()
