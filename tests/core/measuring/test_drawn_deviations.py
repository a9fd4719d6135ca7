"""Errors of many deviations: their draws, and their cost."""

from __future__ import annotations

import tracemalloc
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pytest

from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import Shape
from ocmm_core.measuring import DeviationRows, PointFactors
from ocmm_core.measuring._pattern_field import PatternField
from ocmm_core.tolerances.decisions import Verdict, evaluate_all
from ocmm_core.tolerances.zones import Characteristic
from tests.core.features.exact_touches import nominal, touches, zigzag

NOISE_MM = 0.001


@dataclass(frozen=True)
class Job:
    """A face and the uncertainty of its points."""

    actual: Mapping[str, ActualFeature | FitError]
    factors: PointFactors

    @property
    def face(self) -> ActualFeature:
        found = self.actual["face"]
        assert isinstance(found, ActualFeature)
        return found


def path_on_a_face(count: int, seed: int) -> Job:
    """Return a face along a zigzag, with noise and a sensor pattern that neighbours share."""
    rng = np.random.default_rng(seed)
    places = zigzag(count)
    normal = np.array([0.0, 0.0, 1.0])
    camera = np.zeros((count, 2), dtype=np.int64)
    camera[:, 1] = 1
    gain = np.zeros((count, 2, 2, 3))
    gain[:, 0, 0, 2] = gain[:, 1, 1, 2] = gain[:, 1, 0, 0] = NOISE_MM
    pattern = PatternField.of(camera, np.repeat(places[:, None, :2], 2, axis=1), gain)
    shared = 0.5 * NOISE_MM * rng.standard_normal((3 * count + 1, 4))
    factors = PointFactors(shared, np.tile(NOISE_MM**2 * np.eye(3), (count, 1, 1)), pattern)
    errors = factors.draws()(rng, 1)[0, :-1].reshape(count, 3)
    own = touches("face", places + errors * normal, np.tile(normal, (count, 1)))
    points = [replace(one, approach="path") for one in own]
    return Job(actual_features([nominal("face", Shape.PLANE, 0.0, "outer")], points), factors)


def test_variances_of_own_parts_are_those_of_their_covariance() -> None:
    job = path_on_a_face(60, seed=4)
    rows = job.face.by_residuals
    alone = DeviationRows.of_own(rows.places, rows.own, rows.by_radius)
    # Each camera has one spot of a point: its variance is exact, only the order of sums differs.
    expected = np.diagonal(job.factors.of_deviations(alone))
    assert job.factors.of_own(rows) == pytest.approx(expected, rel=1e-12)


def test_drawn_errors_have_the_covariance_of_the_deviations() -> None:
    job = path_on_a_face(600, seed=3)
    rows, draws = job.face.by_residuals, 4000
    whole = job.factors.of_deviations(rows)
    drawn = job.factors.drawn_deviations(rows, np.random.default_rng(1), draws)
    found = drawn.T @ drawn / draws
    sigma = np.sqrt(np.diagonal(whole))
    off = (found - whole) / np.outer(sigma, sigma)
    # 3 of 600 numbers of an element, and five standard errors of a variance.
    assert np.abs(np.diagonal(off)).max() < 0.03 + 5.0 * np.sqrt(2.0 / draws)
    # Beside the ends of blocks only the pattern of neighbours is missing.
    assert np.sqrt(np.mean(off**2)) < 0.03
    middle = np.diagonal(off, 1)[np.arange(599) % 64 < 63]
    assert np.abs(middle).max() < 0.03 + 5.0 / np.sqrt(draws)


def test_the_form_of_thousands_of_points_needs_no_squared_matrices() -> None:
    job = path_on_a_face(4000, seed=4)
    wanted = Characteristic(
        name="flat", kind="flatness", features=["face"], nominal=0.0, lower=0.0, upper=0.05
    )
    tracemalloc.start()
    (result,) = evaluate_all([wanted], None, job.actual, job.factors, "iso14253-1")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert result.floor is not None
    assert result.uncertainty is not None
    # A perfect part, whose deviations are drawn in another way.
    assert result.measured == pytest.approx(result.floor, rel=0.3)
    assert result.verdict is Verdict.CONFORM
    # One number for each two deviations would be 128 MB.
    assert peak < 100e6, peak
