"""Angles of axes through a right angle, near zero, and cases without a side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from ocmm_core.alignment import BoundAlignment, DatumAlignment, DatumReferenceFrame
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import Shape, nominal_geometry
from ocmm_core.measuring import Rows, factors_of_matrix
from ocmm_core.tolerances.decisions import evaluate_all
from ocmm_core.tolerances.kinds import evaluate, involved_features
from ocmm_core.tolerances.uncertainty import expanded
from ocmm_core.tolerances.uncertainty._interval import Length
from tests.core.features.exact_touches import moved
from tests.core.tolerances.known_part import KnownPart, asked, face, motion, ring

pytestmark = pytest.mark.numerics

DATUMS = DatumReferenceFrame(datums=("top", "left", "front"))
RULES = (DATUMS, DatumAlignment(primary="top", secondary=("left",), origin="up"))


@lru_cache(maxsize=8)
def part(off_deg: float) -> KnownPart:
    """Return a part with bores tilted by this angle: one along the top, one near an upright one."""
    lean = np.deg2rad(off_deg)
    made = KnownPart()
    made.add("top", Shape.PLANE, face(motion(0, 0, 0)))
    made.add("left", Shape.PLANE, face(motion(-50, 0, -20, 0, -np.pi / 2, 0)),
             point=(-50, 0, -20), direction=(-1, 0, 0))  # fmt: skip
    made.add("front", Shape.PLANE, face(motion(0, -50, -20, np.pi / 2, 0, 0)),
             point=(0, -50, -20), direction=(0, -1, 0))  # fmt: skip
    along = motion(30, 0, -10).compose(motion(0, 0, 0, -np.pi / 2 + lean, 0, 0))
    for name, T, direction in (
        ("up", motion(10, 0, -20), (0, 0, 1)),
        ("along", along, (0, 1, 0)),
        ("beside", motion(40, 20, -20, lean, 0, 0), (0, 0, 1)),
    ):
        made.add(name, Shape.CYLINDER, ring(T, 6.0, (-15, 0, 15), inner=True),
                 point=tuple(T.translation.tolist()), direction=direction, diameter=12.0,
                 side="inner")  # fmt: skip
    return made


def bound(rule: object, actual: Mapping[str, ActualFeature]) -> BoundAlignment:
    assert isinstance(rule, (DatumReferenceFrame, DatumAlignment))
    return BoundAlignment(
        rule,
        {name: item.fit.shape for name, item in actual.items()},
        {name: nominal_geometry(item.nominal) for name, item in actual.items()},
    )


@pytest.mark.parametrize("rule", RULES, ids=("datums", "3-2-1"))
@pytest.mark.parametrize(
    ("features", "nominal", "way"),
    [
        ("up,along", 90.0, -1.0),
        ("along,up", 90.0, -1.0),
        ("along,top", 0.0, 1.0),
        ("top,along", 180.0, -1.0),
        ("along,left", 0.0, 0.0),
    ],
)
def test_the_plan_says_on_which_side_of_a_right_angle_it_is(
    rule: object, features: str, nominal: float, way: float
) -> None:
    for off in (-0.05, 0.0, 0.05):
        actual = part(off).actual()
        item = asked("angle", features, nominal=nominal, lower=0.0)
        found = evaluate(item, actual, bound(rule, actual))
        assert found.value == pytest.approx(nominal + way * off, abs=1e-9)
        assert found.frame == ""
    # It rests on the alignment for its side alone.
    names = involved_features(item, bound(rule, actual))
    assert set(features.split(",")) < set(names)


@pytest.mark.parametrize("features", ["up,along", "along,top", "up,beside"])
def test_the_gradient_runs_through_the_right_angle(features: str) -> None:
    made = part(0.0)
    rng = np.random.default_rng(5)
    noise, way = (rng.normal(size=(len(made.points), 3)) for _ in range(2))
    item = asked("angle", features, nominal=90.0 if features == "up,along" else 0.0)

    def of(by: float) -> tuple[float, Rows]:
        points = moved(made.points, 0.005 * noise + by * way)
        actual = made.actual([replace(p, tip_radius=p.tip_radius + by) for p in points])
        found = evaluate(item, actual, bound(DATUMS, actual))
        return found.value, found.gradient

    step = 1e-6
    slope = float(of(0.0)[1] @ np.append(way.ravel(), 1.0))
    # First order in residuals of 0.005 mm on 6 mm.
    assert slope == pytest.approx((of(step)[0] - of(-step)[0]) / (2.0 * step), rel=0.01)


@pytest.mark.statistics
def test_u_holds_the_angle_at_and_through_the_places_without_a_side() -> None:
    """At exactly 90 degrees between bores and exactly none, 60 noisy parts each."""
    made = part(0.0)
    rng = np.random.default_rng(8)
    sigma = 0.005
    noise = np.append(np.full(3 * len(made.points), sigma**2), 0.0)
    factors = factors_of_matrix(np.diag(noise))
    square = asked("angle", "up,along", nominal=90.0, name="square")
    level = asked("angle", "up,beside", nominal=0.0, lower=-0.1, name="level")
    clean = made.actual()
    frame = bound(DATUMS, clean)
    held = [0, 0]
    beyond = 0
    for _ in range(60):
        actual = made.actual(moved(made.points, sigma * rng.normal(size=(len(made.points), 3))))
        results = evaluate_all([square, level], frame, dict(actual), factors, "iso14253-1")
        for place, (result, truth) in enumerate(zip(results, (90.0, 0.0), strict=True)):
            assert result.measured is not None
            assert result.uncertainty is not None
            held[place] += abs(result.measured - truth) <= result.uncertainty
            beyond += place == 0 and result.measured > 90.0
    # Three standard errors of 60 at 95 %: 8.5 %; and an equal number above and below.
    assert min(held) / 60 > 0.95 - 0.085
    assert 0.5 - 0.2 < beyond / 60 < 0.5 + 0.2


def test_an_angle_of_none_is_the_length_of_a_vector() -> None:
    found = evaluate(asked("angle", "up,beside", lower=-0.1), part(0.05).actual(), None)
    assert found.value == pytest.approx(0.05, abs=1e-9)
    assert found.components is not None
    assert found.component_gradients is not None
    assert float(np.linalg.norm(found.components)) == pytest.approx(0.05, abs=1e-9)
    spread = Length(found.components, 1e-4 * np.eye(2))
    assert expanded(spread, found.value) > 0.019


def test_without_a_frame_only_what_is_alike_on_both_sides_is_said() -> None:
    actual = part(0.05).actual()
    both = evaluate(asked("angle", "up,along", nominal=90.0, lower=-0.1), actual, None)
    assert both.value == pytest.approx(89.95, abs=1e-9)
    assert "side of the right angle is undefined" in both.note
    with pytest.raises(FitError, match="on which side of a right angle"):
        evaluate(asked("angle", "up,along", nominal=90.0), actual, None)
    with pytest.raises(FitError, match="on which side of a right angle"):
        evaluate(asked("angle", "up,along", nominal=88.0, lower=-2.0, upper=2.0), actual, None)
    leaning = evaluate(asked("angle", "beside,top", nominal=90.0), actual, bound(DATUMS, actual))
    assert leaning.value == pytest.approx(89.95, abs=1e-9)
    assert leaning.note.startswith("So near its end, noise shifts the angle in one direction only")
    with pytest.raises(FitError, match="has no sense at 90"):
        evaluate(asked("angle", "up,top", nominal=90.0), actual, bound(DATUMS, actual))


def test_directions_of_the_plan_that_do_not_mean_the_angle_are_left_aside() -> None:
    made = part(0.05)
    actual = made.actual()
    rule = bound(DATUMS, actual)
    # The plan states both bores as upright, or as another angle: that decides nothing.
    wrong = replace(rule, nominals={**rule.nominals, "along": rule.nominals["up"]})
    item = asked("angle", "up,along", nominal=90.0, lower=-0.1)
    assert evaluate(item, actual, wrong).value == pytest.approx(89.95, abs=1e-9)
    other = asked("angle", "up,along", nominal=60.0, lower=-40.0, upper=40.0)
    with pytest.raises(FitError, match="on which side"):
        evaluate(other, actual, rule)
