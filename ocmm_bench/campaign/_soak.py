"""Soak: jobs at full rate in one program that must not grow (window: ``benchmarks.soak``)."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ocmm_bench.campaign._kills import measure_job
from ocmm_bench.campaign._stores import other_station
from ocmm_bench.campaign._trials import NotRunError, Trial
from ocmm_core.storage import JobFile

RATE_HZ = 8000
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

    def look(self, now_s: float) -> None:
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
            measure_job(out, None, RATE_HZ)
            points = faults = 0
            for path in out.glob("*.ocmm"):
                with JobFile.open(path) as job:
                    points, faults = len(job.points()), len(job.verify())
            shutil.rmtree(out)
            held.look(time.monotonic() - begun)
            found = {"jobs without all points": int(points == 0 or faults > 0), **held.found()}
            slope, sigma = held.growth()
            yield Trial(
                "soak", seed, number, points, {what: many for what, many in found.items() if many},
                f"{held.times[-1]:.0f} s: {held.mib[-1]:.1f} MiB, {held.others[-1]}; "
                f"{slope:+.2f} +- {sigma:.2f} MiB/h",
            )  # fmt: skip
