"""One job from its raw spots under two calibrations: its own, and a later one.

A calibration is fitted to the raw spots point by point. Residuals have three reasons: poses of the
probe, parameter errors within their covariance, and noise. The rest is a chi-square (generalised
least squares with a prior; GUM 5.2.2 and Searle, Linear Models, 2.5). A calibration that does not
describe the cameras leaves more than noise; after a movement without effect on residuals both
calibrations fit.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ocmm_core import tracking
from ocmm_core.alignment import Relocation, saved_frame_in
from ocmm_core.calibration.records import CameraRecord, rig_from_record
from ocmm_core.camera import N_PARAMETERS, Rig, project, projection_jacobians
from ocmm_core.errors import OcmmError, TrackingError
from ocmm_core.geometry import Float
from ocmm_core.inspection import evaluation
from ocmm_core.inspection.finished import KnownOfJob, ReopenedJob, reopen_content
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobHead
from ocmm_core.tolerances.decisions import CharacteristicResult
from ocmm_core.tolerances.kinds import needs_part_frame


@dataclass(frozen=True, slots=True)
class Misfit:
    """Misfit of one calibration over n points, in their order."""

    poses: tracking.PoseBatch
    first: Float
    last: Float
    """`first`, `last`: (n + 1,): chi-square of points before, and from, each index on."""
    dof: Float
    """(n + 1,): degrees of freedom of the points before each index."""
    alike: float
    """Mean number of spots that share one error (>= 1): divides the number of observations."""


def misfit_of(
    points: Sequence[MeasuredPoint], rig: Rig, body: tracking.ProbeBody, scale: float = 1.0
) -> Misfit:
    """Return the fit of points to a calibration; TrackingError if a pose is undetermined.

    `points`: one or more. `scale`: of the spots' noise, in standard deviations: the calibration's
    own residual beyond the noise of the rig.
    """
    spots = np.stack([point.spots for point in points])
    poses = tracking.solve(spots, rig, body, tracking.spot_sigma_px(rig))
    if np.any(poses.status):
        lost = points[int(np.flatnonzero(poses.status)[0])].number
        raise TrackingError(
            "tracking.targets",
            f"The spots of point {lost} do not determine a pose.",
            "Take the point again.",
        )
    frames = np.array([point.n_frames for point in points], dtype=np.float64)
    sigma = scale * np.sqrt(rig.noise.white_px**2 / frames + rig.noise.pattern_px**2)
    residuals, by_pose, by_prior = _rows(spots, poses, rig, body)
    factor = _factor(rig, body)
    n, width = len(points), factor.shape[1]
    normal, right, squares = np.zeros((n, width, width)), np.zeros((n, width)), np.zeros(n)
    dof = np.zeros(n)
    for index in range(n):
        seen = np.isfinite(residuals[index])
        rest = residuals[index, seen] / sigma[index]
        # Changes explained by the pose prove nothing about the cameras.
        basis, _ = np.linalg.qr(by_pose[index, seen])
        rows = (by_prior[index, seen] @ factor) / sigma[index]
        rest = rest - basis @ (basis.T @ rest)
        rows = rows - basis @ (basis.T @ rows)
        normal[index], right[index] = rows.T @ rows, rows.T @ rest
        squares[index], dof[index] = float(rest @ rest), np.count_nonzero(seen) - 6
    zero = np.zeros(1)
    return Misfit(
        poses=poses,
        first=_courses(normal, right, squares),
        last=_courses(normal[::-1], right[::-1], squares[::-1])[::-1],
        dof=np.concatenate([zero, np.cumsum(dof)]),
        alike=_alike(spots, rig),
    )


def _rows(
    spots: Float, poses: tracking.PoseBatch, rig: Rig, body: tracking.ProbeBody
) -> tuple[Float, Float, Float]:
    """Return residuals (n, m), px, NaN if unseen, and derivatives by pose, cameras and LEDs."""
    n, cameras, leds, _ = spots.shape
    turned = np.einsum("nij,lj->nli", poses.rotation_world_from_probe, body.leds_probe)
    world = turned + poses.origin_world[:, None]
    residuals = np.empty((n, cameras, leds, 2))
    by_pose = np.empty((n, cameras, leds, 2, 6))
    by_prior = np.zeros((n, cameras, leds, 2, N_PARAMETERS * cameras + 3 * leds))
    for c, camera in enumerate(rig.cameras):
        residuals[:, c] = spots[:, c] - project(camera, world)
        jacobian, parameters = projection_jacobians(camera, world.reshape(-1, 3))
        d_point = jacobian.reshape(n, leds, 2, 3)
        by_pose[:, c, :, :, :3] = np.cross(turned[:, :, None], d_point)
        by_pose[:, c, :, :, 3:] = d_point
        own = slice(c * N_PARAMETERS, (c + 1) * N_PARAMETERS)
        by_prior[:, c, :, :, own] = parameters.reshape(n, leds, 2, N_PARAMETERS)
        of_leds = np.einsum("nlai,nij->nlaj", d_point, poses.rotation_world_from_probe)
        for led in range(leds):
            place = N_PARAMETERS * cameras + 3 * led
            by_prior[:, c, led, :, place : place + 3] = of_leds[:, led]
    rows = 2 * cameras * leds
    return (residuals.reshape(n, rows), by_pose.reshape(n, rows, 6), by_prior.reshape(n, rows, -1))


def _factor(rig: Rig, body: tracking.ProbeBody) -> Float:
    """Return F with F F' the covariance of the parameters of all cameras and of the LEDs."""
    leds = body.leds_probe.size
    size = len(rig.parameter_covariance)
    covariance = np.zeros((size + leds, size + leds))
    covariance[:size, :size] = rig.parameter_covariance
    covariance[size:, size:] = body.geometry_covariance[:leds, :leds]
    # Angles, pixels and polynomial terms differ by powers of ten.
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    factor: Float = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    return factor


