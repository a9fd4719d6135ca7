"""Jobs that were measured with a calibration from a store, for tests of what became of it."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from ocmm_core.calibration.records import (
    ArtefactUse,
    CalibrationStore,
    CameraRecord,
    canonical,
    rig_from_record,
    store_folder,
)
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.finished import ReopenedJob, Trend
from ocmm_core.inspection.finished import _compare as compare
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.storage import JobFile, make_head
from tests.core.calibration.made_records import make_record, make_verification
from tests.core.inspection.conftest import PLAN, PROBE, RIG, Bench

BAR = ArtefactUse(
    name="bar", serial="B-17", certificate="C-1", certificate_sha256="d" * 64,
    due_utc="2030-01-01T00:00:00+00:00",
)  # fmt: skip


def compare_jobs(jobs: Sequence[ReopenedJob]) -> tuple[Trend, ...]:
    return compare.trends_of([compare.part_job(job) for job in jobs])


class Cameras:
    """The calibrations of the rig in a separate folder, with one in force and verified."""

    def __init__(self, folder: Path, **changes: object) -> None:
        self.folder = folder
        self.record = make_record(**changes)
        self.store = CalibrationStore(store_folder(folder, self.record.rig))
        self.checks = 0
        self.store.accept(self.record, "technician", "new", datetime.now(UTC))
        self.verify()

    def verify(self, *, passed: bool = True, artefacts: tuple[ArtefactUse, ...] = ()) -> None:
        """Verify the calibration in force now."""
        self.checks += 1
        active = self.store.active()
        assert active is not None
        now = datetime.now(UTC)
        made = msgspec.structs.replace(
            make_verification(active, passed=passed),
            data_sha256=hashlib.sha256(str(self.checks).encode()).hexdigest(),
            made_utc=now.isoformat(),
            artefacts=artefacts,
        )
        self.store.verify(made, now)

    def measure(self, bench: Bench, name: str, record: CameraRecord | None = None) -> Path:
        """Measure the quick plan with a calibration, and close the job."""
        used = record or self.record
        head = make_head(plan=PLAN, rig=RIG, probe=PROBE, operator="me", part="P", serial=name)
        head = replace(head, rig_text=canonical(used).decode("utf-8"))
        path = bench.folder / f"{name}.ocmm"
        with JobFile.create(path, head) as job:
            rig = rig_from_record(used)
            session = InspectionSession(bench.plan, rig, bench.body, job, SessionOptions())
            for touch in bench.touches:
                session.touches.record_touch(touch)
        return path
