"""Planned lines: all corners, different directions, and why the guideline could not be followed."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.calibration.verification._line_planning import (
    CORNER_NAMES,
    CORNER_SHARE,
    MIN_ANGLE,
    PlannedLine,
    corner_distances,
    plan_lines,
)
from ocmm_core.calibration.verification._verification import judge_placement, reached_corners
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float

VOLUMES = [
    ((400.0, 200.0, 400.0), 400.0),
    ((400.0, 200.0, 400.0), 450.0),
    ((400.0, 400.0, 400.0), 464.0),
    ((400.0, 400.0, 400.0), 500.0),
    ((1000.0, 600.0, 400.0), 820.0),
    ((2000.0, 2000.0, 1500.0), 2100.0),
]


def box(edges: tuple[float, float, float]) -> Float:
    half = 0.5 * np.array(edges)
    corners: Float = np.stack([-half, half]) + np.array([10.0, -20.0, 30.0])
    return corners


@pytest.mark.parametrize(("edges", "length"), VOLUMES)
def test_lines_end_in_all_corners_in_different_directions(
    edges: tuple[float, float, float], length: float
) -> None:
    volume = box(edges)
    lines = plan_lines(volume, length).lines
    assert len(lines) in (7, 8)
    ends = np.concatenate([line.ends_world for line in lines])
    assert corner_distances(ends, volume).min(axis=0).max() < CORNER_SHARE
    assert sorted({corner for line in lines for corner in line.corners}) == list(range(8))
    low, high = volume
    assert ((ends >= low) & (ends <= high)).all()
    directions = np.array([line.ends_world[1] - line.ends_world[0] for line in lines]) / length
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1.0)
    cosines = np.abs(directions @ directions.T) - np.eye(len(lines))
    assert np.arccos(cosines.max()) > MIN_ANGLE
    assert len({line.name for line in lines}) == len(lines)


def test_seven_lines_do_where_a_placement_serves_two_corners() -> None:
    planning = plan_lines(box((400.0, 200.0, 400.0)), 400.0)
    assert len(planning.lines) == 7
    # Four placements reach all eight corners; two space diagonals follow.
    assert [len(line.corners) for line in planning.lines] == [2, 2, 2, 2, 0, 0, 0]
    names = [line.name for line in planning.lines]
    assert sum(name.startswith("space diagonal") for name in names) == 2
    # The bar is longer than any edge, and a note reports it.
    assert [note[:20] for note in planning.notes] == [
        f"No line lies along {axis}" for axis in "XYZ"
    ]


def test_a_cube_needs_eight_lines_and_says_why() -> None:
    planning = plan_lines(box((400.0, 400.0, 400.0)), 464.0)
    assert len(planning.lines) == 8
    assert planning.notes[0].startswith("8 lines instead of 7")


def test_a_line_lies_along_each_axis_where_the_bar_fits() -> None:
    lines = plan_lines(box((1000.0, 600.0, 400.0)), 820.0).lines
    assert "along X" in [line.name for line in lines]


@pytest.mark.parametrize(
    ("edges", "length", "why"),
    [
        ((400.0, 200.0, 400.0), 300.0, "too short"),
        ((400.0, 200.0, 400.0), 700.0, "longer than the space diagonal"),
        ((400.0, 200.0, 400.0), 560.0, "does not fit in 7 directions"),
        ((2000.0, 300.0, 300.0), 1400.0, r"corners .* stay out of reach"),
    ],
)
def test_a_bar_that_does_not_suit_is_refused_with_its_reason(
    edges: tuple[float, float, float], length: float, why: str
) -> None:
    with pytest.raises(CalibrationError, match=why) as caught:
        plan_lines(box(edges), length)
    # The remedy's recommendation works.
    low, high = (float(word) for word in caught.value.remedy.split() if word.isdigit())
    for one in (low, high):
        assert len(plan_lines(box(edges), one).lines) >= 7


def test_corners_count_as_they_were_reached() -> None:
    volume = box((400.0, 200.0, 400.0))
    lines = plan_lines(volume, 400.0).lines
    first = lines[0]
    # 10 % of the edge of 400 mm are 40 mm, and 10 mm of them are planned.
    shifted = first.ends_world + np.array([35.0, 0.0, 0.0])
    assert "% of an edge from corner" in judge_placement(first, shifted, [], volume)
    nearer = first.ends_world + np.array([25.0, 0.0, 0.0])
    assert judge_placement(first, nearer, [], volume) == ""
    ends = np.concatenate([line.ends_world for line in lines[1:]])
    # Another line reaches the one as well, by its end.
    shares = corner_distances(ends, volume).min(axis=0)
    lost = next(CORNER_NAMES[one] for one in first.corners if shares[one] > CORNER_SHARE)
    corners = reached_corners(ends, volume, {lost: "a post stands there", "X+ Y+ Z+": "no"})
    missing = {one.name: one.reason for one in corners if not one.reached}
    assert missing == {lost: "a post stands there"}
    assert all(not one.reason for one in corners if one.reached)


def test_a_line_without_corners_may_lie_a_little_elsewhere() -> None:
    volume = box((400.0, 200.0, 400.0))
    across = PlannedLine("across", plan_lines(volume, 400.0).lines[-1].ends_world)
    assert judge_placement(across, 0.97 * across.ends_world, [], volume) == ""
