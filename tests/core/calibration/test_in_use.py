"""A calibration in use: found by the rig's name, judged at every moment, refused with a reason."""

from __future__ import annotations

import hashlib
from datetime import datetime, timedelta
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.calibration.records import (
    CalibrationInUse,
    CalibrationStatus,
    CalibrationStore,
    CalibrationView,
    default_folder,
    judge,
    open_calibration,
    open_design,
    record_hash,
    store_folder,
)
from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from tests.core.calibration.made_records import MADE, make_record, make_verification

DOCUMENT = resource("rigs", "recommended.toml")
LATER = MADE + timedelta(days=1)


def store_in(folder: Path, *, verified: bool = True) -> CalibrationStore:
    """Return the store of the recommended rig with one calibration that differs from it."""
    store = CalibrationStore(store_folder(folder, "recommended"))
    record = make_record(points=123)
    store.accept(record, "technician", "new", MADE)
    if verified:
        store.verify(make_verification(record), MADE)
    return store


def seen(in_use: CalibrationInUse, when: datetime = LATER) -> CalibrationView:
    return judge(in_use, when)


def test_a_design_takes_points_and_proves(tmp_path: Path) -> None:
    view = seen(open_design(DOCUMENT))
    assert (view.word, view.blocking_reason, view.unproven) == (CalibrationStatus.DESIGN, None, "")
    assert view.label == f"DESIGN {view.identity[:12]}"
    assert view.identity == load_rig(DOCUMENT).identity


def test_real_cameras_without_a_calibration_take_no_points(tmp_path: Path) -> None:
    in_use = open_calibration(DOCUMENT, tmp_path)
    view = seen(in_use)
    assert view.word is CalibrationStatus.NONE
    assert str(view.blocking_reason) == (
        "The cameras of rig 'recommended' were never calibrated. Calibrate them."
    )
    assert list(tmp_path.iterdir()) == []


def test_who_insists_gets_points_that_prove_nothing(tmp_path: Path) -> None:
    view = seen(open_calibration(DOCUMENT, tmp_path, uncalibrated=True))
    assert view.blocking_reason is None
    assert view.unproven == (
        "Measured as uncalibrated. The cameras of rig 'recommended' were never calibrated."
    )
    assert view.label.startswith("UNCALIBRATED ")


def test_the_record_in_force_is_measured_with(tmp_path: Path) -> None:
    store = store_in(tmp_path)
    in_use = open_calibration(DOCUMENT, tmp_path)
    assert in_use.record == store.active()
    assert in_use.rig.identity == store.active_hash
    # What goes into the job file is the whole record, and its hash is that of the record.
    assert hashlib.sha256(in_use.rig_text.encode()).hexdigest() == store.active_hash
    assert np.array_equal(in_use.rig.parameter_covariance, load_rig(DOCUMENT).parameter_covariance)
    view = seen(in_use)
    assert (view.word, view.blocking_reason, view.warnings) == (CalibrationStatus.VALID, None, ())


def test_cameras_run_as_the_rig_document_says(tmp_path: Path) -> None:
    store_in(tmp_path)
    slower = tmp_path / "slower.toml"
    text = DOCUMENT.read_text("utf-8")
    slower.write_text(text.replace("frame_rate_hz = 8000", "frame_rate_hz = 4000"), "utf-8")
    assert open_calibration(slower, tmp_path).rig.frame_rate_hz == 4000


def test_what_was_not_verified_takes_no_points(tmp_path: Path) -> None:
    store_in(tmp_path, verified=False)
    view = seen(open_calibration(DOCUMENT, tmp_path))
    assert view.word is CalibrationStatus.SUSPECT
    assert view.blocking_reason is not None
    assert "not been verified" in view.blocking_reason.what
    assert view.since_utc == MADE.isoformat()


@pytest.mark.parametrize(
    ("days", "word", "warned", "stopped"),
    [
        (350, CalibrationStatus.VALID, 0, False),
        (352, CalibrationStatus.DUE, 1, False),
        (365, CalibrationStatus.EXPIRED, 0, True),
    ],
)
def test_the_calendar_stops_a_running_job(
    tmp_path: Path, days: int, word: CalibrationStatus, warned: int, stopped: bool
) -> None:
    store_in(tmp_path)
    in_use = open_calibration(DOCUMENT, tmp_path)
    view = seen(in_use, MADE + timedelta(days=days))
    assert (view.word, len(view.warnings), view.blocking_reason is not None) == (
        word,
        warned,
        stopped,
    )


