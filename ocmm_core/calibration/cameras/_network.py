"""Calibration of all cameras of a rig from one list of known points.

Each is fitted alone (a joint fit differs by less than a thousandth, measured); the common error of
the reference points couples their uncertainties. Points held back show the errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from ocmm_core.calibration.cameras import _guards as guards
from ocmm_core.calibration.cameras._lens import by_point, project_with_jacobian
from ocmm_core.calibration.cameras._model_fit import (
    CameraFit,
    fit_camera,
    indices_of_wrong,
    whitening_of,
)
from ocmm_core.calibration.cameras._reference_points import KnownPoints, SpotTable
from ocmm_core.calibration.guided import CameraResiduals, Findings
from ocmm_core.calibration.records import Finding, let_pass
from ocmm_core.camera import N_PARAMETERS, CameraModel, Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Int, Pixels, Points3
from ocmm_core.tracking import triangulate


def own_covariance(fit: CameraFit, points: KnownPoints) -> Float:
    """Return a camera's covariance (14, 14), scaled by chi-square per dof if above one."""
    stretch = _stretch(fit, points)
    return fit.covariance * max(1.0, fit.chi2 / fit.dof) + np.outer(stretch, stretch)


def joint_covariance(
    fits: Sequence[CameraFit], indices: Sequence[Int], points: KnownPoints
) -> Float:
    """Return the covariance (14 C, 14 C) of all cameras; ``indices``: their points.

    An error d of a reference point shifts every camera that used it by -C J' W Jp d, C its
    covariance; two such gains times the variance of d are their covariance. So is the length error
    of the list.
    """
    count = len(fits)
    covariance = np.zeros((N_PARAMETERS * count,) * 2)
    gains = np.zeros((count, N_PARAMETERS, len(points.names), 3))
    stretches = [_stretch(fit, points) for fit in fits]
    for c, (fit, seen) in enumerate(zip(fits, indices, strict=True)):
        part = slice(c * N_PARAMETERS, (c + 1) * N_PARAMETERS)
        covariance[part, part] = own_covariance(fit, points)
        gains[c][:, seen[fit.used]] = _reference_gain(fit)
    for a in range(count):
        for b in range(a + 1, count):
            common = points.sigma**2 * np.einsum("pni,qni->pq", gains[a], gains[b])
            common += np.outer(stretches[a], stretches[b])
            rows, columns = (slice(c * N_PARAMETERS, (c + 1) * N_PARAMETERS) for c in (a, b))
            covariance[rows, columns] = common
            covariance[columns, rows] = common.T
    return covariance


def _stretch(fit: CameraFit, points: KnownPoints) -> Float:
    """Return the change (14,) per sigma of list length: away in its ratio, centroid fixed."""
    move = np.zeros(N_PARAMETERS)
    pose = fit.camera.model.T_camera_from_world
    move[3:6] = points.length_sigma * pose.apply(points.positions_world.mean(axis=0))
    return move


def _reference_gain(fit: CameraFit) -> Float:
    """Return d(parameters)/d(reference position), (14, n, 3), of the used points."""
    points = fit.points_world[fit.used]
    whitening = whitening_of(fit.camera, points, fit.sigma_px, fit.reference_sigma)
    rows = project_with_jacobian(fit.camera, points, N_PARAMETERS, whitening=whitening).rows
    gain: Float = -np.einsum(
        "pq,qun,uin->pni", fit.covariance, rows, by_point(fit.camera, rows), optimize=True
    )
    return gain


@dataclass(frozen=True, slots=True)
class Outlier:
    """An outlier point."""

    name: str
    miss_px: Float
    """(2,), observed minus predicted."""


@dataclass(frozen=True, slots=True)
class CameraCalibration:
    """One calibrated camera with its evaluation."""

    model: CameraModel
    covariance: Float
    """(14, 14), order of `camera.model.PARAMETERS`; scaled by chi-square per degree of freedom if
    above one; with the length uncertainty of the list."""
    rms_px: float
    chi2: float
    dof: int
    """`rms_px`, `chi2`, `dof`: RMS residual per coordinate; chi-square and degrees of freedom."""
    indices: Int
    """(n,): indices of the reference points seen by the camera."""
    uv: Pixels
    residuals_px: Pixels
    """`uv`, `residuals_px`: (n, 2), px; residuals are observed minus predicted."""
    used: np.ndarray[tuple[int], np.dtype[np.bool_]]
    """(n,): False for the outliers."""
    outliers: tuple[Outlier, ...]
    """Worst first."""
    warnings: tuple[Finding, ...]
    """Findings that did not refuse it."""
    start: str


