"""A part with every kind of datum, as it is and as it is measured anywhere."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import (
    ACROSS,
    DIRECTION,
    HALF_ANGLE,
    POINT,
    RADIUS,
    Fit,
    NominalFeature,
    Shape,
    element,
)
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector
from ocmm_core.measuring import DeviationRows, Rows

SHAPES = {
    "A": Shape.PLANE,
    "B": Shape.PLANE,
    "C": Shape.PLANE,
    "H": Shape.CIRCLE,
    "G": Shape.CIRCLE,
    "X": Shape.CYLINDER,
    "Z": Shape.CYLINDER,
    "S": Shape.SPHERE,
    "K": Shape.CONE,
    "O": Shape.ROUND_SLOT,
    "P": Shape.POINT,
}
NOMINALS = {
    "A": element((50.0, 30.0, 0.0), (0.0, 0.0, 1.0)),
    "B": element((0.0, 20.0, -5.0), (-1.0, 0.0, 0.0)),
    "C": element((40.0, 0.0, -5.0), (0.0, -1.0, 0.0)),
    "H": element((20.0, 20.0, 0.0), (0.0, 0.0, 1.0), 5.0),
    "G": element((80.0, 40.0, 0.0), (0.0, 0.0, 1.0), 5.0),
    "X": element((60.0, 0.0, -10.0), (0.0, 1.0, 0.0), 4.0),
    "Z": element((30.0, 30.0, -4.0), (0.0, 0.0, 1.0), 6.0),
    "S": element((10.0, 60.0, 20.0), radius=9.0),
    "K": element((30.0, 30.0, 5.0), (0.0, 0.0, -1.0), 9.0, half_angle=0.4),
    "O": element((70.0, 50.0, 0.0), (0.0, 0.0, 1.0), 9.0, second=4.0, across=(1.0, 0.0, 0.0)),
    "P": element((95.0, 15.0, 7.0)),
}


def anywhere(rng: np.random.Generator) -> RigidTransform:
    """Return a motion of any turn and up to some hundred millimetres."""
    turn, shift = 2.0 * rng.normal(size=3), 500.0 * rng.normal(size=3)
    return RigidTransform(rotation_from_vector(turn), shift)


def measured(
    T_world_from_part: RigidTransform, rng: np.random.Generator, depth: float = 0.0
) -> dict[str, Float]:
    """Return the part without error, probed elsewhere on its planes and axes, in the world.

    Directions without a sense run either way by chance; circles and slots were probed at any height
    of some ``depth``, mm.
    """
    found = {}
    for name, nominal in NOMINALS.items():
        geometry, shape = nominal.copy(), SHAPES[name]
        direction = nominal[DIRECTION]
        point = nominal[POINT]
        if shape is Shape.PLANE:
            point = point + 20.0 * np.cross(direction, rng.normal(size=3))
        if shape is Shape.CYLINDER:
            point = point + 10.0 * rng.normal() * direction
        if shape in (Shape.CIRCLE, Shape.ROUND_SLOT):
            point = point + depth * rng.normal() * direction
        if shape is Shape.CONE:
            higher = 3.0 * rng.normal()
            point = point + higher * direction
            geometry[RADIUS] += higher * np.tan(nominal[HALF_ANGLE])
        sense = 1.0 if shape in (Shape.PLANE, Shape.CONE) else rng.choice([-1.0, 1.0])
        geometry[POINT] = T_world_from_part.apply(point)
        geometry[DIRECTION] = sense * T_world_from_part.rotation @ direction
        geometry[ACROSS] = rng.choice([-1.0, 1.0]) * T_world_from_part.rotation @ nominal[ACROSS]
        found[name] = geometry
    return found


def actual_of(geometries: Mapping[str, Float]) -> dict[str, ActualFeature]:
    """Return features whose 12 numbers each are the coordinates of the job."""
    count = 12 * len(geometries) + 1
    found = {}
    for index, (name, geometry) in enumerate(geometries.items()):
        jacobian = np.zeros((12, count))
        jacobian[:, 12 * index : 12 * index + 12] = np.eye(12)
        fit = Fit(SHAPES[name], geometry, np.zeros((12, 0)), np.zeros(0), 0.0, 0.0)
        nominal = NominalFeature(
            name=name, shape=SHAPES[name], points=1, point=(0.0, 0.0, 0.0), diameter=1.0
        )
        none = DeviationRows.of_rows(Rows.nothing(0))
        found[name] = ActualFeature(nominal, fit, (index,), Rows.of_dense(jacobian), none)
    return found
