"""Sectors of round features: the effect of a touch on or near an edge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike

from ocmm_core.features.measured import fit_shape
from ocmm_core.features.shapes import Fit, NominalFeature, Shape
from ocmm_core.geometry import Float, perpendicular_pair
from ocmm_core.inspection.evaluation import coverage_of
from ocmm_core.inspection.evaluation._view import Coverage
from tests.core.inspection.test_guidance import point_at

RADIUS = 10.0


def circle_fit(angles: Float, direction: Float, off: Float) -> tuple[Fit, list[Float]]:
    """Return an exact circle whose centre is moved by ``off``, and points at these angles."""
    first, second = perpendicular_pair(direction)
    tips = RADIUS * (np.outer(np.cos(angles), first) + np.outer(np.sin(angles), second))
    fit = fit_shape(Shape.CIRCLE, tips, direction_hint=direction)
    geometry = fit.geometry.copy()
    geometry[:3], geometry[3:6] = off, direction
    return replace(fit, geometry=geometry), list(tips)


def coverage(
    angles: ArrayLike,
    count: int = 8,
    direction: ArrayLike = (0.0, 0.0, 1.0),
    off: ArrayLike = (0.0, 0.0, 0.0),
) -> Coverage:
    bore = NominalFeature(
        name="B", shape=Shape.CIRCLE, points=count, point=(0.0, 0.0, 0.0), diameter=2.0 * RADIUS
    )
    fit, tips = circle_fit(*(np.asarray(a, dtype=float) for a in (angles, direction, off)))
    return coverage_of(bore, fit, [point_at(tip) for tip in tips])


def sectors_of(found: Coverage, angles: Float) -> set[int]:
    """Return the sectors of these angles in a picture that begins at ``start``."""
    count = len(found.cells)
    places = (np.asarray(angles) - found.start) / (2.0 * np.pi) * count
    # A touch very near an edge would be shown on either side.
    assert np.abs(places - np.round(places)).min() > 0.5 / len(places) - 1e-6
    return {int(place) for place in np.floor(places) % count}


@pytest.mark.numerics
@pytest.mark.parametrize("count", range(3, 9))
def test_evenly_spread_touches_lie_one_in_each_sector_whatever_the_rounding(count: int) -> None:
    rng = np.random.default_rng(count)
    even = np.arange(count) / count * 2.0 * np.pi
    edges = np.arange(2 * count) / count * np.pi
    for phase in (*edges, *rng.uniform(0.0, 2.0 * np.pi, 60)):
        # From rounding to the uncertainty of a touch, with equally uncertain direction and centre.
        for size in 10.0 ** rng.uniform(-15.0, -3.0, 4):
            angles = even + phase + rng.uniform(-size, size, count)
            direction = rng.uniform(-size, size, 3) + np.array([0.0, 0.0, 1.0])
            found = coverage(
                rng.permutation(angles), count, direction / np.linalg.norm(direction),
                rng.uniform(-size, size, 3),
            )  # fmt: skip
            assert found.words == f"{count} of {count} sectors", (phase, size)
            assert found.warning == ""


def test_a_hand_that_is_not_steady_still_touches_every_sector() -> None:
    """Less than half of half a sector to each side: only that could make it doubtful."""
    rng = np.random.default_rng(1)
    for _ in range(200):
        turn = rng.uniform(0.0, 2.0 * np.pi)
        angles = np.arange(8) * np.pi / 4.0 + turn + np.radians(rng.uniform(-11.0, 11.0, 8))
        assert coverage(angles).words == "8 of 8 sectors"


def test_touches_close_together_are_one_sector_wherever_they_are() -> None:
    rng = np.random.default_rng(2)
    for middle in (*(np.arange(16) * np.pi / 8.0), *rng.uniform(0.0, 2.0 * np.pi, 100)):
        angles = middle + np.radians(rng.uniform(-11.0, 11.0, 8))
        assert coverage(angles).words == "1 of 8 sectors"


@pytest.mark.parametrize("half", [0.0, 0.5])
def test_more_touches_than_sectors_never_leave_one_out(half: float) -> None:
    for number in range(8, 40):
        angles = (np.arange(number) + half) / number * 2.0 * np.pi
        assert coverage(angles).words == "8 of 8 sectors"


def test_the_sectors_of_the_picture_are_those_of_the_count() -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        angles = rng.uniform(0.0, 2.0 * np.pi, int(rng.integers(4, 14)))
        found = coverage(angles)
        touched = {sector for sector, hit in enumerate(found.cells) if hit}
        assert sectors_of(found, angles) == touched


def test_patches_of_a_sphere_take_touches_on_their_edges() -> None:
    """The pole, and eight round the equator from any beginning."""
    ball = NominalFeature(
        name="S", shape=Shape.SPHERE, points=9, point=(0.0, 0.0, 0.0), diameter=2.0 * RADIUS
    )
    rng = np.random.default_rng(4)
    for phase in (*(np.arange(16) * np.pi / 8.0), *rng.uniform(0.0, 2.0 * np.pi, 40)):
        turns = np.arange(8) * np.pi / 4.0 + phase
        tips = RADIUS * np.stack([np.cos(turns), np.sin(turns), np.zeros(8)], axis=1)
        tips = np.vstack([tips, [[0.0, 0.0, RADIUS]]])
        fit = fit_shape(Shape.SPHERE, tips)
        found = coverage_of(ball, fit, [point_at(tip) for tip in tips])
        assert found.words == "9 of 9 patches"


@pytest.mark.parametrize(("count", "cells"), [(4, 4), (5, 5), (9, 9), (25, 9)])
def test_a_sphere_of_few_points_has_a_patch_for_each(count: int, cells: int) -> None:
    ball = NominalFeature(
        name="S", shape=Shape.SPHERE, points=count, point=(0.0, 0.0, 0.0), diameter=2.0 * RADIUS
    )
    rng = np.random.default_rng(5)
    tips = rng.normal(size=(count, 3))
    tips *= RADIUS / np.linalg.norm(tips, axis=1, keepdims=True)
    fit = fit_shape(Shape.SPHERE, tips)
    assert len(coverage_of(ball, fit, [point_at(tip) for tip in tips]).cells) == cells
