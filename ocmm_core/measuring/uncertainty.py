"""The joint covariance of measured points: what they have in common and what each has alone.

Propagated from their own records to all points of a job at once (GUM 5.2.2):

- the scatter of each point's window, independent from point to point;
- the part of the spot error that stays at a place of the sensor (pixel pattern, rest of the lens
  model): a Gaussian field on each sensor, so that points taken near each other share it;
- the calibration of the cameras and the geometry of the probe: common to all points; where the
  design of the probe is known, growth by warmth and sag are in that geometry's covariance
  (`calibration.probe_shape.body_in_use`);
- the force of the hand, where that design is known (`measuring.contact`);
- the place of a reference body, where one is used: its LEDs, and the noise left in its first place;
- the scale of a part that is reported at 20 °C (`measuring.temperature`);
- the radius of the ball: common to all points, kept as a last, separate quantity because it acts
  on features and not on ball centres.

What is common cancels or not depending on the characteristic; a covariance per point alone could
not know.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocmm_core.calibration.probe_shape import ContactForce
from ocmm_core.camera.rig import Rig
from ocmm_core.geometry import Float
from ocmm_core.measuring.contact import contact_covariance
from ocmm_core.measuring.point import MeasuredPoint
from ocmm_core.measuring.temperature import PartWarmth, scale_covariance
from ocmm_core.tracking.body import ProbeBody
from ocmm_core.tracking.sensitivity import TipSensitivity

COVERAGE_FACTOR = 2.0
"""k of every expanded uncertainty U = k u that the product states."""


def joint_covariance(
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    contact: ContactForce | None = None,
    part: PartWarmth | None = None,
) -> Float:
    """Return the covariance of all ball centres and the tip radius.

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

    Returns
    -------
    numpy.ndarray
        (3 N + 1, 3 N + 1), mm^2: tip_world of the points in their order (x1 y1 z1 x2 ...), world
        frame, then the tip radius.
    """
    size = 3 * len(points)
    covariance = np.zeros((size + 1, size + 1))
    covariance[size, size] = body.tip_radius_sigma**2
    if not points:
        return covariance
    covariance[:size, :size] = systematic_covariance(sensitivities, rig, body)
    for index, point in enumerate(points):
        block = slice(3 * index, 3 * index + 3)
        covariance[block, block] += point.random_covariance
    if contact is not None:
        covariance[:size, :size] += contact_covariance(points, sensitivities, contact)
    if part is not None:
        covariance += scale_covariance(points, part)
    return covariance


def systematic_covariance(
    sensitivities: Sequence[TipSensitivity], rig: Rig, body: ProbeBody
) -> Float:
    """Return the covariance (3 N, 3 N), mm^2, of what averaging over frames does not remove."""
    by_cameras = np.vstack([item.by_cameras for item in sensitivities])
    by_geometry = np.vstack([item.by_geometry for item in sensitivities])
    covariance: Float = by_cameras @ rig.parameter_covariance @ by_cameras.T
    covariance += by_geometry @ body.geometry_covariance @ by_geometry.T
    by_common = np.vstack([item.by_common for item in sensitivities])
    covariance += by_common @ by_common.T
    for camera in range(len(rig.cameras)):
        covariance += _pattern_covariance(sensitivities, rig, camera)
    return covariance


def point_uncertainty(sensitivity: TipSensitivity, rig: Rig, body: ProbeBody) -> float:
    """Return U (k = 2), mm, of one point in its worst direction, without the window's scatter."""
    variances = np.linalg.eigvalsh(systematic_covariance([sensitivity], rig, body))
    return COVERAGE_FACTOR * float(np.sqrt(variances[-1]))


def _pattern_covariance(sensitivities: Sequence[TipSensitivity], rig: Rig, camera: int) -> Float:
    """Return what the field of one sensor does to all points, (3 N, 3 N), mm^2.

    Each point answers to its own spots only, so the points are stacked with equal numbers of
    spots: a spot that was not seen has no weight, and its place does not matter.
    """
    n = len(sensitivities)
    counts = [int(np.count_nonzero(item.camera == camera)) for item in sensitivities]
    most = max(counts)
    uv, gain = np.zeros((n, most, 2)), np.zeros((n, 2, 3, most))
    for index, (item, count) in enumerate(zip(sensitivities, counts, strict=True)):
        uv[index, :count] = item.uv[item.camera == camera]
        gain[index, :, :, :count] = item.by_spots[:, item.camera == camera].transpose(2, 0, 1)
    spots = uv.reshape(-1, 2)
    apart = np.sum((spots[:, None] - spots[None]) ** 2, axis=2)
    noise = rig.noise
    field = noise.pattern_px**2 * np.exp(-0.5 / noise.pattern_length_px**2 * apart)
    by_point = field.reshape(n, most, n * most)
    covariance = np.zeros((3 * n, 3 * n))
    for axis in range(2):
        left = (gain[:, axis] @ by_point).reshape(3 * n, n, most).transpose(1, 0, 2)
        both = left @ gain[:, axis].transpose(0, 2, 1)
        covariance += both.transpose(1, 0, 2).reshape(3 * n, 3 * n)
    return covariance
