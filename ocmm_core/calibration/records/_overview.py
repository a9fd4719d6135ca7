"""Everything that is kept about the calibrations of a rig, for a page to show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ocmm_core.calibration.records._history import CalibrationStore, Event
from ocmm_core.calibration.records._records import VerificationRecord
from ocmm_core.calibration.records._trends import CalibrationTrends, trends
from ocmm_core.errors import OcmmError

NO_TRENDS = trends([], [])


@dataclass(frozen=True, slots=True)
class CalibrationOverview:
    """What the store of a rig holds.

    Attributes
    ----------
    events
        What happened, oldest first.
    trends
        Over all calibrations and verifications.
    verifications
        The last one of each calibration that has one, by its hash.
    fault
        Why a part of it cannot be shown; empty where all can.
    """

    events: tuple[Event, ...] = ()
    trends: CalibrationTrends = NO_TRENDS
    verifications: Mapping[str, VerificationRecord] = field(default_factory=dict)
    fault: str = ""


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
