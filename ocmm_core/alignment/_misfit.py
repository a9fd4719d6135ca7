"""Misfit of features from their nominals, to choose the sense of axes without one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocmm_core.alignment._freedom import Freedom
from ocmm_core.features.shapes import DIRECTION, POINT, Shape
from ocmm_core.geometry import Float, RigidTransform, unit

LEVER_MM = 100.0
"""Lever, mm, that weights a direction error against a place error for the choice of senses."""


def misfit_of_all(
    T_frame_from_world: RigidTransform,
    free: Freedom,
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    nominals: Mapping[str, Float],
) -> float:
    """Return the squared misfit, mm^2, of all features in the constrained motions.

    Places by quantities invariant to rotation about free axes and shifts along free directions.
    """
    if len(free.turn) == 3:
        return 0.0
    T = T_frame_from_world
    names = [name for name in nominals if name in geometries]
    places = [name for name in names if shapes[name].spec.located != "along"]
    total = 0.0
    if places:
        measured = T.apply(np.array([geometries[name][POINT] for name in places]))
        wanted = np.array([nominals[name][POINT] for name in places])
        off = measured - wanted
        flat = [shapes[name].spec.is_flat for name in places]
        axes = np.array([nominals[name][DIRECTION] for name in places]) * np.array(flat)[:, None]
        off = off - np.sum(off * axes, axis=1, keepdims=True) * axes
        if len(free.turn):
            axis = free.turn[0]
            off = (off @ axis)[:, None] * axis
            if len(free.slide) < 2:
                rounds = [_from_axis(items, free.centre, axis) for items in (measured, wanted)]
                total += float(np.sum((rounds[0] - rounds[1]) ** 2))
        off = off - off.mean(axis=0) @ free.slide.T @ free.slide
        total += float(np.sum(off**2))
    for name in names:
        if not shapes[name].spec.has_sense:
            continue
        off = T.rotation @ geometries[name][DIRECTION] - unit(nominals[name][DIRECTION])
        if len(free.turn):
            off = free.turn[0] * (free.turn[0] @ off)
        total += LEVER_MM**2 * float(off @ off)
    return total


def _from_axis(points: Float, centre: Float, axis: Float) -> Float:
    distances: Float = np.linalg.norm(np.cross(points - centre, axis), axis=1)
    return distances
