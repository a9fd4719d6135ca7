"""Records of a probe and its tips: sealed, chained, with the state of the mounted tip."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.calibration.records import (
    ProbeRecord,
    ProbeStore,
    State,
    TipRecord,
    probe_from_records,
    record_hash,
)
from ocmm_core.calibration.records._events import status_of_tip
from ocmm_core.errors import CalibrationError, StorageError
from tests.core.calibration.made_probe_records import (
    MADE,
    PROBE,
    make_probe_record,
    make_tip_check,
    make_tip_record,
)

HOUR = timedelta(hours=1)


@dataclass(frozen=True, slots=True)
class Qualified:
    """A store with a probe that was calibrated and qualified."""

    store: ProbeStore
    calibration: ProbeRecord
    tip: TipRecord
    at: datetime


@pytest.fixture
def qualified(tmp_path: Path) -> Qualified:
    """Return a store whose tip is VALID."""
    store = ProbeStore(tmp_path)
    calibration = make_probe_record()
    store.calibrate(calibration, "technician", "", MADE)
    tip = make_tip_record(calibration)
    store.qualify(tip, MADE + HOUR)
    return Qualified(store, calibration, tip, MADE + 2 * HOUR)


def test_a_calibrated_tip_waits_for_its_qualification(tmp_path: Path) -> None:
    store = ProbeStore(tmp_path)
    with pytest.raises(CalibrationError, match="never calibrated"):
        store.status("6 mm", MADE)
    calibration = make_probe_record()
    store.calibrate(calibration, "technician", "", MADE)
    assert store.mounted == "6 mm"
    said = store.status("6 mm", MADE)
    assert said.state is State.SUSPECT
    assert "not been qualified" in said.reason
    store.qualify(make_tip_record(calibration, passed=False), MADE + HOUR)
    assert store.events[-1].reason == "1 check; farthest beyond its limit: form, 200 % of it."
    assert store.status("6 mm", MADE + HOUR).state is State.SUSPECT
    store.qualify(make_tip_record(calibration), MADE + 2 * HOUR)
    assert store.status("6 mm", MADE + 2 * HOUR).state is State.VALID
    assert len(store.qualifications()) == 2
    assert store.events[-1].reason == "1 check; nearest to its limit: form, 60 % of it."


def test_records_survive_another_opening(qualified: Qualified) -> None:
    again = ProbeStore(qualified.store.folder)
    active = again.active("6 mm")
    assert active is not None
    assert active.calibration == qualified.calibration
    assert active.qualification == qualified.tip
    assert again.status("6 mm", qualified.at).state is State.VALID


@pytest.mark.parametrize("event", ["mounted", "doubted", "failed"])
def test_whatever_can_change_the_tip_forces_a_check(qualified: Qualified, event: str) -> None:
    store, now = qualified.store, qualified.at
    if event == "mounted":
        store.mount("6 mm", "inspector", now)
    elif event == "doubted":
        store.doubt("bus", "The probe felt a blow.", now, now)
    else:
        store.check(make_tip_check(qualified.calibration, qualified.tip, passed=False), now)
    said = store.status("6 mm", now)
    assert said.state is State.SUSPECT
    assert said.since_utc
    assert "quick tip check" in said.remedy
    store.check(make_tip_check(qualified.calibration, qualified.tip), now + HOUR)
    assert store.status("6 mm", now + HOUR).state is State.VALID
    assert len(store.checks()) == (2 if event == "failed" else 1)


def test_points_are_in_doubt_since_the_last_good_check(qualified: Qualified) -> None:
    qualified.store.mount("6 mm", "inspector", qualified.at)
    said = qualified.store.status("6 mm", qualified.at)
    assert datetime.fromisoformat(said.since_utc) == MADE + HOUR


def test_two_tips_are_kept_apart(qualified: Qualified) -> None:
    store, now = qualified.store, qualified.at
    other = make_probe_record(tip="2 mm")
    store.calibrate(other, "technician", "", now)
    assert store.tips == ("6 mm", "2 mm")
    assert store.mounted == "2 mm"
    assert store.status("2 mm", now).state is State.SUSPECT
    assert store.status("6 mm", now).state is State.VALID
    store.mount("6 mm", "inspector", now)
    assert store.mounted == "6 mm"
    assert store.status("6 mm", now).state is State.SUSPECT
    with pytest.raises(CalibrationError, match="never calibrated"):
        store.mount("3 mm", "inspector", now)


def test_a_new_calibration_needs_a_new_qualification(qualified: Qualified) -> None:
    store, now = qualified.store, qualified.at
    store.calibrate(make_probe_record(frames=2000), "technician", "", now)
    assert store.status("6 mm", now).state is State.SUSPECT
    with pytest.raises(CalibrationError, match="active calibration"):
        store.qualify(qualified.tip, now)
    with pytest.raises(CalibrationError, match="active calibration"):
        store.check(make_tip_check(qualified.calibration, qualified.tip), now)


def test_the_earlier_of_both_dates_counts(qualified: Qualified) -> None:
    def state(days: float) -> State:
        return qualified.store.status("6 mm", MADE + HOUR + timedelta(days=days)).state

    assert state(20.0) is State.VALID
    assert state(25.0) is State.DUE
    assert state(30.0) is State.EXPIRED
    assert qualified.store.status("6 mm", MADE - HOUR).state is State.EXPIRED


def test_changed_files_are_not_used(qualified: Qualified) -> None:
    store = qualified.store
    path = store.folder / f"{record_hash(qualified.tip)}.json"
    path.write_bytes(path.read_bytes().replace(b"5.998", b"5.918"))
    with pytest.raises(CalibrationError, match="was changed after it was written"):
        store.active("6 mm")
    events = store.folder / "events.jsonl"
    events.write_bytes(events.read_bytes().replace(b"technician", b"technicien"))
    with pytest.raises(StorageError, match="line 1"):
        ProbeStore(store.folder)


def test_the_probe_is_measured_with_what_the_records_say(qualified: Qualified) -> None:
    calibration = make_probe_record(tip_mm=(0.1, 0.2, -0.3))
    body = probe_from_records(PROBE, calibration, make_tip_record(calibration))
    assert np.array_equal(body.tip_probe, [0.1, 0.2, -0.3])
    assert body.tip_radius == pytest.approx(2.999)
    assert body.tip_radius_sigma == pytest.approx(0.001)
    assert body.identity not in (PROBE.identity, record_hash(calibration))
    without = probe_from_records(PROBE, calibration, None)
    assert without.tip_radius == PROBE.tip_radius
    with pytest.raises(CalibrationError, match="not qualified with this calibration"):
        probe_from_records(PROBE, calibration, qualified.tip)
    with pytest.raises(CalibrationError, match="a document other"):
        probe_from_records(PROBE, make_probe_record(probe_identity="f" * 64), None)
    with pytest.raises(CalibrationError, match="lacks the LEDs"):
        probe_from_records(PROBE, make_probe_record(covariance=((1.0,),)), None)


def test_what_an_earlier_version_stored_without_a_seal_is_checked_once(
    qualified: Qualified,
) -> None:
    active = qualified.store.active("6 mm")
    assert active is not None
    unsealed = [msgspec.structs.replace(one, sealed=False) for one in qualified.store.events]
    said = status_of_tip(active, unsealed, qualified.at)
    assert said.state is State.SUSPECT
    assert "stored by an earlier version" in said.reason
    assert said.remedy == "Run the quick tip check (one minute)."