@dataclass(frozen=True, slots=True)
class RigCalibration:
    """All cameras of a rig, calibrated together."""

    cameras: tuple[CameraCalibration, ...]
    covariance: Float
    """(14 C, 14 C), with the common effects of reference points and list length."""
    warnings: tuple[Finding, ...]
    hull_world: Points3
    """(h, 3), mm: corners of the convex hull of the points used by at least two cameras."""
    forced: bool

    @property
    def volume_world(self) -> Float:
        """Return the box around the calibrated volume, (2, 3), mm."""
        return np.stack([self.hull_world.min(axis=0), self.hull_world.max(axis=0)])

    def applied_to(self, rig: Rig, identity: str) -> Rig:
        """Return the rig with these cameras and the ``identity`` of the record."""
        return replace(
            rig,
            cameras=tuple(camera.model for camera in self.cameras),
            volume_world=self.volume_world,
            parameter_covariance=self.covariance,
            identity=identity,
        )


def calibrate_rig(
    rig: Rig, points: KnownPoints, spots: SpotTable, force: bool = False
) -> RigCalibration:
    """Calibrate all cameras of ``rig`` from known points (thesis 3.1).

    ``rig`` gives names, serials, sensors, nominal focal lengths and rough distances; ``force``
    turns guards on the design into warnings. CalibrationError if a guard refuses, see `guards`.
    """
    rows = _rows_of(rig, spots)
    fits: list[CameraFit] = []
    indices: list[Int] = []
    findings: list[list[Finding]] = []
    for nominal, row in zip(rig.cameras, rows, strict=True):
        seen = np.flatnonzero(np.isfinite(spots.uv[row]).all(axis=1)).astype(np.int64)
        at, uv = points.positions_world[seen], spots.uv[row, seen]
        fit = _fit_or_explain(nominal, at, uv, spots.sigma_px, points.sigma)
        found = guards.judge_fit(fit, [points.names[i] for i in seen])
        # Refuse hopeless fits here: a test of their lens terms would be meaningless.
        let_pass(found, force=True)
        fits.append(fit)
        indices.append(seen)
        terms = guards.judge_lens_terms(fit)
        findings.append([*found, *guards.judge_lens(nominal.name, fit.sigma_px, terms)])
    everything = [*_baselines(rig, fits), *(one for found in findings for one in found)]
    warnings = let_pass(everything, force)
    cameras = tuple(
        _camera_calibration(fit, points, seen, let_pass(found, force))
        for fit, seen, found in zip(fits, indices, findings, strict=True)
    )
    return RigCalibration(
        cameras=cameras,
        covariance=joint_covariance(fits, indices, points),
        warnings=warnings,
        hull_world=_hull(points, fits, indices),
        forced=any(one.refuses for one in everything),
    )


def _fit_or_explain(
    nominal: CameraModel, at: Points3, uv: Pixels, sigma_px: float, reference_sigma: float
) -> CameraFit:
    """Fit one camera; raise if the list fits only in another order."""
    try:
        fit = fit_camera(nominal, at, uv, sigma_px, reference_sigma)
    except CalibrationError as error:
        if error.code == "calibration.too_few_points":
            raise
        _refuse_mix_up(nominal, at, uv, sigma_px, reference_sigma)
        raise
    if guards.ratio_of(fit) > guards.RMS_REFUSED or np.mean(~fit.used) > guards.OUTLIERS_REFUSED:
        _refuse_mix_up(nominal, at, uv, sigma_px, reference_sigma)
    return fit


def _refuse_mix_up(
    nominal: CameraModel, at: Points3, uv: Pixels, sigma_px: float, reference_sigma: float
) -> None:
    mixed_up = guards.explain_misfit(nominal, at, uv, sigma_px, reference_sigma)
    if mixed_up is not None:
        let_pass([mixed_up], force=False)


def _rows_of(rig: Rig, spots: SpotTable) -> list[int]:
    expected = {camera.serial: camera.name for camera in rig.cameras}
    strange = [serial for serial in spots.serials if serial not in expected]
    missing = [serial for serial in expected if serial not in spots.serials]
    if strange or missing:
        said = [f"spots of camera {serial}, which is not in this rig" for serial in strange]
        said += [f"none of camera {s} ('{expected[s]}')" for s in missing]
        raise CalibrationError(
            "calibration.serial_mismatch",
            f"The spots were not taken with the cameras of rig '{rig.name}': {'; '.join(said)}.",
            "Select the rig the spots were taken with, or correct the serial numbers in its "
            "document if a camera was replaced.",
        )
    return [spots.serials.index(camera.serial) for camera in rig.cameras]


def _baselines(rig: Rig, fits: Sequence[CameraFit]) -> list[Finding]:
    found = []
    first = rig.cameras[0]
    for nominal, fit in zip(rig.cameras[1:], fits[1:], strict=True):
        centres = fits[0].camera.model.centre_world, fit.camera.model.centre_world
        found += guards.explain_baseline(
            first.name,
            nominal.name,
            float(np.linalg.norm(centres[1] - centres[0])),
            float(np.linalg.norm(nominal.centre_world - first.centre_world)),
        )
    return found


