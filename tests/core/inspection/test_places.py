"""Targets of a plan: on the nominal surface, spread over it, and from the right side."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, unit
from ocmm_core.inspection.evaluation._coverage import (
    across_of,
    along_line,
    around_axis,
    at_point,
    on_cap,
    on_ellipse,
    on_plane,
    on_rectangle,
    on_round_slot,
    on_torus,
)

CENTRE = np.array([10.0, -20.0, 5.0])
AXIS = unit(np.array([0.2, -0.3, 1.0]))
# Results of a few additions and roots of numbers below 100.
EXACT = 1e-12


def nominal(shape: Shape, **more: Any) -> NominalFeature:
    """Return a feature at `CENTRE` along `AXIS`."""
    return NominalFeature(
        name="A",
        shape=shape,
        points=shape.spec.minimum_points,
        point=tuple(CENTRE.tolist()),
        direction=tuple(AXIS.tolist()),
        **more,
    )


def along_and_radial(points: Float) -> tuple[Float, Float]:
    """Return heights (n,) above the centre and the components square to the axis (n, 3)."""
    away = points - CENTRE
    heights = away @ AXIS
    return heights, away - heights[:, None] * AXIS


def test_the_length_lies_square_to_the_direction_however_little_of_it_is_told() -> None:
    told = np.array([1.0, 0.0, 0.3])
    found = across_of(nominal(Shape.RECTANGLE, across=tuple(told)))
    expected = told - (told @ AXIS) * AXIS
    assert np.linalg.norm(expected) < 1.05  # square to the axis less than the given vector remains
    assert found == pytest.approx(unit(expected), abs=EXACT)
    # A tenth of a unit is enough to know where to.
    slight = tuple((AXIS + 0.1 * found).tolist())
    assert across_of(nominal(Shape.RECTANGLE, across=slight)) == pytest.approx(found, abs=1e-9)
    # Along the axis the turn is open: any direction is valid.
    any_ = across_of(nominal(Shape.RECTANGLE, across=tuple(AXIS.tolist())))
    assert (abs(any_ @ AXIS), np.linalg.norm(any_)) == pytest.approx((0.0, 1.0), abs=EXACT)


@pytest.mark.parametrize("count", [1, 3])
def test_a_point_is_touched_where_it_is(count: int) -> None:
    places = at_point(nominal(Shape.POINT), CENTRE, AXIS, 1.0, count)
    assert places.points.tolist() == [CENTRE.tolist()] * count
    assert places.normals.tolist() == [AXIS.tolist()] * count


@pytest.mark.parametrize("length", [0.5, 80.0])
def test_a_line_is_touched_over_its_length(length: float) -> None:
    places = along_line(nominal(Shape.LINE, length=length), CENTRE, AXIS, 1.0, 5)
    heights, radial = along_and_radial(places.points)
    assert np.abs(radial).max() < EXACT
    # 6 % of the length stay free at both ends.
    assert heights == pytest.approx(0.44 * length * np.linspace(-1.0, 1.0, 5), abs=EXACT)
    nowhere = along_line(nominal(Shape.LINE, length=0.0), CENTRE, AXIS, 1.0, 5)
    assert len(nowhere.points) == len(nowhere.normals) == 0


@pytest.mark.parametrize("count", [3, 4, 7, 12])
def test_a_plane_is_touched_inside_its_rectangle_and_not_along_a_line(count: int) -> None:
    plane = nominal(Shape.PLANE, length=0.8, width=0.4, across=(1.0, 0.0, 0.0))
    places = on_plane(plane, CENTRE, AXIS, 1.0, count)
    heights, flat = along_and_radial(places.points)
    assert len(flat) == count
    assert np.abs(heights).max() < EXACT
    assert np.linalg.svd(flat - flat.mean(axis=0), compute_uv=False)[1] > 0.1
    across = across_of(plane)
    assert np.abs(flat @ across).max() <= 0.44 * 0.8 + EXACT
    assert np.abs(flat @ np.cross(AXIS, across)).max() <= 0.44 * 0.4 + EXACT


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("count", "levels"), [(8, (-12.0, 12.0)), (15, (-12.0, 0.0, 12.0))])
def test_a_cylinder_is_touched_at_heights_turned_against_each_other(
    count: int, levels: tuple[float, ...], sign: float
) -> None:
    cylinder = nominal(Shape.CYLINDER, diameter=12.0, length=40.0)
    places = around_axis(cylinder, CENTRE, AXIS, sign, count)
    heights, radial = along_and_radial(places.points)
    assert sorted(set(np.round(heights, 9))) == pytest.approx(levels, abs=1e-9)
    assert np.linalg.norm(radial, axis=1) == pytest.approx(6.0, abs=EXACT)
    assert places.normals == pytest.approx(sign * radial / 6.0, abs=EXACT)
    # The second height begins half a step further.
    first, second = (radial[np.isclose(heights, level)] for level in levels[:2])
    turned = math.acos(float(first[0] @ second[0]) / 36.0)
    assert turned == pytest.approx(math.pi / len(second), abs=1e-9)
    assert np.abs(first.sum(axis=0)).max() < 1e-9  # even round the axis


def test_a_cone_is_touched_square_to_its_side() -> None:
    cone = nominal(Shape.CONE, diameter=20.0, length=10.0, angle_deg=60.0)
    places = around_axis(cone, CENTRE, AXIS, 1.0, 8)
    heights, radial = along_and_radial(places.points)
    radii = np.linalg.norm(radial, axis=1)
    assert radii == pytest.approx(10.0 + heights * math.tan(math.radians(30.0)), abs=EXACT)
    side = unit(math.cos(math.radians(30.0)) * AXIS + math.sin(math.radians(30.0)) * unit(radial))
    assert np.abs(np.sum(side * places.normals, axis=1)).max() < EXACT
    assert (np.sum(places.normals * radial, axis=1) > 0.0).all()


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("count", [1, 5, 25])
def test_a_sphere_is_touched_on_the_half_that_looks_up_from_its_pole_on(
    count: int, sign: float
) -> None:
    places = on_cap(nominal(Shape.SPHERE, diameter=30.0), CENTRE, AXIS, sign, count)
    assert np.linalg.norm(places.normals, axis=1) == pytest.approx(1.0, abs=EXACT)
    assert places.points == pytest.approx(CENTRE + sign * 15.0 * places.normals, abs=EXACT)
    heights = places.normals @ AXIS
    assert heights[0] == pytest.approx(1.0, abs=EXACT)
    assert (np.diff(heights) < 0.0).all()
    assert heights[-1] > 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_torus_is_touched_on_its_tube(sign: float) -> None:
    torus = nominal(Shape.TORUS, diameter=60.0, width=8.0)
    places = on_torus(torus, CENTRE, AXIS, sign, 9)
    heights, radial = along_and_radial(places.points)
    tube = np.hypot(np.linalg.norm(radial, axis=1) - 30.0, heights)
    assert tube == pytest.approx(4.0, abs=1e-9)
    ring = CENTRE + 30.0 * unit(radial)
    assert places.normals == pytest.approx(sign * (places.points - ring) / 4.0, abs=1e-9)
    # On top of the tube, and 60 degrees towards the middle and away from it.
    radii = 30.0 + 4.0 * math.sin(math.radians(60.0)) * np.array([-1.0, 0.0, 1.0])
    assert np.linalg.norm(radial, axis=1) == pytest.approx(
        np.tile(radii, 3)[:: int(sign)], abs=1e-9
    )


OUTLINES = {
    "ellipse": (on_ellipse, Shape.ELLIPSE),
    "round slot": (on_round_slot, Shape.ROUND_SLOT),
    "rectangle": (on_rectangle, Shape.RECTANGLE),
}


def off_outline(kind: str, a: float, b: float, u: float, v: float) -> float:
    """Return the distance of a place from an outline of half axes a >= b, mm (ellipse: no unit)."""
    if kind == "ellipse":
        return (u / a) ** 2 + (v / b) ** 2 - 1.0
    if kind == "round slot":
        return math.hypot(max(abs(u) - (a - b), 0.0), v) - b
    return max(abs(u) - a, abs(v) - b)


@pytest.mark.parametrize("kind", OUTLINES)
@pytest.mark.parametrize("count", [5, 8, 14])
@pytest.mark.parametrize(("length", "width"), [(5.0, 4.5), (40.0, 10.0)])
def test_outlines_are_touched_all_round_and_square_to_them(
    kind: str, count: int, length: float, width: float
) -> None:
    place, shape = OUTLINES[kind]
    feature = nominal(shape, length=length, width=width, across=(1.0, 0.0, 0.0))
    across = across_of(feature)
    up = np.cross(AXIS, across)
    places = place(feature, CENTRE, AXIS, 1.0, count)
    heights, flat = along_and_radial(places.points)
    assert len(flat) == count
    assert np.abs(heights).max() < EXACT
    u, v = flat @ across, flat @ up
    a, b = 0.5 * length, 0.5 * width
    for at_u, at_v, normal in zip(u, v, places.normals, strict=True):
        assert off_outline(kind, a, b, at_u, at_v) == pytest.approx(0.0, abs=1e-9)
        assert np.linalg.norm(normal) == pytest.approx(1.0, abs=EXACT)
        assert normal @ AXIS == pytest.approx(0.0, abs=EXACT)
        # A step along the normal leads away from the outline, one across it hardly does.
        out, aside = normal, np.cross(AXIS, normal)
        away = [
            off_outline(kind, a, b, at_u + 1e-4 * step @ across, at_v + 1e-4 * step @ up)
            for step in (out, aside, -aside)
        ]
        assert away[0] > 0.0
        assert abs(away[1]) < 0.01 * away[0]
        assert abs(away[2]) < 0.01 * away[0]
    # On every side, and not twice at one place.
    assert u.min() < 0.0 < u.max()
    assert v.min() < 0.0 < v.max()
    apart = np.linalg.norm(flat[:, None] - flat, axis=2) + 1e3 * np.eye(count)
    assert apart.min() > 0.02 * width
    inner = place(feature, CENTRE, AXIS, -1.0, count)
    assert inner.points.tolist() == places.points.tolist()
    assert inner.normals == pytest.approx(-places.normals, abs=EXACT)
