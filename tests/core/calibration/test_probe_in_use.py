"""A probe in use: records found by its name, judged at every moment, refused with a reason."""

from __future__ import annotations

import hashlib
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.calibration.records import (
    CalibrationStatus,
    ProbeInUse,
    ProbeStore,
    ProbeView,
    judge,
    open_probe,
    open_probe_design,
    probe_store_folder,
    require_records,
)
from ocmm_core.documents import resource
from ocmm_core.errors import CalibrationError, InputError
from tests.core.calibration.made_probe_records import (
    MADE,
    PROBE,
    make_probe_record,
    make_tip_check,
    make_tip_record,
)

DOCUMENT = resource("probes", "standard.toml")
LATER = MADE + timedelta(days=1)
_X, _Y, _Z = PROBE.tip_probe.tolist()
RECORD = make_probe_record(tip_mm=(_X + 0.02, _Y, _Z))
QUALIFIED = make_tip_record(RECORD)


def store_in(folder: Path, *, qualified: bool = True) -> ProbeStore:
    """Return the store of the standard probe with one tip that differs from its document."""
    store = ProbeStore(probe_store_folder(folder, PROBE.name))
    store.calibrate(RECORD, "technician", "new", MADE)
    if qualified:
        store.qualify(QUALIFIED, MADE)
    return store


def seen(in_use: ProbeInUse, when: datetime = LATER) -> ProbeView:
    return judge(in_use, when)


def test_a_design_takes_points(tmp_path: Path) -> None:
    in_use = open_probe_design(DOCUMENT)
    view = seen(in_use)
    assert (view.word, view.blocking_reason, view.due_utc) == (CalibrationStatus.DESIGN, None, "")
    assert view.label == f"DESIGN {PROBE.name} {PROBE.identity[:12]}"
    assert hashlib.sha256(in_use.probe_text.encode()).hexdigest() == in_use.body.identity
    with pytest.raises(CalibrationError, match="without records"):
        require_records(in_use)


def test_a_probe_without_records_takes_no_points(tmp_path: Path) -> None:
    view = seen(open_probe(DOCUMENT, tmp_path))
    assert view.word is CalibrationStatus.NONE
    assert (
        str(view.blocking_reason)
        == f"Probe '{PROBE.name}' was never calibrated. Calibrate the probe."
    )
    named = open_probe(DOCUMENT, tmp_path, "long")
    assert "never calibrated with tip 'long'" in str(seen(named).blocking_reason)
    assert list(tmp_path.iterdir()) == []
    insisted = seen(open_probe(DOCUMENT, tmp_path, uncalibrated=True))
    assert insisted.blocking_reason is None
    assert insisted.blocker is not None
    assert insisted.label.startswith("UNCALIBRATED ")


def test_the_records_of_the_mounted_tip_are_measured_with(tmp_path: Path) -> None:
    store_in(tmp_path)
    in_use = open_probe(DOCUMENT, tmp_path)
    assert np.array_equal(in_use.body.tip_probe, RECORD.tip_mm)
    assert 2.0 * in_use.body.tip_radius == QUALIFIED.diameter_mm
    assert in_use.design.identity == PROBE.identity
    # The job file keeps the document and both records, and their hash names the geometry.
    assert hashlib.sha256(in_use.probe_text.encode()).hexdigest() == in_use.body.identity
    assert require_records(in_use).qualification == QUALIFIED
    view = seen(in_use)
    assert (view.word, view.blocking_reason, view.warnings) == (CalibrationStatus.VALID, None, ())
    assert view.title == f"{PROBE.name}, tip 6 mm"
    assert view.label == f"VALID {PROBE.name}/6 mm {in_use.body.identity[:12]} due 2026-03-31"


def test_a_tip_that_was_not_qualified_takes_no_points(tmp_path: Path) -> None:
    store_in(tmp_path, qualified=False)
    in_use = open_probe(DOCUMENT, tmp_path)
    view = seen(in_use)
    assert view.word is CalibrationStatus.SUSPECT
    assert "not been qualified" in str(view.blocking_reason)
    # Its qualification changes the ball that is measured with: not within a job.
    assert in_use.store is not None
    in_use.store.qualify(QUALIFIED, LATER)
    assert seen(in_use).word is CalibrationStatus.UNUSABLE
    assert "start a new one" in str(seen(in_use).blocking_reason)
    assert seen(open_probe(DOCUMENT, tmp_path)).word is CalibrationStatus.VALID


