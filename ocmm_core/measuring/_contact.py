"""What the hand's force on the ball adds to the uncertainty of points.

The surface presses the ball towards the probe, along the compensation direction. LEDs and ball
move as the design of the probe says (`calibration.probe_shape.ContactForce`), and the tip is
computed wrong by what is left after the pose has followed the LEDs. Every force from zero to the
largest is as likely: its mean is common to all points of a job, for it is a habit of the hand, and
its scatter is each point's own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocmm_core.calibration.probe_design import ContactForce
from ocmm_core.geometry import Float
from ocmm_core.measuring._point import MeasuredPoint
from ocmm_core.tracking import TipSensitivity


def contact_movement(
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    contact: ContactForce,
) -> Float:
    """Return by how much each of N ball centres is computed wrong for one newton, (N, 3), mm/N."""
    return np.stack(
        [
            item.by_geometry
            @ (contact.by_force @ (point.rotation_world_from_probe.T @ point.direction))
            for point, item in zip(points, sensitivities, strict=True)
        ]
    )
