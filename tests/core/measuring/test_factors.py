"""The factors of the joint uncertainty against the dense matrix."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.calibration.probe_design import MaterialExpansion, Temperature
from ocmm_core.camera import Rig, project
from ocmm_core.geometry import Float, rotation_from_vector
from ocmm_core.measuring import (
    MeasuredPoint,
    PartTemperature,
    PointFactors,
    Rows,
    factors_of_matrix,
    joint_factors,
)
from ocmm_core.measuring._pattern_field import LARGEST_ERROR, PatternField
from ocmm_core.measuring._temperature import scale_movement
from ocmm_core.tracking import ProbeBody, TipSensitivity, tip_sensitivity
from tests.core.measuring.test_temperature import point

WARM = PartTemperature(
    Temperature(25.0, 0.5, "test"), MaterialExpansion("steel", 11.5e-6, 1e-6), compensated=True
)
COUNT = 60


def touched(rig: Rig, body: ProbeBody) -> tuple[list[MeasuredPoint], list[TipSensitivity]]:
    """Return points in a small volume, so that many share the pattern; some miss an LED."""
    rng = np.random.default_rng()
    points, found = [], []
    for number in range(1, COUNT + 1):
        tip = rng.uniform(-8.0, 8.0, 3) + np.array([20.0, 0.0, 10.0])
        rotation = rotation_from_vector(rng.normal(0.0, 0.05, 3))
        leds = (body.leds_probe - body.tip_probe) @ rotation.T + tip
        spots = np.stack([project(camera, leds) for camera in rig.cameras])
        if number % 5 == 0:
            spots[number % 2, number % 6] = np.nan
        noise = rng.normal(0.0, 0.003, (3, 3))
        touch = replace(
            point(tip, np.array([0.0, 0.0, 1.0])),
            number=number, spots=spots, random_covariance=noise @ noise.T,
        )  # fmt: skip
        points.append(touch)
        found.append(tip_sensitivity(spots, rig, body))
    return points, found


def dense(
    points: Sequence[MeasuredPoint], found: Sequence[TipSensitivity], rig: Rig, body: ProbeBody
) -> Float:
    """Return the whole matrix (3 N + 1, 3 N + 1), every pair of spots by the formula itself."""
    n = len(points)
    matrix = np.zeros((3 * n + 1, 3 * n + 1))
    moved = scale_movement(points)
    matrix += WARM.scale_sigma**2 * np.outer(moved, moved)
    matrix[-1, -1] += body.tip_radius_sigma**2
    noise = rig.noise
    for i, one in enumerate(found):
        matrix[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] += points[i].random_covariance
        for j, other in enumerate(found):
            apart = np.sum((one.uv[:, None] - other.uv[None]) ** 2, axis=2)
            field = noise.pattern_px**2 * np.exp(-0.5 * apart / noise.pattern_length_px**2)
            field *= one.camera[:, None] == other.camera[None]
            block = np.einsum("ima,mn,jna->ij", one.by_spots, field, other.by_spots)
            block += one.by_cameras @ rig.parameter_covariance @ other.by_cameras.T
            block += one.by_geometry @ body.geometry_covariance @ other.by_geometry.T
            matrix[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] += block
    return matrix


def test_values_are_as_uncertain_as_the_whole_matrix_says(
    recommended: Rig, standard_probe: ProbeBody
) -> None:
    points, found = touched(recommended, standard_probe)
    factors = joint_factors(points, found, recommended, standard_probe, None, WARM)
    whole = dense(points, found, recommended, standard_probe)
    rng = np.random.default_rng()
    few = rng.normal(size=(20, 3 * COUNT + 1))
    few[:10, 3 * 7 : -1] = 0.0
    differences = np.zeros((COUNT - 1, 3 * COUNT + 1))
    differences[np.arange(COUNT - 1), 3 * np.arange(1, COUNT)] = 1.0
    differences[:, 0] = -1.0
    for gradients in (few, differences):
        expected = gradients @ whole @ gradients.T
        u = np.sqrt(np.diagonal(expected))
        # The correlation of spots is good to 5e-4, and they are a part of u.
        assert np.sqrt(np.diagonal(factors.covariance_of(gradients))) == pytest.approx(u, rel=1e-3)
        assert np.abs((factors.covariance_of(gradients) - expected) / np.outer(u, u)).max() < 2e-3
    chosen = few[0]
    moved = np.where(chosen != 0.0, whole @ chosen, 0.0)
    found_moved = factors.moved(Rows.of_dense(chosen[None])).dense(COUNT)[0]
    assert np.abs(found_moved - moved).max() < 2e-3 * np.abs(moved).max()


def test_the_correlation_of_two_spots_is_the_gaussian_of_their_distance() -> None:
    rng = np.random.default_rng()
    # In pitches of the grid, which is 1 / sqrt(2) of the length of correlation.
    place = rng.uniform(-3.0, 9.0, (300, 1, 2))
    place[:2] = [[[2.0, 2.0]], [[5.0, 5.0]]]
    gain = np.zeros((300, 1, 2, 3))
    gain[:, 0, 0, 0] = 1.0
    field = PatternField.of(np.zeros((300, 1), dtype=np.int64), place, gain)
    gradients = np.zeros((300, 300, 3))
    gradients[np.arange(300), np.arange(300), 0] = 1.0
    answers = field.answers(Rows(np.arange(300), gradients, np.zeros(300)))
    apart = np.sum((place - place[:, 0]) ** 2, axis=2)
    assert np.abs(answers @ answers.T - np.exp(-0.25 * apart)).max() < LARGEST_ERROR
    # A single spot is exact, except for rounding.
    assert np.sum(answers**2, axis=1) == pytest.approx(1.0, abs=1e-12)


def test_some_of_the_points_are_those_points(recommended: Rig, standard_probe: ProbeBody) -> None:
    points, found = touched(recommended, standard_probe)
    factors = joint_factors(points, found, recommended, standard_probe, None, WARM)
    places = [31, 2, 14]
    columns = [3 * place + k for place in places for k in range(3)] + [3 * COUNT]
    rows = np.eye(3 * COUNT + 1)[columns]
    # The same sums in another order.
    assert factors.kept(places).covariance_of(np.eye(10)) == pytest.approx(
        factors.covariance_of(rows), rel=1e-9, abs=1e-15
    )


@pytest.mark.parametrize("together", [True, False], ids=["few points", "many points"])
def test_draws_scatter_as_the_values_do(
    recommended: Rig, standard_probe: ProbeBody, monkeypatch: pytest.MonkeyPatch, together: bool
) -> None:
    monkeypatch.setattr("ocmm_core.measuring._factors._DRAWN_TOGETHER", 10_000 if together else 0)
    points, found = touched(recommended, standard_probe)
    factors = joint_factors(points, found, recommended, standard_probe, None, WARM)
    gradients = np.random.default_rng().normal(size=(4, 3 * COUNT + 1))
    gradients[0] = 0.0
    gradients[0, 0], gradients[0, 3] = 1.0, -1.0
    values = factors.draws()(np.random.default_rng(), 4000) @ gradients.T
    # Of 4000 draws the standard deviation has a standard error of 1.1 %; six of them.
    assert values.std(axis=0) == pytest.approx(
        np.sqrt(np.diagonal(factors.covariance_of(gradients))), rel=0.067
    )


def test_a_matrix_is_its_factors_and_what_is_none_is_not_a_number() -> None:
    rng = np.random.default_rng()
    half = rng.normal(size=(7, 4)) * np.array([1.0, 1e-6, 1.0, 1e3, 1.0, 1.0, 1e-4])[:, None]
    matrix = half @ half.T
    found: PointFactors = factors_of_matrix(matrix)
    scale = np.sqrt(np.diagonal(matrix))
    assert np.abs((found.covariance_of(np.eye(7)) - matrix) / np.outer(scale, scale)).max() < 1e-12
    assert found.count == 2
    assert np.isnan(factors_of_matrix(-np.eye(7)).covariance_of(np.eye(7))).all()
