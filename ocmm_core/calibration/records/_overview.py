"""Everything that is kept about the calibrations of a rig, or a probe with its tips, for a page."""

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
from ocmm_core.calibration.records._records import VerificationRecord
from ocmm_core.calibration.records._sealed import record_hash
from ocmm_core.calibration.records._trends import CalibrationTrends, Course, Sample, trends
from ocmm_core.errors import OcmmError

NO_TRENDS = trends([], [])


@dataclass(frozen=True, slots=True)
class CalibrationOverview:
    """What the store of a rig holds."""

    events: tuple[Event, ...] = ()
    """What happened, oldest first."""
    trends: CalibrationTrends = NO_TRENDS
    """Over all calibrations and verifications."""
    verifications: Mapping[str, VerificationRecord] = field(default_factory=dict)
    """The last one of each calibration that has one, by its hash."""
    fault: str = ""
    """Why a part of it cannot be shown; empty where all can."""


def overview(store: CalibrationStore | None) -> CalibrationOverview:
    """Return what a store holds; reads all its records, some milliseconds for each.

    A record that was changed is a fault, not an error: the rest is worth being seen.
    """
    if store is None:
        return CalibrationOverview()
    try:
        store.refresh()
        verifications = store.verifications()
        found = trends(store.records(), verifications)
    except OcmmError as error:
        return CalibrationOverview(store.events, fault=str(store.defect(thorough=True) or error))
    # Of every calibration, because a job may still be measured with one that was replaced since.
    last = {record.calibration: record for record in verifications}
    return CalibrationOverview(store.events, found, last)


@dataclass(frozen=True, slots=True)
class TipState:
    """One tip as it stands."""

    tip: str
    """Name."""
    mounted: bool
    """It is on the probe."""
    status: RecordStatus
    """Whether it may be trusted."""
    calibration: ProbeRecord
    qualification: TipRecord | None
    """In force; None where it was not qualified since."""
    check: TipCheckRecord | None
    """The last quick check of this qualification; None where there was none."""

    @property
    def due_utc(self) -> str:
        """Return until when its records hold, ISO 8601 text."""
        return TipRecords(self.calibration, self.qualification).due_utc


@dataclass(frozen=True, slots=True)
class ProbeTrends:
    """What is worth watching over the years; one course for each tip."""

    diameter: tuple[Course, ...] = ()
    form: tuple[Course, ...] = ()
    """`diameter`, `form`: Of the ball, mm, of all qualifications."""
    place: tuple[Course, ...] = ()
    """Distance of the tip from where its first calibration had it, mm."""
    check: tuple[Course, ...] = ()
    """Of each quick check, the error that came nearest to its limit, as a part of that limit."""


@dataclass(frozen=True, slots=True)
class ProbeOverview:
    """What the store of a probe holds."""

    tips: tuple[TipState, ...] = ()
    """All that were ever calibrated, the mounted one first."""
    events: tuple[TipEvent, ...] = ()
    """What happened, oldest first."""
    trends: ProbeTrends = ProbeTrends()
    """Over all records."""
    fault: str = ""
    """Why a part of it cannot be shown; empty where all can."""


def probe_overview(store: ProbeStore | None, now: datetime) -> ProbeOverview:
    """Return what a store holds at a moment; reads all its records, some milliseconds for each.

    A record that was changed is a fault, not an error: the rest is worth being seen.
    """
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
        tip=tip,
        mounted=tip == store.mounted,
        status=store.status_of(active, now, thorough=True),
        calibration=active.calibration,
        qualification=active.qualification,
        check=check,
    )


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
        check=_courses([(one.tip, _nearest(one)) for one in checks if one.checks]),
    )


def _nearest(record: TipCheckRecord) -> Sample:
    worst = max(record.checks, key=lambda one: abs(one.error_mm) / one.limit_mm)
    return Sample(
        datetime.fromisoformat(record.made_utc),
        worst.error_mm / worst.limit_mm,
        0.5 * worst.expanded_mm / worst.limit_mm,
    )


def _courses(samples: Sequence[tuple[str, Sample]]) -> tuple[Course, ...]:
    names = dict.fromkeys(name for name, _ in samples)
    return tuple(Course(name, tuple(one for tip, one in samples if tip == name)) for name in names)
