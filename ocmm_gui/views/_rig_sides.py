"""View directions of a rig: upright, and from the cameras' side."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_gui.scene import Orbit


def upright(rig: Rig) -> Float:
    """Return the upright world axis: opposite to the sensors' columns, (3,), unit."""
    columns = np.mean([camera.T_camera_from_world.rotation[1] for camera in rig.cameras], axis=0)
    axis = int(np.argmax(np.abs(columns)))
    up: Float = -np.sign(columns[axis]) * np.eye(3)[axis]
    return up


def seen_from(rig: Rig, up: Float) -> Orbit:
    """Return a view from the cameras' side, turned and raised to show depth."""
    start = Orbit(np.zeros(3), 0.0, 0.0, 200.0, up)
    centre = rig.volume_world.mean(axis=0)
    seat = np.mean([camera.centre_world for camera in rig.cameras], axis=0) - centre
    right, _, outward = start.axes()
    azimuth = float(np.arctan2(seat @ right, seat @ outward))
    return start.turned(azimuth + np.radians(25.0), np.radians(25.0))


def mean_distance(rig: Rig) -> float:
    """Return the mean distance of the cameras from the middle of the volume, mm."""
    centre = rig.volume_world.mean(axis=0)
    return float(np.mean([np.linalg.norm(c.centre_world - centre) for c in rig.cameras]))
