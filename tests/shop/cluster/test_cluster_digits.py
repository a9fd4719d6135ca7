"""Recall, comparison, Monte Carlo and studies give the same on the workers of a scheduler."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from benchmarks.cluster_processes import ShopCluster
from benchmarks.recall_scenes import TruePart, World, base_points
from ocmm_cli.study import CoverageSetup, run_coverage
from ocmm_core.calibration.records import seal
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import job_uncertainty
from ocmm_core.inspection.finished import compare_files, reopen_job
from ocmm_core.inspection.recall import KeptPlaces, recall
from ocmm_core.tolerances.monte_carlo import MonteCarloOptions, simulate
from ocmm_sim.scene import ProbeStudy, run_study
from tests.core.inspection.test_recall import SHIFT, TURN


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> tuple[World, Path]:
    folder = tmp_path_factory.mktemp("world")
    jobs = folder / "jobs"
    jobs.mkdir()
    found = World(base_points(folder), folder / "calibrations", seed=3)
    for at in range(6):
        if at == 3:
            found.push(TURN, SHIFT)
        found.measure(jobs / f"{at}.ocmm", TruePart())
    found.verify(passed=False)
    found.calibrate()
    return found, jobs


def test_recall_and_comparison_are_the_same_to_the_byte(
    cluster: ShopCluster, world: tuple[World, Path]
) -> None:
    found, jobs = world
    now = datetime.now(UTC)
    places = KeptPlaces((jobs,), found.calibrations)
    here = recall(places, now, processes=1)
    assert len(here.jobs) == 6
    assert seal(recall(places, now, site=cluster.site)) == seal(here)
    files = sorted(jobs.glob("*.ocmm"))
    alone = compare_files(files, calibrations=found.calibrations)
    there = compare_files(files, calibrations=found.calibrations, site=cluster.site)
    # A cluster does not read files on this computer.
    assert repr(there) == repr(replace(alone, files=()))


def test_monte_carlo_has_the_same_digits(
    cluster: ShopCluster, world: tuple[World, Path], repeats: Callable[..., int]
) -> None:
    trials, slow = repeats(10_000, 300_000), repeats(8, 400)
    job = reopen_job(world[1] / "0.ocmm", calibrations=world[0].calibrations)
    (task,) = job_uncertainty(
        job.plan, job.points, job.sensitivities, job.rig, job.body, job.options
    ).tasks
    for adaptive in (True, False):
        options = MonteCarloOptions(
            max_trials=trials, max_slow_trials=slow, slow_batch=slow // 4, adaptive=adaptive
        )  # fmt: skip
        here = simulate(task, options)
        there = simulate(task, options, site=cluster.site)
        assert there.values == here.values
        assert there.failed == here.failed


def test_the_thesis_study_has_the_same_digits(
    cluster: ShopCluster, repeats: Callable[..., int]
) -> None:
    from ocmm_core.tracking import load_probe

    body = load_probe(resource("probes", "thesis.toml"))
    study = ProbeStudy(
        body.leds_probe - body.tip_probe, np.radians([45.0, 45.0, 10.0]),
        1e-3 * np.array([4.6, 22.7, 4.6]), 300,
    )  # fmt: skip
    runs = repeats(5, 100)
    here = run_study(study, runs, seed=1, processes=1)
    there = replace(run_study(study, runs, seed=1, site=cluster.site), cpu_s=here.cpu_s)
    assert all(
        np.array_equal(getattr(there, name), getattr(here, name))
        for name in ("centre_errors", "tip_errors", "led_errors")
    )


@pytest.mark.slow
def test_coverage_has_the_same_digits(cluster: ShopCluster) -> None:
    setup = CoverageSetup(plan=resource("plans", "quick.toml"))
    here = run_coverage(setup, range(2))
    assert run_coverage(setup, range(2), cluster.site) == here
