"""Touches of the virtual operator on every shape give that shape back, without any noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import RADIUS, SECOND, NominalFeature, Shape
from ocmm_core.inspection.plan import load_plan
from ocmm_core.measuring import MeasuredPoint
from ocmm_sim.scene import load_part, sample
from ocmm_sim.scene._surfaces import HOLES, free_width
from ocmm_sim.sources import true_values
from tests.core.features.exact_touches import touches

TIP_RADIUS = 3.0


@pytest.mark.parametrize("seed", range(3))
def test_exact_touches_give_the_true_sizes(seed: int) -> None:
    plan = load_plan(resource("plans", "gauge.toml"))
    part = load_part(resource("parts", "gauge.toml"))
    assert plan.part == part.name
    assert len(plan.features) == 12
    assert len({feature.shape for feature in plan.features}) == 10
    rng = np.random.default_rng(seed)
    points: list[MeasuredPoint] = []
    for feature in plan.features:
        contacts = sample(part.artefact(feature.name), feature.points, rng)
        assert len(contacts.points) == feature.points
        np.testing.assert_allclose(np.linalg.norm(contacts.normals, axis=1), 1.0, atol=1e-12)
        points += touches(
            feature.name, contacts.points, contacts.normals, len(points) + 1, TIP_RADIUS
        )
    truth = part.features_part()
    for name, actual in actual_features(plan.features, points).items():
        assert isinstance(actual, ActualFeature), actual
        true, fit = truth[name], actual.fit
        assert fit.form < 1e-8, name
        if fit.shape in (Shape.ROUND_SLOT, Shape.RECTANGLE, Shape.TORUS):
            assert 2.0 * fit.geometry[SECOND] == pytest.approx(true.width, abs=1e-8)
        if fit.shape in (Shape.ROUND_SLOT, Shape.RECTANGLE):
            assert 2.0 * fit.geometry[RADIUS] == pytest.approx(true.length, abs=1e-8)
        elif fit.shape is Shape.CONE:
            assert fit.half_angle == pytest.approx(true.half_angle, abs=1e-9)
            assert fit.direction @ true.direction == pytest.approx(-1.0)
        elif true.diameter > 0.0:
            assert 2.0 * fit.geometry[RADIUS] == pytest.approx(true.diameter, abs=1e-8)


def test_the_nominals_of_the_gauge_plan_are_near_the_truth() -> None:
    plan = load_plan(resource("plans", "gauge.toml"))
    part = load_part(resource("parts", "gauge.toml"))
    truth = part.features_part()
    for feature in plan.features:
        true = truth[feature.name]
        assert feature.diameter == pytest.approx(true.diameter, abs=0.05)
        assert feature.length == pytest.approx(true.length, abs=0.05)
        assert feature.width == pytest.approx(true.width, abs=0.05)
        assert feature.angle_deg == pytest.approx(np.degrees(2.0 * true.half_angle), abs=0.05)
        assert feature.text
        artefact = part.artefact(feature.name)
        if isinstance(artefact, HOLES):
            assert free_width(artefact) > 2.0 * TIP_RADIUS
    assert true_values(plan, part)["Bore A diameter"] == pytest.approx(20.007)


PART = """
schema = "ocmm.part/1"
unit = "mm"
name = "P"
[pose]
translation = [0.0, 0.0, 0.0]
rotation_vector = [0.0, 0.0, 0.0]
[[features]]
kind = "ellipse"
name = "E"
point = [0.0, 0.0, 0.0]
direction = [0.0, 0.0, 1.0]
along = [0.0, 1.0, 0.0]
length = 40.0
width = 30.0
depth = 10.0
"""


def test_an_elliptic_bore(tmp_path: Path) -> None:
    path = tmp_path / "part.toml"
    path.write_text(PART)
    contacts = sample(load_part(path).artefact("E"), 9, np.random.default_rng(1))
    points = touches("E", contacts.points, contacts.normals, 1, TIP_RADIUS)
    nominal = NominalFeature(
        name="E", shape=Shape.ELLIPSE, points=9, point=(0.0, 0.0, 0.0), length=40.0, width=30.0,
        side="inner", across=(0.0, 1.0, 0.0),
    )  # fmt: skip
    (actual,) = actual_features([nominal], points).values()
    assert isinstance(actual, ActualFeature), actual
    # The depths of the touches tilt the plane that is fitted to them, by what 1 mm does on 40.
    assert 2.0 * actual.fit.radius == pytest.approx(40.0, abs=0.1)
    assert 2.0 * actual.fit.second == pytest.approx(30.0, abs=0.1)
    for old, new, word in (
        ("width = 30.0", "width = 40.0", "not smaller than 'length'"),
        ("along = [0.0, 1.0, 0.0]", "along = [0.0, 1.0, 1.0]", "not perpendicular"),
        ("depth = 10.0", "depth = 0.0", "greater than zero"),
    ):
        path.write_text(PART.replace(old, new))
        with pytest.raises(InputError, match=word):
            load_part(path)
