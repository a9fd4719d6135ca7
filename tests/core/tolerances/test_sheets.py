"""Sheets: trimmed edges, thickness from both sides, and refusals."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from ocmm_core.errors import FitError
from ocmm_core.features.measured import (
    ActualFeature,
    Construction,
    actual_features,
    constructed_features,
)
from ocmm_core.features.shapes import (
    DIRECTION,
    POINT,
    NominalFeature,
    Shape,
    nominal_geometry,
    shape_fault,
)
from ocmm_core.geometry import Float
from ocmm_core.inspection.plan import Plan, step_fault
from ocmm_core.measuring import FeatureUncertainty, MeasuredPoint, PointFactors
from ocmm_core.tolerances.decisions import evaluate_all
from ocmm_core.tolerances.kinds import characteristic_fault, evaluate
from ocmm_core.tolerances.uncertainty import form_samples
from tests.core.features.exact_touches import nudged, shape_nominal, shape_touches
from tests.core.features.shape_samples import RADIUS, SECOND
from tests.core.tolerances.known_part import PLACES, KnownPart, asked, motion, ring
from tests.host import looser

pytestmark = pytest.mark.numerics

THICK = 2.4
"""mm: of the sheet; its upper side is z = 0, its edge x = 30 with the material at smaller x."""
EDGES = msgspec.convert(
    [
        {"name": "TRIM", "kind": "projection", "features": ("EDGE", "TOP")},
        {"name": "SPOT", "kind": "part of", "features": ("TRIM",), "part": "middle"},
    ],
    list[Construction],
)
RUNS = 600


def side(z: float, count: int = 6, size: float = 12.0, at: float = 20.0) -> tuple[Float, Float]:
    """Return touches around a place of a side of the sheet, from outside."""
    turn = 2.4 * np.arange(count)
    arm = 0.5 * size * np.sqrt((np.arange(count) + 0.5) / count)
    surface = np.stack([at + arm * np.cos(turn), arm * np.sin(turn), np.full(count, z)], axis=1)
    up = 1.0 if z == 0.0 else -1.0
    return surface, np.tile([0.0, 0.0, up], (count, 1))


def trimmed(depths: Sequence[float], lift_deg: float = 0.0) -> tuple[Float, Float]:
    """Return touches of the edge at depths below the upper side, approached from above by an angle.

    The ball touches the edge square to it, however it came.
    """
    y = np.linspace(-8.0, 8.0, len(depths))
    surface = np.stack([np.full(len(y), 30.0), y, -np.array(depths)], axis=1)
    return surface, np.tile([1.0, 0.0, 0.0], (len(y), 1))


def sheet(depths: Sequence[float] = (1.0, 1.4, 0.8, 1.2), lift_deg: float = 0.0) -> KnownPart:
    part = KnownPart(PLACES[1])
    part.add("TOP", Shape.PLANE, side(0.0))
    part.add("BELOW", Shape.PLANE, side(-THICK), direction=(0, 0, -1))
    part.add(
        "EDGE", Shape.LINE, trimmed(depths), point=(30, 0, -1.2), direction=(0, 1, 0),
        projection="TOP", width=THICK,
    )  # fmt: skip
    lift = np.radians(lift_deg)
    came = part.place.rotation @ np.array([np.cos(lift), 0.0, np.sin(lift)])
    part.points = [
        replace(one, direction=came) if one.feature == "EDGE" else one for one in part.points
    ]
    return part


def everything(part: KnownPart, points: Sequence[MeasuredPoint]) -> dict[str, ActualFeature]:
    found = actual_features(part.nominals, points)
    found |= constructed_features(EDGES, found, {})
    for item in found.values():
        if isinstance(item, FitError):
            raise item
    return {k: v for k, v in found.items() if isinstance(v, ActualFeature)}


@pytest.mark.parametrize("lift_deg", [0.0, 20.0, -35.0])
def test_an_edge_lies_in_the_face_wherever_the_ball_touched_and_came_from(lift_deg: float) -> None:
    part = sheet(lift_deg=lift_deg)
    actual = everything(part, part.points)
    back = part.place.inverse()
    spot = back.apply(actual["SPOT"].fit.geometry[POINT])
    # A slant of 35 degrees would move a line that is compensated along it by 0.3 mm.
    assert spot[[0, 2]] == pytest.approx([30.0, 0.0], abs=1e-9)
    along = back.rotation @ actual["TRIM"].fit.direction
    assert abs(along[1]) == pytest.approx(1.0, abs=1e-12)
    # Heights are no form of the edge.
    assert abs(actual["EDGE"].fit.residuals).max() < 1e-9


def test_an_edge_moves_with_every_touch_as_a_new_fit_does() -> None:
    rng = np.random.default_rng(6)
    part = sheet((0.4, 0.9, 1.4, 2.1))
    points = part.points
    for i in range(3 * len(points)):
        points = nudged(points, i, 0.004 * rng.normal())
    count, normal = len(points), part.place.rotation[:, 0]
    jacobian = everything(part, points)["TRIM"].jacobian.dense(count)
    for i in range(3 * count + 1):
        ends = [
            everything(part, nudged(points, i, by))["TRIM"].fit.geometry for by in (1e-4, -1e-4)
        ]
        slope = (ends[0] - ends[1]) / 2e-4
        # Across the edge, and its turn in the face over 10 mm.
        for part_of, arm in ((POINT, 1.0), (DIRECTION, 10.0)):
            off = arm * (slope - jacobian[:, i])[part_of] @ normal
            assert off == pytest.approx(0.0, abs=1e-3), i


@pytest.mark.parametrize(
    ("part", "words"),
    [
        (sheet((1.0, 1.0, -0.4, 1.0)), "0.40 mm beyond"),
        (sheet((1.0, 1.0, 3.1, 1.0)), "0.70 mm beyond"),
        (sheet(lift_deg=75.0), "approached from above"),
    ],
)
def test_no_edge_from_a_corner_or_from_above(part: KnownPart, words: str) -> None:
    with pytest.raises(FitError, match=words) as caught:
        everything(part, part.points)
    assert caught.value.remedy


def test_no_edge_from_one_place() -> None:
    part = sheet()
    points = [
        replace(one, tip_world=part.points[12].tip_world) if one.feature == "EDGE" else one
        for one in part.points
    ]
    with pytest.raises(FitError, match=r"0\.00 mm from each other"):
        everything(part, points)


def test_an_edge_needs_the_thickness_of_its_sheet() -> None:
    edge = sheet().nominals[2]
    assert shape_fault(edge) is None
    fault = shape_fault(msgspec.structs.replace(edge, width=0.0))
    assert fault is not None
    assert fault[0] == "width"


def with_shared_errors(count: int) -> PointFactors:
    """Return own errors of 3 um; a radius, and three errors of all points, of 2 um each."""
    shared = np.zeros((3 * count + 1, 4))
    shared[:-1, :3] = np.tile(0.002 * np.eye(3), (count, 1))
    shared[-1, 3] = 0.002
    return PointFactors(shared, np.tile(0.003**2 * np.eye(3), (count, 1, 1)))


CHARACTERISTICS = [
    asked("thickness", "TOP,BELOW", nominal=THICK, lower=-0.1),
    asked("distance", "SPOT,WALL", name="trim", nominal=30.0, lower=-0.1),
]


def test_u_of_thickness_and_edge_holds_the_truth(repeats: Callable[..., int]) -> None:
    """Form of 4 um, own and shared errors; the edge is held against a wall 30 mm away."""
    runs = repeats(80, RUNS, 40)
    part = sheet((1.0, 1.6, 0.7, 1.2, 1.1, 1.5), lift_deg=15.0)
    part.add("WALL", Shape.PLANE, walled(), direction=(1, 0, 0))
    exact, count = part.points, len(part.points)
    factors = with_shared_errors(count)
    draw, rng = factors.draws(), np.random.default_rng(12)
    held = np.zeros(2)
    for _ in range(runs):
        (moves,) = draw(rng, 1)
        shifts = moves[:-1].reshape(-1, 3)
        form = 0.004 * rng.normal(size=count)
        points = [
            replace(one, tip_world=one.tip_world + shift + by * one.direction)
            for one, shift, by in zip(exact, shifts, form, strict=True)
        ]
        # The true ball is greater than its record.
        points = [
            replace(one, tip_world=one.tip_world + moves[-1] * true.direction)
            for one, true in zip(points, touched(part), strict=True)
        ]
        actual = everything(part, points)
        results = evaluate_all(CHARACTERISTICS, None, actual, factors, "simple")
        for i, (result, true) in enumerate(zip(results, (THICK, 30.0), strict=True)):
            assert result.measured is not None, result.note
            assert result.uncertainty is not None
            held[i] += abs(result.measured - true) <= result.uncertainty
    # Three standard errors of the runs about 95.5 %.
    away = looser(0.026, runs, RUNS)
    assert held / runs == pytest.approx([0.955, 0.955], abs=away)


def walled() -> tuple[Float, Float]:
    y, z = (a.ravel() for a in np.meshgrid([-9.0, 0.0, 9.0], [-1.9, -1.0, -0.3]))
    return np.stack([np.zeros(9), y, z], axis=1), np.tile([1.0, 0.0, 0.0], (9, 1))


def touched(part: KnownPart) -> list[MeasuredPoint]:
    """Return the touches with the true normals of their surfaces."""
    square = part.place.rotation[:, 0]
    return [replace(one, direction=square) if one.feature == "EDGE" else one for one in part.points]


def test_a_thickness_counts_the_ball_twice_and_shared_errors_not_at_all() -> None:
    part = sheet()
    found = evaluate(CHARACTERISTICS[0], part.actual(), None)
    assert found.value == pytest.approx(THICK, abs=1e-9)
    assert found.gradient.by_radius == pytest.approx(-2.0, abs=1e-6)
    assert abs(found.gradient.by_points.sum(axis=0)).max() < 1e-6
    assert "2.400 to 2.400 mm" in found.note


def _tilted(degrees: float) -> tuple[Float, Float]:
    surface, normals = side(-THICK)
    turn = motion(20.0, 0.0, -THICK, 0.0, np.radians(degrees), 0.0)
    away = surface - [20.0, 0.0, -THICK]
    return turn.apply(away), normals @ turn.rotation.T


@pytest.mark.parametrize(
    ("below", "words"),
    [
        (_tilted(1.6), r"not parallel: 1\.6°"),
        ((side(-THICK)[0], -side(-THICK)[1]), "face the same way"),
        (side(THICK), "no material lies between"),
        (side(-THICK, at=60.0), "40.0 mm apart along the sheet"),
    ],
)
def test_no_thickness_of_what_is_no_sheet(below: tuple[Float, Float], words: str) -> None:
    part = KnownPart().add("TOP", Shape.PLANE, side(0.0)).add("BELOW", Shape.PLANE, below)
    with pytest.raises(FitError, match=words) as caught:
        evaluate(CHARACTERISTICS[0], part.actual(), None)
    assert caught.value.remedy


def test_the_thickness_of_a_wedge_is_that_amid_the_touches() -> None:
    part = KnownPart().add("TOP", Shape.PLANE, side(0.0)).add("BELOW", Shape.PLANE, _tilted(0.8))
    places = np.concatenate([side(0.0)[0], _tilted(0.8)[0]])
    slope = np.tan(np.radians(0.8))
    # The lower side falls along x about x = 20; half of its tilt shortens the path by its square.
    expected = THICK + slope * float(places[:, 0].mean() - 20.0)
    found = evaluate(CHARACTERISTICS[0], part.actual(), None)
    assert found.value == pytest.approx(expected, abs=3e-4)
    low, high = (float(word) for word in re.findall(r"[0-9]\.[0-9]{3}", found.note)[:2])
    over = THICK + slope * (places[:, 0] - 20.0)
    assert [low, high] == pytest.approx([over.min(), over.max()], abs=1e-3)


def test_form_of_an_edge_is_that_across_it() -> None:
    part = sheet((0.3, 2.0, 0.9, 1.4, 0.5, 1.8))
    across = part.place.rotation[:, 0]
    waves = iter([0.01, -0.02, 0.015, 0.0, -0.01, 0.02])
    points = [
        replace(one, tip_world=one.tip_world + next(waves) * across)
        if one.feature == "EDGE"
        else one
        for one in part.points
    ]
    edge = everything(part, points)["EDGE"]
    tiny = PointFactors(np.zeros((3 * len(points) + 1, 0)), np.tile(1e-12 * np.eye(3), (18, 1, 1)))
    (sample,) = form_samples({"EDGE": edge}, tiny)
    assert edge.fit.residuals @ edge.fit.residuals > 5e-4
    assert sample.degrees == 4
    assert sample.variance == pytest.approx(edge.fit.residuals @ edge.fit.residuals / 4, rel=1e-6)
    assert abs(sample.normals[:, :, 0] @ across) == pytest.approx(np.ones(6), abs=1e-4)


def test_two_point_thickness_is_of_opposite_touches_and_never_a_gap() -> None:
    least = asked("thickness", "TOP,BELOW", association="two-point minimum")
    surface, normals = side(-THICK)
    surface[2, 2] += 0.05
    part = KnownPart().add("TOP", Shape.PLANE, side(0.0))
    part.add("BELOW", Shape.PLANE, (surface, normals))
    assert evaluate(least, part.actual(), None).value == pytest.approx(THICK - 0.05, abs=1e-3)
    gap = KnownPart().add("TOP", Shape.PLANE, side(0.0)).add("BELOW", Shape.PLANE, side(THICK))
    with pytest.raises(FitError, match="no material lies between"):
        evaluate(least, gap.actual(), None)


def test_exactly_equal_directions_are_no_sheet() -> None:
    part = KnownPart(motion(0.0, 0.0, 0.0)).add("TOP", Shape.PLANE, side(0.0))
    part.add("BELOW", Shape.PLANE, (side(0.0)[0] - [0.0, 0.0, THICK], side(0.0)[1]))
    with pytest.raises(FitError, match="face the same way"):
        evaluate(CHARACTERISTICS[0], part.actual(), None)


@pytest.mark.parametrize(
    ("direction", "point", "fails"),
    [
        ((0, 0, 1), (0, 0, -2), True),
        ((0, 0, -1), (0, 0, 2), True),
        ((0, 0.1, -1), (0, 0, -2), True),
        ((0, 0, -1), (0, 0, -2), False),
    ],
)
def test_a_plan_with_two_planes_that_are_no_sheet_is_refused(
    direction: tuple[float, float, float], point: tuple[float, float, float], fails: bool
) -> None:
    top, below = sheet().nominals[:2]
    below = msgspec.structs.replace(below, direction=direction, point=point)
    nominals = {one.name: nominal_geometry(one) for one in (top, below)}
    shapes = dict.fromkeys(nominals, Shape.PLANE)
    fault = characteristic_fault(CHARACTERISTICS[0], shapes, nominals, list(shapes), aligned=False)
    assert (fault is not None) == fails
    if fault is not None:
        assert fault[0] == "features"


def test_no_thickness_that_varies_over_the_touched_places() -> None:
    """Half a degree over 60 mm is 0.5 mm of a sheet of 2.4 mm."""
    surface, normals = side(-THICK, size=60.0)
    turn = motion(20.0, 0.0, -THICK, 0.0, np.radians(0.5), 0.0)
    below = turn.apply(surface - [20.0, 0.0, -THICK]), normals @ turn.rotation.T
    part = KnownPart().add("TOP", Shape.PLANE, side(0.0, size=60.0))
    part.add("BELOW", Shape.PLANE, below)
    with pytest.raises(FitError, match="varies by"):
        evaluate(CHARACTERISTICS[0], part.actual(), None)


def behind(limit: float) -> NominalFeature:
    return msgspec.structs.replace(sheet().nominals[0], sheet=THICK, sheet_limit=limit)


def test_the_other_side_of_a_bent_tube_is_thinner() -> None:
    tube = shape_nominal("TUBE", Shape.TORUS, "outer")
    points = shape_touches("TUBE", Shape.TORUS, "outer", PLACES[1])
    for sheet_mm in (0.0, 0.5):
        behind_it = msgspec.structs.replace(tube, sheet=sheet_mm, sheet_limit=0.1 * sheet_mm)
        assert shape_fault(behind_it) is None
        found = actual_features([behind_it], points)["TUBE"]
        assert isinstance(found, ActualFeature)
        assert found.fit.second == pytest.approx(SECOND - sheet_mm, abs=1e-9)
        assert found.fit.radius == pytest.approx(RADIUS, abs=1e-9)


@pytest.mark.parametrize("shape", [Shape.PLANE, Shape.CYLINDER])
def test_the_other_side_of_a_sheet_is_where_it_lies(shape: Shape) -> None:
    part = KnownPart(PLACES[1])
    probed = side(0.0) if shape is Shape.PLANE else ring(motion(0, 0, 0), 40.0, (-5.0, 5.0))
    size = 80.0 if shape is Shape.CYLINDER else 0.0
    part.add("IT", shape, probed, diameter=size, sheet=THICK, sheet_limit=0.1)
    fit = part.actual()["IT"].fit
    if shape is Shape.CYLINDER:
        assert fit.radius == pytest.approx(40.0 - THICK, abs=1e-9)
    else:
        assert part.place.inverse().apply(fit.point)[2] == pytest.approx(-THICK, abs=1e-9)


def test_the_limit_of_a_sheet_is_in_the_u_of_its_other_side_alone() -> None:
    plan = Plan(
        schema="ocmm.plan/1", unit="mm", name="P", part="P", characteristics=[],
        features=[behind(0.1), sheet().nominals[1]],
    )  # fmt: skip
    (share,) = plan.common_uncertainties
    assert isinstance(share, FeatureUncertainty)
    points = sheet().points[:12]
    part = share.contribution(points)
    exact = actual_features(plan.features, points)
    top, below = exact["TOP"], exact["BELOW"]
    assert isinstance(top, ActualFeature)
    assert isinstance(below, ActualFeature)
    # Uniform within 0.1 mm, common to all points; none of it in the side that was touched itself.
    along = top.fit.direction @ top.jacobian[POINT]
    variance = part.covariance_of(along[None])[0, 0]
    assert np.sqrt(variance) == pytest.approx(0.1 / np.sqrt(3.0), rel=1e-9)
    assert np.all(part.covariance_of(below.jacobian[POINT]) == 0.0)
    assert part.source.name == "Sheet of TOP"


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"sheet_limit": 0.0}, "sheet_limit"),
        ({"sheet": 0.0}, "sheet_limit"),
        ({"sheet": -1.0}, "sheet_limit"),
        ({"shape": Shape.LINE}, "sheet"),
    ],
)
def test_a_sheet_needs_its_limit(changed: dict[str, object], field: str) -> None:
    assert shape_fault(behind(0.1)) is None
    fault = shape_fault(msgspec.structs.replace(behind(0.1), **changed))
    assert fault is not None
    assert fault[0] == field


def test_a_point_behind_a_sheet_needs_the_direction_of_the_plan() -> None:
    point = msgspec.structs.replace(behind(0.1), shape=Shape.POINT)
    fault = step_fault(point, "approach")
    assert fault is not None
    assert fault[0] == "compensation"
    assert step_fault(point, "nominal") is None
