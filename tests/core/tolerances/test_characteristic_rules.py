"""Statements that accompany the values of characteristics, and refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import Shape
from ocmm_core.tolerances.kinds import evaluate
from tests.core.tolerances.known_errors import RULE, measured
from tests.core.tolerances.known_part import KnownPart, asked, ball, face, motion, ring


def _with_datums() -> KnownPart:
    part = KnownPart()
    part.add("top", Shape.PLANE, face(motion(0, 0, 0)))
    part.add("left", Shape.PLANE, face(motion(-50, 0, -20, 0, -np.pi / 2, 0)),
             point=(-50, 0, -20), direction=(-1, 0, 0))  # fmt: skip
    part.add("front", Shape.PLANE, face(motion(0, -50, -20, np.pi / 2, 0, 0)),
             point=(0, -50, -20), direction=(0, -1, 0))  # fmt: skip
    return part


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
    part = _with_datums()
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


def _with_three_lobes(side: str, form: float, **nominal: object) -> KnownPart:
    """Return a part with a ring of 12.0 mm by least squares, and a form of three lobes."""
    part = _with_datums()
    probed = ring(
        motion(60.03, 0.04, 0), 6.0, bulge=lambda turn: form * np.cos(3.0 * turn),
        inner=side == "inner",
    )  # fmt: skip
    part.add("it", Shape.CIRCLE, probed, point=(60, 0, 0), diameter=12.0, side=side, **nominal)
    return part


@pytest.mark.parametrize("criterion", ["least squares", "inscribed", "circumscribed"])
@pytest.mark.parametrize(
    ("side", "modifier", "limit", "mating"),
    [
        ("inner", "maximum material", 11.9, "inscribed"),
        ("inner", "least material", 12.1, "circumscribed"),
        ("outer", "maximum material", 12.1, "circumscribed"),
        ("outer", "least material", 11.9, "inscribed"),
    ],
)
def test_the_bonus_is_never_larger_than_by_any_size(
    side: str, modifier: str, limit: float, mating: str, criterion: str
) -> None:
    # Lobes of 0.02 mm: least squares shows 12.00, and would give 0.10 away; the gauge 0.06.
    part = _with_three_lobes(side, 0.02, criterion=criterion)
    item = asked("position", "it", "top,left,front", modifier=modifier, material_size=limit)
    found = evaluate(item, part.actual(), None)
    bonuses = []
    for word in ("least squares", "inscribed", "circumscribed"):
        size = evaluate(asked("diameter", "it", association=word), part.actual(), None).value
        bonuses.append(abs(size - limit) if (size > limit) == (limit < 12.0) else 0.0)
    assert found.bonus == pytest.approx(min(bonuses), abs=1e-6)
    assert found.bonus == pytest.approx(0.06, abs=2e-4)
    assert f"mm, {mating} (" in found.note
    # Its gradient is that of this size: one point of three lobes moved in by 3 um.
    assert found.bonus_gradient is not None
    moved = list(part.points)
    place = found.bonus_gradient.places[np.abs(found.bonus_gradient.by_points).argmax() // 3]
    step = 1e-4 * found.bonus_gradient.at(np.array([place])).reshape(3)
    moved[place] = replace(moved[place], tip_world=moved[place].tip_world + step)
    change = evaluate(item, part.actual(moved), None).bonus - found.bonus
    assert change == pytest.approx(float(step @ step) / 1e-4, rel=0.02)


def test_a_bonus_by_the_planes_along_a_slot_needs_no_opposite_points() -> None:
    part = _with_datums()
    x = np.array([-8.0, -3.0, 2.0, 7.0])
    upper, lower = np.array([0.0, 0.02, -0.02, 0.0]), np.array([-0.02, 0.02, 0.02, -0.02])
    sides = [
        np.stack([x + shift, sign * (3.0 + bulge), 0.0 * x], axis=1)
        for sign, bulge, shift in ((1.0, upper, 0.0), (-1.0, lower, 0.5))
    ]
    ends = np.array([[12.0, 0.0, 0.0], [-12.0, 0.0, 0.0]])
    normals = np.vstack([np.tile([0.0, -1.0, 0.0], (4, 1)), np.tile([0.0, 1.0, 0.0], (4, 1)),
                         [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]])  # fmt: skip
    surface = np.vstack([*sides, ends])
    part.add("it", Shape.ROUND_SLOT, (surface, normals), point=(0, 0, 0), direction=(0, 0, 1),
             length=24.0, width=6.0, across=(1, 0, 0), side="inner")  # fmt: skip
    bonus = {}
    for modifier, limit in (("maximum material", 5.9), ("least material", 6.1)):
        item = asked("position", "it", "top,left,front", modifier=modifier, material_size=limit)
        found = evaluate(item, part.actual(), None)
        assert "planes along its sides" in found.note
        bonus[modifier] = found.bonus
    # By least squares 0.1 each; the sides come in and go out by 0.02 each, less how they lean.
    assert bonus["maximum material"] == pytest.approx(0.06, abs=0.012)
    assert bonus["least material"] == pytest.approx(0.06, abs=0.012)


def test_without_a_mating_size_there_is_no_bonus() -> None:
    part = _with_datums()
    surface, normals = ring(motion(60.03, 0.04, 0), 6.0, inner=True)
    part.add("it", Shape.CIRCLE, (surface[:5], normals[:5]), point=(60, 0, 0), diameter=12.0,
             side="inner")  # fmt: skip
    item = asked(
        "position", "it", "top,left,front", modifier="maximum material", material_size=11.9
    )
    found = evaluate(item, part.actual(), None)
    assert found.bonus == 0.0
    assert "No bonus, there is no mating size: No largest inscribed circle" in found.note


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
    """Return the features with the bent pin next to the straight one."""
    actual = dict(measured())
    actual["bent"] = actual["pin"]
    return actual
