"""Effect of noise on residuals, summed by shared terms, against the whole derivative."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float
from ocmm_core.measuring import MeasuredPoint, Rows, factors_of_matrix
from ocmm_core.tolerances.uncertainty import form_samples
from ocmm_core.tolerances.uncertainty._sampling import of_residuals
from tests.core.features.exact_touches import (
    flat_touches,
    moved,
    nominal,
    round_touches,
    shape_nominal,
    shape_touches,
    touches,
)
from tests.core.features.shape_samples import OUTLINES, somewhere

OTHERS = (*OUTLINES, Shape.CONE, Shape.TORUS)


def part_of(
    shape: Shape, rng: np.random.Generator
) -> tuple[list[NominalFeature], list[MeasuredPoint]]:
    """Return a face, and among its touches those of another feature; outlines are projected."""
    motion = somewhere(rng, far=100.0)
    flat = shape in (Shape.CIRCLE, *OUTLINES)
    side, projection = ("inner", "face") if flat else ("outer", "")
    if shape in OTHERS:
        own = shape_touches("it", shape, side, motion, first=10)
        said = shape_nominal("it", shape, side, projection)
    elif shape is Shape.LINE:
        surface = motion.apply(np.outer(np.linspace(-30.0, 30.0, 6), [1.0, 0.0, 0.0]))
        own = touches("it", surface, np.tile(motion.rotation[:, 1], (6, 1)), first=10)
        said = nominal("it", shape, 0.0, side, projection)
    else:
        own = round_touches("it", shape, 20.0, side, motion, n=9, first=10)
        said = nominal("it", shape, 20.0, side, projection)
    face = flat_touches("face", motion)
    points = [*face[:4], *own, *face[4:]]
    return [nominal("face", Shape.PLANE), said], moved(
        points, rng.normal(0.0, 1e-3, (len(points), 3))
    )


@pytest.mark.parametrize(
    "shape", [s for s in Shape if s not in (Shape.POINT, Shape.PLANE)], ids=lambda s: s.value
)
def test_the_sum_over_residuals_is_that_of_the_whole_matrix(shape: Shape) -> None:
    rng = np.random.default_rng()
    features, points = part_of(shape, rng)
    found = actual_features(features, points)
    half = rng.normal(0.0, 1e-3, (3 * len(points) + 1, 12))
    covariance = half @ half.T + 1e-6 * np.eye(len(half))
    factors = factors_of_matrix(covariance)
    for feature in found.values():
        assert isinstance(feature, ActualFeature), feature
        slopes = feature.by_residuals
        whole = slopes.rows.dense(len(points))
        noise, own = of_residuals(slopes, factors)
        # The same sums in another order.
        assert noise == pytest.approx(float(np.trace(whole @ covariance @ whole.T)), rel=1e-9)
        of_all = factors.of_deviations(slopes)
        assert of_all == pytest.approx(whole @ covariance @ whole.T, abs=1e-9 * noise)
        blocks = whole[:, :-1].reshape(len(whole), -1, 3)
        assert own == pytest.approx(blocks[np.arange(len(whole)), slopes.places], abs=1e-12)


def test_the_noise_of_a_line_is_that_of_both_directions_across_it() -> None:
    rng = np.random.default_rng()
    features, points = part_of(Shape.LINE, rng)
    found = actual_features(features, points)
    half = rng.normal(0.0, 1e-3, (3 * len(points) + 1, 12))
    covariance = half @ half.T + 1e-6 * np.eye(len(half))
    line = found["it"]
    assert isinstance(line, ActualFeature)
    assert line.touches is not None
    n, direction = len(line.touches.tips), line.fit.direction
    across = np.eye(3) - np.outer(direction, direction)
    along = (line.touches.tips - line.touches.tips.mean(axis=0)) @ direction
    kept = np.eye(n) - 1.0 / n - np.outer(along, along) / float(along @ along)
    by_points: Float = np.kron(kept, across).astype(np.float64)
    whole = Rows.of_points(line.touches.places, by_points).dense(len(points))
    noise = float(np.trace(whole @ covariance @ whole.T))
    (sample,) = (
        item for item in form_samples(found, factors_of_matrix(covariance)) if item.feature == "it"
    )
    squares = float(line.fit.residuals @ line.fit.residuals)
    assert squares - sample.degrees * sample.variance == pytest.approx(noise, rel=1e-8)
