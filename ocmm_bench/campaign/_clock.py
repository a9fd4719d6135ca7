"""Clocks that jump: both ways, by seconds to years, between checks and within a job.

Of ten trials three are a store of calibrations, three one of a probe, three a job file and one a
whole measured job. Each trial process has its own shifted wall clock (`WRONG_CLOCK`); the
monotonic clock is not shifted.
"""

from __future__ import annotations

import ctypes
import json
import math
import os
import random
import shutil
import signal
import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

from ocmm_bench.campaign._faulty_disk import served
from ocmm_bench.campaign._kills import measure_job
from ocmm_bench.campaign._trials import Trial, forked
from ocmm_bench.campaign._work import sample_job, sample_point
from ocmm_bench.campaign._writers import SITES, Site, other_station
from ocmm_core.calibration.records import State
from ocmm_core.documents import resource
from ocmm_core.storage import CLOCK, JobFile
from ocmm_sim.calibration_scenes import RECORDS_MADE

WRONG_CLOCK = resource("selftest", "wrong_clock.c").read_text("utf-8")
"""Shifts the time of day of this process only."""

_SECOND = timedelta(seconds=1)


class WrongClock:
    """The clock in a process that was started with the preloaded library."""

    def __init__(self) -> None:
        self._library = ctypes.CDLL(os.environ["LD_PRELOAD"])
        self._shift = timedelta()

    def set_to(self, moment: datetime) -> None:
        self._shift += moment - datetime.now(UTC)
        self._library.ocmm_shift_clock(ctypes.c_longlong(self._shift // (_SECOND / 1_000_000)))

    def jump(self, by: timedelta) -> None:
        self.set_to(datetime.now(UTC) + by)


PRELUDE = ""
"""Run before the trial; its test breaks something there."""
_STEPS = 12
_LEAST_S, _MOST_S = 1.0, 5.0 * 365.0 * 86400.0
_CORRECTED = timedelta(seconds=60)
"""Clock corrections up to this are no step."""
_BEHIND = timedelta(minutes=10) + _CORRECTED
"""A store notes every ten minutes that it was checked."""
_SLACK = timedelta(seconds=2)
"""Between our reading of the clock and that of the callee; a busy computer delays at most between
two steps, where it changes nothing."""
_LONGEST_KILL_S = 0.02
_DEEDS = ("look", "look", "look", "look anew", "look anew", "killed", "add", "verify")
_FIRST, _LAST = datetime(1990, 1, 1, tzinfo=UTC), datetime(2090, 1, 1, tzinfo=UTC)
"""Limits of the calendar; a file says nothing of the years beyond them."""


def clock(seed: int, runs: int, done: frozenset[int]) -> Iterator[Trial]:
    """Yield the result of each series of jumps."""
    yield from served("clock", WRONG_CLOCK, serve_clock.__name__, (seed, runs, done), PRELUDE)


def serve_clock() -> None:
    """Jump and print a line per trial; runs with the wrong clock preloaded."""
    seed, runs, done, name = json.loads(sys.argv[1])
    wrong, whole = WrongClock(), _WholeJob(Path(name))
    for number in range(runs):
        if number in done:
            continue
        folder = Path(name) / str(number)
        rng = random.Random(f"{seed} {number}")  # noqa: S311 - moments, no secret
        found: Counter[str] = Counter()
        log: list[str] = []
        with other_station(folder / "home"):
            kind = number % 10
            if kind == 9:
                steps = whole.disturbed(wrong, rng, folder, found)
            elif kind >= 6:
                steps = _job(wrong, rng, folder, found, log)
            else:
                steps = _store(wrong, rng, SITES[kind // 3], folder / "store", found, log)
        shutil.rmtree(folder, ignore_errors=True)
        counts = {finding: many for finding, many in found.items() if many}
        line = [number, steps, counts, "; ".join(log) if counts else ""]
        sys.stdout.write(json.dumps(line) + "\n")
        sys.stdout.flush()


def _store(
    wrong: WrongClock,
    rng: random.Random,
    kind: type[Site],
    folder: Path,
    found: Counter[str],
    log: list[str],
) -> int:
    """Check a store, add to it and verify it under a jumping clock; compare its messages."""
    wrong.set_to(RECORDS_MADE + timedelta(days=1))
    site: Site = kind.made(folder)
    # State known to an observer of everything: latest check, last event, status.
    looked = event = RECORDS_MADE + timedelta(hours=1)
    expired = doubted = False
    until = site.until
    for _ in range(_STEPS):
        _jump(wrong, rng, until, looked)
        before = datetime.now(UTC)
        deed = rng.choice(_DEEDS)
        if deed == "look anew":
            site = kind.opened(folder)
        elif deed == "killed":
            _killed(lambda: kind.opened(folder).state(datetime.now(UTC)), rng)
            # Whether it finished its check is unknown: check again here.
        elif deed == "add":
            site.add("a blow", before)
            doubted, event = True, before
        elif deed == "verify" and before < until - _CORRECTED:
            site.verify(before)
            # Measured now, by this clock, which is therefore trusted.
            doubted, looked, event, expired = False, before, before, before >= until
        state = site.state(datetime.now(UTC))
        after = datetime.now(UTC)
        log.append(f"{deed} at {before:%Y-%m-%d %H:%M:%S}: {state}")
        if state.usable and expired:
            found["expired became valid"] += 1
        latest = max(looked, event)
        behind = looked - after > _BEHIND + _SLACK or event - after > _CORRECTED + _SLACK
        if behind and state is not State.EXPIRED:
            found["steps back not told"] += 1
        clear = before >= latest and not before <= until <= after
        if clear and (state.usable, state is State.SUSPECT) != (
            not doubted and before < until,
            doubted,
        ):
            found["honest steps accused"] += 1
        expired = expired or before >= until
        looked = max(looked, before)
    return _STEPS


def _job(
    wrong: WrongClock, rng: random.Random, folder: Path, found: Counter[str], log: list[str]
) -> int:
    """Store points and events in a job under a jumping clock, with restarts and kills between."""
    wrong.set_to(RECORDS_MADE)
    path = folder / "a.ocmm"
    job, begun = sample_job(path), datetime.now(UTC)
    latest = begun
    back: set[str] = set()
    must = False
    for step in range(_STEPS):
        _jump(wrong, rng, begun, latest)
        before = datetime.now(UTC)
        last = datetime.fromisoformat(job.audited()[-1].time_utc)
        if last - before > _CORRECTED + _SLACK:
            must = True
            back.add(last.isoformat())
        elif last - before > _CORRECTED - _SLACK:
            back.add("perhaps")
        if rng.random() < 0.7:
            job.append_point(sample_point(job.next_number()))
        else:
            job.append_event("note", f"step {step}")
        latest = max(latest, before)
        log.append(f"step {step} at {before:%Y-%m-%d %H:%M:%S}")
        if rng.random() < 0.3:
            job.close()
            if rng.random() < 0.5:
                _killed(lambda: _append_more(path), rng)
            job = JobFile.open(path)
    times = [one.time_utc for one in job.audited()]
    taken = [text for _, text in sorted(job.taken_utc().items())]
    events = [one.time_utc for one in job.events()]
    told = sum(one.kind == CLOCK for one in job.events())
    found["times that run backwards"] = sum(one != sorted(one) for one in (times, taken, events))
    # A killed program may have reported a step of its own.
    found["steps back not told"] = int(must and told < len(back - {"perhaps"}))
    found["honest steps accused"] = len(job.verify()) + int(bool(told) and not back)
    job.close()
    return _STEPS


def _append_more(path: Path) -> None:
    with JobFile.open(path) as job:
        while True:
            job.append_point(sample_point(job.next_number()))


class _WholeJob:
    """A job measured whole, once with a good clock and then with a jumping one."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._good: tuple[object, ...] = ()

    def disturbed(
        self, wrong: WrongClock, rng: random.Random, folder: Path, found: Counter[str]
    ) -> int:
        """Measure while the clock jumps: same points, times in order."""
        if not self._good:
            # Warm up first, so that nothing is compiled during the trial.
            measure_job(folder / "warm", None)
            self._good, _ = self._measured(folder / "good")
        over = threading.Event()
        jumps = 0

        def jump() -> None:
            nonlocal jumps
            while not over.wait(rng.uniform(0.0, 0.05)):
                wrong.jump(_drawn(rng))
                jumps += 1

        thread = threading.Thread(target=jump)
        wrong.set_to(RECORDS_MADE)
        thread.start()
        try:
            points, times = self._measured(folder / "jumped")
        finally:
            over.set()
            thread.join()
        found["measuring disturbed"] = int(points != self._good)
        found["times that run backwards"] = int(times != sorted(times))
        return jumps

    def _measured(self, folder: Path) -> tuple[tuple[object, ...], list[str]]:
        measure_job(folder, None)
        (path,) = folder.glob("*.ocmm")
        with JobFile.open(path) as job:
            points = tuple(
                (one.number, one.time_s, one.first_frame, one.tip_world.tobytes())
                for one in job.points()
            )
            return points, [one.time_utc for one in job.audited()]


def _drawn(rng: random.Random) -> timedelta:
    """Return a jump: either sign, a second to five years, log-uniform."""
    size = math.exp(rng.uniform(math.log(_LEAST_S), math.log(_MOST_S)))
    return timedelta(seconds=rng.choice((-1.0, 1.0)) * size)


def _jump(wrong: WrongClock, rng: random.Random, until: datetime, latest: datetime) -> None:
    """Set the clock: by any jump, to the end of validity, or on from the latest moment."""
    way = rng.random()
    if way < 0.4:
        wrong.set_to(min(max(datetime.now(UTC) + _drawn(rng), _FIRST), _LAST))
    elif way < 0.7:
        wrong.set_to(until + timedelta(seconds=rng.choice((-1.0, 1.0)) * rng.uniform(2.0, 900.0)))
    elif way < 0.9:
        wrong.set_to(latest + timedelta(seconds=rng.uniform(2.0, 86400.0)))


def _killed(work: Callable[[], object], rng: random.Random) -> None:
    """Do something in a copy of this program and kill it meanwhile."""

    def run(_to: int) -> None:
        work()

    child, pipe = forked(run)
    threading.Event().wait(rng.uniform(0.0, _LONGEST_KILL_S))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    os.close(pipe)
