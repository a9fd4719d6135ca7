"""Alignment by reference points (RPS): six conditions that hold exactly.

Each condition brings one coordinate of one point to its nominal place. They are six equations for
the six motions of the part; Newton's method solves them from a first alignment.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocmm_core.alignment._best_fit import fit_points
from ocmm_core.alignment._rules import ReferencePoints
from ocmm_core.errors import FitError
from ocmm_core.features.shapes import POINT
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, unit

LEAST_HOLD = 0.01
"""Part of the best held motion that the worst held one must have, turns at the points' distance."""

_MOST_STEPS = 30
_CONVERGED = 1e-12
"""mm for every metre of the size: what the conditions may miss by."""


def reference_points(
    rule: ReferencePoints,
    geometries: Mapping[str, Float],
    nominals: Mapping[str, Float],
    start: RigidTransform | None,
) -> RigidTransform:
    """Return the motion from the world to the part frame in which all conditions hold.

    Parameters
    ----------
    geometries, nominals
        Geometry vectors (12,), mm, world and part frame, by name.
    start
        ``T_part_from_world`` of the alignment that comes first.

    Raises
    ------
    FitError
        A nominal is missing, the conditions leave a motion open or contradict each other, or they
        are not met.
    """
    names = list(dict.fromkeys(item.feature for item in rule.conditions))
    for name in names:
        if name not in nominals:
            raise FitError(
                "alignment.no_nominal",
                f"The reference points need the nominal position of {name}, which is unknown.",
                f"Give {name} a nominal.",
            )
    measured = np.array([geometries[item.feature][POINT] for item in rule.conditions])
    wanted = np.array([nominals[item.feature][POINT] for item in rule.conditions])
    directions = unit(np.array([item.direction for item in rule.conditions]))
    if start is None:
        # A point with three conditions counts once.
        firsts = [[item.feature for item in rule.conditions].index(name) for name in names]
        start = fit_points(measured[firsts], wanted[firsts], np.ones(len(firsts)))
    centre = wanted.mean(axis=0)
    size = max(float(np.linalg.norm(wanted - centre, axis=1).max()), 1.0)
    T = start
    for _ in range(_MOST_STEPS):
        placed = T.apply(measured)
        off = np.sum(directions * (placed - wanted), axis=1)
        rows = np.hstack([np.cross(placed - centre, directions) / size, directions])
        values = np.linalg.svd(rows, compute_uv=False)
        if values[-1] < LEAST_HOLD * values[0]:
            raise FitError(
                "alignment.open",
                f"The six conditions do not constrain the part: {_open_words(rows)}.",
                "Spread the points, or use another direction.",
            )
        if float(np.abs(off).max()) < _CONVERGED * max(size, 1000.0):
            return T
        step = np.linalg.solve(rows, -off)
        rotation = rotation_from_vector(step[:3] / size)
        about = RigidTransform(rotation, centre - rotation @ centre + step[3:])
        T = about.compose(T)
    raise FitError(
        "alignment.no_end",
        "No position of the part meets all six conditions.",
        "Check the nominal positions and which feature was probed for which.",
    )


def _open_words(rows: Float) -> str:
    way = np.linalg.svd(rows)[2][-1]
    turn, shift = way[:3], way[3:]
    most = int(np.argmax(np.abs(way)))
    if most < 3:
        return f"rotation about {'xyz'[int(np.argmax(np.abs(turn)))]}"
    return f"translation along {'xyz'[int(np.argmax(np.abs(shift)))]}"
