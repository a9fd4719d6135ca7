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

from ocmm_core.calibration.probe_shape import ContactForce
from ocmm_core.geometry import Float
from ocmm_core.measuring.point import MeasuredPoint
from ocmm_core.tracking.sensitivity import TipSensitivity


def contact_covariance(
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    contact: ContactForce,
) -> Float:
    """Return the covariance (3 N, 3 N), mm^2, of all ball centres; N at least one.

    The common part has the standard deviation of half the largest force, for the mean is not
    corrected; the own part that of the uniform distribution. Together they are its mean square.
    """
    per_n = np.stack(
        [
            item.by_geometry
            @ (contact.by_force @ (point.rotation_world_from_probe.T @ point.direction))
            for point, item in zip(points, sensitivities, strict=True)
        ]
    )
    flat = per_n.ravel()
    covariance = np.outer(flat, flat) * (0.5 * contact.largest_n) ** 2
    for index, own in enumerate(per_n):
        block = slice(3 * index, 3 * index + 3)
        covariance[block, block] += np.outer(own, own) * contact.largest_n**2 / 12.0
    return covariance
