"""Fits against references computed here in 50 digits, for shapes without certified data.

The reference starts from the truth, not from the product's result, and takes Gauss-Newton steps
with Jacobians by differences in 50 digits until they vanish; its distances are written
independently, mostly in another form than in the product.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from ocmm_core.features.elements import fit_ellipse
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.search._ellipse_kernel import ellipse_foot
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float, Points3, rotation_from_vector
from tests.core.features.shape_samples import HALF_ANGLE, RADIUS, SECOND, ideal_points, somewhere

pytestmark = pytest.mark.numerics

DIGITS = 50
FAR = 10_000.0
"""mm: distance of the parts from the origin."""

Numbers = list[Any]


def _axis(p: Numbers) -> Numbers:
    """Return the unit vector of two angles about x and y, from z."""
    return [mp.sin(p[1]), -mp.sin(p[0]) * mp.cos(p[1]), mp.cos(p[0]) * mp.cos(p[1])]


def _dot(a: Numbers, b: Numbers) -> Any:
    return sum(x * y for x, y in zip(a, b, strict=True))


def _rho_t(point: Numbers, place: Numbers, turns: Numbers) -> tuple[Any, Any]:
    arm = [x - y for x, y in zip(point, place, strict=True)]
    axis = _axis(turns)
    t = _dot(arm, axis)
    return mp.sqrt(_dot(arm, arm) - t * t), t


def _torus(point: Numbers, p: Numbers) -> Any:
    rho, t = _rho_t(point, p[0:3], p[3:5])
    return mp.sqrt((rho - p[5]) ** 2 + t * t) - p[6]


def _cone(point: Numbers, p: Numbers) -> Any:
    rho, t = _rho_t(point, [p[0], p[1], mp.mpf(0)], p[2:4])
    return (rho - p[4] - t * mp.tan(p[5])) / mp.sqrt(1 + mp.tan(p[5]) ** 2)


def _cylinder(point: Numbers, p: Numbers) -> Any:
    return _rho_t(point, [p[0], p[1], mp.mpf(0)], p[2:4])[0] - p[4]


def _sphere(point: Numbers, p: Numbers) -> Any:
    return mp.sqrt(sum((x - y) ** 2 for x, y in zip(point, p[0:3], strict=True))) - p[3]


def _in_frame(point: Numbers, p: Numbers) -> tuple[Any, Any]:
    x, y = point[0] - p[0], point[1] - p[1]
    return x * mp.cos(p[2]) + y * mp.sin(p[2]), y * mp.cos(p[2]) - x * mp.sin(p[2])


def _ellipse(point: Numbers, p: Numbers) -> Any:
    x, y = _in_frame(point, p)
    a, b = p[3], p[4]
    # The anomaly of the foot by Newton from that of the product, good to 16 digits.
    c, s = ellipse_foot(float(x), float(y), float(a), float(b))
    turn = mp.atan2(s, c)
    for _ in range(4):
        c, s = mp.cos(turn), mp.sin(turn)
        slope = (x - a * c) * -a * s + (y - b * s) * b * c
        bend = -((a * s) ** 2) - (b * c) ** 2 - (x - a * c) * a * c - (y - b * s) * b * s
        turn -= slope / bend
    c, s = mp.cos(turn), mp.sin(turn)
    side = 1 if (x / a) ** 2 + (y / b) ** 2 > 1 else -1
    return side * mp.sqrt((x - a * c) ** 2 + (y - b * s) ** 2)


def _round_slot(point: Numbers, p: Numbers) -> Any:
    x, y = _in_frame(point, p)
    beyond = max(abs(x) - (p[3] - p[4]), mp.mpf(0))
    return mp.sqrt(beyond**2 + y**2) - p[4]


def _rectangle(point: Numbers, p: Numbers) -> Any:
    x, y = _in_frame(point, p)
    across, beside = abs(x) - p[3], abs(y) - p[4]
    if across > 0 and beside > 0:
        return mp.sqrt(across**2 + beside**2)
    return max(across, beside)


def _reference(
    distance: Callable[[Numbers, Numbers], Any], points: Float, start: list[float]
) -> Numbers:
    """Return the least-squares parameters in `DIGITS` digits."""
    h = mp.mpf(10) ** -20
    rows = [[mp.mpf(float(x)) for x in row] for row in points]
    p = [mp.mpf(value) for value in start]

    def all_of(q: Numbers) -> Numbers:
        return [distance(row, q) for row in rows]

    for _ in range(60):
        residuals = all_of(p)
        jacobian = mp.matrix(len(rows), len(p))
        for j in range(len(p)):
            ahead = all_of([x + (h if i == j else 0) for i, x in enumerate(p)])
            behind = all_of([x - (h if i == j else 0) for i, x in enumerate(p)])
            for i in range(len(rows)):
                jacobian[i, j] = (ahead[i] - behind[i]) / (2 * h)
        step = mp.lu_solve(jacobian.T * jacobian, -(jacobian.T * mp.matrix(residuals)))
        p = [x + d for x, d in zip(p, step, strict=True)]
        if max(abs(d) for d in step) < mp.mpf(10) ** -16:
            return p
    raise AssertionError("the reference did not converge")


def _grid(points: Points3) -> Points3:
    """Return the points on a grid of a power of two, so that a shift by `FAR` is exact."""
    return np.round(points * 2.0**20) / 2.0**20


SPACE = {
    Shape.SPHERE: (_sphere, [0.0, 0.0, 0.0, RADIUS]),
    Shape.CYLINDER: (_cylinder, [0.0, 0.0, 0.0, 0.0, RADIUS]),
    Shape.CONE: (_cone, [0.0, 0.0, 0.0, 0.0, RADIUS, HALF_ANGLE]),
    Shape.TORUS: (_torus, [0.0, 0.0, 0.0, 0.0, 0.0, RADIUS, SECOND]),
}
FLAT = {
    Shape.ELLIPSE: (_ellipse, [0.0, 0.0, 0.0, RADIUS, SECOND]),
    Shape.ROUND_SLOT: (_round_slot, [0.0, 0.0, 0.0, RADIUS, SECOND]),
    Shape.RECTANGLE: (_rectangle, [0.0, 0.0, 0.0, RADIUS, SECOND]),
}
CASES = [(2.0 * np.pi, 0.01), (2.0 * np.pi, 0.1 * SECOND), (np.deg2rad(20.0), 1e-4)]
LENGTH, ANGLE = 1e-8, 1e-9
"""mm and rad: a double at 10 m resolves 2e-12 mm, which arcs of 20 degrees magnify."""


@pytest.mark.parametrize(("arc", "noise"), CASES)
@pytest.mark.parametrize("shape", SPACE)
def test_shapes_in_space_far_away(shape: Shape, arc: float, noise: float) -> None:
    rng = np.random.default_rng(41)
    points = ideal_points(shape, rng, 14, arc)
    points = _grid(points + rng.normal(0.0, noise, points.shape))
    distance, start = SPACE[shape]
    with mp.workdps(DIGITS):
        p = _reference(distance, points, start)
        fit = fit_shape(shape, points + FAR, direction_hint=np.array([0.0, 0.0, 1.0]))
        place = [mp.mpf(float(x)) - FAR for x in fit.point]
        if shape in (Shape.SPHERE, Shape.TORUS):
            assert max(abs(x - y) for x, y in zip(place, p[:3], strict=True)) < LENGTH
            radius = p[-1] if shape is Shape.SPHERE else p[5]
        else:
            turns = p[2:4]
            off, along = _rho_t(place, [p[0], p[1], mp.mpf(0)], turns)
            assert off < LENGTH
            radius = p[4] if shape is Shape.CYLINDER else p[4] + along * mp.tan(p[5])
        assert abs(fit.radius - radius) < LENGTH
        if shape is Shape.TORUS:
            assert abs(fit.second - p[6]) < LENGTH
        if shape is Shape.CONE:
            assert abs(fit.half_angle - p[5]) < ANGLE
        if shape is not Shape.SPHERE:
            axis = _axis(p[3:5] if shape is Shape.TORUS else p[2:4])
            sense = 1 if fit.direction[2] > 0 else -1
            assert shape is not Shape.CONE or sense == 1
            for mine, true in zip(fit.direction, axis, strict=True):
                assert abs(sense * mine - true) < ANGLE


@pytest.mark.parametrize(
    ("shape", "arc", "noise"),
    # A slot is not determined by a part of its outline.
    [(s, *case) for s in FLAT for case in (CASES if s is Shape.ELLIPSE else CASES[:2])],
)
def test_outlines_in_a_plane(shape: Shape, arc: float, noise: float) -> None:
    rng = np.random.default_rng(42)
    points = ideal_points(shape, rng, 16, arc)
    if shape is Shape.RECTANGLE:
        # Clear of the corners, where noise decides which side a point belongs to.
        end = np.abs(points[:, 0]) > RADIUS - 1e-9
        points[end, 1] = np.clip(points[end, 1], 2.5 - SECOND, SECOND - 2.5)
        points[~end, 0] = np.clip(points[~end, 0], 2.5 - RADIUS, RADIUS - 2.5)
    points[:, :2] += rng.normal(0.0, noise, (16, 2)) * (0.01 if arc < 1.0 else 1.0)
    points = _grid(points)
    distance, start = FLAT[shape]
    with mp.workdps(DIGITS):
        p = _reference(distance, points[:, :2], start)
        fit = fit_shape(shape, points + FAR)
        # An arc of 20 degrees of an ellipse magnifies the rounding at 10 m by some 1e5.
        magnified = 1.0 if arc > 1.0 else 1e3
        assert max(abs(fit.point[i] - FAR - p[i]) for i in range(2)) < LENGTH * magnified
        assert abs(fit.radius - max(p[3], p[4])) < LENGTH * magnified
        assert abs(fit.second - min(p[3], p[4])) < LENGTH * magnified
        turned = p[2] + (mp.pi / 2 if p[4] > p[3] else 0)
        cross = fit.across[0] * mp.sin(turned) - fit.across[1] * mp.cos(turned)
        assert abs(cross) < ANGLE * magnified


def test_an_offset_ellipse() -> None:
    rng = np.random.default_rng(43)
    motion = somewhere(rng)
    turn = np.arange(15) * 2.0 * np.pi / 15
    normal = np.stack([SECOND * np.cos(turn), RADIUS * np.sin(turn)], axis=1)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    flat = np.stack([RADIUS * np.cos(turn), SECOND * np.sin(turn)], axis=1) - 1.5 * normal
    points = _grid(np.column_stack([flat + rng.normal(0.0, 0.05, flat.shape), np.zeros(15)]))
    with mp.workdps(DIGITS):
        p = _reference(
            lambda point, q: _ellipse(point, q) + mp.mpf(1.5),
            points[:, :2],
            [0.0, 0.0, 0.0, RADIUS, SECOND],
        )
        fit = fit_ellipse(motion.apply(points), offset=-1.5)
        assert abs(fit.radius - p[3]) < LENGTH
        assert abs(fit.second - p[4]) < LENGTH


@pytest.mark.parametrize("offset", [0.0, FAR])
@pytest.mark.parametrize("noise", [1e-6, 0.01])
@pytest.mark.parametrize("shape", [Shape.LINE, Shape.PLANE])
def test_principal_axes_of_thin_points(shape: Shape, noise: float, offset: float) -> None:
    # The moments of such points have eigenvalues that differ by up to sixteen digits.
    rng = np.random.default_rng(37)
    extent = [1.0, 0.0, 0.0] if shape is Shape.LINE else [1.0, 0.02, 0.0]
    points = rng.uniform(-150.0, 150.0, (100, 3)) * extent + rng.normal(0.0, noise, (100, 3))
    rotation = rotation_from_vector(rng.normal(size=3))
    points = points @ rotation.T + offset * rng.normal(size=3)
    fit = fit_shape(shape, points, direction_hint=rotation[:, 0 if shape is Shape.LINE else 2])
    with mp.workdps(DIGITS):
        rows = [[mp.mpf(float(x)) for x in row] for row in points]
        centre = [mp.fsum(row[k] for row in rows) / len(rows) for k in range(3)]
        arms = mp.matrix([[row[k] - centre[k] for k in range(3)] for row in rows])
        vectors = mp.eigsy(arms.T * arms)[1]
        axis = np.array([vectors[k, 2 if shape is Shape.LINE else 0] for k in range(3)], float)
    # Coordinates of some 10 m are rounded to 2e-12 mm; the direction does not feel that.
    assert fit.point == pytest.approx(np.array(centre, float), abs=1e-11 if offset else 1e-13)
    assert fit.direction * np.sign(axis @ fit.direction) == pytest.approx(axis, abs=2e-15)
