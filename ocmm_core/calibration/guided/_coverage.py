"""Coverage of a volume by a waved probe: cells and attitudes that still lack poses."""

from __future__ import annotations

import numpy as np

from ocmm_core.calibration.guided._procedure_views import Cell, Tilt, VolumeCoverage
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Int, Points3
from ocmm_core.tracking import ProbeBody

CELL_MM = 120.0
POSES_PER_CELL = 8
POSES_PER_TILT = 30
LEANING = np.radians(12.0)
"""Angle from which a probe counts as leaning."""

_WORDS = (("left", "centre", "right"), ("near", "middle", "far"), ("low", "mid-height", "high"))
_TILTS = ("upright", "leaning left", "leaning right", "leaning forward", "leaning back")


def coverage(
    rig: Rig, body: ProbeBody, rotations_world_from_probe: Float, tips_world: Points3
) -> VolumeCoverage:
    """Return how poses (n, 3, 3), (n, 3), mm, fill the volume; cameras may have moved."""
    low, high = rig.volume_world
    views = viewer_axes(rig)
    counts = [max(1, min(4, round(float(size) / CELL_MM))) for size in high - low]
    step = (high - low) / counts
    place = np.floor((tips_world - low) / step).astype(np.int64)
    # Poses of a moved frame may lie outside: count them in the cell at the border.
    place = np.clip(place, 0, np.array(counts) - 1)
    cells = []
    for index in np.ndindex(*counts):
        begin = low + np.array(index) * step
        poses = int(np.count_nonzero((place == np.array(index)).all(axis=1)))
        name = _name(index, counts, views)
        cells.append(Cell(name, begin, begin + step, poses, POSES_PER_CELL))
    held = _tilts(body, rotations_world_from_probe, views)
    tilts = [
        Tilt(name, int(np.count_nonzero(held == number)), POSES_PER_TILT)
        for number, name in enumerate(_TILTS)
    ]
    done = sum(min(cell.poses, cell.wanted) for cell in cells)
    done += sum(min(tilt.poses, tilt.wanted) for tilt in tilts)
    wanted = len(cells) * POSES_PER_CELL + len(tilts) * POSES_PER_TILT
    return VolumeCoverage(tuple(cells), tuple(tilts), done / wanted)


def viewer_axes(rig: Rig) -> Float:
    """Return right, away and up as seen along the cameras' view, (3, 3) rows."""
    axes = np.mean([camera.T_camera_from_world.rotation for camera in rig.cameras], axis=0)
    return np.stack([axes[0], axes[2], -axes[1]])


def _name(index: tuple[int, ...], counts: list[int], views: Float) -> str:
    """Return the place of a cell in words; axes with one cell are not named."""
    words = []
    free = [0, 1, 2]
    for view in (1, 2, 0):
        axis = max(free, key=lambda one: abs(views[view, one]))
        free.remove(axis)
        if counts[axis] == 1:
            continue
        number = index[axis] if views[view, axis] > 0.0 else counts[axis] - 1 - index[axis]
        ends = {0: _WORDS[view][0], counts[axis] - 1: _WORDS[view][2]}
        inner = _WORDS[view][1] if counts[axis] == 3 else f"{_WORDS[view][1]} {number}"
        words.append(ends.get(number, inner))
    return " ".join(words)


def _tilts(body: ProbeBody, rotations: Float, views: Float) -> Int:
    """Return the attitude class of each pose, (n,): index into the names of tilts."""
    handle = body.leds_probe.mean(axis=0) - body.tip_probe
    axis = rotations @ (handle / np.linalg.norm(handle))
    right, away, up = views
    across, along = np.arctan2(axis @ right, axis @ up), np.arctan2(axis @ away, axis @ up)
    sideways = np.abs(across) >= np.abs(along)
    held = np.where(sideways, np.where(across < 0.0, 1, 2), np.where(along > 0.0, 3, 4))
    upright = np.maximum(np.abs(across), np.abs(along)) < LEANING
    return np.where(upright, 0, held).astype(np.int64)
