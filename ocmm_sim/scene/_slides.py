"""Slides of a ball over a surface, part frame: places, pace with stick-slip, and hops."""

from __future__ import annotations

import numpy as np
import scipy

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, perpendicular_pair, unit
from ocmm_sim.scene import _surfaces as surfaces
from ocmm_sim.scene._touches import Contacts

STEP_MM = 0.1
_STICKS, _STICK_S = 0.02, (0.03, 0.12)
"""Stops per mm of path, and their duration."""
_HOPS, _HOP_MM, _HOP_S = 0.01, (0.06, 0.3), 0.03
"""Losses of contact per mm of path, their height and duration."""
_RIM = 0.1
_LEVELS = (0.35, 0.75)
_POLE, _LOWEST = np.radians([8.0, 75.0])


def slide(artefact: surfaces.Artefact, length: float) -> Contacts:
    """Return the places of a slide of at least ``length``, mm, `STEP_MM` apart.

    Planes: a zigzag over their largest free area; balls, bores, bosses and cones: a helix of one
    turn or more; lines: once along. InputError for other surfaces.
    """
    point, axis = np.array(artefact.point), unit(np.array(artefact.direction))
    first, second = perpendicular_pair(axis)
    if isinstance(artefact, surfaces.PlaneEntry):
        along = unit(np.array(artefact.along))
        u0, v0, u1, v1 = max(artefact.areas, key=lambda a: (a[2] - a[0]) * (a[3] - a[1]))
        rim = _RIM * np.array([u1 - u0, v1 - v0])
        half = 0.5 * (u1 - u0) - rim[0]
        # Three lines or more, over half the length or more.
        half = min(half, max(0.5 * half, length / 6.0))
        lines = max(int(np.ceil(length / (2.0 * half))), 3)
        v = np.repeat(np.linspace(v0 + rim[1], v1 - rim[1], lines), 2)
        u = 0.5 * (u0 + u1) + np.resize([-half, half, half, -half], len(v))
        corners = point + u[:, None] * along + v[:, None] * np.cross(axis, along)
        places = _dense(corners)
        return _contacts(places, np.tile(axis, (len(places), 1)))
    if isinstance(artefact, surfaces.LineEntry):
        ends = point + artefact.length * np.array([[0.06], [0.94]]) * axis
        places = _dense(ends)
        return _contacts(places, np.tile(unit(np.array(artefact.normal)), (len(places), 1)))
    if not isinstance(
        artefact,
        surfaces.SphereEntry | surfaces.BoreEntry | surfaces.CylinderEntry | surfaces.ConeEntry,
    ):
        raise InputError(
            "simulation.slide",
            f"The virtual hand cannot slide on '{artefact.name}'.",
            "Measure it by single touches: set 'spacing' to 0 in the plan.",
        )
    radius = 0.5 * artefact.diameter
    turns = max(length / (2.0 * np.pi * radius), 1.1)
    if isinstance(artefact, surfaces.SphereEntry):
        turns *= 1.5
    share = np.linspace(0.0, 1.0, int(turns * 2.0 * np.pi * radius / STEP_MM))[:, None]
    turn = 2.0 * np.pi * turns * share
    around = np.cos(turn) * first + np.sin(turn) * second
    if isinstance(artefact, surfaces.SphereEntry):
        tilt = _POLE + (_LOWEST - _POLE) * share
        normals = np.cos(tilt) * axis + np.sin(tilt) * around
        return _contacts(point + radius * normals, normals)
    level = _LEVELS[0] + (_LEVELS[1] - _LEVELS[0]) * share
    if isinstance(artefact, surfaces.BoreEntry):
        return _contacts(point - level * artefact.depth * axis + radius * around, -around)
    taper = 0.0
    if isinstance(artefact, surfaces.ConeEntry):
        taper = 0.5 * (artefact.diameter - artefact.top_diameter) / artefact.height
    height = level * artefact.height
    return _contacts(
        point + height * axis + (radius - taper * height) * around, unit(around + taper * axis)
    )


def pace(count: int, speed: float, rng: np.random.Generator) -> Float:
    """Return the seconds (count,) of each step at a mean ``speed``, mm/s, with stops."""
    waves = np.sin(np.linspace(0.0, rng.uniform(2.0, 8.0), count) * 2.0 * np.pi)
    seconds: Float = STEP_MM / (speed * (1.0 + 0.4 * waves))
    stops = rng.random(count) < _STICKS * STEP_MM
    return seconds + np.where(stops, rng.uniform(*_STICK_S, count), 0.0)


def hops(seconds: Float, rng: np.random.Generator) -> Float:
    """Return the height (n,), mm, of the ball above the surface after each step."""
    times, heights = np.cumsum(seconds), np.zeros(len(seconds))
    for start in np.flatnonzero(rng.random(len(seconds)) < _HOPS * STEP_MM):
        share = np.clip((times - times[start]) / _HOP_S, 0.0, 1.0)
        heights += rng.uniform(*_HOP_MM) * 4.0 * share * (1.0 - share)
    # It starts, stops and ends in contact.
    heights[:50] = heights[-50:] = 0.0
    latest = scipy.ndimage.maximum_filter1d(seconds, 9) - 0.02
    return np.where(scipy.ndimage.minimum_filter1d(seconds, 9) < latest, 0.0, heights)


def _dense(corners: Float) -> Float:
    """Return places `STEP_MM` apart along straight lines between corners (n, 3)."""
    far = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    at = np.arange(0.0, far[-1], STEP_MM)
    return np.stack([np.interp(at, far, corners[:, k]) for k in range(3)], axis=1)


def _contacts(points: Float, normals: Float) -> Contacts:
    return Contacts(points, normals, np.zeros(len(points), dtype=np.int64))
