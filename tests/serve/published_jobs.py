"""Jobs of the quick plan in all published states, and their reports."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec

from ocmm_core.calibration.records import (
    CalibrationStore,
    ProbeStore,
    probe_store_folder,
    store_folder,
)
from ocmm_core.export import EXPORTERS
from ocmm_core.export.report import ReportFile, polyworks_profile, read_report, report_of_job
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.inspection.plan import load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.storage import JobFile, make_head
from ocmm_machine import Machine
from tests.core.calibration.made_probe_records import make_probe_record, make_tip_record
from tests.core.calibration.made_records import make_record, make_verification
from tests.core.inspection.conftest import PLAN, PROBE, RIG, Bench
from tests.machine.cut_parts import document_file

GOOD = "nominal = 20.28"
"""Nominal size of the ball that the part has; the plan of the demonstration states another one."""


def measure(
    bench: Bench, folder: Path, name: str, *, nominal: str = GOOD, simulated: bool = False,
    unproven: str = "", touches: int | None = None,
) -> Path:  # fmt: skip
    """Measure the quick plan with calibrated cameras and probe."""
    document = bench.folder / f"{name}.toml"
    text = PLAN.read_text(encoding="utf-8").replace("nominal = 20.34", nominal)
    document.write_text(text, encoding="utf-8")
    head = make_head(plan=document, rig=RIG, probe=PROBE, operator="me", part="P/1", serial=name)
    folder.mkdir(exist_ok=True)
    path = folder / f"{name}.ocmm"
    with JobFile.create(path, head) as job:
        session = InspectionSession(
            load_plan(document), bench.rig, bench.body, job, SessionOptions()
        )
        session.conditions.note_origin(simulated=simulated)
        session.conditions.note_calibration("VALID RIG", "VALID PROBE", unproven)
        for touch in bench.touches[:touches]:
            session.touches.record_touch(touch)
    return path


STATES = {"good": 1, "simulated": 1, "bad": 2, "unproven": 3, "open": 0}
"""Jobs of `measure_all`, and the evaluation that OPC UA must show: OK, NotOK, NotDecidable."""


def measure_all(bench: Bench, folder: Path) -> None:
    """Measure one job of each state."""
    measure(bench, folder, "good")
    measure(bench, folder, "simulated", simulated=True)
    measure(bench, folder, "bad", nominal="nominal = 20.0")
    measure(bench, folder, "unproven", unproven="Measured as uncalibrated.")
    measure(bench, folder, "open", touches=8)


def record_equipment(folder: Path, made: datetime, until: str) -> None:
    """Record cameras and a tip that were calibrated and verified, valid until a time."""
    cameras = CalibrationStore(store_folder(folder, "recommended"))
    record = make_record(made_utc=made.isoformat(), valid_until_utc=until)
    cameras.accept(record, "technician", "new", made)
    cameras.verify(make_verification(record), made)
    tips = ProbeStore(probe_store_folder(folder, "standard"))
    probe = make_probe_record(tip="A", made_utc=made.isoformat(), valid_until_utc=until)
    tips.calibrate(probe, "technician", "first", made)
    tip = make_tip_record(probe, made_utc=made.isoformat(), valid_until_utc=until)
    tips.qualify(tip, made + timedelta(minutes=5))


def state_offsets(folder: Path) -> tuple[Path, Path]:
    """State a tool length twice; return the document of the machine and its records."""
    document = document_file(
        folder, [{"name": "H3", "kind": "length", "number": 3, "present": 0.012}],
        [{"characteristic": "Block step", "offsets": ["H3"], "acts": "position",
          "direction": "+Z"}],
    )  # fmt: skip
    records = folder / "registers"
    machine = Machine.open(document, records)
    machine.state({"H3": 0.02}, "me", datetime.now(UTC))
    machine.state({"H3": 0.031}, "me", datetime.now(UTC))
    return document, records


def report_file(path: Path) -> ReportFile:
    """Return the report that `ocmm report` writes of a job."""
    data = report_of_job(reopen_job(path))
    (content,) = EXPORTERS["json"].contents((data,), polyworks_profile()).values()
    return read_report(content)


def published(path: Path) -> object:
    """Return the published facts of a job, as plain objects."""
    return msgspec.to_builtins(
        msgspec.structs.replace(report_file(path), observations=(), taken_back=())
    )
