"""Places of nests and sphere stands of a verification of the virtual rig."""

from __future__ import annotations

import numpy as np

from ocmm_core.calibration.verification import PLACES
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, unit

SEATS = np.array([[0.2, 0.25, 0.25], [0.8, 0.7, 0.65]])
"""As fractions of the volume."""
_THIRD = 0.22
"""Depth from the middle: well inside the near or the far third."""


def stand_of(rig: Rig, place: str, number: int) -> Float:
    """Return a sphere stand's centre, (3,), mm, at a place of `verification.PLACES`.

    An empty place is the middle, where spheres are next to each other by number.
    """
    middle = rig.volume_world.mean(axis=0)
    centres = np.array([camera.centre_world for camera in rig.cameras])
    away = unit(middle - centres.mean(axis=0))
    reach = _THIRD * float(np.abs(away) @ np.ptp(rig.volume_world, axis=0))
    side = dict(zip(PLACES, (-reach, reach), strict=True)).get(place)
    offset = np.array([60.0 * number, 0.0, 0.0]) if side is None else side * away
    stand: Float = middle + offset
    return stand
