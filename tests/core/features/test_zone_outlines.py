"""Smallest zones of ellipse, slots, rectangle and of a circle in space as one problem."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from ocmm_core.errors import FitError
from ocmm_core.features.elements import distance_derivatives, fit_ellipse
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.shapes import Criterion, Fit, NominalFeature, Shape, shape_fault
from ocmm_core.features.zones import certificate, fit_zone
from ocmm_core.features.zones._certificate import least_held
from ocmm_core.geometry import Float, Points3, RigidTransform
from ocmm_core.tolerances.kinds import evaluate
from tests.core.features.exact_outlines import (
    ellipse_in_fifty_digits,
    even_zone,
    narrowest_rectangle,
    tube_in_fifty_digits,
)
from tests.core.features.exact_touches import TIP_RADIUS, moved
from tests.core.features.shape_samples import OUTLINES, RADIUS, SECOND, ideal_points, somewhere
from tests.core.features.test_zone import sample
from tests.core.tolerances.known_part import KnownPart, asked

RECTANGLES = (Shape.SQUARE_SLOT, Shape.RECTANGLE)
DIFFERENT = (Shape.ELLIPSE, Shape.ROUND_SLOT, Shape.RECTANGLE)
"""A square slot is a rectangle."""


def _zone(shape: Shape, points: Points3, *, free: bool = False, hint: Float | None = None) -> Fit:
    return fit_shape(
        shape, points, criterion=Criterion.MINIMUM_ZONE, free=free, direction_hint=hint
    )


def _noisy(shape: Shape, rng: np.random.Generator, n: int, noise: float) -> Points3:
    points = ideal_points(shape, rng, n)
    points[:, :2] += rng.normal(0.0, noise, (n, 2))
    return points


def _in_plane(fit: Fit, motion: RigidTransform) -> Float:
    """Return x y turn a b of a fit in the plane of ``motion``."""
    centre = motion.inverse().apply(fit.point)
    along = fit.across @ motion.rotation
    turn = np.arctan(along[1] / along[0])
    return np.array([centre[0], centre[1], turn, fit.radius, fit.second])


@pytest.mark.parametrize(
    ("shape", "noise", "far"),
    [
        (Shape.SQUARE_SLOT, 0.01, 500.0),
        (Shape.RECTANGLE, 0.5, 500.0),
        (Shape.RECTANGLE, 0.02, 10_000.0),
    ],
)
def test_a_rectangle_is_the_best_of_all_turns(shape: Shape, noise: float, far: float) -> None:
    for seed in range(2):
        rng = np.random.default_rng(seed)
        sides = []
        for number, count in enumerate((6, 5, 4, 3)):
            half = SECOND if number < 2 else RADIUS
            reach = 0.7 * (RADIUS if half == SECOND else SECOND)
            along = np.linspace(-reach, reach, count)
            across = (half if number % 2 else -half) + rng.uniform(-noise, noise, count)
            pair = (along, across) if half == SECOND else (across, along)
            sides.append(np.stack(pair, axis=1))
        flat = np.concatenate(sides)
        motion = somewhere(rng, far)
        points = motion.apply(np.column_stack([flat, np.zeros(len(flat))]))
        fit = _zone(shape, points)
        # Coordinates at 10 m are rounded to 2e-12 mm.
        assert fit.form == pytest.approx(narrowest_rectangle(sides), abs=2e-11)
        assert certificate(fit, points).certified
        # Sides that do not limit the zone are in the middle of their own points.
        for own in np.split(fit.residuals, np.cumsum([len(side) for side in sides])[:-1]):
            assert own.max() == pytest.approx(-own.min(), abs=2e-11)


@pytest.mark.parametrize(("noise", "far"), [(0.01, 0.0), (0.3, 500.0), (0.02, 10_000.0)])
def test_an_ellipse_agrees_with_fifty_digits(noise: float, far: float) -> None:
    held = 0
    for seed in range(3):
        rng = np.random.default_rng(seed)
        motion = somewhere(rng, far)
        points = motion.apply(_noisy(Shape.ELLIPSE, rng, 30, noise))
        fit = _zone(Shape.ELLIPSE, points)
        assert certificate(fit, points).certified
        if held or len(fit.contacts) < 6:
            continue
        held += 1
        rows = list(fit.contacts)
        flat = motion.inverse().apply(points)[rows, :2]
        found = _in_plane(fit, motion)
        guess = np.append(found, 0.5 * fit.form)
        exact, half = ellipse_in_fifty_digits(flat, (fit.residuals[rows] > 0.0).tolist(), guess)
        # The points come back from 10 m rounded to some 4e-12 mm, and few contacts amplify it.
        assert np.abs(found - exact).max() < 1e-10
        assert fit.form == pytest.approx(2.0 * half, abs=2e-11)
    assert held


@pytest.mark.parametrize("shape", DIFFERENT)
@pytest.mark.parametrize("noise", [0.02, 0.4])
def test_linear_programs_from_other_places_find_nothing_better(shape: Shape, noise: float) -> None:
    rng = np.random.default_rng(3)
    flat = _noisy(shape, rng, 18, noise)
    fit = _zone(shape, flat)
    here = _in_plane(fit, RigidTransform.identity())
    found = [even_zone(shape, flat[:, :2], here)]
    found += [even_zone(shape, flat[:, :2], here + rng.normal(0.0, noise, 5)) for _ in range(2)]
    # Their slopes are differences, good to 1e-10.
    assert min(found) > 0.5 * fit.form - 1e-11
    assert min(found) == pytest.approx(0.5 * fit.form, abs=1e-9)


@pytest.mark.parametrize("shape", [*DIFFERENT, Shape.CIRCLE])
def test_certified_on_parts_of_it_and_never_wider_than_least_squares(shape: Shape) -> None:
    free = shape is Shape.CIRCLE
    for seed, noise, part in ((0, 1e-4, 1.0), (1, 0.5, 1.0), (2, 0.02, 0.6)):
        rng = np.random.default_rng(seed)
        if shape in (Shape.ELLIPSE, Shape.CIRCLE):
            points = ideal_points(shape, rng, 24, arc=2.0 * np.pi * part)
        else:
            points = ideal_points(shape, rng, 24)
        points += rng.normal(0.0, noise, points.shape) * [1.0, 1.0, float(free)]
        points = somewhere(rng).apply(points)
        squares = fit_shape(shape, points, free=free)
        fit = _zone(shape, points, free=free)
        proof = certificate(fit, points)
        assert proof.certified, proof.sentence
        assert set(proof.contacts) <= set(fit.contacts)
        if free:
            height = (points - squares.point) @ squares.direction
            assert fit.form <= 2.0 * np.hypot(squares.residuals, height).max()
        else:
            assert fit.form <= 2.0 * np.abs(squares.residuals).max()
            assert fit.form == pytest.approx(2.0 * np.abs(fit.residuals).max(), abs=1e-12)
            assert fit.form == pytest.approx(np.ptp(fit.residuals), abs=1e-12)


@pytest.mark.parametrize("shape", [*DIFFERENT, Shape.CIRCLE])
def test_the_jacobian_is_that_of_differences(shape: Shape) -> None:
    rng = np.random.default_rng(6)
    free = shape is Shape.CIRCLE
    points = _noisy(shape, rng, 16, 0.03)
    if free:
        points[:, 2] = rng.normal(0.0, 0.03, 16)
    points = somewhere(rng, 100.0).apply(points)
    fit = _zone(shape, points, free=free)
    # Along a way of all coordinates at once: every column takes part.
    way = rng.normal(size=points.shape)
    ahead, behind = (
        _zone(shape, points + step * way, free=free, hint=fit.direction).geometry
        for step in (1e-5, -1e-5)
    )
    # Curvature adds some 1e-9; a zone is good to 1e-13 mm.
    assert fit.jacobian @ way.ravel() == pytest.approx((ahead - behind) / 2e-5, abs=1e-7)


@pytest.mark.parametrize("shape", DIFFERENT)
def test_far_order_and_unit_change_nothing(shape: Shape) -> None:
    rng = np.random.default_rng(5)
    points = _noisy(shape, rng, 20, 0.05)
    here = _zone(shape, points)
    motion = somewhere(rng, 10_000.0)
    there = _zone(shape, motion.apply(25.4 * points)[rng.permutation(20)])
    # The choice between outlines with the same zone is deterministic: sizes agree as well.
    assert there.form == pytest.approx(25.4 * here.form, abs=1e-9)
    assert [there.radius, there.second] == pytest.approx(
        [25.4 * here.radius, 25.4 * here.second], abs=1e-8
    )


def test_points_without_form_and_as_few_as_possible_give_least_squares() -> None:
    for shape in OUTLINES:
        rng = np.random.default_rng(4)
        points = somewhere(rng, 10_000.0).apply(ideal_points(shape, rng, 20))
        fit = _zone(shape, points)
        assert fit.form < 1e-9
        assert fit.criterion is Criterion.MINIMUM_ZONE
        assert certificate(fit, points).certified


def test_balls_along_an_ellipse_keep_their_distance() -> None:
    rng = np.random.default_rng(8)
    ideal = ideal_points(Shape.ELLIPSE, rng, 24)
    normals = distance_derivatives(fit_ellipse(ideal), ideal)[1]
    for side in (1.0, -1.0):
        offset = side * TIP_RADIUS
        centres = ideal + (offset + rng.uniform(-0.02, 0.02, 24))[:, None] * normals
        squares = fit_ellipse(centres, None, offset)
        fit = fit_zone(squares, centres, offset)
        assert certificate(fit, centres, offset).certified
        assert not certificate(fit, centres).certified
        assert fit.form < min(0.04, 2.0 * np.abs(squares.residuals).max())
        assert [fit.radius, fit.second] == pytest.approx([RADIUS, SECOND], abs=0.02)


def test_a_flat_circle_has_the_same_zone_in_space_as_in_its_plane() -> None:
    rng = np.random.default_rng(9)
    points = sample(Shape.CIRCLE, rng, 14, 0.05)
    points[:, 2] = 0.0
    points = somewhere(rng).apply(points)
    flat, free = _zone(Shape.CIRCLE, points), _zone(Shape.CIRCLE, points, free=True)
    assert free.form == pytest.approx(flat.form, abs=1e-11)
    assert np.abs(free.point - flat.point).max() < 1e-9
    assert free.free


def test_no_circle_in_space_has_a_thinner_tube() -> None:
    rng = np.random.default_rng(10)
    points = sample(Shape.CIRCLE, rng, 20, 0.3)
    fit = _zone(Shape.CIRCLE, points, free=True)
    assert certificate(fit, points).certified

    def tube(step: Float) -> float:
        axis = fit.direction + step[3:6]
        axis = axis / np.linalg.norm(axis)
        arms = points - fit.point - step[:3]
        height = arms @ axis
        radius = np.linalg.norm(arms - np.outer(height, axis), axis=1)
        return 2.0 * float(np.hypot(radius - fit.radius - step[6], height).max())

    assert tube(np.zeros(7)) == pytest.approx(fit.form, abs=1e-12)
    for size in (1e-6, 1e-4, 1e-2, 0.3):
        for _ in range(100):
            step = size * rng.normal(size=7)
            step[3:6] /= 12.5
            assert tube(step) > fit.form - 1e-12
    # Residuals are radial, as those of least squares, and within the tube; for contacts in the
    # plane both are the same number, each with its own rounding.
    assert np.ptp(fit.residuals) <= fit.form + 1e-12
    with pytest.raises(FitError, match="not available for a circle in space"):
        fit_shape(Shape.CIRCLE, points, criterion=Criterion.INSCRIBED, free=True)


@pytest.mark.parametrize("side", ["outer", "inner"])
@pytest.mark.parametrize("shape", DIFFERENT)
def test_form_and_its_gradient(shape: Shape, side: str) -> None:
    rng = np.random.default_rng(11)
    ideal = ideal_points(shape, rng, 24)
    if shape in RECTANGLES:
        # No ball reaches into the corners.
        ideal = ideal[(np.abs(ideal[:, 0]) < 10.0) | (np.abs(ideal[:, 1]) < 2.5)]
    n = len(ideal)
    normals = distance_derivatives(fit_shape(shape, ideal), ideal)[1]
    if side == "inner":
        normals = -normals
    probed = (ideal + rng.uniform(-0.02, 0.02, n)[:, None] * normals, normals)
    part = KnownPart().add("it", shape, probed, side=side, length=2.0 * RADIUS, width=2.0 * SECOND)
    item = asked("form", "it")
    found = evaluate(item, part.actual(), None)
    assert found.association == "minimum zone"
    assert 0.02 < found.value < 0.04
    way = rng.normal(size=(n, 3))
    ahead, behind = (
        evaluate(item, part.actual(moved(part.points, step * way)), None).value
        for step in (1e-5, -1e-5)
    )
    # The effect of a tilt of the plane on points within it is of the order of the residuals.
    assert found.gradient @ np.append(way.ravel(), 0.0) == pytest.approx(
        (ahead - behind) / 2e-5, abs=2e-3
    )


def test_the_feature_of_a_plan_by_its_minimum_zone() -> None:
    rng = np.random.default_rng(12)
    ideal = ideal_points(Shape.RECTANGLE, rng, 15)
    normals = distance_derivatives(fit_shape(Shape.RECTANGLE, ideal), ideal)[1]
    part = KnownPart().add(
        "it", Shape.RECTANGLE, (ideal, normals), criterion="minimum zone", side="outer",
        length=2.0 * RADIUS, width=2.0 * SECOND,
    )  # fmt: skip
    fit = part.actual()["it"].fit
    assert fit.criterion is Criterion.MINIMUM_ZONE
    assert [fit.radius, fit.second] == pytest.approx([RADIUS, SECOND], abs=1e-9)


@pytest.mark.parametrize(
    ("shape", "said", "wrong"),
    [
        ("Rectangle", {"criterion": "minimum zone"}, None),
        ("Circle", {"criterion": "minimum zone", "free": True}, None),
        ("Ellipse", {"criterion": "inscribed"}, "criterion"),
        ("Circle", {"criterion": "inscribed", "free": True}, "criterion"),
        ("Point", {"criterion": "minimum zone"}, "criterion"),
        ("Circle", {"criterion": "minimum zone", "projection": "top"}, "criterion"),
    ],
)
def test_a_plan_asks_only_for_what_there_is(
    shape: str, said: dict[str, object], wrong: str | None
) -> None:
    sizes: dict[str, object] = {"length": 30.0, "width": 10.0}
    if shape == "Circle":
        sizes = {"diameter": 30.0}
    rest = {} if shape == "Point" else sizes
    feature = msgspec.convert(
        {"name": "it", "shape": shape, "points": 9, "point": (0, 0, 0), **rest, **said},
        NominalFeature,
        strict=False,
    )
    fault = shape_fault(feature)
    assert (fault and fault[0]) == wrong


def test_cylinders_in_exact_symmetry_are_held() -> None:
    # All contacts lie in one section; each lean is held by other forces among them.
    turn = np.arange(6) * np.pi / 3.0
    low = 12.5 + 0.02 * np.cos(3.0 * turn)
    rows = [np.stack([low * np.cos(turn), low * np.sin(turn), np.full(6, -15.0)], axis=1)]
    turn = turn + np.pi / 6.0
    rows.append(12.5 * np.stack([np.cos(turn), np.sin(turn), np.full(6, 1.2)], axis=1))
    points = np.concatenate(rows)
    fit = _zone(Shape.CYLINDER, points)
    assert certificate(fit, points).certified
    assert fit.form == pytest.approx(0.04, abs=1e-9)


def test_each_way_may_be_held_by_forces_of_its_own() -> None:
    # Either contact balances alone; each holds one way and lets the other go.
    both = np.array([np.diag([1.0, -0.4]), np.diag([-0.4, 1.0])])
    touch, right = np.ones((1, 2)), np.ones(1)
    # Halfway between, both hold with 1/2 - 0.4/2.
    assert least_held(both, touch, right) == pytest.approx(0.3, abs=1e-12)
    assert least_held(both[:1], touch[:, :1], right) == pytest.approx(-0.4, abs=1e-12)
    assert least_held(both[:, :1, :1], touch, right) == pytest.approx(1.0, abs=1e-12)


def test_a_circle_in_space_agrees_with_fifty_digits() -> None:
    rng = np.random.default_rng(8)
    points = somewhere(rng, 10_000.0).apply(sample(Shape.CIRCLE, rng, 30, 0.05))
    fit = _zone(Shape.CIRCLE, points, free=True)
    assert len(fit.contacts) == 7
    exact, tube = tube_in_fifty_digits(fit, points[list(fit.contacts)])
    # The geometry itself is stored to 2e-12 mm at 10 m.
    assert np.abs(np.append(fit.point, fit.radius) - exact).max() < 1e-10
    assert fit.form == pytest.approx(tube, abs=1e-11)