def _courses(normal: Float, right: Float, squares: Float) -> Float:
    """Return the chi-square of the first 0, 1, ... n points, the parameters free in their prior."""
    n, width = right.shape
    found = np.zeros(n + 1)
    sum_normal, sum_right, total = np.eye(width), np.zeros(width), 0.0
    for index in range(n):
        sum_normal += normal[index]
        sum_right += right[index]
        total += squares[index]
        found[index + 1] = total - float(sum_right @ np.linalg.solve(sum_normal, sum_right))
    return found


def _alike(spots: Float, rig: Rig) -> float:
    """Return the mean sum of correlations of a spot with all spots of its camera.

    The variance of a mean of n equal errors with this correlation is this multiple of that of n
    independent ones: n spots are worth n divided by this.
    """
    noise = rig.noise
    if noise.pattern_px <= 0.0:
        return 1.0
    sums = []
    for c in range(spots.shape[1]):
        uv = spots[:, c].reshape(-1, 2)
        uv = uv[np.isfinite(uv).all(axis=1)]
        apart = np.sum((uv[:, None] - uv[None]) ** 2, axis=2)
        sums.append(np.exp(-0.5 / noise.pattern_length_px**2 * apart).sum(axis=1))
    return float(np.concatenate(sums).mean())


_OF_CAMERAS = (evaluation.HoldReason.CALIBRATION, evaluation.HoldReason.FAILED_CALIBRATION)


@dataclass(frozen=True, slots=True)
class Later:
    """Calibration to recalculate a job with."""

    record: CameraRecord | None
    """None if there is none."""
    calibration: str = ""
    """Hash of the record; empty without one."""
    why_not: str = ""
    """Why there is none; else empty."""
    scale: float = 1.0
    """Of the noise of the spots (`_recall_job.misfit_of`)."""


@dataclass(frozen=True, slots=True)
class Anew:
    """Results of a job by a later calibration, and the fit of its spots to both."""

    own_fit: Misfit
    later_fit: Misfit
    """`own_fit`, `later_fit`: Of its own calibration and of the later one."""
    results: tuple[CharacteristicResult, ...]
    """Of all characteristics by the later one; not proven if suspect for other reasons."""


@dataclass(frozen=True, slots=True)
class JobFindings:
    """A job under its own calibration and under a later one."""

    path: Path
    sha256: str
    """`path`, `sha256`: The file, and the hash of its content."""
    name: str
    """Name of the job in the file."""
    head: JobHead
    rig: str
    calibration: str
    """`head`, `rig`, `calibration`: Its metadata; name of the rig and hash of its calibration."""
    simulated: bool
    """Its points come from a virtual rig."""
    points: tuple[MeasuredPoint, ...]
    """That count, in their order."""
    requirements: str
    """Sentence with the count of requirements that the plan contains; empty if it has all."""
    begun_utc: str
    ended_utc: str
    """`begun_utc`, `ended_utc`: Storage times of the first and the last of them."""
    in_doubt: Mapping[int, str]
    """Suspect points by the history of the calibration, and why."""
    own: tuple[CharacteristicResult, ...]
    """Results of all characteristics; not proven if suspect for other reasons."""
    anew: Anew | None
    """The same by the later calibration; None if it cannot be computed."""
    in_world: tuple[bool, ...]
    """Per characteristic: stated in the world of the cameras, which a new calibration changes."""
    rests_on: tuple[tuple[int, ...], ...]
    """Per characteristic: indices in ``points`` that it depends on."""
    why_not: str
    """Why nothing can be judged; empty if ``anew`` exists."""
    later_calibration: str
    """Hash of the later calibration; empty without one."""
    left_out: str = ""
    """Incomplete steps of its file, as a sentence; empty if none."""


@dataclass(frozen=True, slots=True)
class DoubtedJob:
    """A suspect job and its later calibration; can be sent to another computer."""

    path: Path
    later: Later
    in_doubt: Mapping[int, str]
    """Suspect points by the history of its calibration, and why."""
    known: KnownOfJob
    """Outside its file; of the calibration whether it can be read (``in_doubt`` has the rest)."""


