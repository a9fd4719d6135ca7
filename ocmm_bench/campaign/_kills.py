"""Kill -9 of a whole headless job at any moment, and soak.

Kills: from creating its file to its end. Soak: jobs at full rate in one program that must not grow
(window: ``benchmarks.soak``).
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ocmm_bench.campaign._trials import NotRunError, Trial, forked, read_numbers
from ocmm_bench.campaign._writers import other_station
from ocmm_core.acquisition.frames import FrameRing
from ocmm_core.camera import load_rig
from ocmm_core.cleanup import clear_leftovers, unheld
from ocmm_core.composition import RECOMMENDED_RIG, STANDARD_PROBE, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.plan import load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.storage import JobFile
from ocmm_core.tracking import load_probe

REOPEN_LIMIT_S = 2.0
"""CPU time, so that other load has no effect."""
QUICK_PLAN = resource("plans", "quick.toml")
RATE_HZ = 500
_RINGS = Path("/dev/shm")  # noqa: S108 - shared memory, only looked at
_PATIENCE_S = 120.0


def kills(seed: int, runs: int, done: frozenset[int]) -> Iterator[Trial]:
    """Yield the result of each kill; see `FINDINGS`."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # Once to warm up every fork, and once to measure its duration.
        measure_job(folder / "warm", None)
        begin = time.monotonic()
        child, pipe = forked(lambda to: measure_job(folder / "whole", to))
        os.waitpid(child, 0)
        os.close(pipe)
        longest = time.monotonic() - begin
        for number in range(runs):
            if number not in done:
                yield _kill(folder / f"{number}", seed, number, longest)


def measure_job(out: Path, pipe: int | None, rate_hz: int = RATE_HZ) -> None:
    """Measure a whole job on the virtual rig; point numbers, and 0 at its start, go to the pipe."""
    others = set(threading.enumerate())
    request = StationRequest(plan=QUICK_PLAN, out=out, speed=0.0, frame_rate_hz=rate_hz)
    station = build_station(request).station
    if pipe is not None:
        os.write(pipe, b"0\n")
        station.events.point_taken.connect(lambda point: os.write(pipe, b"%d\n" % point.number))
    station.start()
    station.wait_finished(_PATIENCE_S)
    station.close()
    # A copy of this program has none of its threads, and the locks that they held for ever.
    for thread in set(threading.enumerate()) - others:
        thread.join(_PATIENCE_S)


def _kill(out: Path, seed: int, number: int, longest: float) -> Trial:
    rng = random.Random(f"{seed} {number}")  # noqa: S311 - moments of a kill, no secret
    child, pipe = forked(lambda to: measure_job(out, to))
    time.sleep(rng.uniform(0.0, longest))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    # The first line means that the job exists.
    heard = read_numbers(pipe)
    os.close(pipe)
    acknowledged = [point for point in heard if point]
    jobs = list(out.glob("*.ocmm")) if out.exists() else []
    found: dict[str, int] = {}
    note = ""
    if heard and not jobs:
        found["acknowledged points lost"] = len(heard)
    for path in jobs:
        begin = time.process_time()
        try:
            points, faults = _reopened(path)
        except OcmmError as error:
            found["jobs half made"], note = 1, str(error)
            continue
        took = time.process_time() - begin
        found["acknowledged points lost"] = len(set(acknowledged) - set(points))
        found["audit faults"] = faults
        found["reopened after 2 s"] = int(took > REOPEN_LIMIT_S)
    # The next start, as after every kill.
    FrameRing.create(2, 1).close()
    clear_leftovers([out])
    found["rings left"] = len(unheld(_RINGS.glob("ocmm-ring-*")))
    found["temporary files left"] = len(list(out.glob(".*.tmp"))) if out.exists() else 0
    found = {finding: count for finding, count in found.items() if count}
    if found and not note:
        note = f"acknowledged {acknowledged}"
    return Trial("kills", seed, number, len(acknowledged), found, note)


