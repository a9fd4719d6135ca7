"""Datums after the first on a part whose faces are out of square: associated under the first."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from msgspec import structs
from scipy.optimize import minimize, minimize_scalar

from ocmm_core.alignment import (
    BoundAlignment,
    DatumReferenceFrame,
    in_precedence,
    part_frame,
    preview_alignment,
    refit_under_precedence,
)
from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import POINT, Shape, nominal_geometry
from ocmm_core.geometry import Float
from ocmm_core.measuring import Rows
from ocmm_core.tolerances.kinds import evaluate
from ocmm_core.tolerances.zones import Frames
from tests.core.features.exact_touches import (
    flat_touches,
    moved,
    nominal,
    round_touches,
    shape_nominal,
    shape_touches,
)
from tests.core.tolerances.known_part import PLACES, KnownPart, asked, face, motion, ring

LEAN = np.deg2rad(1.0)
"""The faces lean by this out of square to the top."""


def corner(criterion: str = "least squares") -> KnownPart:
    """Return a part with a top, two leaning faces, a leaning bore along the top, and a hole.

    Points of the faces lie higher on one side than on the other: a plane through them without a
    constraint shows another turn about the normal of the top than one square to it.
    """
    part = KnownPart()
    part.add("A", Shape.PLANE, face(motion(0, 0, 0), 80.0))
    rows = [0, 1, 3, 4, 7, 8]
    for name, T, at, normal in (
        ("B", motion(-50, 0, -20).compose(motion(0, 0, 0, 0, -np.pi / 2 - LEAN, 0)),
         (-50, 0, -20), (-1, 0, 0)),
        ("C", motion(0, -50, -20).compose(motion(0, 0, 0, np.pi / 2 - LEAN, 0, 0)),
         (0, -50, -20), (0, -1, 0)),
    ):  # fmt: skip
        surface, normals = face(T)
        part.add(name, Shape.PLANE, (surface[rows], normals[rows]), point=at, direction=normal,
                 criterion=criterion)  # fmt: skip
    along = motion(-20, 0, -15).compose(motion(0, 0, 0, -np.pi / 2 + 0.2 * LEAN, 0.0, 0.01))
    surface, normals = ring(along, 5.0, (-15, 0, 15), inner=True)
    part.add("X", Shape.CYLINDER, (surface[:31], normals[:31]), point=(-20, 0, -15),
             direction=(0, 1, 0), diameter=10.0, side="inner", criterion=criterion)  # fmt: skip
    part.add("H", Shape.CIRCLE, ring(motion(100, 80, -3), 6.0, inner=True), point=(100, 80, -3),
             diameter=12.0, side="inner")  # fmt: skip
    return part


@lru_cache(maxsize=8)
def noisy(criterion: str = "least squares", by: float = 0.0) -> dict[str, ActualFeature]:
    """Return the features with 0.01 mm of noise, and all coordinates moved ``by`` one way."""
    part = corner(criterion)
    rng = np.random.default_rng(3)
    noise, way = (rng.normal(0.0, 1.0, (len(part.points), 3)) for _ in range(2))
    points = moved(part.points, 0.01 * noise + by * way)
    return part.actual([replace(item, tip_radius=item.tip_radius + 0.5 * by) for item in points])


def along_the_way(gradient: Rows) -> Float:
    rng = np.random.default_rng(3)
    count = len(corner().points)
    rng.normal(size=(count, 3))
    answer: Float = gradient @ np.append(rng.normal(size=(count, 3)).ravel(), 0.5)
    return answer


def bound(datums: str, actual: dict[str, ActualFeature]) -> BoundAlignment:
    return BoundAlignment(
        DatumReferenceFrame(datums=tuple(datums)),
        {name: item.fit.shape for name, item in actual.items()},
        {name: nominal_geometry(item.nominal) for name, item in actual.items()},
    )


def tips(feature: ActualFeature) -> Float:
    assert feature.touches is not None
    return feature.touches.tips


def test_a_face_out_of_square_is_fitted_square_to_the_primary() -> None:
    """The direction is the one in which its own ball centres scatter least, as rotation about A."""
    actual = noisy()
    up = actual["A"].fit.direction
    across = np.cross(up, actual["B"].fit.direction)
    across /= np.linalg.norm(across)
    start = np.cross(across, up)
    arms = tips(actual["B"]) - tips(actual["B"]).mean(axis=0)

    def scatter(turn: float) -> float:
        return float(np.sum((arms @ (np.cos(turn) * start + np.sin(turn) * across)) ** 2))

    found = minimize_scalar(scatter, bounds=(-0.1, 0.1), method="bounded", options={"xatol": 1e-10})
    best = float(found.x)
    wanted = np.cos(best) * start + np.sin(best) * across
    frame = part_frame(bound("ABC", actual), actual)
    x = -frame.rotation[0]
    assert x == pytest.approx(wanted, abs=1e-7)
    # The result of the unconstrained plane, seen along the normal of A.
    free = start
    assert np.degrees(np.arccos(min(float(x @ free), 1.0))) > 0.2
    # The third datum passes through the middle of its points, independent of its tilt.
    middle = tips(actual["C"]).mean(axis=0) + 1.5 * frame.rotation[1]
    assert frame.apply(middle)[1] == pytest.approx(-50.0, abs=1e-9)


@pytest.mark.parametrize("criterion", ["minimum zone", "inscribed"])
def test_other_criteria_are_kept_under_the_constraint(criterion: str) -> None:
    """A zone has the smallest range that turning leaves; an inscribed bore the greatest radius."""
    name = "B" if criterion == "minimum zone" else "X"
    part = corner()
    points = moved(part.points, np.random.default_rng(3).normal(0.0, 0.01, (len(part.points), 3)))
    part.nominals = [
        type(item)(**{**{f: getattr(item, f) for f in item.__struct_fields__},
                      "criterion": criterion if item.name == name else item.criterion})
        for item in part.nominals
    ]  # fmt: skip
    actual = part.actual(points)
    rule = bound("A" + name, actual)
    held = in_precedence(("A", name), actual, rule.shapes, rule.nominals)[0].features[name]
    up, d0 = actual["A"].fit.direction, held.fit.direction
    assert float(up @ d0) == pytest.approx(0.0, abs=1e-12)
    across = np.cross(up, d0)
    arms = tips(actual[name]) - tips(actual[name]).mean(axis=0)

    def turned(turn: float) -> Float:
        return np.asarray(np.cos(turn) * d0 + np.sin(turn) * across)

    if name == "B":
        found = minimize_scalar(
            lambda turn: float(np.ptp(arms @ turned(turn))), bounds=(-0.05, 0.05),
            method="bounded", options={"xatol": 1e-10},
        )  # fmt: skip
        assert held.fit.form == pytest.approx(float(found.fun), abs=1e-6)
        return

    def smallest(p: Float) -> float:
        d = turned(0.01 * p[2])
        off = arms - p[0] * np.cross(d, up) - p[1] * up
        return -float(np.linalg.norm(off - np.outer(off @ d, d), axis=1).min())

    best = max(
        -minimize(smallest, start, method="Nelder-Mead",
                  options={"xatol": 1e-9, "fatol": 1e-12, "maxiter": 4000}).fun
        for start in np.random.default_rng(0).normal(0.0, 0.02, (6, 3))
    )  # fmt: skip
    assert held.raw is not None
    assert held.raw.radius >= best - 1e-6


@pytest.mark.parametrize("datums", ["ABC", "AXC", "CXA", "XAC"])
@pytest.mark.parametrize("criterion", ["least squares", "minimum zone"])
def test_the_chain_through_all_datums_is_that_of_the_whole_way(datums: str, criterion: str) -> None:
    """Place of the hole, and its position, by every coordinate and the ball."""
    item = asked("position", "H", ",".join(datums))
    step = 1e-5

    def of(by: float) -> tuple[Float, float]:
        actual = noisy(criterion, by)
        T = part_frame(bound(datums, actual), actual)
        return T.apply(actual["H"].fit.point), evaluate(item, actual, None).value

    actual = noisy(criterion)
    frame = Frames(actual, bound(datums, actual)).aligned("it")
    place = frame.T_frame_from_world.apply(actual["H"].fit.point)
    slopes = frame.point_derivative(place, actual["H"].jacobian[POINT])
    ahead, behind = of(step), of(-step)
    # Of first order in residuals, which the lean of the bore makes 0.05 mm on 5 mm.
    assert along_the_way(slopes) == pytest.approx((ahead[0] - behind[0]) / (2 * step), abs=0.05)
    by_value = along_the_way(evaluate(item, actual, None).gradient)
    assert by_value == pytest.approx((ahead[1] - behind[1]) / (2 * step), abs=0.1)


def test_a_square_part_is_aligned_as_before_and_the_report_shows_the_lean() -> None:
    actual = noisy()
    rule = bound("ABC", actual)
    again = refit_under_precedence(rule, actual)
    held = again.features
    assert held["A"] is actual["A"]
    assert abs(float(held["B"].fit.direction @ held["A"].fit.direction)) < 1e-12
    assert abs(float(held["C"].fit.direction @ held["B"].fit.direction)) < 1e-12
    # Its points lie higher on one side: a turn of 5 mrad over 40 mm.
    assert 0.1 < again.turned["B"] < 0.5
    assert again.turned["C"] == 0.0
    assert again.note.startswith("B leans: fitted under the preceding datums, it rotates by 0.")
    report = preview_alignment(rule, actual)
    assert report.advice[0] == again.note
    position = evaluate(asked("position", "H", "A,B,C"), actual, None)
    assert "B and C follow the orientation of the datums before (least squares)." in position.note
    assert position.note.endswith(again.note)
    angles = {item.feature: np.degrees(item.angle) for item in report.residuals}
    assert angles["A"] < 1e-9
    assert angles["B"] > 0.99
    assert report.T_part_from_world is not None
    frame = part_frame(rule, actual)
    assert np.array_equal(report.T_part_from_world.rotation, frame.rotation)


def test_datums_without_points_of_their_own_stay_as_they_are() -> None:
    actual = noisy()
    constructed = {**actual, "B": replace(actual["B"], touches=None, raw=None)}
    held = refit_under_precedence(bound("ABC", constructed), constructed).features
    assert held["B"] is constructed["B"]
    assert held["C"] is not constructed["C"]
    assert np.abs(held["C"].fit.direction - constructed["C"].fit.direction).max() > 1e-3
    assert held["H"] is constructed["H"]


@pytest.mark.parametrize("lies", ["upright", "along"])
@pytest.mark.parametrize(
    "shape", [Shape.CIRCLE, Shape.ELLIPSE, Shape.ROUND_SLOT, Shape.CONE, Shape.TORUS]
)
def test_every_shape_with_a_direction_follows_the_primary(shape: Shape, lies: str) -> None:
    """It is 2 mrad out of square to a plane, or out of its direction along it."""
    way, turn = ((0, 0, 1), 0.0) if lies == "upright" else ((0, 1, 0), -np.pi / 2)
    T = motion(60, 20, -10, turn + 2e-3, 1e-3, 0)
    touches = flat_touches("A", PLACES[0])
    if shape is Shape.CIRCLE:
        said = nominal("it", shape, 16.0)
        touches += round_touches("it", shape, 16.0, "outer", PLACES[0].compose(T))
    else:
        said = shape_nominal("it", shape, "outer")
        touches += shape_touches("it", shape, "outer", PLACES[0].compose(T))
    said = structs.replace(said, direction=way, point=(60.0, 20.0, -10.0))
    rng = np.random.default_rng(6)
    noise, change = (rng.normal(size=(len(touches), 3)) for _ in range(2))

    def of(by: float) -> tuple[ActualFeature, ActualFeature]:
        points = moved(touches, 0.003 * noise + by * change)
        points = [replace(item, tip_radius=item.tip_radius + 0.3 * by) for item in points]
        found = actual_features([nominal("A", Shape.PLANE), said], points)
        actual = {k: v for k, v in found.items() if isinstance(v, ActualFeature)}
        again, _ = in_precedence(
            ("A", "it"), actual, {k: v.fit.shape for k, v in actual.items()},
            {k: nominal_geometry(v.nominal) for k, v in actual.items()},
        )  # fmt: skip
        return actual["A"], again.features["it"]

    primary, held = of(0.0)
    cosine = abs(float(primary.fit.direction @ held.fit.direction))
    assert cosine == pytest.approx(1.0 if lies == "upright" else 0.0, abs=1e-12)
    step = 1e-6
    slope = (of(step)[1].fit.geometry - of(-step)[1].fit.geometry) / (2.0 * step)
    # First order in residuals of 0.02 mm on some 10 mm.
    assert held.jacobian @ np.append(change.ravel(), 0.3) == pytest.approx(slope, abs=0.01)
