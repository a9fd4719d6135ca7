"""Points along a path share their form: as many count as are independent, by Monte Carlo."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import Shape
from ocmm_core.measuring import factors_of_matrix
from ocmm_core.tolerances.uncertainty import form_samples, widened
from tests.core.features.exact_touches import nominal, touches, zigzag
from tests.host import amount, looser

LONG = 200
RUNS = amount(20, LONG)
_ALONE_IN = 3
"""One run in three is also computed as independent points: all agree within a few percent."""
FORM_MM, NOISE_MM = 0.005, 0.001


@pytest.mark.parametrize("length", [0.5, 6.0, 15.0])
def test_the_effective_number_is_that_of_monte_carlo(length: float) -> None:
    """Form of a correlation ``exp(-d / length)``; U holds, N = 20 (200)."""
    rng = np.random.default_rng(11)
    places = zigzag(400)
    away = np.linalg.norm(places[:, None] - places[None], axis=2)
    root = np.linalg.cholesky(np.exp(-away / length) + 1e-9 * np.eye(len(places)))
    normal = np.array([0.0, 0.0, 1.0])
    tiny = factors_of_matrix(1e-14 * np.eye(3 * len(places) + 1))
    heights, stated, held, alone = [], [], 0, []
    for number in range(RUNS):
        form = FORM_MM * root @ rng.standard_normal(len(places))
        form += NOISE_MM * rng.standard_normal(len(places))
        own = touches("face", places + form[:, None] * normal, np.tile(normal, (len(places), 1)))
        for approach in ("path", "trail")[: 2 if number % _ALONE_IN == 0 else 1]:
            points = [replace(one, approach=approach) for one in own]
            found = actual_features([nominal("face", Shape.PLANE, 0.0, "outer")], points)
            face = found["face"]
            assert isinstance(face, ActualFeature)
            gradient = face.jacobian[2:3]
            (sample,) = form_samples(found, tiny)
            plain = float(np.sum(sample.jacobian(gradient) ** 2)) * sample.variance
            if approach == "trail":
                alone.append(plain)
                continue
            # Height of the foot of the centroid, whose true form is zero on average.
            height = float((face.fit.point - places.mean(axis=0)) @ normal)
            heights.append(height)
            stated.append(plain)
            # With Student's factor for as few as count.
            wide = float(widened(gradient, tiny, [sample]).covariance[0, 0])
            held += abs(height) <= 2.0 * wide**0.5
    true = float(np.mean(np.square(heights)))
    # The lengths are estimated from one path each: stated variances vary, and not to the low side.
    ratio = float(np.median(stated)) / true
    assert 1.0 - looser(0.2, RUNS, LONG) < ratio < 1.0 + looser(0.9, RUNS, LONG)
    assert held / RUNS > 0.92
    # As independent points they would promise too much.
    if length > 1.0:
        assert float(np.mean(alone)) < 0.2 * true
