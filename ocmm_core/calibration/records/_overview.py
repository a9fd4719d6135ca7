"""Contents of a calibration or probe store, for display.

Also the changes of the cameras over calibrations, and results of verifications.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime

import numpy as np

from ocmm_core.calibration.records._events import Event, TipEvent, TipRecords
from ocmm_core.calibration.records._history import CalibrationStore
from ocmm_core.calibration.records._probe_records import ProbeRecord, TipCheckRecord, TipRecord
from ocmm_core.calibration.records._probe_store import ProbeStore
from ocmm_core.calibration.records._record_store import RecordStatus
from ocmm_core.calibration.records._records import CameraRecord, VerificationRecord, rig_from_record
from ocmm_core.calibration.records._sealed import record_hash
from ocmm_core.camera import N_PARAMETERS, PARAMETERS, CameraModel, Rig
from ocmm_core.errors import OcmmError
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
    return _camera_courses(found)


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
    return _camera_courses(found)


def _centre_jacobian(camera: CameraModel) -> Float:
    """Return d(centre_world) / d(rotation, translation), (3, 6), see `camera.model.PARAMETERS`.

    The centre is ``-R^T t``; a small rotation w of the camera turns R to ``(1 + [w]) R``.
    """
    pose = camera.T_camera_from_world
    x, y, z = pose.translation
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    jacobian: Float = -pose.rotation.T @ np.hstack([cross, np.eye(3)])
    return jacobian


def _sample(record: VerificationRecord | TipCheckRecord) -> Sample:
    """Return the check nearest to its limit."""
    worst = max(record.checks, key=lambda check: abs(check.error_mm) / check.limit_mm)
    return Sample(
        datetime.fromisoformat(record.made_utc),
        worst.error_mm / worst.limit_mm,
        0.5 * worst.expanded_mm / worst.limit_mm,
    )


def _name(camera: CameraModel) -> tuple[str, str]:
    return camera.name, str(camera.serial)


def _camera_courses(found: dict[tuple[str, ...], list[Sample]]) -> tuple[Course, ...]:
    """Name each course as briefly as unambiguous: serial numbers only if they changed."""
    short = [" – ".join(name[::2]) for name in found]
    return tuple(
        Course(
            words
            if short.count(words) == 1
            else " – ".join(map(" ".join, zip(name[::2], name[1::2], strict=True))),
            tuple(samples),
        )
        for words, (name, samples) in zip(short, found.items(), strict=True)
    )


NO_TRENDS = trends([], [])


@dataclass(frozen=True, slots=True)
class CalibrationOverview:
    """Contents of the store of a rig."""

    events: tuple[Event, ...] = ()
    """Oldest first."""
    trends: CalibrationTrends = NO_TRENDS
    verifications: Mapping[str, VerificationRecord] = field(default_factory=dict)
    """Latest of each calibration, by the hash of the calibration."""
    fault: str = ""
    """Why a part cannot be shown, or empty."""


def overview(store: CalibrationStore | None) -> CalibrationOverview:
    """Return the contents of a store (ms for each record); changed records become faults."""
    if store is None:
        return CalibrationOverview()
    try:
        store.refresh()
        verifications = store.verifications()
        found = trends(store.records(), verifications)
    except OcmmError as error:
        return CalibrationOverview(store.events, fault=str(store.defect(thorough=True) or error))
    # For every calibration, as a job may still use one that was replaced since.
    last = {record.calibration: record for record in verifications}
    return CalibrationOverview(store.events, found, last)


@dataclass(frozen=True, slots=True)
class TipState:
    """Status of one tip."""

    tip: str
    mounted: bool
    status: RecordStatus
    calibration: ProbeRecord
    qualification: TipRecord | None
    """In force; None if not qualified since the calibration."""
    check: TipCheckRecord | None
    """Latest quick check of this qualification, or None."""

    @property
    def due_utc(self) -> str:
        """Return the expiry of its records, ISO 8601 text."""
        return TipRecords(self.calibration, self.qualification).due_utc


@dataclass(frozen=True, slots=True)
class ProbeTrends:
    """Long-term courses of a probe, one for each tip."""

    diameter: tuple[Course, ...] = ()
    form: tuple[Course, ...] = ()
    """`diameter`, `form`: Of the ball, mm, of all qualifications."""
    place: tuple[Course, ...] = ()
    """Distance of the tip from its first calibration, mm."""
    check: tuple[Course, ...] = ()
    """For each quick check, the error closest to its limit, as a fraction of that limit."""


@dataclass(frozen=True, slots=True)
class ProbeOverview:
    """Contents of the store of a probe."""

    tips: tuple[TipState, ...] = ()
    """All calibrated tips, the mounted one first."""
    events: tuple[TipEvent, ...] = ()
    """Oldest first."""
    trends: ProbeTrends = ProbeTrends()
    fault: str = ""
    """Why a part cannot be shown, or empty."""


def probe_overview(store: ProbeStore | None, now: datetime) -> ProbeOverview:
    """Return the contents of a store (ms for each record); changed records become faults."""
    if store is None:
        return ProbeOverview()
    try:
        store.refresh()
        checks = store.checks()
        tips = [_state(store, tip, checks, now) for tip in store.tips]
        found = _trends(store.calibrations(), store.qualifications(), checks)
    except OcmmError as error:
        return ProbeOverview(events=store.events, fault=str(store.defect(thorough=True) or error))
    ordered = sorted((one for one in tips if one is not None), key=lambda one: not one.mounted)
    return ProbeOverview(tuple(ordered), store.events, found)


def _state(
    store: ProbeStore, tip: str, checks: Sequence[TipCheckRecord], now: datetime
) -> TipState | None:
    active = store.active(tip)
    if active is None:
        return None
    check = None
    if active.qualification is not None:
        digest = record_hash(active.qualification)
        own = [one for one in checks if one.qualification == digest]
        check = own[-1] if own else None
    return TipState(
        tip=tip, mounted=tip == store.mounted, status=store.status_of(active, now, thorough=True),
        calibration=active.calibration, qualification=active.qualification, check=check,
    )  # fmt: skip


def _trends(
    calibrations: Sequence[ProbeRecord],
    qualifications: Sequence[TipRecord],
    checks: Sequence[TipCheckRecord],
) -> ProbeTrends:
    first = {one.tip: np.array(one.tip_mm) for one in reversed(calibrations)}
    moved = [
        (
            one.tip,
            Sample(
                datetime.fromisoformat(one.made_utc),
                float(np.linalg.norm(np.array(one.tip_mm) - first[one.tip])),
                one.tip_sigma_mm,
            ),
        )
        for one in calibrations
    ]
    diameters, forms = [], []
    for one in qualifications:
        when = datetime.fromisoformat(one.made_utc)
        diameters.append((one.tip, Sample(when, one.diameter_mm, one.diameter_sigma_mm)))
        forms.append((one.tip, Sample(when, one.form_mm, 0.0)))
    return ProbeTrends(
        diameter=_courses(diameters),
        form=_courses(forms),
        place=_courses(moved),
        check=_courses([(one.tip, _sample(one)) for one in checks if one.checks]),
    )


def _courses(samples: Sequence[tuple[str, Sample]]) -> tuple[Course, ...]:
    names = dict.fromkeys(name for name, _ in samples)
    return tuple(Course(name, tuple(one for tip, one in samples if tip == name)) for name in names)
