"""Fit the ball of a probe to points on a calibrated sphere.

Its centres lie on a sphere of diameter D_sphere + D_ball. They are fitted by their distances along
the normals with full covariance, including shared effects (cameras; LEDs and tip of the probe,
which turn with its attitude). Form (ISO 10360-5): largest less smallest radius about the centre of
the unweighted least-squares sphere.

The uncertainty contributions of the diameter are kept apart. A quick check shares the probe
calibration, mostly the cameras and often the sphere with its qualification. Their errors cancel as
far as the touches agree; only spots are independent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from ocmm_core.calibration.guided import RestingTouch, joint_covariance, range_limit, tips_of
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import Sphere, TipRecord
from ocmm_core.calibration.verification import fit_sphere
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
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


LEAST_POINTS = 5
"""Four determine a sphere; the fifth is the first redundant one."""

DOUBT = 1e-3
"""Probability that the worst of good points is flagged."""

FORM_CHANCE = 1e-4
"""Probability that form, or the misfit, of good points exceeds its limit."""

_STEPS = 30
_CONVERGED_MM = 1e-9
_WORST_CONDITION = 1e10
_MOST_DOUBTFUL = 3


@dataclass(frozen=True, slots=True)
class BallFit:
    """Ball fitted to points on a sphere."""

    centre_world: Float
    """(3,), mm: of the sphere."""
    radius: float
    """mm: half of D_sphere + D_ball."""
    covariance: Float
    """(4, 4), mm^2: of centre and radius."""
    directions_world: Points3
    """(n, 3): from the centre to the points, unit."""
    residuals: Float
    """(n,), mm: positive outside."""
    misfit: float
    misfit_limit: float
    """`misfit`, `misfit_limit`: mm: weighted RMS of the residuals, and its limit. More sensitive
    than form if the points differ in uncertainty."""
    form: float
    form_limit: float
    """`form`, `form_limit`: mm: see the module; limit from the uncertainties of the points."""
    point_sigma: float
    """mm: standard deviation of a point along its normal, from the unweighted residuals."""
    diameter: float
    diameter_sigma: float
    """`diameter`, `diameter_sigma`: mm: of the ball, and its standard uncertainty with that of the
    sphere, scaled up if the residuals are significantly too large."""
    errors: DiameterErrors
    """Uncertainty contributions of the diameter except those of the sphere."""
    doubtful: tuple[int, ...]
    """Indices of inconsistent points, the worst first; all were used."""


def fit_ball_on(
    touches: Sequence[RestingTouch],
    sphere: Sphere,
    rig: Rig,
    body: ProbeBody,
    temperature: Temperature | None,
) -> BallFit:
    """Return the ball that touched a sphere; CalibrationError if undetermined.

    Five or more touches, computed with ``rig`` and ``body``. Unmeasured: 20 degrees, u = 2 K.
    """
    if len(touches) < LEAST_POINTS:
        raise CalibrationError(
            "tip.few_points",
            f"{len(touches)} points on the sphere are too few to determine the ball.",
            f"Touch it at {LEAST_POINTS} places or more.",
        )
    tips = tips_of(touches)
    plain_centre, plain_radius, _ = fit_sphere(tips)
    plain = np.linalg.norm(tips - plain_centre, axis=1) - plain_radius
    centre, radius = plain_centre, plain_radius
    for _ in range(_STEPS):
        away = tips - centre
        distance = np.linalg.norm(away, axis=1)
        normals = away / distance[:, None]
        of_points = joint_covariance(touches, normals[:, None], rig, body)
        covariance, gain = _solved(normals, of_points)
        step = gain @ (distance - radius)
        centre, radius = centre + step[:3], radius + float(step[3])
        if float(np.abs(step).max()) < _CONVERGED_MM:
            break
    else:
        raise _undetermined()
    away = tips - centre
    residuals = np.linalg.norm(away, axis=1) - radius
    weight = np.linalg.inv(of_points)
    dof = len(touches) - 4
    chi2 = float(residuals @ weight @ residuals)
    certified, _ = sphere.artefact.at(sphere.diameter, temperature)
    # Ratio of the residuals to their expected size.
    ratio, limit = np.sqrt(np.array([chi2, scipy.special.chdtri(dof, FORM_CHANCE)]) / dof)
    sigmas = np.sqrt(np.diag(of_points))
    typical = float(np.sqrt(np.mean(sigmas**2)))
    errors = errors_of(touches, normals, 2.0 * gain[3])
    if ratio > limit:
        errors = replace(errors, noise=2.0 * float(ratio * np.sqrt(covariance[3, 3])))
    return BallFit(
        centre_world=centre, radius=radius, covariance=covariance,
        directions_world=away / np.linalg.norm(away, axis=1)[:, None], residuals=residuals,
        misfit=float(typical * ratio), misfit_limit=float(typical * limit),
        form=float(np.ptp(plain)),
        form_limit=range_limit(_plain_residuals(normals, of_points), FORM_CHANCE),
        point_sigma=float(np.sqrt(plain @ plain / dof)), diameter=2.0 * radius - certified,
        diameter_sigma=sigma_with_sphere(errors, sphere, temperature, rig, body), errors=errors,
        doubtful=doubtful_points(normals, of_points, residuals),
    )  # fmt: skip


def doubtful_points(normals: Points3, covariance: Float, residuals: Float) -> tuple[int, ...]:
    """Return inconsistent points, the worst first (W. Baarda, data snooping, 1968).

    After each significant one the search continues among the others, because a gross error also
    affects its neighbours. ``covariance`` (n, n), mm^2: along the normals; ``residuals`` (n,), mm:
    of any sphere nearby.
    """
    left = np.arange(len(normals))
    found: list[int] = []
    while len(found) < _MOST_DOUBTFUL and len(left) > LEAST_POINTS:
        weight = np.linalg.inv(covariance[np.ix_(left, left)])
        rows = _rows(normals[left])
        normal = rows.T @ weight @ rows
        if np.linalg.cond(normal) > _WORST_CONDITION:
            break
        reduced = weight - weight @ rows @ np.linalg.solve(normal, rows.T @ weight)
        own = np.diag(reduced)
        # An uncontrolled point (zero redundancy) cannot be contradicted.
        known = own > 1e-9 * np.diag(weight)
        size = np.where(known, reduced @ residuals[left] / np.sqrt(np.where(known, own, 1.0)), 0.0)
        worst = int(np.argmax(np.abs(size)))
        if abs(size[worst]) < -float(scipy.special.ndtri(0.5 * DOUBT / len(left))):
            break
        found.append(int(left[worst]))
        left = np.delete(left, worst)
    return tuple(found)


def predicted_errors(
    touches: Sequence[RestingTouch], directions: Points3, rig: Rig, body: ProbeBody, more: Points3
) -> DiameterErrors | None:
    """Return predicted contributions to the uncertainty; None if undetermined.

    Directions from its centre; ``more`` (m, 3) are as uncertain as their nearest recorded one.
    """
    if not len(touches):
        return None
    nearest = np.argmax(more @ directions.T, axis=1) if len(more) else np.empty(0, dtype=np.int64)
    all_touches = [*touches, *(touches[i] for i in nearest)]
    normals = np.concatenate([directions, more])
    rows = _rows(normals)
    if len(rows) < 4 or np.linalg.cond(rows) > np.sqrt(_WORST_CONDITION):
        return None
    _, gain = _solved(normals, joint_covariance(all_touches, normals[:, None], rig, body))
    return errors_of(all_touches, normals, 2.0 * gain[3])


def centre_of_few(tips: Points3, radius: float, pole: Float) -> Float:
    """Return the approximate centre (3,), mm, of a sphere; the first point is near the pole."""
    start = tips[0] - radius * pole
    centre = start
    loose = 0.05
    for _ in range(_STEPS):
        away = tips - centre
        distance = np.maximum(np.linalg.norm(away, axis=1), 1e-9)
        rows = np.concatenate([away / distance[:, None], loose * np.eye(3)])
        step = np.linalg.lstsq(rows, np.concatenate([distance - radius, loose * (start - centre)]))
        centre = centre + step[0]
        if float(np.abs(step[0]).max()) < 1e-6:
            break
    return np.asarray(centre)


def _rows(normals: Points3) -> Float:
    return np.column_stack([normals, np.ones(len(normals))])


def _solved(normals: Points3, covariance: Float) -> tuple[Float, Float]:
    """Return the covariance (4, 4) of centre and radius, and their gain (4, n)."""
    rows = _rows(normals)
    weighted = np.linalg.solve(covariance, rows)
    normal = rows.T @ weighted
    if np.linalg.cond(normal) > _WORST_CONDITION:
        raise _undetermined()
    inverse = np.linalg.inv(normal)
    return inverse, inverse @ weighted.T


def _plain_residuals(normals: Points3, covariance: Float) -> Float:
    rows = _rows(normals)
    left = np.eye(len(rows)) - rows @ np.linalg.pinv(rows)
    return left @ covariance @ left.T


def _undetermined() -> CalibrationError:
    return CalibrationError(
        "tip.sphere",
        "The points do not determine a sphere.",
        "Touch it all around, from the pole to the equator.",
    )