@pytest.mark.parametrize(
    ("days", "word", "warned"),
    [
        (20, CalibrationStatus.VALID, 0),
        (25, CalibrationStatus.DUE, 1),
        (31, CalibrationStatus.EXPIRED, 0),
    ],
)
def test_the_calendar_stops_a_running_job(
    tmp_path: Path, days: float, word: CalibrationStatus, warned: int
) -> None:
    store_in(tmp_path)
    view = seen(open_probe(DOCUMENT, tmp_path), MADE + timedelta(days=days))
    assert (view.word, len(view.warnings)) == (word, warned)
    assert (view.blocking_reason is not None) == (word is CalibrationStatus.EXPIRED)


def test_mounting_stops_points_until_the_tip_is_checked(tmp_path: Path) -> None:
    store = store_in(tmp_path)
    in_use = open_probe(DOCUMENT, tmp_path)
    store.mount("6 mm", "inspector", LATER)
    assert seen(in_use).word is CalibrationStatus.SUSPECT
    assert "quick tip check" in str(seen(in_use).blocking_reason)
    store.check(make_tip_check(RECORD, QUALIFIED, passed=False), LATER)
    assert "failed" in str(seen(in_use).blocking_reason)
    store.check(make_tip_check(RECORD, QUALIFIED), LATER)
    assert seen(in_use).word is CalibrationStatus.VALID


def test_another_tip_on_the_probe_stops_the_job(tmp_path: Path) -> None:
    store = store_in(tmp_path)
    in_use = open_probe(DOCUMENT, tmp_path)
    other = make_probe_record(tip="long")
    store.calibrate(other, "technician", "new", LATER)
    store.qualify(make_tip_record(other), LATER)
    view = seen(in_use)
    assert view.word is CalibrationStatus.UNUSABLE
    assert "'long' is mounted, but this job was started with tip '6 mm'" in str(view.blocker)
    assert seen(open_probe(DOCUMENT, tmp_path)).tip == "long"
    assert seen(open_probe(DOCUMENT, tmp_path, "6 mm")).word is CalibrationStatus.UNUSABLE


def test_new_records_are_for_a_new_job(tmp_path: Path) -> None:
    store = store_in(tmp_path)
    in_use = open_probe(DOCUMENT, tmp_path)
    store.qualify(make_tip_record(RECORD, diameter_mm=5.95), LATER)
    assert "has been activated since" in str(seen(in_use).blocker)
    store.calibrate(make_probe_record(), "technician", "new", LATER)
    assert "has been activated since" in str(seen(in_use).blocker)


def test_records_of_another_document_are_not_used(tmp_path: Path) -> None:
    store_in(tmp_path)
    changed = tmp_path / "changed.toml"
    changed.write_text(DOCUMENT.read_text("utf-8") + "\n# changed\n", "utf-8")
    view = seen(open_probe(changed, tmp_path))
    assert view.word is CalibrationStatus.UNUSABLE
    assert "a document other" in str(view.blocker)


def test_a_changed_record_or_history_is_not_used(tmp_path: Path) -> None:
    store = store_in(tmp_path)
    digest = store.active_hash("6 mm")
    path = store.folder / f"{digest}.json"
    content = path.read_bytes()
    path.write_bytes(content.replace(b"technician", b"Technician"))
    assert seen(open_probe(DOCUMENT, tmp_path)).word is CalibrationStatus.UNUSABLE
    path.write_bytes(content)
    events = store.folder / "events.jsonl"
    events.write_bytes(events.read_bytes().replace(b"technician", b"Technician"))
    assert seen(open_probe(DOCUMENT, tmp_path)).word is CalibrationStatus.UNUSABLE


def test_names_that_are_no_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="stored under its name"):
        probe_store_folder(tmp_path, "../probe")


def test_the_label_is_for_any_report(tmp_path: Path) -> None:
    store = ProbeStore(probe_store_folder(tmp_path, PROBE.name))
    store.calibrate(make_probe_record(tip="Ø6, lang"), "technician", "new", MADE)
    label = seen(open_probe(DOCUMENT, tmp_path)).label
    assert label.isascii()
    assert "," not in label
