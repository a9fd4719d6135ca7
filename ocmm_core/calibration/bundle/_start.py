"""Start of a bundle adjustment: poses, bars and seats from the previous cameras."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Pixels, Points3, perpendicular_pair, rigid_fit, unit
from ocmm_core.tracking import ProbeBody, triangulate
from ocmm_core.tracking.kernels import OK, allocate, solve_frames

LEAST_LEDS = 3
"""LEDs seen by two cameras in one frame, needed for its pose."""

_SHAPE_FRAMES = 200
_SHAPE_ROUNDS = 10
_NEVER_LOST_PX = 1e-9
"""Effectively disables the uncertainty check of a start pose."""


def solvable(seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the frames (n,) with enough LEDs, from a visibility mask (n, C, L)."""
    enough: NDArray[np.bool_] = (seen.sum(axis=1) >= 2).sum(axis=1) >= LEAST_LEDS
    return enough


def start_poses(rig: Rig, leds: Points3, uv: Pixels) -> tuple[Float, Points3, NDArray[np.bool_]]:
    """Return rotations (n, 3, 3), origins (n, 3), world from probe, and success (n,).

    Rigid fit to triangulated LEDs (thesis 2.4), tolerates millimetres. ``uv``: (n, C, L, 2), px.
    """
    outputs = allocate(len(uv))
    solve_frames(
        np.ascontiguousarray(uv, dtype=np.float64), rig.packed(), leds, np.zeros(3),
        _NEVER_LOST_PX, 0, *outputs,
    )  # fmt: skip
    status, _, _, rotations, origins, _, _ = outputs
    found = status == OK
    rotations[~found] = np.eye(3)
    origins[~found] = 0.0
    return rotations, origins, found


def start_shape(rig: Rig, body: ProbeBody, uv: Pixels) -> Points3:
    """Return the LEDs (L, 3), mm, from frames (n, C, L, 2), in the probe's frame.

    Mean of triangulated shapes (generalised Procrustes, Gower 1975; thesis 3.2), fitted to the
    body. CalibrationError if no frame shows all LEDs to two cameras.
    """
    complete = np.flatnonzero((np.isfinite(uv).all(axis=3).sum(axis=1) >= 2).all(axis=1))
    if not len(complete):
        raise CalibrationError(
            "relocation.no_complete_frame",
            "No frame shows all LEDs of the probe to two cameras, so its unknown geometry has "
            "no start value.",
            "Wave the probe with its LEDs towards the cameras.",
        )
    every = max(1, len(complete) // _SHAPE_FRAMES)
    shapes = [triangulate(rig, uv[index]) for index in complete[::every]]
    mean = shapes[0]
    for _ in range(_SHAPE_ROUNDS):
        laid = []
        for shape in shapes:
            rotation, translation = rigid_fit(shape, mean)
            laid.append(shape @ rotation.T + translation)
        mean = np.median(laid, axis=0)
    rotation, translation = rigid_fit(mean, body.leds_probe)
    start: Points3 = mean @ rotation.T + translation
    return start


def start_bars(rig: Rig, uv: Pixels) -> tuple[Float, Points3, NDArray[np.bool_]]:
    """Return bars along x in ``uv`` (m, C, 2, 2), px: world from bar (m, 3, 3), (m, 3); success."""
    rotations, centres = np.tile(np.eye(3), (len(uv), 1, 1)), np.zeros((len(uv), 3))
    found = np.zeros(len(uv), dtype=np.bool_)
    for index, placement in enumerate(uv):
        first, second = triangulate(rig, placement)
        found[index] = np.isfinite(first).all() and np.isfinite(second).all()
        if found[index]:
            direction = unit(second - first)
            rotations[index] = np.stack([direction, *perpendicular_pair(direction)], axis=1)
            centres[index] = 0.5 * (first + second)
    return rotations, centres, found
