"""Compensation of the ball: exact touches of given features must return these features."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float
from ocmm_core.measuring import MeasuredPoint
from tests.core.features.exact_touches import (
    TIP_RADIUS,
    flat_touches,
    moved,
    nominal,
    nudged,
    round_touches,
    shape_nominal,
    shape_touches,
    slanted,
    touches,
)
from tests.core.features.shape_samples import OUTLINES, geometry_distance, somewhere, true_geometry

OTHERS = (*OUTLINES, Shape.CONE, Shape.TORUS)

EXACT = 1e-9
"""mm: rounding of coordinates of some hundred mm, magnified by the fit."""


def _feature(
    nominals: Sequence[NominalFeature], points: Sequence[MeasuredPoint], name: str
) -> ActualFeature:
    found = actual_features(nominals, points)[name]
    assert isinstance(found, ActualFeature), found
    return found


def _error(nominals: Sequence[NominalFeature], points: Sequence[MeasuredPoint]) -> FitError:
    found = actual_features(nominals, points)[nominals[-1].name]
    assert isinstance(found, FitError), found
    return found


@pytest.mark.parametrize("side", ["outer", "inner"])
@pytest.mark.parametrize("shape", [Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER])
def test_shaft_and_bore(shape: Shape, side: str) -> None:
    rng = np.random.default_rng(1)
    for diameter in (4.0, 19.989, 120.0):
        motion = somewhere(rng)
        points = slanted(round_touches("it", shape, diameter, side, motion), rng)
        fit = _feature([nominal("it", shape, diameter, side)], points, "it").fit
        assert 2.0 * fit.radius == pytest.approx(diameter, abs=EXACT)
        arm = fit.point - motion.translation
        if shape is Shape.CYLINDER:
            arm -= (arm @ fit.direction) * fit.direction
        assert np.linalg.norm(arm) < EXACT
        if shape is not Shape.SPHERE:
            assert abs(fit.direction @ motion.rotation[:, 2]) == pytest.approx(1.0, abs=1e-12)
        assert fit.form < EXACT


@pytest.mark.parametrize("side", ["outer", "inner"])
@pytest.mark.parametrize("shape", OTHERS)
def test_the_ball_is_taken_off_every_shape(shape: Shape, side: str) -> None:
    rng = np.random.default_rng(11)
    motion = somewhere(rng)
    points = slanted(shape_touches("it", shape, side, motion), rng)
    feature = _feature([shape_nominal("it", shape, side)], points, "it")
    assert geometry_distance(shape, true_geometry(shape, motion), feature.fit.geometry) < EXACT
    assert feature.fit.form < EXACT


@pytest.mark.parametrize("shape", OUTLINES)
def test_outlines_are_projected_onto_a_face(shape: Shape) -> None:
    rng = np.random.default_rng(12)
    motion = somewhere(rng)
    own = shape_touches("it", shape, "inner", motion, first=10)
    own = moved(own, np.outer(rng.uniform(-4.0, -2.0, len(own)), motion.rotation[:, 2]))
    points = own + flat_touches("face", motion)
    features = [shape_nominal("it", shape, "inner", "face"), nominal("face", Shape.PLANE)]
    fit = _feature(features, points, "it").fit
    truth = true_geometry(shape, motion)
    truth[:3] += ((fit.point - truth[:3]) @ motion.rotation[:, 2]) * motion.rotation[:, 2]
    assert geometry_distance(shape, truth, fit.geometry) < EXACT


def test_a_ball_that_cannot_touch_the_end_of_an_ellipse_gives_none() -> None:
    # The ends of the ellipse have a radius of 2 mm.
    points = shape_touches("HOLE", Shape.ELLIPSE, "inner", somewhere(np.random.default_rng(13)))
    points = [replace(p, tip_world=p.tip_world + 0.6 * p.direction, tip_radius=2.1) for p in points]
    error = _error([shape_nominal("HOLE", Shape.ELLIPSE, "inner")], points)
    assert error.code == "feature.ball_too_large"
    assert error.what.startswith("HOLE: ")


@pytest.mark.parametrize("flip", [1.0, -1.0])
def test_a_plane_faces_the_probe_whatever_its_direction(flip: float) -> None:
    rng = np.random.default_rng(2)
    motion = somewhere(rng)
    motion = replace(motion, rotation=motion.rotation @ np.diag([1.0, flip, flip]))
    points = slanted(flat_touches("top", motion), rng)
    fit = _feature([nominal("top", Shape.PLANE)], points, "top").fit
    assert fit.direction == pytest.approx(motion.rotation[:, 2], abs=1e-12)
    assert abs(fit.direction @ (fit.point - motion.translation)) < EXACT


def test_a_line_lies_on_the_face_that_was_touched() -> None:
    rng = np.random.default_rng(3)
    motion = somewhere(rng)
    surface = motion.apply(np.outer(np.linspace(-30.0, 30.0, 7), [1.0, 0.0, 0.0]))
    normals = np.tile(motion.rotation[:, 1], (7, 1))
    points = touches("edge", surface, normals)
    # An approach that slants along the edge does not move it, nor does its length shift.
    along = [replace(p, direction=_unit(p.direction + 0.4 * motion.rotation[:, 0])) for p in points]
    for taken in (points, along):
        fit = _feature([nominal("edge", Shape.LINE)], taken, "edge").fit
        arm = fit.point - motion.translation
        assert np.linalg.norm(arm - (arm @ fit.direction) * fit.direction) < EXACT
        assert abs(fit.direction @ motion.rotation[:, 0]) == pytest.approx(1.0, abs=1e-12)


def test_a_point_is_compensated_along_its_approach() -> None:
    direction = _unit(np.array([1.0, 2.0, 2.0]))
    points = touches("corner", np.full((2, 3), 7.0), np.tile(direction, (2, 1)))
    assert _feature([nominal("corner", Shape.POINT)], points, "corner").fit.point == pytest.approx(
        [7.0, 7.0, 7.0]
    )


def test_a_bore_probed_at_several_depths_is_projected_onto_its_face() -> None:
    rng = np.random.default_rng(4)
    motion = somewhere(rng)
    bore = round_touches("bore", Shape.CIRCLE, 12.0, "inner", motion, n=8, first=10)
    bore = moved(bore, np.outer(rng.uniform(-4.0, -2.0, 8), motion.rotation[:, 2]))
    points = bore + flat_touches("face", motion)
    features = [nominal("bore", Shape.CIRCLE, 12.0, "inner", "face"), nominal("face", Shape.PLANE)]
    fit = _feature(features, points, "bore").fit
    centre = motion.inverse().apply(fit.point)
    assert centre[:2] == pytest.approx([0.0, 0.0], abs=EXACT)
    assert 2.0 * fit.radius == pytest.approx(12.0, abs=EXACT)
    assert list(actual_features(features, points)) == ["bore", "face"]

    without_face = _error([features[1], features[0]], bore)
    assert without_face.code == "feature.no_projection_plane"
    assert "face" in without_face.what


@pytest.mark.parametrize(
    ("shape", "side"),
    [
        (Shape.SPHERE, "outer"),
        (Shape.CIRCLE, "inner"),
        (Shape.CYLINDER, "outer"),
        (Shape.PLANE, "outer"),
        (Shape.CONE, "inner"),
        (Shape.TORUS, "outer"),
        (Shape.ELLIPSE, "inner"),
        (Shape.ROUND_SLOT, "inner"),
        (Shape.RECTANGLE, "outer"),
    ],
)
def test_one_point_from_the_wrong_side_is_named(shape: Shape, side: str) -> None:
    motion = somewhere(np.random.default_rng(5))
    feature = nominal("it", shape, 0.0 if shape is Shape.PLANE else 20.0, side)
    if shape in OTHERS:
        points, feature = (
            shape_touches("it", shape, side, motion, first=11),
            shape_nominal("it", shape, side),
        )
    elif shape is Shape.PLANE:
        points = flat_touches("it", motion, first=11)
    else:
        points = round_touches("it", shape, 20.0, side, motion, first=11)
    points[6] = replace(points[6], direction=-points[6].direction)
    error = _error([feature], points)
    assert error.code == "feature.wrong_side"
    assert "Point 17 of it was approached from the wrong side" in error.what


def test_a_bore_that_the_plan_calls_a_shaft_gives_no_diameter() -> None:
    motion = somewhere(np.random.default_rng(6))
    points = round_touches("bore", Shape.CIRCLE, 20.0, "inner", motion)
    error = _error([nominal("bore", Shape.CIRCLE, 20.0, "outer")], points)
    assert error.code == "feature.wrong_side"
    assert "the plan says 'outer'" in error.what


def test_a_line_approached_lengthwise_has_no_side() -> None:
    surface = np.outer(np.arange(5.0), [10.0, 0.0, 0.0])
    points = touches("edge", surface, np.tile([1.0, 0.0, 0.0], (5, 1)))
    assert _error([nominal("edge", Shape.LINE)], points).code == "feature.no_side"


def test_a_shaft_thinner_than_the_ball_correction_gives_no_diameter() -> None:
    motion = somewhere(np.random.default_rng(7))
    points = round_touches("pin", Shape.CIRCLE, 2.0, "outer", motion)
    # The points say a ball of 1.5 mm, the record of the stylus 3 mm.
    points = [replace(point, tip_radius=3.0) for point in points]
    error = _error([nominal("pin", Shape.CIRCLE, 2.0)], points)
    assert error.code == "feature.smaller_than_ball"


def test_two_balls_in_one_feature_are_refused() -> None:
    motion = somewhere(np.random.default_rng(8))
    points = flat_touches("top", motion)
    points[2] = replace(points[2], tip_radius=TIP_RADIUS + 0.5)
    assert _error([nominal("top", Shape.PLANE)], points).code == "feature.mixed_tips"


def test_too_few_points_are_counted() -> None:
    motion = somewhere(np.random.default_rng(9))
    points = round_touches("ball", Shape.SPHERE, 20.0, "outer", motion, n=3)
    error = _error([nominal("ball", Shape.SPHERE, 20.0)], points)
    assert error.what == "ball needs at least 4 points (3 taken)."
    assert _error([nominal("ball", Shape.SPHERE, 20.0)], []).what.startswith(
        "ball needs at least 4 points"
    )


def test_a_fit_error_names_the_feature() -> None:
    line = np.outer(np.arange(6.0), [10.0, 0.0, 0.0])
    points = touches("top", line, np.tile([0.0, 0.0, 1.0], (6, 1)))
    assert _error([nominal("top", Shape.PLANE)], points).what.startswith("top: The points do not")


@pytest.mark.parametrize("shape", list(Shape))
@pytest.mark.parametrize("side", ["outer", "inner"])
def test_jacobians_are_those_of_the_whole_way(shape: Shape, side: str) -> None:
    rng = np.random.default_rng(10)
    motion = somewhere(rng, far=100.0)
    is_round = shape in (Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER)
    if shape in OTHERS:
        own = shape_touches("it", shape, side, motion, first=10)
    elif is_round:
        own = round_touches("it", shape, 20.0, side, motion, n=9, first=10)
    elif shape is Shape.LINE:
        surface = motion.apply(np.outer(np.linspace(-30.0, 30.0, 6), [1.0, 0.0, 0.0]))
        own = touches("it", surface, np.tile(motion.rotation[:, 1], (6, 1)), first=10)
    else:
        own = flat_touches("it", motion, first=10)
    face = flat_touches("face", motion)
    # The points of the job are mixed; columns follow their order.
    points = [*face[:4], *slanted(own, rng, 0.1), *face[4:]]
    features = [nominal("face", Shape.PLANE)]
    flat = shape in (Shape.CIRCLE, *OUTLINES)
    projection = "face" if flat and side == "inner" else ""
    if projection:
        depth = np.zeros((len(points), 3))
        depth[4:-5] = np.outer(rng.uniform(-3.0, 3.0, len(own)), motion.rotation[:, 2])
        points = moved(points, depth)
    if shape in OTHERS:
        features.append(shape_nominal("it", shape, side, projection))
    else:
        features.append(nominal("it", shape, 20.0 * is_round, side, projection))

    feature = _feature(features, points, "it")
    step = 1e-5
    jacobian = feature.jacobian.dense(len(points))
    differences = np.empty_like(jacobian)
    for i in range(differences.shape[1]):
        geometry = [_geometry(features, nudged(points, i, s), feature) for s in (step, -step)]
        differences[:, i] = (geometry[0] - geometry[1]) / (2.0 * step)
    # Exact data: differences and jacobian agree to the rounding of the differences.
    assert jacobian == pytest.approx(differences, abs=2e-5)
    assert len(feature.by_residuals) == len(own)


def _unit(vector: Float) -> Float:
    unit: Float = vector / np.linalg.norm(vector)
    return unit


def _geometry(
    features: Sequence[NominalFeature], points: Sequence[MeasuredPoint], like: ActualFeature
) -> Float:
    geometry = _feature(features, points, "it").fit.geometry
    if geometry[3:6] @ like.fit.direction < 0.0:
        geometry[3:6] *= -1.0
    return geometry
