"""Compiled starts about trial axes, and certainty of few points."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.features.elements._ball import taubin_ball
from ocmm_core.features.search import (
    TORUS,
    across_axes,
    centred_solid,
    circles,
    degenerate,
    flanks,
    minimise,
    quadric_feet,
    trial_axes,
)
from ocmm_core.features.search._search import certain
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float, Points3, unit

AXIS = unit(np.array([0.3, -0.4, 0.8]))
FOOT = np.cross(AXIS, np.array([0.2, 0.7, 0.1]))
HALF_ANGLE = 0.3


def _cone(rng: np.random.Generator, n: int) -> Points3:
    """Return points of a cone; its radius is one at `FOOT`."""
    first, second = across_axes(AXIS)
    turn, height = rng.uniform(0.0, 5.0, n), rng.uniform(-1.0, 1.0, n)
    radius = 1.0 + np.tan(HALF_ANGLE) * height
    around = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second
    points: Points3 = FOOT + radius[:, None] * around + height[:, None] * AXIS
    return points


@pytest.mark.parametrize("n", [6, 8, 60])
def test_cone_about_its_axis_is_found_from_the_quadric(n: int) -> None:
    found = np.zeros((1, 8))
    points = _cone(np.random.default_rng(n), n)

    quadric_feet(points, AXIS[None], found)
    flanks(points, found)

    # The ridge of 1e-12 and the conditioning of six points leave so many digits.
    assert found[0, 0:3] == pytest.approx(FOOT, abs=1e-6)
    assert found[0, 6] == pytest.approx(HALF_ANGLE, abs=1e-6)
    assert found[0, 7] == pytest.approx(np.cos(HALF_ANGLE), abs=1e-6)


@pytest.mark.parametrize("n", [6, 8, 60])
def test_circles_are_those_of_taubin(n: int) -> None:
    rng = np.random.default_rng((n, 1))
    points = _cone(rng, n) + 0.01 * rng.standard_normal((n, 3))
    axes = trial_axes(points)
    found = np.empty((len(axes), 8))

    circles(points, axes, found)

    for axis, start in zip(axes, found, strict=True):
        frame = np.stack(across_axes(axis))
        flat = points @ frame.T
        middle = flat.mean(axis=0)
        centre, radius, _ = taubin_ball(flat - middle)
        scale = 1.0 + radius
        assert start[0:3] == pytest.approx((centre + middle) @ frame, abs=1e-9 * scale**2)
        assert start[6] == pytest.approx(radius, abs=1e-9 * scale**2)


def _torus(rng: np.random.Generator, n: int, noise: float) -> Float:
    """Return centred and scaled points all over a torus."""
    turn = 2.0 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n
    tube = rng.uniform(0.0, 2.0 * np.pi, n)
    rho = 1.0 + 0.3 * np.cos(tube)
    points = np.stack([rho * np.cos(turn), rho * np.sin(turn), 0.3 * np.sin(tube)], axis=1)
    points += noise * rng.standard_normal((n, 3))
    flat = degenerate(Shape.TORUS, "flat", "")
    return centred_solid(Shape.TORUS, points, flat)[1]


@pytest.mark.parametrize(("n", "noise", "wanted"), [(12, 1e-4, True), (12, 0.02, False),
                                                     (9, 1e-4, False)])  # fmt: skip
def test_few_points_are_certain_by_chance_only(n: int, noise: float, wanted: bool) -> None:
    about = _torus(np.random.default_rng(3), n, noise)
    start = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.3])

    found = minimise(TORUS, about, start)

    assert found.converged
    assert certain(TORUS, about, found) is wanted
