"""Slots and rectangles of six or seven points, some near a corner."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.errors import FitError
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.search import unambiguous
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float, Points3
from tests.host import amount

NOISE_MM = 0.005


def _pocket(shape: Shape, n: int, rng: np.random.Generator) -> tuple[Points3, Float]:
    """Return points on all four sides, the first near a corner, and half length and width."""
    length = rng.uniform(10.0, 40.0)
    width = length * rng.uniform(0.25, 0.9)
    straight = length if shape is Shape.RECTANGLE else length - width
    places = []
    for index, side in enumerate([0, 0, 1, 2, 3, *rng.integers(0, 4, n - 5)]):
        along = rng.uniform(-0.9, 0.9) if index else rng.choice([-1.0, 1.0]) * rng.uniform(0.9, 1)
        sign = 1.0 if side in (0, 2) else -1.0
        if side < 2:
            places.append((along * straight, sign * width))
        elif shape is Shape.RECTANGLE:
            places.append((sign * length, along * width))
        else:
            turn = 0.45 * np.pi * along
            places.append((sign * (straight + width * np.cos(turn)), width * np.sin(turn)))
    turn = rng.uniform(0.0, np.pi)
    turned = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    flat = (np.array(places) + rng.normal(0.0, NOISE_MM, (n, 2))) @ turned.T
    return np.column_stack([flat, np.zeros(n)]), np.array([length, width])


@pytest.mark.parametrize("shape", [Shape.RECTANGLE, Shape.ROUND_SLOT])
def test_well_conditioned_pockets_are_accepted_at_their_sizes(shape: Shape) -> None:
    refused, wrong = 0, 0
    count = amount(60, 750)
    for seed in range(count):
        rng = np.random.default_rng((seed, 8))
        points, sizes = _pocket(shape, 6 + seed % 2, rng)
        try:
            fit = fit_shape(shape, points, radius_hint=sizes[0], second_hint=sizes[1])
        except FitError:
            refused += 1
            continue
        if fit.rival is not None:
            # A point so near to a corner that noise leaves open to which side it belongs.
            continue
        # An end next to a corner hardly determines the turn: fifty standard deviations.
        wrong += bool(np.abs([fit.radius, fit.second] - sizes).max() > 50.0 * NOISE_MM)

    assert refused == 0
    assert wrong == 0


def test_pocket_without_a_point_on_an_end_is_refused() -> None:
    points = np.array(
        [[-20.0, 8, 0], [5, 8, 0], [18, 8, 0], [-12, -8, 0], [9, -8, 0], [-25, 3, 0], [-25, -4, 0]]
    )
    points[:, :2] += 0.005 * np.random.default_rng(1).standard_normal((7, 2))

    with pytest.raises(FitError):
        unambiguous(fit_shape(Shape.RECTANGLE, points))
