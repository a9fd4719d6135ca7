from __future__ import annotations

import csv
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ocmm_cli.terminal import histogram
from ocmm_core.calibration.pivot import moments_of
from ocmm_sim.scene import ProbeStudy, draw_targets, run_study
from tests.commands import Ocmm
from tests.core.calibration.swept_probe import probe, rig

THESIS = ProbeStudy(
    leds=probe().leds_probe - probe().tip_probe,
    ranges=np.radians([45.0, 45.0, 10.0]),
    sigma=np.array([4.6e-3, 22.7e-3, 4.6e-3]),
    poses=10_000,
    with_leds=False,
)


def _rms_um(errors: Any) -> float:
    return 1e3 * float(np.sqrt(np.mean(np.sum(np.square(errors), axis=1))))


def test_error_of_the_thesis(record_property: Any) -> None:
    result = run_study(THESIS, 600, seed=1, processes=1)

    rms = _rms_um(result.centre_errors)
    record_property("RMS, mean, largest, um", [
        round(v, 3) for v in (rms, 1e3 * result.distances.mean(), 1e3 * result.distances.max())
    ])  # fmt: skip
    # Most of the error is along Z: 600 runs know its size to 3 %.
    assert rms == pytest.approx(0.526, abs=0.05)
    assert 1e3 * result.distances.max() < 2.0
    # No bias: the mean of 600 runs scatters by 0.02 um.
    assert np.abs(1e3 * result.centre_errors.mean(axis=0)).max() < 0.08


def test_leds_average_to_a_third_of_a_micrometre() -> None:
    result = run_study(replace(THESIS, with_leds=True), 20, seed=2, processes=1)

    # 0.37 um; a single run is anything from 0.1 to 0.9.
    assert 1e3 * result.led_errors.mean() == pytest.approx(0.37, abs=0.12)
    assert _rms_um(result.tip_errors) < 1.2


def test_other_estimators_are_better_at_small_angles() -> None:
    small = replace(
        THESIS, ranges=np.radians([20.0, 20.0, 10.0]), poses=1000, with_leds=True, rig=rig()
    )
    errors = [
        _rms_um(run_study(replace(small, estimator=name), 15, seed=3, processes=1).tip_errors)
        for name in ("thesis", "common", "bundle")
    ]

    thesis, common, bundle = errors
    assert common < 0.8 * thesis
    assert bundle < 0.5 * thesis


def test_moments_are_those_of_the_targets() -> None:
    study = replace(THESIS, with_leds=True, poses=2500)
    moments, targets = draw_targets(study, np.random.default_rng(4))

    again = moments_of(targets, study.leds)

    # Single precision inside; its loss in sums of thousands of poses.
    assert np.allclose(moments, again, rtol=1e-5, atol=1e-5 * np.abs(again).max())
    distances = np.linalg.norm(targets, axis=2) - np.linalg.norm(study.leds, axis=1)
    assert distances.std() < 0.03


@pytest.mark.slow
def test_result_does_not_depend_on_the_number_of_processes() -> None:
    study = replace(THESIS, poses=500)
    counts: list[int] = []

    alone = run_study(study, 50, seed=5, processes=1)
    shared = run_study(study, 50, seed=5, processes=2, progress=counts.append)

    assert np.array_equal(alone.centre_errors, shared.centre_errors)
    assert counts[-1] == 50
    assert counts == sorted(counts)
    assert not np.array_equal(
        alone.centre_errors, run_study(study, 50, seed=6, processes=1).centre_errors
    )


def test_command_writes_figures_and_numbers(tmp_path: Path, ocmm_here: Ocmm) -> None:
    words = ("--runs", "12", "--poses", "300", "--processes", "1", "--out", tmp_path)
    done = ocmm_here("study", "probe-calibration", *words)

    assert "12 calibrations of 300 poses" in " ".join(done.stdout.split())
    with (tmp_path / "errors.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 12
    bars = 0
    for number in (13, 14, 15):
        tree = ET.parse(tmp_path / f"figure_{number}.svg")  # noqa: S314 - written above
        bars += len(tree.findall(".//{http://www.w3.org/2000/svg}rect")) - 1
    assert bars > 5


def test_command_refuses_ranges_that_are_none(tmp_path: Path, ocmm_here: Ocmm) -> None:
    words = ("--runs", "1", "--poses", "100", "--range", "0", "0", "0", "--out", tmp_path)
    done = ocmm_here("study", "probe-calibration", *words)

    assert done.returncode == 2
    assert "range" in done.stderr.casefold()


def test_histogram_shows_every_value() -> None:
    values = np.array([0.1, 0.11, 0.5, 1.26])

    text = histogram(values, "a < b", "", "x", bins=30)

    tree = ET.fromstring(text)  # noqa: S314 - written above
    bars = [float(bar.get("height", 0)) for bar in tree.iter("{http://www.w3.org/2000/svg}rect")][
        1:
    ]
    unit = min(bars)
    assert sum(round(bar / unit) for bar in bars) == len(values)
