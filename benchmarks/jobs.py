"""Time that it takes to open a job again, and to compare many of them.

Jobs are those of the demonstration plan. A larger one has its 91 touches several times, each time
with white noise of its own on the mean spots; every point is stored by the calibration that is
believed, as the station stores it.

``reading`` is what the file, its audit and the sensitivities of its points take; ``reopened`` is
all of `reopen_job`, with the evaluation. Both are processor times of one process, the least of
three, because the computer may have other work. Jobs are compared in this process and in several;
the second is told in time of the clock as well, and both per job. Small numbers of jobs are scaled
to a thousand.
Run: ``python -m benchmarks.jobs [--points 91 1000] [--jobs 40] [--processes 2]``.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from ocmm_core.blas import use_one_thread

use_one_thread()

import numpy as np  # noqa: E402 - the number of BLAS threads is set before numpy is loaded

from benchmarks.recall_scenes import PROBE, RIG, base_points  # noqa: E402 - as above
from ocmm_core.camera import load_rig  # noqa: E402 - as above
from ocmm_core.documents import resource  # noqa: E402 - as above
from ocmm_core.inspection.evaluation import SessionOptions  # noqa: E402 - as above
from ocmm_core.inspection.finished import compare_files, reopen_job  # noqa: E402 - as above
from ocmm_core.inspection.plan import load_plan  # noqa: E402 - as above
from ocmm_core.inspection.session import InspectionSession, ReferenceUse  # noqa: E402 - as above
from ocmm_core.measuring import MeasuredPoint  # noqa: E402 - as above
from ocmm_core.storage import JobFile, make_head  # noqa: E402 - as above
from ocmm_core.tracking import load_probe, solve, spot_sigma_px  # noqa: E402 - as above

PLAN = resource("plans", "demo.toml")
LONGEST_S = {91: 0.15, 10_000: 3.0}
THOUSAND_S = 30.0
_REPEATS = 3


def write_job(path: Path, base: Sequence[MeasuredPoint], n: int, seed: int) -> None:
    """Write a job of ``n`` points after those of ``base``."""
    rng = np.random.default_rng(seed)
    rig, body = load_rig(RIG), load_probe(PROBE)
    like = [base[i % len(base)] for i in range(n)]
    noise = rng.standard_normal((n, *base[0].spots.shape))
    sigmas = np.array([rig.noise.white_px / np.sqrt(point.n_frames) for point in like])
    spots = np.array([point.spots for point in like]) + sigmas[:, None, None, None] * noise
    found = solve(spots, rig, body, spot_sigma_px(rig))
    head = make_head(plan=PLAN, rig=RIG, probe=PROBE, operator="me", part="P", serial=path.stem)
    with JobFile.create(path, head) as job:
        job.change(
            append=[
                replace(point, number=i + 1, spots=spots[i], tip_world=found.tip_world[i])
                for i, point in enumerate(like)
            ]
        )


def least_s(call: Callable[[], object]) -> float:
    """Return the least processor time of some calls, s."""
    times = []
    for _ in range(_REPEATS):
        begun = time.process_time()
        call()
        times.append(time.process_time() - begun)
    return min(times)


def read(path: Path) -> None:
    """Do all that opening does but evaluating."""
    rig, body, options = load_rig(RIG), load_probe(PROBE), SessionOptions()
    with JobFile.open(path) as job:
        points = job.points()
        use = ReferenceUse(rig, body, None, job, begun=True)
        use.sensitivities([(point.spots, point.reference_spots) for point in points])
        InspectionSession(load_plan(PLAN), rig, body, job, options)
        job.verify()


def main() -> int:
    """Print the times; return 0 where all are as short as they should be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, nargs="+", default=[91, 1000])
    parser.add_argument("--jobs", type=int, default=40)
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    good = True
    with tempfile.TemporaryDirectory(prefix="ocmm-jobs-") as name:
        folder = Path(name)
        base = base_points(folder, PLAN)
        for n in options.points:
            path = folder / f"large-{n}.ocmm"
            write_job(path, base, n, n)
            reading = least_s(partial(read, path))
            whole = least_s(partial(reopen_job, path, folder, calibrations=folder))
            sys.stdout.write(f"{n:6d} points: reading {reading:.3f} s, reopened {whole:.3f} s\n")
            good = good and whole <= LONGEST_S.get(n, np.inf)
        if options.jobs > 1:
            good = compared(folder, base, options.jobs, options.processes) and good
    return 0 if good else 1


def compared(folder: Path, base: Sequence[MeasuredPoint], jobs: int, processes: int) -> bool:
    """Print the time to compare jobs; return whether a thousand would be done in time."""
    paths = [folder / f"part-{k}.ocmm" for k in range(jobs)]
    for k, path in enumerate(paths):
        write_job(path, base, len(base), k)
    times = {}
    for many in (1, processes):
        cpu, clock = time.process_time(), time.perf_counter()
        compare_files(paths, probes=folder, calibrations=folder, processes=many)
        times[many] = time.perf_counter() - clock
        if many == 1:
            own = (time.process_time() - cpu) / jobs
            sys.stdout.write(f"a job compared: {own:.3f} s of a processor\n")
    one, several = times[1], times[processes]
    sys.stdout.write(
        f"{jobs} jobs: in one process {one:.1f} s, in {processes} {several:.1f} s of the clock "
        f"(ratio {one / several:.2f}); a thousand: {several / jobs * 1000:.0f} s\n"
    )
    return several / jobs * 1000 <= THOUSAND_S


if __name__ == "__main__":
    sys.exit(main())
