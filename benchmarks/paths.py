"""How often value ± U (k = 2) holds the truth in whole jobs by continuous probing.

    python -m benchmarks.paths [--jobs N] [--seed FIRST] [--spacing MM]

The demonstration plan: planes, circles, ball and boss along paths of a virtual hand with stick-slip
and hops, line and corner by touches. By characteristic: the share inside U, the mean error in u and
its root mean square, and how many jobs state no U. Form is left out: noise can only enlarge it.
Ends with 1 if the 95 % interval of the share inside, over jobs, lies outside 94 to 97 %.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from ocmm_core.blas import use_one_thread

use_one_thread()

import msgspec  # noqa: E402 - the number of BLAS threads is set before numpy is loaded
import numpy as np  # noqa: E402 - as above

from benchmarks.coverage import over_jobs  # noqa: E402 - as above
from ocmm_core.composition import StationRequest, build_station  # noqa: E402 - as above
from ocmm_core.features.shapes import Shape  # noqa: E402 - as above
from ocmm_core.inspection.plan import load_plan, save_plan  # noqa: E402 - as above
from ocmm_core.options import DEMO_PLAN  # noqa: E402 - as above
from ocmm_core.tolerances.kinds import spec_of  # noqa: E402 - as above
from ocmm_sim.scene import load_part  # noqa: E402 - as above
from ocmm_sim.sources import true_values  # noqa: E402 - as above

PATHS = (Shape.PLANE, Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER)
POINTS = 40
LOWEST, HIGHEST = 0.94, 0.97


def job(seed: int, spacing: float) -> dict[str, float]:
    """Return error / U of each characteristic of one job; NaN without U."""
    with tempfile.TemporaryDirectory() as folder:
        plan = load_plan(DEMO_PLAN)
        features = [
            msgspec.structs.replace(one, spacing=spacing, points=POINTS)
            if one.shape in PATHS
            else one
            for one in plan.features
        ]
        plan = msgspec.structs.replace(plan, features=features)
        path = Path(folder) / "plan.toml"
        save_plan(plan, path)
        request = StationRequest(plan=path, out=Path(folder), seed=seed)
        station = build_station(request).station
        try:
            station.start()
            station.wait_finished(600.0)
            view = station.job.view()
        finally:
            station.close()
        truth = true_values(plan, load_part(request.part))
    found = {}
    for item in view.characteristics:
        if not spec_of(item.kind).form_alone:
            known = item.measured is not None and item.uncertainty is not None
            error = np.nan if item.measured is None else item.measured - truth[item.name]
            found[item.name] = error / (item.uncertainty or np.nan) if known else np.nan
    return found


def main() -> int:
    """Print the coverage of every characteristic."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--jobs", type=int, default=30)
    parser.add_argument("--seed", type=int, default=201, help="first seed")
    parser.add_argument("--spacing", type=float, default=1.0, help="mm")
    options = parser.parse_args()
    seeds = range(options.seed, options.seed + options.jobs)
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn")) as pool:
        jobs = list(pool.map(job, seeds, [options.spacing] * len(seeds)))
    print(
        f"{'characteristic':<22}{'N':>5}{'inside %':>10}{'mean e/u':>10}{'rms e/u':>9}{'no U':>6}"
    )
    for name in jobs[0]:
        ratio = np.array([one[name] for one in jobs])
        stated = ratio[np.isfinite(ratio)]
        inside = 100.0 * np.mean(np.abs(stated) <= 1.0)
        rms = 2.0 * np.sqrt(np.mean(stated**2))
        print(
            f"{name:<22}{len(stated):>5}{inside:>10.1f}{2.0 * stated.mean():>10.2f}{rms:>9.2f}"
            f"{len(ratio) - len(stated):>6}"
        )
    each = [[ratio for ratio in one.values() if np.isfinite(ratio)] for one in jobs]
    held = sum(abs(ratio) <= 1.0 for ratios in each for ratio in ratios)
    low, high = over_jobs(each)
    count = sum(map(len, each))
    print(f"{held} of {count} inside U: {100.0 * held / count:.1f} %, "
          f"{100.0 * low:.1f} to {100.0 * high:.1f} % (95 %, over jobs)")  # fmt: skip
    return int(low > HIGHEST or high < LOWEST)


if __name__ == "__main__":
    sys.exit(main())
