"""Uncertainty contributions of a ball diameter, kept apart.

A quick check shares the probe calibration, mostly the cameras and often the sphere with its
qualification. Their errors cancel as far as the touches agree; only spots are independent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.calibration.guided import RestingTouch
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import Sphere, TipRecord
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Points3
from ocmm_core.tracking import ProbeBody


@dataclass(frozen=True, slots=True)
class DiameterErrors:
    """Errors of a diameter, without those of the sphere."""

    noise: float
    """mm: standard uncertainty by spot noise alone."""
    by_cameras: Float
    """(14 C,): derivative by the camera parameters."""
    by_geometry: Float
    """(3 L + 3,): derivative by LEDs and tip of the probe."""

    def sigma(self, rig: Rig, body: ProbeBody) -> float:
        """Return the standard uncertainty, mm."""
        return float(
            np.sqrt(
                self.noise**2
                + _variance(self.by_cameras, rig.parameter_covariance)
                + _variance(self.by_geometry, body.geometry_covariance)
            )
        )


def errors_of(touches: Sequence[RestingTouch], normals: Points3, gain: Float) -> DiameterErrors:
    """Return the contributions for a diameter that is ``gain`` (n,) times n tip distances."""
    noise = np.array([one.noise for one in touches])
    own = np.einsum("ni,nij,nj->n", normals, noise, normals)
    cameras = np.array([one.by_cameras for one in touches])
    geometry = np.array([one.by_geometry for one in touches])
    return DiameterErrors(
        noise=float(np.sqrt(gain**2 @ own)),
        by_cameras=np.einsum("n,ni,nij->j", gain, normals, cameras),
        by_geometry=np.einsum("n,ni,nij->j", gain, normals, geometry),
    )


def sigma_with_sphere(
    errors: DiameterErrors,
    sphere: Sphere,
    temperature: Temperature | None,
    rig: Rig,
    body: ProbeBody,
) -> float:
    """Return the standard uncertainty of a diameter including its sphere, mm."""
    return float(np.hypot(errors.sigma(rig, body), _sphere_sigma(sphere, temperature)))


def sigma_of_difference(
    errors: DiameterErrors,
    sphere: Sphere,
    temperature: Temperature | None,
    qualification: TipRecord,
    rig: Rig,
    body: ProbeBody,
) -> float:
    """Return the standard uncertainty of a diameter less the qualified one, mm.

    Without stored derivatives of the qualification, nothing cancels.
    """
    by_geometry = np.array(qualification.by_geometry)
    by_cameras = np.array(qualification.by_cameras)
    sphere_sigma = _sphere_sigma(sphere, temperature)
    shapes = (by_geometry.shape, by_cameras.shape)
    if shapes != (errors.by_geometry.shape, errors.by_cameras.shape):
        whole = np.hypot(errors.sigma(rig, body), sphere_sigma)
        return float(np.hypot(whole, qualification.diameter_sigma_mm))
    before = DiameterErrors(qualification.noise_sigma_mm, by_cameras, by_geometry)
    variance = errors.noise**2 + before.noise**2 + sphere_sigma**2
    variance += _variance(errors.by_geometry - by_geometry, body.geometry_covariance)
    if qualification.rig_identity == rig.identity:
        variance += _variance(errors.by_cameras - by_cameras, rig.parameter_covariance)
    else:
        variance += _variance(errors.by_cameras, rig.parameter_covariance)
        variance += _variance(by_cameras, rig.parameter_covariance)
    # Only for equal serial numbers: confusing two spheres would make U too small.
    serial = sphere.artefact.use.serial
    if not serial or serial not in {one.serial for one in qualification.artefacts}:
        rest = qualification.diameter_sigma_mm**2 - before.sigma(rig, body) ** 2
        variance += max(rest, 0.0)
    return float(np.sqrt(variance))


def _variance(slope: Float, covariance: Float) -> float:
    return float(slope @ covariance @ slope)


def _sphere_sigma(sphere: Sphere, temperature: Temperature | None) -> float:
    return 0.5 * sphere.artefact.at(sphere.diameter, temperature)[1]
