"""Values and gradients of characteristics of a part with exact geometry."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
import pytest
from msgspec.structs import replace

from ocmm_core.alignment import DatumAlignment
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector
from ocmm_core.measuring import MeasuredPoint, factors_of_matrix
from ocmm_core.tolerances.decisions import Verdict, evaluate_all
from ocmm_core.tolerances.kinds import evaluate, geometry_value
from ocmm_core.tolerances.uncertainty import noise_floor
from ocmm_core.tolerances.uncertainty._spread import Extent
from ocmm_core.tolerances.zones import Characteristic, Evaluation
from tests.core.features.exact_touches import (
    flat_touches,
    moved,
    nominal,
    nudged,
    round_touches,
    touches,
)

T_WORLD_FROM_PART = RigidTransform(
    rotation_from_vector(np.array([0.4, -0.7, 1.1])), np.array([120.0, -80.0, 950.0])
)
RULE = DatumAlignment(primary="top", secondary=("a", "b"), origin="a")
FEATURES = [
    nominal("top", Shape.PLANE),
    nominal("step", Shape.PLANE),
    nominal("a", Shape.CIRCLE, 12.0, "inner", projection="top"),
    nominal("b", Shape.CIRCLE, 8.0, "inner", projection="top"),
    nominal("ball", Shape.SPHERE, 19.989),
    nominal("pin", Shape.CYLINDER, 16.0),
    nominal("dot", Shape.POINT),
]


def _part() -> list[MeasuredPoint]:
    """Return exact touches of the part: bores at 0 and 60 mm in x, a ball, a step, a pin."""

    def at(x: float, y: float, z: float) -> RigidTransform:
        return T_WORLD_FROM_PART.compose(RigidTransform(np.eye(3), np.array([x, y, z])))

    points = flat_touches("top", at(30.0, 10.0, 0.0))
    points += flat_touches("step", at(30.0, 90.0, 20.34), size=40.0)
    for name, x, diameter in (("a", 0.0, 12.0), ("b", 60.0, 8.0)):
        bore = round_touches(name, Shape.CIRCLE, diameter, "inner", at(x, 0.0, -2.0), n=7)
        depth = np.outer(np.sin(np.arange(7.0)), T_WORLD_FROM_PART.rotation[:, 2])
        points += moved(bore, depth)
    points += round_touches("ball", Shape.SPHERE, 19.989, "outer", at(25.0, 40.0, 30.0))
    points += round_touches("pin", Shape.CYLINDER, 16.0, "outer", at(-50.0, 20.0, 15.0))
    points += touches("dot", at(5.0, 6.0, 7.0).translation[None], T_WORLD_FROM_PART.rotation[2:])
    return points


POINTS = _part()


def _actual(
    points: Sequence[MeasuredPoint], features: Sequence[NominalFeature] = FEATURES
) -> dict[str, ActualFeature]:
    found = actual_features(features, points)
    return {name: item for name, item in found.items() if isinstance(item, ActualFeature)}


def _characteristic(
    kind: Literal["diameter", "distance", "coordinate", "form"],
    features: Sequence[str],
    axis: Literal["", "x", "y", "z"] = "",
    target: float = 0.0,
) -> Characteristic:
    return Characteristic(
        name="it",
        kind=kind,
        features=list(features),
        nominal=target,
        lower=-0.1,
        upper=0.1,
        axis=axis,
    )


KNOWN = [
    (_characteristic("diameter", ["ball"]), 19.989),
    (_characteristic("diameter", ["a"]), 12.0),
    (_characteristic("diameter", ["pin"]), 16.0),
    (_characteristic("distance", ["a", "b"]), 60.0),
    (_characteristic("distance", ["step", "top"]), 20.34),
    (_characteristic("distance", ["top", "step"]), 20.34),
    (_characteristic("distance", ["ball", "top"]), 30.0),
    (_characteristic("distance", ["top", "ball"]), 30.0),
    (_characteristic("distance", ["dot", "ball"]), float(np.linalg.norm([20.0, 34.0, 23.0]))),
    (_characteristic("coordinate", ["ball"], "x"), 25.0),
    (_characteristic("coordinate", ["ball"], "y"), 40.0),
    (_characteristic("coordinate", ["ball"], "z"), 30.0),
    (_characteristic("coordinate", ["b"], "x"), 60.0),
    (_characteristic("coordinate", ["pin"], "y"), 20.0),
    (_characteristic("coordinate", ["dot"], "z"), 7.0),
]


def _name(value: object) -> str:
    if isinstance(value, Characteristic):
        return "-".join([value.kind, *value.features, value.axis])
    return ""


@pytest.mark.parametrize(("characteristic", "truth"), KNOWN, ids=_name)
def test_exact_touches_give_the_true_value(characteristic: Characteristic, truth: float) -> None:
    assert evaluate(characteristic, _actual(POINTS), RULE).value == pytest.approx(truth, abs=1e-9)


@pytest.fixture(scope="module")
def differences() -> Float:
    """Return d(value of every exact characteristic) / d(all coordinates, tip radius)."""
    step = 1e-4
    columns = []
    whole = _actual(POINTS)
    shapes = {name: item.fit.shape for name, item in whole.items()}
    for i in range(3 * len(POINTS) + 1):
        sides = []
        touched = FEATURES
        if i < 3 * len(POINTS):
            # A point moves its own feature, and features projected onto it.
            own = POINTS[i // 3].feature
            moves = [item for item in FEATURES if own in (item.name, item.projection)]
            names = {item.name for item in moves} | {item.projection for item in moves}
            touched = [item for item in FEATURES if item.name in names]
        for by in (step, -step):
            actual = whole | _actual(nudged(POINTS, i, by), touched)
            geometries = {name: item.fit.geometry for name, item in actual.items()}
            sides.append([geometry_value(c, geometries, shapes, RULE) for c, _ in KNOWN])
        columns.append((np.array(sides[0]) - np.array(sides[1])) / (2.0 * step))
    return np.array(columns).T


@pytest.mark.parametrize("index", range(len(KNOWN)), ids=lambda i: _name(KNOWN[i][0]))
def test_gradient_through_fit_compensation_and_alignment(index: int, differences: Float) -> None:
    gradient = evaluate(KNOWN[index][0], _actual(POINTS), RULE).gradient.dense(len(POINTS))
    # Exact data: what remains is the curvature over the step, 1e-4 mm on some mm.
    assert gradient == pytest.approx(differences[index], abs=1e-4)
    assert np.abs(gradient).max() > 0.05


@pytest.mark.parametrize(("name", "by_radius"), [("ball", -2.0), ("a", 2.0)])
def test_the_ball_counts_twice_in_a_diameter(name: str, by_radius: float) -> None:
    gradient = evaluate(_characteristic("diameter", [name]), _actual(POINTS), RULE).gradient
    assert gradient.by_radius == pytest.approx(by_radius, abs=1e-9)


def test_the_ball_cancels_in_a_step_and_not_in_a_height_over_a_face() -> None:
    actual = _actual(POINTS)
    step = evaluate(_characteristic("distance", ["step", "top"]), actual, RULE).gradient
    assert step.by_radius == pytest.approx(0.0, abs=1e-6)
    height = evaluate(_characteristic("distance", ["ball", "top"]), actual, RULE).gradient
    assert height.by_radius == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("name", ["top", "a", "ball", "pin"])
def test_a_form_and_its_gradient(name: str) -> None:
    rng = np.random.default_rng(3)
    own = next(item for item in FEATURES if item.name == name)
    features = [item for item in FEATURES if item.name in (name, own.projection)]
    names = {item.name for item in features}
    needed = [point for point in POINTS if point.feature in names]
    points = moved(needed, rng.normal(0.0, 0.005, (len(needed), 3)))
    by_least_squares = replace(_characteristic("form", [name]), association="least squares")
    evaluation = evaluate(by_least_squares, _actual(points, features), None)
    assert evaluation.value == pytest.approx(np.ptp(_actual(points, features)[name].fit.residuals))
    gradient, step = evaluation.gradient.dense(len(points)), 1e-5
    for i in range(3 * len(points) + 1):
        sides = [_actual(nudged(points, i, by), features)[name].fit.form for by in (step, -step)]
        # First order in residuals of 0.005 mm on a radius of 6 mm, thus 0.1 %, some fold.
        assert gradient[i] == pytest.approx((sides[0] - sides[1]) / (2 * step), abs=0.01)


@pytest.mark.parametrize(("name", "axis"), [("b", "y"), ("a", "x"), ("a", "y")])
def test_what_the_frame_is_made_of_is_no_measurement(name: str, axis: Literal["x", "y"]) -> None:
    with pytest.raises(FitError, match="fixed by the part frame itself"):
        evaluate(_characteristic("coordinate", [name], axis), _actual(POINTS), RULE)


@pytest.mark.parametrize("association", ["least squares", "minimum zone"])
def test_the_floor_is_the_form_that_a_perfect_sphere_shows(
    association: Literal["least squares", "minimum zone"],
) -> None:
    rng = np.random.default_rng(4)
    sigma = 0.004
    points = [point for point in POINTS if point.feature == "ball"]
    covariance = np.diag(np.append(np.full(3 * len(points), sigma**2), 0.0))
    item = replace(_characteristic("form", ["ball"]), association=association)

    def form_of(scatter: float) -> Evaluation:
        noise = rng.normal(0.0, scatter, (len(points), 3))
        return evaluate(item, _actual(moved(points, noise)), None)

    noise = form_of(1e-6).noise
    assert noise is not None
    forms = [form_of(sigma).value for _ in range(60)]
    # Means of 60 and of 100 ranges that scatter by some 25 %.
    errors = factors_of_matrix(covariance).of_deviations(noise.by_coordinates)
    floor = noise_floor(noise, Extent(0.0, sigma, noise.deviations, errors))
    assert floor == pytest.approx(np.mean(forms), rel=0.1)


def test_results_of_a_plan() -> None:
    sigma = 0.01
    covariance = np.diag(np.append(np.full(3 * len(POINTS), sigma**2), 0.002**2))
    actual = actual_features(FEATURES, POINTS)
    wanted = [
        _characteristic("diameter", ["ball"], target=19.989),
        _characteristic("coordinate", ["ball"], "z", target=29.8),
        _characteristic("form", ["top"]),
    ]
    known = factors_of_matrix(covariance)
    size, height, flat = evaluate_all(wanted, RULE, actual, known, "iso14253-1")
    assert size.uncertainty is not None
    gradient = evaluate(wanted[0], _actual(POINTS), RULE).gradient.dense(len(POINTS))
    assert size.uncertainty == pytest.approx(2.0 * np.sqrt(gradient @ covariance @ gradient))
    assert size.verdict is Verdict.CONFORM
    assert height.deviation == pytest.approx(0.2)
    assert height.verdict is Verdict.NOT_CONFORM
    assert "Noise floor" in flat.note

    ball_known_badly = covariance.copy()
    ball_known_badly[-1, -1] = 0.1**2
    known = factors_of_matrix(ball_known_badly)
    worse = evaluate_all(wanted[:1], RULE, actual, known, "iso14253-1")[0]
    assert worse.uncertainty == pytest.approx(2.0 * np.hypot(0.2, size.uncertainty / 2.0), rel=1e-3)
    assert worse.verdict is Verdict.NOT_PROVEN


def test_what_cannot_be_stated_says_why() -> None:
    n = 3 * len(POINTS) + 1
    actual = actual_features(FEATURES, POINTS)
    size = _characteristic("diameter", ["ball"])
    height = _characteristic("coordinate", ["ball"], "z")

    def only(characteristic: Characteristic, covariance: Float | None) -> tuple[Verdict, str]:
        known = None if covariance is None else factors_of_matrix(covariance)
        result = evaluate_all([characteristic], RULE, actual, known, "iso14253-1")[0]
        assert result.measured is None
        assert result.uncertainty is None
        return result.verdict, result.note

    verdict, note = only(size, None)
    assert verdict is Verdict.NOT_MEASURED
    assert note.startswith("No uncertainty")
    assert "not a finite number" in only(size, np.full((n, n), np.nan))[1]
    assert "not a finite number" in only(size, -np.eye(n))[1]
    assert "uncertainty is zero" in only(size, np.zeros((n, n)))[1]
    few = "b needs at least 3 points (2 taken)."
    actual["b"] = FitError("feature.too_few_points", few, "Go on.")
    assert only(height, np.eye(n))[1] == few
    actual = actual_features(FEATURES, POINTS)
    del actual["top"]
    assert "needs top, which is not measured" in only(height, np.eye(n))[1]


def test_features_in_one_place_have_no_distance() -> None:
    actual = _actual(POINTS)
    actual["twin"] = actual["ball"]
    with pytest.raises(FitError, match="coincide"):
        evaluate(_characteristic("distance", ["ball", "twin"]), actual, None)


def test_as_few_points_as_the_shape_needs_show_no_form() -> None:
    points = [p for p in POINTS if p.feature != "top"] + [p for p in POINTS if p.feature == "top"][
        :3
    ]
    with pytest.raises(FitError, match="top has 3 points; form of a plane needs at least 4"):
        evaluate(_characteristic("form", ["top"]), _actual(points), None)


def test_a_coordinate_without_a_frame() -> None:
    with pytest.raises(FitError, match="the plan has no alignment"):
        evaluate(_characteristic("coordinate", ["ball"], "x"), _actual(POINTS), None)
