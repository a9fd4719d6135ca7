"""Flags of points that do not belong to their feature: false alarms, and detections."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import outliers, places_of
from tests.core.inspection.test_guidance import BALL, point_at

NOISE_MM = 0.05
RUNS = 200


def measured(nominal: NominalFeature, shifts: Float) -> ActualFeature:
    """Return a feature whose points lie off the nominal surface by ``shifts``, mm."""
    places = places_of(nominal, nominal.points)
    tips = places.points + (BALL + shifts)[:, None] * places.normals
    points = [
        replace(point_at(tip, number, nominal.name), direction=normal)
        for number, (tip, normal) in enumerate(zip(tips, places.normals, strict=True), start=1)
    ]
    actual = actual_features([nominal], points)[nominal.name]
    assert isinstance(actual, ActualFeature)
    return actual


@pytest.mark.statistics
@pytest.mark.parametrize(
    ("shape", "points", "diameter"), [(Shape.CIRCLE, 8, 30.0), (Shape.PLANE, 9, 0.0)]
)
def test_a_good_feature_is_flagged_in_one_of_a_hundred_cases(
    shape: Shape, points: int, diameter: float, record_property: Callable[[str, object], None]
) -> None:
    nominal = NominalFeature(
        name="F", shape=shape, points=points, point=(0.0, 0.0, 0.0), diameter=diameter,
        length=60.0, width=40.0 if shape is Shape.PLANE else 0.0,
    )  # fmt: skip
    rng = np.random.default_rng(5)
    false = found = 0
    for _ in range(RUNS):
        shifts = NOISE_MM * rng.standard_normal(points)
        false += bool(outliers(measured(nominal, shifts)))
        shifts[2] += 1.0
        found += outliers(measured(nominal, shifts)) == (3,)
    record_property("flagged wrongly", f"{shape.value}: {false} of {RUNS}, found {found}")
    # 1 % is designed: more than 8 of 200 come by chance once in 4,000 runs.
    assert false <= 8
    # Twenty times the noise; with few points it also spoils the scatter of the others.
    assert found >= 0.85 * RUNS


def test_too_few_points_flag_nothing() -> None:
    face = NominalFeature(
        name="F", shape=Shape.PLANE, points=4, point=(0.0, 0.0, 0.0), length=60.0, width=40.0
    )
    assert outliers(measured(face, np.array([0.0, 0.0, 0.0, 3.0]))) == ()
