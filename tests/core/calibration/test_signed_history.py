"""Nobody without the key writes a history that is VALID, nor sets one back, nor turns the clock."""

from __future__ import annotations

import shutil
import subprocess
import sys
from datetime import datetime, timedelta
from pathlib import Path

import msgspec
import pytest

from benchmarks.evidence_site import NOW
from ocmm_core.calibration.records import CalibrationStore, State, record_hash
from ocmm_core.calibration.records._chain_seal import NAME, ChainSeal, SignedSeal
from ocmm_core.calibration.records._sealed import canonical, seal, unseal
from ocmm_core.errors import StorageError
from ocmm_core.seals import KeyFolder, SealWord, Signature, Signed, sign
from tests.core.calibration.made_records import MADE, make_record, make_verification
from tests.other_station import other_station

DAY = timedelta(days=1)


def made(folder: Path) -> CalibrationStore:
    """Return a store that was calibrated and verified."""
    store = CalibrationStore(folder)
    store.accept(make_record(), "technician", "new", MADE)
    store.verify(make_verification(make_record()), MADE)
    return store


@pytest.fixture
def store(tmp_path: Path) -> CalibrationStore:
    return made(tmp_path / "recommended")


def state(folder: Path, now: datetime = NOW) -> State:
    return CalibrationStore(folder).status(now).state


def test_a_history_is_signed_by_this_station(store: CalibrationStore) -> None:
    assert store.status(NOW).state is State.VALID
    assert store.signer.word is SealWord.SEALED
    assert all(event.signed and event.sealed for event in store.events)


def test_a_calibration_made_from_nothing_elsewhere_is_suspect(tmp_path: Path) -> None:
    with other_station(tmp_path / "home"):
        made(tmp_path / "forged")
        assert state(tmp_path / "forged") is State.VALID
    said = CalibrationStore(tmp_path / "forged").status(NOW)
    assert said.state is State.SUSPECT
    assert "signed by a station that this computer does not know" in said.reason


def test_one_more_event_does_not_make_a_forged_history_ours(tmp_path: Path) -> None:
    with other_station(tmp_path / "home"):
        made(tmp_path / "forged")
    forged = CalibrationStore(tmp_path / "forged")
    evidence = record_hash(make_verification(make_record()))
    forged.recalled(forged.active_hash or "", evidence, "Ada", "looked at", NOW)
    again = CalibrationStore(tmp_path / "forged")
    # The signatures of this station on it begin with the reservation.
    assert again.signer.word is SealWord.SEALED
    assert again.status(NOW).state is State.SUSPECT
    again.verify(make_verification(make_record()), NOW)
    assert again.status(NOW).state is State.VALID


def test_a_trusted_station_may_have_calibrated(tmp_path: Path) -> None:
    with other_station(tmp_path / "home"):
        made(tmp_path / "cameras")
        public = KeyFolder().station_key().public
    KeyFolder().trust(public, "Cell 3", "Ada", "compared", NOW)
    try:
        assert state(tmp_path / "cameras") is State.VALID
        assert CalibrationStore(tmp_path / "cameras").signer.station == "Cell 3"
    finally:
        (KeyFolder().folder / "known_keys.json").unlink()


@pytest.mark.parametrize("how", ["removed", "another", "of an earlier end"])
def test_a_seal_without_its_signature_is_no_seal(store: CalibrationStore, how: str) -> None:
    path = store.folder / NAME
    found = unseal(path, path.read_bytes(), SignedSeal)
    assert found.signature is not None
    if how == "removed":
        path.write_bytes(seal(found.end))
    else:
        other = KeyFolder().station_key().sign(canonical(found.end))
        if how == "of an earlier end":
            end = msgspec.structs.replace(found.end, count=1, link=store.events[0].utc)
            value = sign(KeyFolder().station_key(), Signed.HISTORY, canonical(end))
        else:
            value = Signature(found.signature.key, msgspec.json.encode(other).decode().strip('"'))
        path.write_bytes(seal(SignedSeal(found.end, value)))
    with pytest.raises(StorageError, match="the signature of the history") as caught:
        CalibrationStore(store.folder)
    assert caught.value.code == "events.forged"


def test_a_seal_of_an_earlier_version_is_read(store: CalibrationStore) -> None:
    end = ChainSeal(schema="ocmm.events-seal/1", count=2, link="x")
    assert unseal(store.folder / NAME, seal(end), ChainSeal) == end


def test_an_older_copy_in_another_folder_is_known(store: CalibrationStore, tmp_path: Path) -> None:
    older = tmp_path / "older" / "recommended"
    shutil.copytree(store.folder, older)
    assert state(older) is State.VALID
    store.suspect("engineer", "A camera was hit.", None, NOW)
    said = CalibrationStore(older).status(NOW)
    assert said.state is State.SUSPECT
    assert f"which this computer has seen in {store.folder.resolve()}." in said.reason


def test_a_clock_that_is_turned_back_does_not_renew(store: CalibrationStore) -> None:
    later = MADE + 600 * DAY
    assert state(store.folder, later) is State.EXPIRED
    # Nothing was written into the history since it was verified; the computer remembers.
    said = CalibrationStore(store.folder).status(MADE + 10 * DAY)
    assert said.state is State.EXPIRED
    assert "was set back" in said.reason
    store.refresh()
    CalibrationStore(store.folder).verify(make_verification(make_record()), MADE + 10 * DAY)
    assert state(store.folder, MADE + 11 * DAY) is State.VALID


def test_a_clock_that_was_corrected_by_seconds_is_believed(store: CalibrationStore) -> None:
    assert state(store.folder, NOW) is State.VALID
    assert state(store.folder, NOW - timedelta(seconds=50)) is State.VALID


_WRITER = """
import sys
from datetime import datetime, UTC
from pathlib import Path
from ocmm_core.calibration.records import CalibrationStore
store = CalibrationStore(Path(sys.argv[1]))
for number in range(int(sys.argv[3])):
    store.suspect(sys.argv[2], f"doubt {number}", None, datetime.now(UTC))
"""


def test_two_programs_write_one_history(store: CalibrationStore) -> None:
    each = 60
    writers = [
        subprocess.Popen([sys.executable, "-c", _WRITER, str(store.folder), name, str(each)])
        for name in ("Ada", "Bob")
    ]
    assert [one.wait(240) for one in writers] == [0, 0]
    again = CalibrationStore(store.folder)
    assert again.exchanged is None
    for name in ("Ada", "Bob"):
        told = [event.reason for event in again.events if event.who == name]
        assert told == [f"doubt {number}" for number in range(each)]
    assert len(again.events) == 2 + 2 * each
