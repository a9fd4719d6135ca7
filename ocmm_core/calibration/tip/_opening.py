"""Records in force for a tip at the start or resumption of a session."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.calibration.records import ProbeStore, TipRecords
from ocmm_core.calibration.tip._events import TouchBegun
from ocmm_core.errors import CalibrationError


def mounted_records(store: ProbeStore, tip: str) -> TipRecords:
    """Return a tip's records; CalibrationError if never calibrated, or not mounted."""
    store.refresh()
    records = store.active(tip)
    if records is None:
        raise CalibrationError(
            "probe_record.none",
            f"The probe was never calibrated with tip '{tip}'.",
            "Calibrate the probe with this tip.",
        )
    if store.mounted != tip:
        raise CalibrationError(
            "tip.not_mounted",
            f"The mounted tip is recorded as '{store.mounted}', not '{tip}'.",
            "Confirm which tip is mounted.",
        )
    return records


def continued_records(store: ProbeStore, begun: TouchBegun, path: Path) -> TipRecords:
    """Return the session's records; raise CalibrationError if no longer in force."""
    records = store.active(begun.tip)
    if records is None or store.active_hash(begun.tip) != begun.running:
        raise CalibrationError(
            "session.calibration",
            f"{path}: this session was started with a probe calibration that is no longer active.",
            "Start a new session.",
        )
    return records
