"""The joint covariance of measured points: shared and independent parts.

Propagated from the records of all points of a job at once (GUM 5.2.2):

- scatter of each point's window and undetected motion of the ball in it, independent between
  points;
- the position-dependent part of the spot error (pixel pattern, residual of the lens model): a
  Gaussian field on each sensor, shared by near points;
- calibration of the cameras and geometry of the probe: common to all points; with a probe design,
  that geometry's covariance includes thermal growth and sag
  (`calibration.probe_design.body_in_use`);
- the force of the hand, with a probe design (`_contributions`);
- the pose of a reference body, if used: its LEDs, and the noise of its first pose;
- the pose of a saved frame not measured in the job;
- the scale of a part reported at 20 °C (`_temperature`);
- the radius of the ball: common to all points, a last, separate quantity because it acts on
  features and not on ball centres.

Common parts cancel or not depending on the characteristic, which a covariance per point cannot
represent. The covariance is kept as factors (`_factors`); `_contributions` has the named parts.
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

    Arguments as in `contributions`; ``root`` replaces `root_of`, for callers that cache results.
    """
    parts = contributions(points, sensitivities, rig, body, contact, part, frame=frame)
    return factors_of(parts, len(points), root)


def systematic_covariance(
    sensitivities: Sequence[TipSensitivity], rig: Rig, body: ProbeBody
) -> Float:
    """Return the dense covariance (3 N, 3 N), mm^2, that averaging does not remove; few points."""
    count = len(sensitivities)
    factors = factors_of(systematic_contributions(sensitivities, rig, body), count)
    return factors.of(np.eye(3 * count, 3 * count + 1))


def point_uncertainty(
    sensitivity: TipSensitivity, rig: Rig, body: ProbeBody, random_covariance: Float | None = None
) -> float:
    """Return U (k = 2), mm, of one point in its worst direction.

    Without ``random_covariance`` (3, 3), mm^2, it excludes the point's own window.
    """
    covariance = systematic_covariance([sensitivity], rig, body)
    if random_covariance is not None:
        covariance = covariance + random_covariance
    variances = np.linalg.eigvalsh(covariance)
    return COVERAGE_FACTOR * float(np.sqrt(variances[-1]))
