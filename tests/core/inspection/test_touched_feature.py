"""Which of several close features was touched, and when the choice stays open."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from ocmm_core.documents import resource
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, RigidTransform, unit
from ocmm_core.inspection.evaluation import Progress, places_of
from ocmm_core.inspection.plan import Plan, load_plan
from ocmm_core.inspection.session._touch_filter import Contact, touched_feature
from ocmm_core.measuring import Refusal

RADIUS = 2.0
WHERE = RigidTransform(np.eye(3), np.zeros(3))
UP = np.array([0.0, 0.0, 1.0])
TOP = NominalFeature(
    name="TOP", shape=Shape.PLANE, points=4, point=(0.0, 0.0, 0.0), length=60.0, width=60.0
)
MARK = NominalFeature(name="MARK", shape=Shape.POINT, points=1, point=(0.0, 0.0, 0.0))
NEXT = NominalFeature(name="NEXT", shape=Shape.POINT, points=1, point=(1.5, 0.0, 0.0))
# A chamfer of 45 degrees along the edge of the top at x = 30, and the side below it.
CHAMFER = NominalFeature(
    name="CHAMFER", shape=Shape.PLANE, points=3, point=(30.0, 0.0, 0.0), direction=(1.0, 0.0, 1.0)
)
BORE = NominalFeature(
    name="BORE", shape=Shape.CIRCLE, points=4, point=(0.0, 0.0, 0.0), diameter=20.0, side="inner"
)


def plan_of(*features: NominalFeature) -> Plan:
    quick = load_plan(resource("plans", "quick.toml"))
    return msgspec.structs.replace(quick, features=list(features), characteristics=[])


def touch(
    plan: Plan,
    place: tuple[float, float, float],
    *ways: Float,
    done: tuple[str, ...] = (),
    active: str = "",
    selected: str = "",
) -> str | Refusal:
    """Touch a horizontal surface at a place, mm."""
    names = tuple(feature.name for feature in plan.features)
    progress = Progress(names, active=active, done=frozenset(done))
    ball = np.array(place) + RADIUS * UP
    return touched_feature(plan, WHERE, Contact(ball, ways, RADIUS, 0.0), progress, selected)


@pytest.mark.parametrize(
    ("away", "done", "found"),
    [
        (0.0, (), "MARK"),
        (1.5, (), "MARK"),
        (2.5, (), "TOP"),
        (0.0, ("MARK",), "TOP"),
        (0.0, ("TOP",), "MARK"),
        (0.0, ("TOP", "MARK"), "TOP"),
    ],
)
def test_a_point_on_a_plane_gets_the_touch_of_its_place_while_it_is_open(
    away: float, done: tuple[str, ...], found: str
) -> None:
    assert touch(plan_of(TOP, MARK), (away, 0.0, 0.0), UP, done=done) == found
    # The order of the plan and a place without a way change nothing.
    assert touch(plan_of(MARK, TOP), (away, 0.0, 0.0), done=done) == found


def test_whoever_selected_one_of_them_means_it() -> None:
    plan = plan_of(TOP, MARK)
    assert touch(plan, (0.0, 0.0, 0.0), UP, selected="TOP") == "TOP"
    assert touch(plan, (0.0, 0.0, 0.0), UP, selected="MARK", done=("MARK",)) == "MARK"
    # Not where something else is touched.
    assert touch(plan, (20.0, 0.0, 0.0), UP, selected="MARK") == "TOP"


def test_a_point_where_the_guidance_leads_for_the_plane_is_not_decided_by_its_place() -> None:
    x, y, z = places_of(TOP, 4).points[0]
    plan = plan_of(TOP, msgspec.structs.replace(MARK, point=(float(x), float(y), float(z))))
    refused = touch(plan, (x, y, z), UP)
    assert isinstance(refused, Refusal)
    assert "TOP" in refused.what
    assert "MARK" in refused.what
    assert "Select" in refused.remedy
    assert touch(plan, (x, y, z), UP, active="TOP") == "TOP"
    assert touch(plan, (x, y, z), UP, active="MARK") == "MARK"
    assert touch(plan, (x, y, z), UP, done=("TOP",)) == "MARK"


def test_two_open_points_at_one_place_are_refused() -> None:
    plan = plan_of(TOP, MARK, NEXT)
    assert isinstance(touch(plan, (0.7, 0.0, 0.0), UP), Refusal)
    assert touch(plan, (0.7, 0.0, 0.0), UP, done=("MARK",)) == "NEXT"


def test_a_surface_that_is_no_surface_of_the_point_is_refused() -> None:
    # The ball on the rim of a bore: neither the path nor the open features decide.
    plan = plan_of(BORE, msgspec.structs.replace(MARK, point=(-10.5, 0.0, 0.0)))
    slanted = unit(np.array([1.0, 0.0, 1.0]))
    assert isinstance(touch(plan, (-9.0, 0.0, -0.2), slanted, done=("BORE",)), Refusal)
    below = msgspec.structs.replace(MARK, point=(0.0, 0.0, -0.5))
    assert isinstance(touch(plan_of(TOP, below), (0.0, 0.0, -0.2), UP), Refusal)


@pytest.mark.parametrize(
    ("tilt_deg", "found"), [(0.0, "TOP"), (5.0, "TOP"), (40.0, "CHAMFER"), (60.0, "CHAMFER")]
)
def test_the_way_of_the_ball_tells_faces_of_an_edge_apart(tilt_deg: float, found: str) -> None:
    tilt = np.radians(tilt_deg)
    way = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    plan = plan_of(TOP, CHAMFER)
    assert touch(plan, (29.5, 0.0, 0.0), way) == found
    # Two ways that do not agree decide nothing, and neither does one between the two faces.
    assert isinstance(touch(plan, (29.5, 0.0, 0.0), UP, unit(np.array([1.0, 0, 1.0]))), Refusal)
    between = np.array([np.sin(np.radians(22.0)), 0.0, np.cos(np.radians(22.0))])
    assert isinstance(touch(plan, (29.5, 0.0, 0.0), between), Refusal)


def test_the_ball_that_went_off_through_the_material_did_not_touch_that_face() -> None:
    assert isinstance(touch(plan_of(TOP), (0.0, 0.0, 0.0), UP, -UP), Refusal)
    assert touch(plan_of(TOP), (0.0, 0.0, 0.0), UP) == "TOP"
