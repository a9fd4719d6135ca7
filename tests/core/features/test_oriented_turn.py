"""How an element with a given direction follows when that direction turns."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.features.elements import fit_oriented, turned_direction
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import rotation_from_vector
from tests.core.features.shape_samples import ideal_points, somewhere

STEP = 1e-6


@pytest.mark.parametrize(
    "shape", [Shape.PLANE, Shape.LINE, Shape.CYLINDER, Shape.CONE, Shape.TORUS]
)
def test_an_element_turns_with_its_direction(shape: Shape) -> None:
    rng = np.random.default_rng(21)
    points = somewhere(rng, far=200.0).apply(ideal_points(shape, rng, 14))
    points += rng.normal(0.0, 0.001, points.shape)
    start = fit_shape(shape, points)
    # Off by some seconds of arc, as the datum before it leaves the direction.
    given = rotation_from_vector(rng.normal(0.0, 1e-4, 3)) @ start.direction
    by_turn = fit_oriented(start, points, given, None)[1]
    differences = np.empty_like(by_turn)
    for k, turn in enumerate(np.eye(3)):
        ahead, behind = (
            fit_oriented(start, points, rotation_from_vector(step * turn) @ given, None)[0].geometry
            for step in (STEP, -STEP)
        )
        differences[:, k] = (ahead - behind) / (2.0 * STEP)
    # First order in the residuals: 0.001 mm, and a tilt of 1e-4, against sizes of 5 mm and more.
    assert np.abs(by_turn - differences).max() < 0.01 * np.abs(differences).max()


@pytest.mark.parametrize("along", [False, True])
def test_a_direction_turns_to_where_the_points_scatter_least_or_most(along: bool) -> None:
    rng = np.random.default_rng(22)
    motion = somewhere(rng, far=200.0)
    flat = rng.uniform(-20.0, 20.0, (12, 3)) * ([1.0, 0.02, 0.3] if along else [0.02, 1.0, 0.3])
    points = motion.apply(flat)
    about = motion.rotation[:, 2]
    # From so far off a single step does not arrive.
    start = rotation_from_vector(0.3 * about) @ motion.rotation[:, 0]
    found = turned_direction(
        Shape.LINE if along else Shape.PLANE, points, start, about, along=along
    ).direction
    middle = points - points.mean(axis=0)
    slope = float((middle @ found) @ (middle @ np.cross(about, found)))
    # A turn of 1e-12 rad, times the greatest mean square of the points.
    assert abs(slope) < 1e-9 * float(np.sum(middle**2))
