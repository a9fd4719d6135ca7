"""Targets on nominal surfaces, their coverage, the touched feature, the cue."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import FitError
from ocmm_core.features.measured import actual_features, fit_shape
from ocmm_core.features.shapes import MINIMUM_POINTS, NominalFeature, Shape
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.evaluation import (
    Progress,
    Whereabouts,
    coverage_of,
    cue,
    nearness,
    places_of,
    targets_of,
    whereabouts,
)
from ocmm_core.inspection.plan import Plan, load_plan
from ocmm_core.inspection.session._touch_filter import Contact, touched_feature
from ocmm_core.measuring import MeasuredPoint, Refusal
from ocmm_core.tracking import load_probe
from ocmm_sim.scene import TrueTouch, VirtualRig, load_part

pytestmark = pytest.mark.numerics

BALL = 3.0
AXIS = (0.2, -0.3, 0.9)
SHAPES = [
    NominalFeature(
        name=shape.value, shape=shape, points=12, point=(5.0, -7.0, 3.0), direction=AXIS,
        diameter=diameter, length=40.0, width=width, angle_deg=angle, across=(0.9, 0.6, 0.0),
        side=side,
    )
    for shape, diameter, width, angle in (
        (Shape.PLANE, 0.0, 30.0, 0.0), (Shape.LINE, 0.0, 0.0, 0.0),
        (Shape.CIRCLE, 30.0, 0.0, 0.0), (Shape.SPHERE, 30.0, 0.0, 0.0),
        (Shape.CYLINDER, 30.0, 0.0, 0.0), (Shape.CONE, 30.0, 0.0, 40.0),
        (Shape.TORUS, 60.0, 16.0, 0.0), (Shape.ELLIPSE, 0.0, 25.0, 0.0),
        (Shape.ROUND_SLOT, 0.0, 20.0, 0.0), (Shape.SQUARE_SLOT, 0.0, 20.0, 0.0),
        (Shape.RECTANGLE, 0.0, 20.0, 0.0),
    )
    for side in ("outer", "inner")
]  # fmt: skip


def point_at(tip: Float, number: int = 1, feature: str = "X") -> MeasuredPoint:
    return MeasuredPoint(
        number=number, feature=feature, time_s=0.0, first_frame=0, last_frame=1, n_frames=2,
        tip_world=np.asarray(tip, dtype=float), random_covariance=1e-6 * np.eye(3),
        direction=np.array([0.0, 0.0, 1.0]), tip_radius=BALL,
        rotation_world_from_probe=np.eye(3), spots=np.zeros((2, 6, 2)), chi2_per_dof=1.0,
        approach="trail",
    )  # fmt: skip


@pytest.mark.parametrize("nominal", SHAPES, ids=lambda item: f"{item.name}-{item.side}")
def test_a_ball_at_its_target_touches_the_nominal_surface(nominal: NominalFeature) -> None:
    for count in (MINIMUM_POINTS[nominal.shape], 8, 12, 25):
        places = places_of(nominal, count)
        assert len(places.points) == count
        directed = nominal.shape is not Shape.LINE
        assert np.allclose(np.linalg.norm(places.normals, axis=1), float(directed))
        if not directed:
            continue
        for place, normal in zip(places.points, places.normals, strict=True):
            near = nearness(nominal, place + BALL * normal, BALL)
            # Outlines are searched on 200 places, 0.6 mm apart.
            assert near.gap < (0.35 if nominal.shape.value in OUTLINES else 1e-9)
            assert near.normal @ normal > 0.98
        apart = np.linalg.norm(places.points[:, None] - places.points, axis=2)
        assert apart[~np.eye(count, dtype=bool)].min() > 1.0


OUTLINES = ("Ellipse", "RoundSlot", "SquareSlot", "Rectangle")


@pytest.mark.parametrize(
    "nominal", [item for item in SHAPES if item.shape.value in
                ("Plane", "Circle", "Sphere", "Cylinder")], ids=lambda i: f"{i.name}-{i.side}"
)  # fmt: skip
def test_targets_determine_their_shape(nominal: NominalFeature) -> None:
    for count in (MINIMUM_POINTS[nominal.shape] + (nominal.shape is Shape.CYLINDER), 7, 9, 12):
        places = places_of(nominal, count)
        # Six points of a cylinder lie on several; the nominal one is meant.
        fit = fit_shape(
            nominal.shape,
            places.points,
            direction_hint=np.array(nominal.direction),
            radius_hint=0.5 * nominal.diameter,
        )
        if nominal.diameter:
            assert 2.0 * fit.radius == pytest.approx(nominal.diameter, abs=1e-6)


def test_a_size_that_is_not_known_gives_no_targets() -> None:
    plane = NominalFeature(name="P", shape=Shape.PLANE, points=9, point=(0.0, 0.0, 0.0))
    assert len(places_of(plane, 9).points) == 0


@lru_cache(maxsize=1)
def demo() -> tuple[Plan, RigidTransform, tuple[TrueTouch, ...], float]:
    plan = load_plan(resource("plans", "demo.toml"))
    part, body = (
        load_part(resource("parts", "demo.toml")),
        load_probe(resource("probes", "standard.toml")),
    )
    script = [(feature.name, feature.points) for feature in plan.features]
    virtual = VirtualRig(
        load_rig(resource("rigs", "recommended.toml")), body, part, script, seed=4,
        frame_rate_hz=500,
    )  # fmt: skip
    where = part.T_world_from_part.inverse()
    return plan, where, tuple(virtual.truth.touches), body.tip_radius


def names_of(plan: Plan) -> tuple[str, ...]:
    return tuple(feature.name for feature in plan.features)


def contact_of(touch: TrueTouch, radius: float) -> Contact:
    return Contact(touch.tip_world, (touch.normal_world,), radius, 0.0)


def test_the_feature_that_is_touched_is_found_by_where_the_ball_is() -> None:
    plan, where, touches, radius = demo()
    # CORNER lies on the top of the block: the touch of its place is its own.
    for touch in touches:
        found = touched_feature(plan, where, contact_of(touch, radius), Progress(names_of(plan)))
        assert found == touch.feature


def test_a_touch_far_from_everything_belongs_to_nothing() -> None:
    plan, where, _, radius = demo()
    far = where.inverse().apply(np.array([0.0, 0.0, 300.0]))
    refused = touched_feature(plan, where, Contact(far, (), radius, 0.0), Progress(names_of(plan)))
    assert isinstance(refused, Refusal)
    assert "10 mm" in refused.what


def test_a_skipped_feature_is_not_found() -> None:
    plan, where, touches, radius = demo()
    touch = next(item for item in touches if item.feature == "SPHERE")
    refused = touched_feature(
        plan,
        where,
        contact_of(touch, radius),
        Progress(names_of(plan), skipped=frozenset({"SPHERE"})),
    )
    assert isinstance(refused, Refusal)


def test_every_point_covers_the_target_nearest_to_it() -> None:
    plan, where, touches, radius = demo()
    place = Whereabouts(where, approximate=False)
    own = [t for t in touches if t.feature == "BORE_A"]
    points = [point_at(t.tip_world, n, "BORE_A") for n, t in enumerate(own, start=1)]
    assert len(targets_of(plan, "BORE_A", [], place, radius, None)) == 8
    left = targets_of(plan, "BORE_A", points[:3], place, radius, points[2].tip_world)
    assert len(left) == 5
    # The next one is the nearest to the last point; the ball reaches the surface there.
    distances = [target.distance(points[2].tip_world) for target in left]
    assert distances == sorted(distances)
    assert min(left, key=lambda one: one.distance(points[2].tip_world)) is left[0]
    for target in left:
        np.testing.assert_allclose(
            target.ball_world, target.surface_world + radius * target.normal_world, atol=1e-12
        )
        for point in points[:3]:
            assert target.distance(point.tip_world) > 1.0
    assert targets_of(plan, "BORE_A", points, place, radius, None) == ()
    assert targets_of(plan, "BORE_A", [], None, radius, None) == ()


def test_the_place_of_the_part_is_found_before_the_datums_are_all_measured() -> None:
    plan, where, touches, radius = demo()
    names = {"BED", "SPHERE", "BORE_C", "PLATE_TOP"}
    points = [
        replace(point_at(t.tip_world, n, t.feature), direction=t.normal_world, tip_radius=radius)
        for n, t in enumerate(touches, start=1)
        if t.feature in names
    ]
    place = whereabouts(plan, actual_features(plan.features, points))
    assert place is not None
    assert place.approximate
    corner = np.array([100.0, 50.0, 20.0])
    # The part differs from its plan by some hundredths of a millimetre.
    assert (
        np.linalg.norm(
            place.T_nominal_from_world.inverse().apply(corner) - where.inverse().apply(corner)
        )
        < 0.2
    )
    few = [point for point in points if point.feature in ("BED", "SPHERE")]
    assert whereabouts(plan, actual_features(plan.features, few)) is None
    assert isinstance(actual_features(plan.features, few)["BORE_C"], FitError)


def test_nominals_in_another_frame_than_the_part_frame_are_found() -> None:
    plan, where, touches, radius = demo()
    # The plan's nominals start at the bed, its part frame at bore A.
    points = [
        replace(point_at(t.tip_world, n, t.feature), direction=t.normal_world, tip_radius=radius)
        for n, t in enumerate(touches, start=1)
    ]
    place = whereabouts(plan, actual_features(plan.features, points))
    assert place is not None
    assert not place.approximate
    found = place.T_nominal_from_world.compose(where.inverse())
    assert np.linalg.norm(found.translation) < 0.1


@pytest.mark.parametrize(
    ("turns", "words", "warned"),
    [
        ((0.1, 0.9, 1.6, 2.5, 3.3, 4.1, 4.8, 5.6), "8 of 8 sectors", ""),
        ((0.0, 0.3, 0.6, 0.9, 1.2, 1.5, 1.8, 2.1), "3 of 8 sectors", "240°"),
    ],
)
def test_coverage_of_a_bore_counts_sectors(
    turns: tuple[float, ...], words: str, warned: str
) -> None:
    bore = NominalFeature(
        name="B", shape=Shape.CIRCLE, points=8, point=(0.0, 0.0, 0.0), diameter=20.0
    )
    angles = np.array(turns)
    tips = np.stack([10.0 * np.cos(angles), 10.0 * np.sin(angles), np.zeros(8)], axis=1)
    fit = fit_shape(Shape.CIRCLE, tips, direction_hint=np.array([0.0, 0.0, 1.0]))
    coverage = coverage_of(bore, fit, [point_at(tip) for tip in tips])
    assert coverage.words == words
    assert warned in coverage.warning
    assert bool(coverage.warning) is bool(warned)


def test_coverage_warns_of_points_on_one_height_or_nearly_on_a_line() -> None:
    shaft = NominalFeature(
        name="S", shape=Shape.CYLINDER, points=12, point=(0.0, 0.0, 0.0), diameter=20.0
    )
    angles = np.linspace(0.0, 6.0, 12)
    tips = np.stack([10.0 * np.cos(angles), 10.0 * np.sin(angles), 0.2 * angles], axis=1)
    fit = fit_shape(Shape.CYLINDER, tips, direction_hint=np.array([0.0, 0.0, 1.0]))
    assert "two heights" in coverage_of(shaft, fit, [point_at(t) for t in tips]).warning
    face = NominalFeature(name="F", shape=Shape.PLANE, points=4, point=(0.0, 0.0, 0.0))
    tips = np.array([[0.0, 0.0, 0.0], [30.0, 0.5, 0.0], [60.0, -0.5, 0.0], [90.0, 0.4, 0.0]])
    fit = fit_shape(Shape.PLANE, tips)
    assert "line" in coverage_of(face, fit, [point_at(t) for t in tips]).warning


def test_the_ring_shrinks_and_the_tone_rises_all_the_way() -> None:
    distances = np.geomspace(0.5, 300.0, 80)
    cues = [cue(float(distance)) for distance in distances]
    rings = [item.ring_px_fraction for item in cues]
    tones = [item.tone_hz for item in cues]
    assert rings == sorted(rings)
    assert tones == sorted(tones, reverse=True)
    assert (cues[0].arrived, cues[-1].arrived) == (True, False)
    assert max(rings) == 1.0
    assert cue(float("nan")) == cue(1e9)
    assert max(tones) / min(tones) == pytest.approx(8.0)
