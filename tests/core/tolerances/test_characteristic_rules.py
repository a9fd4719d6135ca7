"""What the values of characteristics are told with, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import Shape
from ocmm_core.tolerances.kinds import evaluate
from tests.core.tolerances.known_errors import RULE, measured
from tests.core.tolerances.known_part import KnownPart, asked, ball, face, motion, ring


@pytest.mark.parametrize(
    ("side", "modifier", "limit", "size", "bonus"),
    [
        ("inner", "maximum material", 11.9, 12.0, 0.1),
        ("inner", "maximum material", 12.0, 12.0, 0.0),
        ("inner", "maximum material", 12.1, 12.0, 0.0),
        ("inner", "least material", 12.1, 12.0, 0.1),
        ("inner", "least material", 11.9, 12.0, 0.0),
        ("outer", "maximum material", 12.1, 12.0, 0.1),
        ("outer", "maximum material", 11.9, 12.0, 0.0),
        ("outer", "least material", 11.9, 12.0, 0.1),
        ("outer", "", 0.0, 12.0, 0.0),
    ],
)
def test_bonus_of_material(
    side: str, modifier: str, limit: float, size: float, bonus: float
) -> None:
    part = KnownPart()
    part.add("top", Shape.PLANE, face(motion(0, 0, 0)))
    part.add("left", Shape.PLANE, face(motion(-50, 0, -20, 0, -np.pi / 2, 0)),
             point=(-50, 0, -20), direction=(-1, 0, 0))  # fmt: skip
    part.add("front", Shape.PLANE, face(motion(0, -50, -20, np.pi / 2, 0, 0)),
             point=(0, -50, -20), direction=(0, -1, 0))  # fmt: skip
    probed = ring(motion(60.03, 0.04, 0), size / 2.0, inner=side == "inner")
    part.add("it", Shape.CIRCLE, probed, point=(60, 0, 0), diameter=size, side=side)
    item = asked("position", "it", "top,left,front", modifier=modifier, material_size=limit)
    found = evaluate(item, part.actual(), None)
    assert found.value == pytest.approx(0.1, abs=1e-6)
    assert found.bonus == pytest.approx(bonus, abs=1e-9)
    if bonus > 0.0:
        assert found.bonus_gradient is not None
        # The ball's radius counts twice in the size, and so in the bonus.
        assert abs(found.bonus_gradient.by_radius) == pytest.approx(2.0, abs=1e-9)


def test_few_points_are_told_and_too_few_refused() -> None:
    part = KnownPart()
    surface, normals = face(motion(0, 0, 0))
    for count in (3, 6, 9):
        rows = [0, 2, 6, 8, 4, 1, 3, 5, 7][:count]
        part.add(f"plane {count}", Shape.PLANE, (surface[rows], normals[rows]))
    actual = part.actual()
    with pytest.raises(FitError, match="plane 3 has 3 points; form of a plane needs at least 4"):
        evaluate(asked("flatness", "plane 3"), actual, None)
    few = evaluate(asked("flatness", "plane 6"), actual, None)
    assert "Few points: plane 6 has 6 of 9 recommended" in few.note
    part.add("ball", Shape.SPHERE, ball(motion(0, 0, 50), 10.0), diameter=20.0)
    height = evaluate(asked("distance", "ball,plane 6"), part.actual(), None)
    assert height.note == "Form not evaluated: plane 6 has 6 of 9 recommended."
    assert evaluate(asked("flatness", "plane 9"), actual, None).note == ""


def test_points_that_are_not_in_sections_show_no_circular_runout() -> None:
    part = KnownPart()
    part.add("pin", Shape.CYLINDER, ring(motion(0, 0, 0), 10.0, (0, 20)), diameter=20.0)
    surface, normals = ring(motion(0, 0, 30), 8.0)
    spiral = surface + np.linspace(0.0, 20.0, 12)[:, None] * [0.0, 0.0, 1.0]
    part.add("spiral", Shape.CYLINDER, (spiral, normals), diameter=16.0)
    with pytest.raises(FitError, match="spiral are not in sections"):
        evaluate(asked("circular runout", "spiral", "pin"), part.actual(), None)
    total = evaluate(asked("total runout", "spiral", "pin"), part.actual(), None)
    assert total.value == pytest.approx(0.0, abs=1e-9)


def test_values_without_a_sense_are_refused() -> None:
    with pytest.raises(FitError, match="coincide"):
        evaluate(asked("distance", "pin,bent", axis="z"), level(), RULE)
    with pytest.raises(FitError, match="on which side of a right angle"):
        evaluate(asked("angle", "pin,edge", nominal=90.0), measured(), RULE)


def level() -> dict[str, ActualFeature]:
    """Return the features with the bent pin beside the straight one."""
    actual = dict(measured())
    actual["bent"] = actual["pin"]
    return actual