def _reopened(path: Path) -> tuple[list[int], int]:
    """Read a job as users do; return its points and faults."""
    plan, rig, body = load_plan(QUICK_PLAN), load_rig(RECOMMENDED_RIG), load_probe(STANDARD_PROBE)
    with JobFile.read(path) as job:
        _ = InspectionSession(plan, rig, body, job, SessionOptions()).view
        return [point.number for point in job.points()], len(job.verify())


SOAK_RATE_HZ = 8000
WARM_UP_S = 600.0
"""Earlier, code is compiled and pages are touched."""
MOST_MIB_AN_HOUR = 1.0
_SURE = 3.0
"""Significance: standard deviations by which the slope must exceed the limit."""
_FEWEST = 10
_MIB = 2.0**20
_WARM_JOBS = 1


@dataclass(slots=True)
class SoakSamples:
    """Resources of the program after each job."""

    times: list[float] = field(default_factory=list)
    mib: list[float] = field(default_factory=list)
    others: list[dict[str, int]] = field(default_factory=list)

    def sample(self, now_s: float) -> None:
        own = Path("/proc/self")
        pages = int((own / "statm").read_text("ascii").split()[1])
        self.times.append(now_s)
        self.mib.append(pages * os.sysconf("SC_PAGE_SIZE") / _MIB)
        maps = (own / "maps").read_text("utf-8", "surrogateescape")
        self.others.append(
            {
                "descriptors": len(list((own / "fd").iterdir())),
                "threads": len(list((own / "task").iterdir())),
                "shared memory": sum("/dev/shm/" in line for line in maps.splitlines()),  # noqa: S108 - only looked at
            }
        )

    def growth(self) -> tuple[float, float]:
        """Return slope and standard deviation after warm-up, MiB/h; NaN for too few samples."""
        kept = [at for at, when in enumerate(self.times) if when >= WARM_UP_S]
        if len(kept) < _FEWEST:
            return float("nan"), float("nan")
        hours = np.array([self.times[at] for at in kept]) / 3600.0
        values = np.array([self.mib[at] for at in kept])
        (slope, _), covariance = np.polyfit(hours, values, 1, cov=True)
        return float(slope), float(np.sqrt(covariance[0, 0]))

    def found(self) -> dict[str, int]:
        slope, sigma = self.growth()
        grown = {"memory above 1 MiB/h": int(slope - _SURE * sigma > MOST_MIB_AN_HOUR)}
        if len(self.others) > _WARM_JOBS + 1:
            first, last = self.others[_WARM_JOBS], self.others[-1]
            grown |= {f"{what} more": int(last[what] > first[what]) for what in last}
        return grown


def soak(seed: int, runs: int, done: frozenset[int]) -> Iterator[Trial]:
    """Yield the result of each whole job in this program; its points are acknowledged."""
    if sys.platform != "linux":
        raise NotRunError("needs Linux")
    held, begun = SoakSamples(), time.monotonic()
    with tempfile.TemporaryDirectory() as name, other_station(Path(name) / "home"):
        for number in range(runs):
            if number in done:
                continue
            out = Path(name) / str(number)
            measure_job(out, None, SOAK_RATE_HZ)
            points = faults = 0
            for path in out.glob("*.ocmm"):
                with JobFile.open(path) as job:
                    points, faults = len(job.points()), len(job.verify())
            shutil.rmtree(out)
            held.sample(time.monotonic() - begun)
            found = {"jobs without all points": int(points == 0 or faults > 0), **held.found()}
            slope, sigma = held.growth()
            yield Trial(
                "soak", seed, number, points, {what: many for what, many in found.items() if many},
                f"{held.times[-1]:.0f} s: {held.mib[-1]:.1f} MiB, {held.others[-1]}; "
                f"{slope:+.2f} +- {sigma:.2f} MiB/h",
            )  # fmt: skip
