"""Axes of low bands and normals of nearly collinear points give no uncertainty, or a valid one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.errors import FitError
from ocmm_core.features.shapes import Shape
from ocmm_core.measuring import factors_of_matrix
from ocmm_core.tolerances.kinds import evaluate
from ocmm_core.tolerances.uncertainty import Spreads, form_samples, spreads_of
from tests.core.tolerances.known_part import KnownPart, asked, face, motion, ring

NOISE_MM = 0.005
KINDS = (
    ("total runout", "SHAFT"),
    ("circular runout", "RING"),
    ("coaxiality", "SHAFT"),
    ("parallelism", "SHAFT"),
    ("perpendicularity", "FACE"),
    ("angularity", "FACE"),
    ("total runout", "SAME"),
)


def _spreads(height: float, kind: str, feature: str, seed: int) -> Spreads | None:
    """Return the spreads of a value about a cylinder of 40 mm, probed at two heights."""
    part = KnownPart()
    for name, z, radius, low in (("DATUM", 0.0, 20.0, height), ("SHAFT", 30.0, 15.0, 16.0),
                                 ("SAME", 0.0, 20.0, height / 2.0)):  # fmt: skip
        probed = ring(motion(0, 0, z), radius, (-low / 2.0, low / 2.0))
        size = {"diameter": 2.0 * radius, "direction": (0, 0, 1), "point": (0, 0, z)}
        part.add(name, Shape.CYLINDER, probed, side="outer", **size)
    part.add("RING", Shape.CIRCLE, ring(motion(0, 0, 34), 12.0), side="outer", diameter=24.0,
             direction=(0, 0, 1), point=(0, 0, 34))  # fmt: skip
    part.add("FACE", Shape.PLANE, face(motion(0, 0, 40)), direction=(0, 0, 1), point=(0, 0, 40))
    rng = np.random.default_rng(seed)
    points = [
        replace(point, tip_world=point.tip_world + NOISE_MM * rng.standard_normal(3))
        for point in part.points
    ]
    covariance = NOISE_MM**2 * np.eye(3 * len(points) + 1)
    covariance[-1, -1] = 0.0
    factors = factors_of_matrix(covariance)
    try:
        actual = part.actual(points)
    except FitError:
        return None
    item = asked(kind, feature, "DATUM", **({"nominal": 90.0} if kind == "angularity" else {}))
    own = {name: actual[name] for name in (feature, "DATUM")}
    samples = [one for one in form_samples(actual, factors) if one.feature in own]
    return spreads_of(item, evaluate(item, actual, None), own, factors, samples)


@pytest.mark.parametrize(("kind", "feature"), KINDS)
def test_axis_of_a_low_band_gives_no_uncertainty(kind: str, feature: str) -> None:
    found = [_spreads(0.2, kind, feature, seed) for seed in range(4)]

    assert all(one is None or np.isinf(one.growth) for one in found)


@pytest.mark.parametrize(("kind", "feature"), KINDS)
def test_axis_of_a_high_cylinder_gives_one(kind: str, feature: str) -> None:
    found = [_spreads(20.0, kind, feature, seed) for seed in range(2)]

    assert all(one is not None and one.growth < 1.05 for one in found)
