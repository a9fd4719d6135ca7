"""The joint covariance of measured points: what they have in common and what each has alone.

Propagated from their own records to all points of a job at once (GUM 5.2.2):

- the scatter of each point's window and what the ball may have moved in it unnoticed, independent
  from point to point;
- the part of the spot error that stays at a place of the sensor (pixel pattern, rest of the lens
  model): a Gaussian field on each sensor, so that points taken near each other share it;
- the calibration of the cameras and the geometry of the probe: common to all points; where the
  design of the probe is known, growth by warmth and sag are in that geometry's covariance
  (`calibration.probe_shape.body_in_use`);
- the force of the hand, where that design is known (`measuring.contact`);
- the place of a reference body, where one is used: its LEDs, and the noise left in its first place;
- the place of a saved frame that the job has not measured itself;
- the scale of a part that is reported at 20 °C (`measuring.temperature`);
- the radius of the ball: common to all points, kept as a last, separate quantity because it acts
  on features and not on ball centres.

What is common cancels or not depending on the characteristic; a covariance per point alone could
not know. It is kept as factors (`_factors`); the parts by name are in `_contributions`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ocmm_core.calibration.probe_design import ContactForce
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_core.measuring._contributions import FrameDoubt, contributions, systematic_contributions
from ocmm_core.measuring._factors import PointFactors, factors_of
from ocmm_core.measuring._point import MeasuredPoint
from ocmm_core.measuring._temperature import PartTemperature
from ocmm_core.tracking import ProbeBody, TipSensitivity

COVERAGE_FACTOR = 2.0
"""k of every expanded uncertainty U = k u that the product states."""


def joint_factors(
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    contact: ContactForce | None = None,
    part: PartTemperature | None = None,
    frame: FrameDoubt | None = None,
    root: Callable[[Float], Float] | None = None,
) -> PointFactors:
    """Return the factors of the covariance of all ball centres and the tip radius.

    Parameters
    ----------
    points
        N points, in any order.
    sensitivities
        `tip_sensitivity` of the spots of each point.
    contact
        What the hand's force does; None where the design of the probe is not known.
    part
        How warm the part is; None where it is not compensated.
    frame
        Of a saved frame that results are stated in; None where the job measures its own.
    root
        Stands for the root of a covariance, of which somebody keeps the results.
    """
    parts = contributions(points, sensitivities, rig, body, contact, part, frame=frame)
    return factors_of(parts, len(points), root)


def systematic_covariance(
    sensitivities: Sequence[TipSensitivity], rig: Rig, body: ProbeBody
) -> Float:
    """Return the covariance (3 N, 3 N), mm^2, of what averaging over frames does not remove.

    For a few points only: it is a matrix of all against all.
    """
    count = len(sensitivities)
    factors = factors_of(systematic_contributions(sensitivities, rig, body), count)
    return factors.of(np.eye(3 * count, 3 * count + 1))


def point_uncertainty(
    sensitivity: TipSensitivity, rig: Rig, body: ProbeBody, random_covariance: Float | None = None
) -> float:
    """Return U (k = 2), mm, of one point in its worst direction.

    Without ``random_covariance`` (3, 3), mm^2, it lacks what the point's own window adds.
    """
    covariance = systematic_covariance([sensitivity], rig, body)
    if random_covariance is not None:
        covariance = covariance + random_covariance
    variances = np.linalg.eigvalsh(covariance)
    return COVERAGE_FACTOR * float(np.sqrt(variances[-1]))
