"""Touches on another face are refused before they count, with and without the place of the part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.documents import resource
from ocmm_core.geometry import Float, RigidTransform, rotation_xyz, unit
from ocmm_core.inspection.evaluation import places_of
from ocmm_core.inspection.plan import load_plan
from ocmm_core.inspection.session._assignment import wrong_face
from ocmm_core.inspection.session._touch_filter import Contact
from ocmm_core.measuring import MeasuredPoint, RefusalCode
from tests.core.inspection.test_guidance import BALL, point_at

PLAN = load_plan(resource("plans", "gauge.toml"))
T_WORLD = RigidTransform(rotation_xyz(0.3, -0.2, 1.1), np.array([40.0, -20.0, -100.0]))
FIRST = PLAN.features[0]


def touches(normal: Float, n: int = 9) -> list[MeasuredPoint]:
    """Return points of the first plane, approached along a direction of the plan."""
    spread = np.random.default_rng(4).uniform(-30.0, 30.0, (n, 3))
    spread -= np.outer(spread @ normal, normal)
    way = T_WORLD.rotation @ normal
    return [
        replace(point_at(T_WORLD.apply(place + BALL * normal), number, FIRST.name), direction=way)
        for number, place in enumerate(spread, start=1)
    ]


def contact(way: Float, ball: Float | None = None) -> Contact:
    """Return a touch from a direction of the plan."""
    place = np.zeros(3) if ball is None else ball
    return Contact(T_WORLD.apply(place), (T_WORLD.rotation @ unit(way),), BALL, 1.0)


def test_refuses_a_side_wall_among_the_points_of_a_plane() -> None:
    normal = unit(np.array(FIRST.direction))
    side = unit(np.cross(normal, [0.2, 0.9, 0.4]))
    assert wrong_face(PLAN, FIRST.name, contact(side), None, []) is None
    points = touches(normal, 1)
    found = wrong_face(PLAN, FIRST.name, contact(side), None, points)
    assert found is not None
    assert found.code is RefusalCode.WRONG_FACE
    assert FIRST.name in found.what
    # A hand may slant by 50 degrees.
    slanted = np.cos(np.radians(50.0)) * normal + np.sin(np.radians(50.0)) * side
    assert wrong_face(PLAN, FIRST.name, contact(slanted), None, points) is None


@pytest.mark.parametrize("item", PLAN.features[1:], ids=lambda item: item.name)
def test_one_measured_plane_bounds_the_normals_of_all_others(item: object) -> None:
    feature = PLAN.feature(getattr(item, "name", ""))
    points = touches(unit(np.array(FIRST.direction)))
    places = places_of(feature, feature.points)
    for place, normal in zip(places.points, places.normals, strict=True):
        if np.any(normal):
            good = contact(normal, place + BALL * normal)
            assert wrong_face(PLAN, feature.name, good, None, points) is None
            assert wrong_face(PLAN, feature.name, good, T_WORLD.inverse(), points) is None
            wrong = contact(-normal, place + BALL * normal)
            assert wrong_face(PLAN, feature.name, wrong, T_WORLD.inverse(), points) is not None


def test_refuses_the_top_where_a_bore_is_wanted() -> None:
    normal = unit(np.array(FIRST.direction))
    points = touches(normal)
    round_ones = [
        item for item in PLAN.features
        if item.diameter > 0.0 and abs(unit(np.array(item.direction)) @ normal) > 0.99
        and item.shape.value in ("Circle", "Cylinder")
    ]  # fmt: skip
    assert round_ones
    for item in round_ones:
        assert wrong_face(PLAN, item.name, contact(normal), None, points) is not None


def test_points_from_opposite_sides_say_nothing_about_the_face() -> None:
    normal = unit(np.array(FIRST.direction))
    points = [
        replace(point, direction=sign * point.direction)
        for point, sign in zip(touches(normal, 4), (1.0, -1.0, 1.0, -1.0), strict=True)
    ]
    side = unit(np.cross(normal, [0.2, 0.9, 0.4]))
    for feature in PLAN.features:
        for count in (2, 4):
            assert wrong_face(PLAN, feature.name, contact(side), None, points[:count]) is None
