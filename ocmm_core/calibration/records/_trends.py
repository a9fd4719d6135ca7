"""Changes of the cameras over calibrations, and results of verifications."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from ocmm_core.calibration.records._records import (
    CameraRecord,
    Check,
    VerificationRecord,
    rig_from_record,
)
from ocmm_core.camera import N_PARAMETERS, PARAMETERS, CameraModel, Rig
from ocmm_core.geometry import Float


@dataclass(frozen=True, slots=True)
class Sample:
    """A value at a time."""

    when: datetime
    value: float
    sigma: float
    """`value`, `sigma`: Value and its standard uncertainty, in the unit of the course."""


@dataclass(frozen=True, slots=True)
class Course:
    """A quantity over time."""

    name: str
    """Owner of the quantity."""
    samples: tuple[Sample, ...]
    """Oldest first."""


@dataclass(frozen=True, slots=True)
class CalibrationTrends:
    """Long-term courses of a rig."""

    focal: tuple[Course, ...]
    """Focal length of each camera, mm."""
    principal_u: tuple[Course, ...]
    principal_v: tuple[Course, ...]
    """`principal_u`, `principal_v`: Principal point of each camera, px."""
    baseline: tuple[Course, ...]
    """Distance of each camera from the first one, mm."""
    error: Course
    """Per verification, the error closest to its limit, as a signed fraction of the limit."""


def trends(
    records: Sequence[CameraRecord], verifications: Sequence[VerificationRecord]
) -> CalibrationTrends:
    """Return the trends of a rig, oldest first; another serial number starts a new course.

    Records from `history.CalibrationStore`; CalibrationError for one without covariance.
    """
    rigs = [
        (datetime.fromisoformat(record.made_utc), rig_from_record(record)) for record in records
    ]
    return CalibrationTrends(
        focal=_lens(rigs, "focal"),
        principal_u=_lens(rigs, "u0"),
        principal_v=_lens(rigs, "v0"),
        baseline=_baselines(rigs),
        error=Course("largest error", tuple(_sample(record) for record in verifications)),
    )


def _lens(rigs: Sequence[tuple[datetime, Rig]], parameter: str) -> tuple[Course, ...]:
    place = PARAMETERS.index(parameter)
    found: dict[tuple[str, ...], list[Sample]] = {}
    for when, rig in rigs:
        sigmas = np.sqrt(np.diag(rig.parameter_covariance)).reshape(-1, N_PARAMETERS)
        for camera, sigma in zip(rig.cameras, sigmas, strict=True):
            sample = Sample(when, float(getattr(camera, parameter)), float(sigma[place]))
            found.setdefault(_name(camera), []).append(sample)
    return _courses(found)


def _baselines(rigs: Sequence[tuple[datetime, Rig]]) -> tuple[Course, ...]:
    found: dict[tuple[str, ...], list[Sample]] = {}
    for when, rig in rigs:
        first = rig.cameras[0]
        for index, camera in enumerate(rig.cameras[1:], start=1):
            between = camera.centre_world - first.centre_world
            length = float(np.linalg.norm(between))
            gradient = np.zeros(len(rig.parameter_covariance))
            for sign, place in ((-1.0, 0), (1.0, index)):
                part = slice(place * N_PARAMETERS, place * N_PARAMETERS + 6)
                gradient[part] = sign * between / length @ _centre_jacobian(rig.cameras[place])
            sigma = float(np.sqrt(gradient @ rig.parameter_covariance @ gradient))
            found.setdefault((*_name(first), *_name(camera)), []).append(
                Sample(when, length, sigma)
            )
    return _courses(found)


def _centre_jacobian(camera: CameraModel) -> Float:
    """Return d(centre_world) / d(rotation, translation), (3, 6), see `camera.model.PARAMETERS`.

    The centre is ``-R^T t``; a small rotation w of the camera turns R to ``(1 + [w]) R``.
    """
    pose = camera.T_camera_from_world
    x, y, z = pose.translation
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    jacobian: Float = -pose.rotation.T @ np.hstack([cross, np.eye(3)])
    return jacobian


def _sample(record: VerificationRecord) -> Sample:
    worst = max(record.checks, key=_share)
    return Sample(
        datetime.fromisoformat(record.made_utc),
        worst.error_mm / worst.limit_mm,
        0.5 * worst.expanded_mm / worst.limit_mm,
    )


def _share(check: Check) -> float:
    return abs(check.error_mm) / check.limit_mm


def _name(camera: CameraModel) -> tuple[str, str]:
    return camera.name, str(camera.serial)


def _courses(found: dict[tuple[str, ...], list[Sample]]) -> tuple[Course, ...]:
    """Name each course as briefly as unambiguous: serial numbers only if they changed."""
    short = [" – ".join(name[::2]) for name in found]
    return tuple(
        Course(
            words if short.count(words) == 1 else " – ".join(map(" ".join, _pairs(name))),
            tuple(samples),
        )
        for words, (name, samples) in zip(short, found.items(), strict=True)
    )


def _pairs(name: tuple[str, ...]) -> list[tuple[str, str]]:
    return list(zip(name[::2], name[1::2], strict=True))
