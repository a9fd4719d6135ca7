"""Trends over calibrations: values, their uncertainty, and who they belong to."""

from __future__ import annotations

from datetime import timedelta

import msgspec
import numpy as np
import pytest

from ocmm_core.calibration.records import rig_from_record
from ocmm_core.calibration.records._overview import trends
from ocmm_core.camera import N_PARAMETERS
from tests.core.calibration.made_records import MADE, RIG, make_record, make_verification


def test_lenses_and_baselines_come_with_their_uncertainty() -> None:
    found = trends([make_record()], [])
    assert [course.name for course in found.focal] == ["left", "right"]
    sigmas = np.sqrt(np.diag(RIG.parameter_covariance)).reshape(-1, N_PARAMETERS)
    assert found.focal[1].samples[0].value == RIG.cameras[1].focal
    assert found.focal[1].samples[0].sigma == pytest.approx(sigmas[1, 6])
    assert found.principal_v[0].samples[0].sigma == pytest.approx(sigmas[0, 9])
    (baseline,) = found.baseline
    assert baseline.name == "left – right"
    assert baseline.samples[0].value == pytest.approx(600.0)
    # Against 4,000 draws of both cameras: 1.1 % standard deviation of a sigma, five of them.
    rng = np.random.default_rng(4)
    draws = rng.multivariate_normal(
        np.zeros(2 * N_PARAMETERS), RIG.parameter_covariance, 4000, method="eigh"
    )
    lengths = [
        np.linalg.norm(
            RIG.cameras[1].perturbed(draw[N_PARAMETERS:]).centre_world
            - RIG.cameras[0].perturbed(draw[:N_PARAMETERS]).centre_world
        )
        for draw in draws
    ]
    assert baseline.samples[0].sigma == pytest.approx(float(np.std(lengths)), rel=0.056)


def test_a_replaced_camera_begins_a_course_of_its_own() -> None:
    first, second = make_record().cameras
    spare = msgspec.structs.replace(second, serial=99, focal=24.9)
    later = (MADE + timedelta(days=200)).isoformat()
    records = [make_record(), make_record(cameras=(first, spare), made_utc=later)]
    found = trends(records, [])
    assert [(course.name, len(course.samples)) for course in found.focal] == [
        ("left", 2), (f"right {second.serial}", 1), ("right 99", 1),
    ]  # fmt: skip
    assert found.focal[0].samples[1].when - found.focal[0].samples[0].when == timedelta(days=200)
    assert len(found.baseline) == 2
    assert rig_from_record(records[1]).cameras[1].focal == found.focal[2].samples[0].value


def test_of_a_verification_the_error_nearest_to_its_limit_counts() -> None:
    verification = make_verification(make_record())
    far, near = (
        verification.checks[0],
        msgspec.structs.replace(
            verification.checks[0], name="sphere", measured_mm=399.998, limit_mm=0.003
        ),
    )
    found = trends([], [msgspec.structs.replace(verification, checks=(far, near))])
    (sample,) = found.error.samples
    assert sample.value == pytest.approx(-2.0 / 3.0)
    assert sample.sigma == pytest.approx(1.0 / 3.0)
    assert trends([], []).focal == ()
