"""A store of the standard probe with a tip that was qualified a moment ago, for tests."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

from ocmm_core.calibration.records import ProbeRecord, ProbeStore, TipRecord, probe_store_folder
from tests.core.calibration.made_probe_records import (
    PROBE,
    make_probe_record,
    make_tip_check,
    make_tip_record,
)

TIP = "6 mm"


def fresh_tip(tip: str = TIP, *, days: float = 365.0) -> tuple[ProbeRecord, TipRecord]:
    """Return records from two hours ago, a qualification valid for ``days``, with the true ball."""
    made = datetime.now(UTC) - timedelta(hours=2)
    until = made + timedelta(days=365)
    record = make_probe_record(
        tip=tip, made_utc=made.isoformat(), valid_until_utc=until.isoformat()
    )
    return record, make_tip_record(record, days=days, diameter_mm=2.0 * PROBE.tip_radius)


class Tips:
    """The store of the standard probe in a folder, with one good tip.

    Parameters
    ----------
    folder
        Folder of the records of all probes.
    ago
        Age of the qualification.
    days
        Validity of the qualification.
    """

    def __init__(
        self, folder: Path, ago: timedelta = timedelta(minutes=5), days: float = 365.0
    ) -> None:
        self.record, self.qualified = fresh_tip(days=days)
        self.store = ProbeStore(probe_store_folder(folder, PROBE.name))
        then = datetime.now(UTC) - ago
        self.store.calibrate(self.record, "technician", "new", then)
        self.store.qualify(self.qualified, then)

    def check(self, *, passed: bool = True) -> None:
        """Store a quick check of now."""
        self.store.check(
            make_tip_check(self.record, self.qualified, passed=passed), datetime.now(UTC)
        )
