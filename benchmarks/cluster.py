"""What Dask costs and gives: recall on 1, 2 and 4 workers, tasks of a second, a killed worker.

1. Recall of ``--jobs`` simulated jobs by a scheduler with 1, 2 and 4 workers: time, its share of
   that of one worker (wanted: 2 workers at most 0.6), and whether the pages are the same to the
   byte. Beside it the processor time that looking for the jobs, asking, the scheduler and the
   workers took for a job: what is not the workers' is the part that no worker shortens, and what
   can be compared on a computer that does other work.
2. The same with a worker that is killed when a third is done.
3. ``--tasks`` tasks that take one second each on 2 workers: what is added to the time that they
   take, in per cent (wanted: below 10). They wait instead of computing, so that this is the cost of
   Dask and not of a busy core.

Scheduler and workers are processes of this computer with TLS. Times are those of it, beside
whatever else it does: repeat them on a quiet one.
Run: ``python -m benchmarks.cluster [--jobs 1000] [--tasks 40]``.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from ocmm_core.blas import use_one_thread

use_one_thread()

import numpy as np  # noqa: E402 - the number of BLAS threads is set before numpy is loaded

from benchmarks.cluster_processes import ShopCluster, make_certificates, spent_s, wait_a_second  # noqa: E402
from benchmarks.recall_scenes import TruePart, World, base_points  # noqa: E402
from ocmm_core.calibration.records import seal  # noqa: E402
from ocmm_core.cluster import run_tasks  # noqa: E402
from ocmm_core.inspection.recall import KeptPlaces, recall  # noqa: E402

LARGEST_SHARE, LARGEST_OVERHEAD = 0.6, 0.1
_TURN, _SHIFT = np.array([2e-4, 1e-4, -2e-4]), np.array([0.1, 0.1, 0.1])


def main() -> int:
    """Print the table; return 1 if a limit is broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=1000)
    parser.add_argument("--tasks", type=int, default=40)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="ocmm-cluster-") as name:
        folder = Path(name)
        cluster = ShopCluster(folder, make_certificates(folder / "certificates"))
        try:
            cluster.start_scheduler()
            good = _recalls(folder, cluster, options.jobs)
            good &= _overhead(cluster, options.tasks)
        finally:
            cluster.close()
    return 0 if good else 1


def _recalls(folder: Path, cluster: ShopCluster, jobs: int) -> bool:
    world = World(base_points(folder), folder / "calibrations", seed=3)
    (folder / "jobs").mkdir()
    for at in range(jobs):
        if at == jobs // 2:
            world.push(_TURN, _SHIFT)
        world.measure(folder / "jobs" / f"{at:05d}.ocmm", TruePart())
    world.verify(passed=False)
    world.calibrate()
    places, now = KeptPlaces((folder / "jobs",), world.calibrations), datetime.now(UTC)

    def page(tell: Callable[[str, float], None] = lambda what, share: None) -> tuple[bytes, float]:
        looked: list[tuple[float, float]] = []

        def told(what: str, share: float) -> None:
            if what.startswith("Recalculated") and not looked:
                looked.append((time.monotonic(), time.process_time()))
            tell(what, share)

        whole = (None, cluster.scheduler, *cluster.workers)
        before, begun = [spent_s(one) for one in whole], time.monotonic()
        found = seal(recall(places, now, told, site=cluster.site))
        took = time.monotonic() - begun
        if whole[2:] == tuple(cluster.workers):
            asked, scheduler, *workers = (
                spent_s(one) - had for one, had in zip(whole, before, strict=True)
            )
            looking = looked[0][1] - before[0]
            parts = (looking, asked - looking, scheduler, sum(workers))
            words = ("looking", "asking", "scheduler", "workers")
            print(
                "  ms of processor time a job: "
                + ", ".join(
                    f"{word} {1e3 * part / jobs:.1f}"
                    for word, part in zip(words, parts, strict=True)
                )
                + f"; looking took {looked[0][0] - begun:.1f} s of {took:.1f} s"
            )
        return found, took

    _have(cluster, 1)
    list(run_tasks(wait_a_second, range(2), str, site=cluster.site))
    first, one_s = page()
    print(f"recall of {jobs} jobs on 1 worker: {one_s:.1f} s")
    good = True
    for workers in (2, 4):
        _have(cluster, workers)
        again, took = page()
        same = again == first
        good &= same and (workers != 2 or took <= LARGEST_SHARE * one_s)
        print(
            f"on {workers} workers: {took:.1f} s, {took / one_s:.2f} of that"
            f"{' (limit 0.60)' if workers == 2 else ''}; same page: {same}"
        )
    killed: list[bool] = []

    def kill_once(what: str, share: float) -> None:
        if share > 0.4 and not killed:
            killed.append(True)
            cluster.kill(cluster.workers[0])

    again, took = page(kill_once)
    print(f"a worker of 4 killed: {took:.1f} s; same page: {again == first}")
    return good and again == first


def _overhead(cluster: ShopCluster, tasks: int) -> bool:
    while len(cluster.workers) > 2:
        cluster.kill(cluster.workers[-1])
    _have(cluster, 2)
    list(run_tasks(wait_a_second, range(2), str, site=cluster.site))
    begun = time.monotonic()
    assert list(run_tasks(wait_a_second, range(tasks), str, site=cluster.site)) == list(
        range(tasks)
    )
    took, least = time.monotonic() - begun, -(-tasks // 2)
    over = took / least - 1.0
    print(
        f"{tasks} tasks of 1 s on 2 workers: {took:.2f} s, {100 * over:.1f} % more than {least} s"
    )
    return over < LARGEST_OVERHEAD


def _have(cluster: ShopCluster, workers: int) -> None:
    while len(cluster.workers) < workers:
        cluster.start_worker()
    cluster.wait_for(workers)


if __name__ == "__main__":
    sys.exit(main())
