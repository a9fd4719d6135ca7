"""Records are sealed, their history is a chain, and the state follows from both."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.calibration.records import (
    CalibrationStore,
    CameraRecord,
    State,
    load,
    rig_from_record,
    save,
    seal,
)
from ocmm_core.calibration.records._sealed import unseal
from ocmm_core.camera import project
from ocmm_core.errors import CalibrationError
from tests.core.calibration.made_records import MADE, RIG, make_record, make_verification


@pytest.fixture
def store(tmp_path: Path) -> CalibrationStore:
    """Return a store with one accepted and verified calibration."""
    store = CalibrationStore(tmp_path / "rig")
    record = make_record()
    store.accept(record, "technician", "new", MADE)
    store.verify(make_verification(record), MADE)
    return store


def test_a_record_comes_back_as_the_rig_it_was_made_from(tmp_path: Path) -> None:
    path = save(tmp_path, make_record())
    rig = rig_from_record(load(path, CameraRecord))
    assert rig.identity == path.stem
    assert np.array_equal(rig.parameter_covariance, RIG.parameter_covariance)
    points = np.random.default_rng(1).uniform(-150.0, 150.0, (50, 3))
    for camera, original in zip(rig.cameras, RIG.cameras, strict=True):
        # Only the rotation goes through another notation.
        assert np.allclose(project(camera, points), project(original, points), atol=1e-9)


def test_every_changed_byte_is_noticed() -> None:
    content = seal(make_record())
    path = Path("record.json")
    assert unseal(path, content, CameraRecord) == make_record()
    rng = np.random.default_rng(2)
    unnoticed = []
    for at in range(len(content)):
        changed = bytearray(content)
        changed[at] ^= int(rng.integers(1, 256))
        try:
            unseal(path, bytes(changed), CameraRecord)
        except CalibrationError:
            continue
        unnoticed.append(at)
    assert unnoticed == []


def test_cut_and_lengthened_records_are_refused() -> None:
    content = seal(make_record())
    for wrong in (b"", content[:-1], content + b" ", content + b"\n", b"{}", b"\xff\xfe"):
        with pytest.raises(CalibrationError, match="was changed after it was written"):
            unseal(Path("record.json"), wrong, CameraRecord)


def test_a_calibration_becomes_valid_only_by_a_verification(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path)
    with pytest.raises(CalibrationError, match="never calibrated"):
        store.status(MADE)
    record = make_record()
    store.accept(record, "technician", "new", MADE)
    assert store.status(MADE).state is State.SUSPECT
    assert "not been verified" in store.status(MADE).reason
    store.verify(make_verification(record, passed=False), MADE)
    assert store.status(MADE).state is State.SUSPECT
    store.verify(make_verification(record), MADE)
    assert store.status(MADE).state is State.VALID


def test_state_follows_the_calendar(store: CalibrationStore) -> None:
    states = [
        store.status(MADE + timedelta(days=day)).state for day in (0, 350, 352, 364, 365, 900)
    ]
    assert states == ["VALID", "VALID", "DUE", "DUE", "EXPIRED", "EXPIRED"]
    # A clock that was set back cannot make an old calibration young.
    late = store.status(MADE - timedelta(minutes=2))
    assert (late.state, "clock" in late.reason) == (State.EXPIRED, True)


def test_doubt_names_its_beginning_and_ends_with_a_verification(store: CalibrationStore) -> None:
    since, now = MADE + timedelta(days=3), MADE + timedelta(days=4)
    store.suspect("monitor", "Camera 'left' has turned.", since, now)
    doubt = store.status(now)
    assert (doubt.state, doubt.state.usable) == (State.SUSPECT, False)
    assert doubt.reason == "Camera 'left' has turned."
    assert datetime.fromisoformat(doubt.since_utc) == since
    store.verify(make_verification(make_record()), now)
    assert store.status(now).state is State.VALID


def test_what_was_stored_is_there_again(store: CalibrationStore, tmp_path: Path) -> None:
    store.suspect("monitor", "bump", MADE, MADE)
    again = CalibrationStore(tmp_path / "rig")
    assert again.events == store.events
    assert again.active() == make_record()
    assert again.records() == (make_record(),)
    assert again.verifications() == (make_verification(make_record()),)


def test_a_verification_must_be_of_this_calibration_and_of_other_data(
    store: CalibrationStore,
) -> None:
    other = make_verification(make_record(points=399))
    with pytest.raises(CalibrationError, match="does not belong to the active calibration"):
        store.verify(other, MADE)
    same = msgspec.structs.replace(make_verification(make_record()), data_sha256="a" * 64)
    with pytest.raises(CalibrationError, match="independent data"):
        store.verify(same, MADE)


def test_a_record_that_is_gone_or_changed_is_not_used(
    store: CalibrationStore, tmp_path: Path
) -> None:
    path = tmp_path / "rig" / f"{store.active_hash}.json"
    path.write_bytes(seal(make_record(rms_px=0.02)))
    # Sealed, but not under its name.
    with pytest.raises(CalibrationError):
        store.active()
    path.unlink()
    with pytest.raises(Exception, match="is missing"):
        store.status(MADE)