def findings_of(doubted: DoubtedJob, file: bytes) -> JobFindings:
    """Return a job under both calibrations, without files or histories of this computer.

    `file`: bytes of the job, with the steps of its log. OcmmError as `reopen_job`.
    """
    path, later, in_doubt = doubted.path, doubted.later, doubted.in_doubt
    job = reopen_content(path, file, doubted.known)
    held = {
        hold_reason: {} if hold_reason in _OF_CAMERAS else job.held[hold_reason]
        for hold_reason in evaluation.HoldReason
    }
    status = evaluation.JobStatus(evaluation.notes_of(held), "")
    own = _results(job, job.points, job.sensitivities, job.rig, status)
    why_not = _hindrance(job) or later.why_not
    anew: Anew | None = None
    if not why_not and later.record is not None:
        try:
            anew = _anew(job, rig_from_record(later.record), status, later.scale)
        except OcmmError as error:
            why_not = f"Cannot be recalculated with the later calibration: {error.what}"
    places: dict[str, list[int]] = {point.feature: [] for point in job.points}
    for place, point in enumerate(job.points):
        places[point.feature].append(place)
    part = job.view.part_verdict
    stored = [job.taken_utc[point.number] for point in job.points]
    return JobFindings(
        path=path,
        sha256=hashlib.sha256(file).hexdigest(),
        name=job.view.job,
        head=job.head,
        rig=job.rig.name,
        calibration=job.head.rig_identity,
        simulated=job.view.simulated,
        points=job.points,
        requirements=f"{part.requirement_words}." if part.is_partial else "",
        begun_utc=min(stored, default=job.head.created_utc),
        ended_utc=max(stored, default=job.head.created_utc),
        in_doubt=in_doubt,
        own=own,
        anew=anew,
        in_world=tuple(
            job.plan.alignment is None and needs_part_frame(item)
            for item in job.plan.characteristics
        ),
        rests_on=tuple(
            tuple(sorted(i for name in job.plan.rests_on(item) for i in places.get(name, ())))
            for item in job.plan.characteristics
        ),
        why_not=why_not,
        later_calibration=later.calibration,
        left_out=job.left_out,
    )


def _anew(job: ReopenedJob, rig: Rig, status: evaluation.JobStatus, scale: float) -> Anew:
    """Return a job by a later calibration; OcmmError if it cannot be computed."""
    own = misfit_of(job.points, job.rig, job.body, scale)
    later = misfit_of(job.points, rig, job.body, scale)
    points, sensitivities = _moved(job, own, later, rig)
    return Anew(own, later, _results(job, points, sensitivities, rig, status))


def _hindrance(job: ReopenedJob) -> str:
    """Return why a job cannot be computed with other cameras; empty if it can."""
    others = [*job.faults, *job.differences, *job.cameras.unread, *job.history.unread]
    if others:
        fault = others[0]
        return f"The job file is suspect: {fault}"
    if job.view.unproven:
        return job.view.unproven
    if not job.points:
        return "The job has no points."
    if job.options.reference is not None:
        return "Measured with a reference body whose initial position refers to the old cameras."
    rule = job.plan.alignment
    if isinstance(rule, Relocation) or saved_frame_in(rule) is not None:
        return "Based on a saved frame whose position is unknown to the later calibration."
    return ""


def _results(
    job: ReopenedJob,
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[tracking.TipSensitivity],
    rig: Rig,
    status: evaluation.JobStatus,
) -> tuple[CharacteristicResult, ...]:
    done = {one.name for one in job.view.features if one.state is evaluation.FeatureState.DONE}
    skipped = {
        one.name for one in job.view.features if one.state is evaluation.FeatureState.SKIPPED
    }
    found = evaluation.evaluate_job(
        job.plan, points, sensitivities, rig, job.body, job.options,
        frozenset(done), frozenset(skipped),
    )  # fmt: skip
    return found.judged(status)


def _moved(
    job: ReopenedJob, own: Misfit, later: Misfit, rig: Rig
) -> tuple[list[MeasuredPoint], tuple[tracking.TipSensitivity, ...]]:
    sensitivities = tracking.tip_sensitivities(
        np.stack([point.spots for point in job.points]), rig, job.body
    )
    points = []
    for index, (point, found) in enumerate(zip(job.points, sensitivities, strict=True)):
        turn = (
            later.poses.rotation_world_from_probe[index]
            @ own.poses.rotation_world_from_probe[index].T
        )
        # The mean tip of the frames is not quite the tip of their mean spots.
        apart = point.tip_world - job.sensitivities[index].tip_world
        points.append(
            replace(
                point,
                tip_world=found.tip_world + turn @ apart,
                random_covariance=turn @ point.random_covariance @ turn.T,
                direction=turn @ point.direction,
                rotation_world_from_probe=turn @ point.rotation_world_from_probe,
            )
        )
    return points, sensitivities