def _camera_calibration(
    fit: CameraFit, points: KnownPoints, seen: Int, warnings: tuple[Finding, ...]
) -> CameraCalibration:
    outliers = tuple(
        Outlier(points.names[seen[i]], fit.residuals_px[i]) for i in indices_of_wrong(fit)
    )
    return CameraCalibration(
        model=fit.camera.model, covariance=own_covariance(fit, points), rms_px=fit.rms_px,
        chi2=fit.chi2, dof=fit.dof, indices=seen, uv=fit.uv, residuals_px=fit.residuals_px,
        used=fit.used, outliers=outliers, warnings=warnings, start=fit.start,
    )  # fmt: skip


def _hull(points: KnownPoints, fits: Sequence[CameraFit], indices: Sequence[Int]) -> Points3:
    views = np.zeros(len(points.names), dtype=np.int64)
    for fit, seen in zip(fits, indices, strict=True):
        views[seen[fit.used]] += 1
    common = points.positions_world[views >= 2]
    try:
        return common[scipy.spatial.ConvexHull(common).vertices]
    except (scipy.spatial.QhullError, ValueError) as error:
        raise CalibrationError(
            "calibration.no_common_volume",
            f"Only {len(common)} points, or points in one plane, were seen by two cameras.",
            "Aim the cameras at one common volume, and take the points there.",
        ) from error


def split(points: KnownPoints, calibration: int, rng: np.random.Generator) -> tuple[Int, Int]:
    """Return random disjoint calibration, evaluation indices; CalibrationError if one is empty."""
    n = len(points.names)
    if not 0 < calibration < n:
        raise CalibrationError(
            "calibration.split",
            f"{calibration} of {n} points for calibration leave none for evaluation.",
            f"Use between 1 and {n - 1} points, typically half of them.",
        )
    order = rng.permutation(n).astype(np.int64)
    return np.sort(order[:calibration]), np.sort(order[calibration:])


def subset(points: KnownPoints, spots: SpotTable, indices: Int) -> tuple[KnownPoints, SpotTable]:
    names = tuple(points.names[index] for index in indices)
    return (
        replace(points, names=names, positions_world=points.positions_world[indices]),
        SpotTable(spots.serials, spots.uv[:, indices], spots.sigma_px),
    )


def located_errors(rig: Rig, points: KnownPoints, spots: SpotTable) -> Points3:
    """Return located minus reference (n, 3), mm; NaN if seen by fewer than two cameras.

    CalibrationError if no point was seen by two cameras.
    """
    rows = [spots.serials.index(camera.serial) for camera in rig.cameras]
    errors: Points3 = triangulate(rig, spots.uv[rows]) - points.positions_world
    if not np.isfinite(errors).all(axis=1).any():
        raise CalibrationError(
            "calibration.no_evaluation",
            "No evaluation point was seen by two cameras.",
            "Take evaluation points where the camera views overlap.",
        )
    return errors


def found_by(
    rig: Rig, points: KnownPoints, table: SpotTable, evaluation: int, force: bool
) -> Findings:
    """Return the findings, ``evaluation`` points held back; raises as `calibrate_rig`."""
    used, held = (points, table), None
    if evaluation:
        chosen, rest = split(points, len(points.names) - evaluation, np.random.default_rng(0))
        used, held = subset(points, table, chosen), subset(points, table, rest)
    calibration = calibrate_rig(rig, *used, force)
    at, errors = np.empty((0, 3)), np.empty((0, 3))
    if held is not None:
        located = located_errors(calibration.applied_to(rig, rig.identity), *held)
        seen = np.isfinite(located).all(axis=1)
        at, errors = held[0].positions_world[seen], located[seen]
    squares = [(one.chi2, one.dof) for one in calibration.cameras]
    residuals = np.concatenate([one.residuals_px[one.used] for one in calibration.cameras])
    return Findings(
        cameras=tuple(one.model for one in calibration.cameras),
        covariance=calibration.covariance,
        volume_world=calibration.volume_world,
        hull_world=calibration.hull_world,
        residuals=tuple(
            CameraResiduals(one.model.name, one.uv, one.residuals_px, one.used)
            for one in calibration.cameras
        ),
        rms_px=float(np.sqrt(np.mean(residuals**2))),
        chi2_per_dof=sum(chi2 for chi2, _ in squares) / sum(dof for _, dof in squares),
        points=len({int(i) for one in calibration.cameras for i in one.indices[one.used]}),
        outliers=tuple(
            f"{one.name} in {camera.model.name}"
            for camera in calibration.cameras
            for one in camera.outliers
        ),
        errors_at_world=at,
        errors_world=errors,
        warnings=calibration.warnings,
    )