def test_a_doubt_of_another_process_is_seen_and_not_written_over(tmp_path: Path) -> None:
    store_in(tmp_path)
    in_use = open_calibration(DOCUMENT, tmp_path)
    assert seen(in_use).word is CalibrationStatus.VALID
    other = CalibrationStore(store_folder(tmp_path, "recommended"))
    other.suspect("monitor", "Camera 'left' has turned.", MADE, LATER)
    view = seen(in_use)
    assert (view.word, view.since_utc) == (CalibrationStatus.SUSPECT, MADE.isoformat())
    # The first process has not looked yet: its own line comes after that of the other one.
    other.suspect("monitor", "Camera 'left' has turned again.", MADE, LATER)
    assert in_use.store is not None
    in_use.store.suspect("technician", "The frame was hit.", MADE, LATER)
    events = CalibrationStore(store_folder(tmp_path, "recommended")).events
    assert [event.who for event in events[2:]] == ["monitor", "monitor", "technician"]


def test_a_calibration_that_was_replaced_takes_no_more_points(tmp_path: Path) -> None:
    store = store_in(tmp_path)
    in_use = open_calibration(DOCUMENT, tmp_path)
    record = make_record(points=124)
    store.accept(record, "technician", "new", LATER)
    store.verify(make_verification(record), LATER)
    view = seen(in_use)
    assert view.word is CalibrationStatus.UNUSABLE
    assert "Another calibration has been activated" in str(view.blocking_reason)
    assert seen(open_calibration(DOCUMENT, tmp_path)).identity == record_hash(record)


@pytest.mark.parametrize("field", ["serial", "alias", "name"])
def test_the_calibration_of_other_cameras_is_refused(tmp_path: Path, field: str) -> None:
    store = CalibrationStore(store_folder(tmp_path, "recommended"))
    first, second = make_record().cameras
    value = "middle" if field == "name" else 77
    other = msgspec.structs.replace(first, **{field: value})
    store.accept(make_record(cameras=(other, second)), "technician", "new", MADE)
    in_use = open_calibration(DOCUMENT, tmp_path)
    view = seen(in_use)
    assert view.word is CalibrationStatus.UNUSABLE
    assert view.blocking_reason is not None
    assert str(value) in view.blocking_reason.what
    assert "recommended.toml" in view.blocking_reason.what
    # The bus searches for the cameras named by the document.
    assert in_use.rig.identity == load_rig(DOCUMENT).identity


def test_a_changed_record_or_history_is_not_used(tmp_path: Path) -> None:
    store = store_in(tmp_path)
    record = store_folder(tmp_path, "recommended") / f"{store.active_hash}.json"
    events = record.with_name("events.jsonl")
    for path in (record, events):
        content = path.read_bytes()
        path.write_bytes(content.replace(b"technician", b"Technician", 1))
        view = seen(open_calibration(DOCUMENT, tmp_path))
        assert view.word is CalibrationStatus.UNUSABLE
        assert "was changed after it was written" in str(view.blocking_reason)
        path.write_bytes(content)
    assert seen(open_calibration(DOCUMENT, tmp_path)).word is CalibrationStatus.VALID


def test_a_history_that_breaks_while_it_is_in_use_stops_points(tmp_path: Path) -> None:
    store_in(tmp_path)
    in_use = open_calibration(DOCUMENT, tmp_path)
    events = store_folder(tmp_path, "recommended") / "events.jsonl"
    events.write_bytes(b"{}\n" + events.read_bytes())
    assert seen(in_use).word is CalibrationStatus.UNUSABLE


@pytest.mark.parametrize("name", ["", "..", "a/b", "a\\b", "-a", "a.", "x" * 61, "Gerät", "a\n"])
def test_a_rig_is_kept_under_no_name_that_is_no_folder(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="stored under its name"):
        store_folder(tmp_path, name)


def test_calibrations_are_kept_among_the_users_data() -> None:
    assert default_folder().parts[-2:] == ("ocmm", "calibrations")
