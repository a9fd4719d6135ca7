"""How often value ± U (k = 2) contains the truth over whole jobs, by characteristic and by type.

    python -m benchmarks.coverage [RUNS] [SCHEDULER] [--noise FACTOR ... [--seed FIRST]]

Without ``--noise``: the table of `ocmm study coverage`, on all cores or on the workers of a
scheduler. With it: RUNS jobs of the demonstration part for each factor, whose cameras have that
many times the stated sensor pattern, and the form characteristics of the plan; by type the share
inside U with its interval, the shares below and above, and the share of jobs that report the noise.
A true value at a limit is accepted if its error is below -U, and rejected if it is above U.

More white noise needs no check of the day: it is measured in the window of every touch.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

from ocmm_core.blas import use_one_thread

use_one_thread()

import msgspec  # noqa: E402 - the number of BLAS threads is set before numpy is loaded
import numpy as np  # noqa: E402 - as above

from ocmm_cli.study import (  # noqa: E402 - as above
    CoverageSetup,
    coverage_table,
    more_characteristics,
    run_coverage,
    touch_all,
)
from ocmm_core.camera import load_rig  # noqa: E402 - as above
from ocmm_core.cluster import Site  # noqa: E402 - as above
from ocmm_core.geometry import Float  # noqa: E402 - as above
from ocmm_core.inspection.evaluation import SessionOptions  # noqa: E402 - as above
from ocmm_core.inspection.plan import load_plan  # noqa: E402 - as above
from ocmm_core.inspection.session import InspectionSession  # noqa: E402 - as above
from ocmm_core.measuring import PointOptions, TouchCollector  # noqa: E402 - as above
from ocmm_core.storage import JobFile, make_head  # noqa: E402 - as above
from ocmm_core.tolerances.kinds import spec_of  # noqa: E402 - as above
from ocmm_core.tracking import TrackingPipeline, load_probe  # noqa: E402 - as above
from ocmm_sim.scene import VirtualRig, load_part  # noqa: E402 - as above
from ocmm_sim.sources import true_values  # noqa: E402 - as above

RATE_HZ = 500
Value = tuple[str, float, float]
"""Type, error and U, mm."""


def noisy_job(seed: int, factor: float) -> tuple[bool, list[Value]]:
    """Measure the demonstration part with a sensor pattern of ``factor`` times the stated one.

    Returns whether the job reports it, and its values.
    """
    setup = CoverageSetup()
    plan = load_plan(setup.plan)
    forms = [item for item in plan.characteristics if spec_of(item.kind).form_alone]
    plan = more_characteristics(plan)
    plan = msgspec.structs.replace(plan, characteristics=[*plan.characteristics, *forms])
    rig, body, part = load_rig(setup.rig), load_probe(setup.probe), load_part(setup.part)
    noise = msgspec.structs.replace(rig.noise, pattern_px=factor * rig.noise.pattern_px)
    touches = [(feature.name, feature.points) for feature in plan.features]
    virtual = VirtualRig(
        replace(rig, noise=noise), body, part, touches, seed, frame_rate_hz=RATE_HZ
    )
    head = make_head(
        plan=setup.plan, rig=setup.rig, probe=setup.probe, operator="", part="", serial=""
    )
    with (
        tempfile.TemporaryDirectory() as folder,
        JobFile.create(Path(folder) / "job.ocmm", head) as job,
    ):
        session = InspectionSession(plan, rig, body, job, SessionOptions())
        collector = TouchCollector(virtual.frame_period_ns * 1e-9, PointOptions())
        touch_all(virtual, touches, session, TrackingPipeline(rig, body), collector)
        view = session.view
    truth = true_values(plan, part)
    values = [
        (item.kind, item.measured - truth[item.name], item.uncertainty)
        for item in view.characteristics
        if item.measured is not None and item.uncertainty is not None
    ]
    return bool(view.noise), values


def over_jobs(jobs: list[list[float]], draws: int = 10_000) -> Float:
    """Return the 95 % interval (2,) of the share of |error / U| up to 1, by bootstrap over jobs.

    ``jobs``: error / U of each job. Values of a job share its cameras and probe and err together.
    """
    inside = np.array([sum(abs(ratio) <= 1.0 for ratio in ratios) for ratios in jobs])
    count = np.array([len(ratios) for ratios in jobs])
    drawn = np.random.default_rng(0).integers(len(jobs), size=(draws, len(jobs)))
    share = inside[drawn].sum(axis=1) / np.maximum(count[drawn].sum(axis=1), 1)
    interval: Float = np.percentile(share, [2.5, 97.5])
    return interval


def by_noise(seeds: range, factors: list[float]) -> None:
    """Print coverage by type for each factor."""
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        for factor in factors:
            jobs = list(pool.map(noisy_job, seeds, [factor] * len(seeds), chunksize=4))
            told = np.mean([noisy for noisy, _ in jobs])
            told_of = f"{100 * told:.1f} % of {len(seeds)} told"
            print(f"sensor pattern {factor:g} times as stated: {told_of}")
            kinds = sorted({kind for _, values in jobs for kind, _, _ in values})
            print(f"  {'type':<16}{'N':>6}{'inside %':>10}{'below %':>9}{'above %':>9}{'u/rms':>7}")
            for kind in ("all", *kinds):
                each = [[e / u for k, e, u in values if kind in (k, "all")] for _, values in jobs]
                ratio = np.concatenate(each)
                inside, below = 100 * np.mean(np.abs(ratio) <= 1), 100 * np.mean(ratio < -1)
                low, high = 100 * over_jobs(each)
                print(
                    f"  {kind:<16}{len(ratio):>6}{inside:>10.1f}{below:>9.1f}"
                    f"{100 * np.mean(ratio > 1):>9.1f}{0.5 / np.sqrt(np.mean(ratio**2)):>7.2f}"
                    f"  inside {low:.1f} to {high:.1f} % (95 %, over jobs)"
                )


def main() -> None:
    """Print the coverage of every characteristic."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", type=int, nargs="?", default=200)
    parser.add_argument("scheduler", nargs="?", default="")
    parser.add_argument("--noise", type=float, nargs="+", default=[])
    parser.add_argument("--seed", type=int, default=0, help="first seed, with --noise")
    options = parser.parse_args()
    if options.noise:
        by_noise(range(options.seed, options.seed + options.runs), options.noise)
        return
    site = Site(options.scheduler) if options.scheduler else Site(workers=os.cpu_count())
    rows = coverage_table(run_coverage(CoverageSetup(), range(options.runs), site))
    print(f"{options.runs} runs; wanted: 92 to 99 %")
    print(f"{'characteristic':<24}{'covered %':>10}{'mean U um':>11}{'RMS error um':>14} without U")
    for name, covered, stated, error, without in rows:
        numbers = f"{100 * covered:>10.1f}{1e3 * stated:>11.2f}{1e3 * error:>14.2f}"
        print(f"{name:<24}{numbers}{without:>10}")


if __name__ == "__main__":
    main()
