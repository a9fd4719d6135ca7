"""Everything that is kept about the calibrations of a rig, for a page to show."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.calibration.history import CalibrationStore, Event
from ocmm_core.calibration.records import VerificationRecord
from ocmm_core.calibration.trends import CalibrationTrends, trends
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
    verification
        The last one of the calibration in force; None before the first.
    fault
        Why a part of it cannot be shown; empty where all can.
    """

    events: tuple[Event, ...] = ()
    trends: CalibrationTrends = NO_TRENDS
    verification: VerificationRecord | None = None
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
    own = [record for record in verifications if record.calibration == store.active_hash]
    return CalibrationOverview(store.events, found, own[-1] if own else None)
