"""The evidence for VALID is complete, or the state differs (`benchmarks.evidence`: large run)."""

from __future__ import annotations

import hashlib
import os
import shutil
import threading
from datetime import timedelta
from pathlib import Path

import msgspec
import pytest

from benchmarks.evidence import KINDS, run, set_back
from benchmarks.evidence_site import NOW, RIG_DOCUMENT, Store, cameras_in, probe_in
from ocmm_core.calibration.records import NAME as SEAL
from ocmm_core.calibration.records import (
    CalibrationStatus,
    CalibrationStore,
    CameraRecord,
    Event,
    EventKind,
    ProbeStore,
    State,
    judge,
    open_calibration,
    record_hash,
)
from ocmm_core.calibration.records import _sealed as evidence
from ocmm_core.calibration.records._sealed import EvidenceCheck, KeptFile
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import StorageError
from tests.core.calibration.made_records import MADE, make_record, make_verification


@pytest.fixture
def cameras(tmp_path: Path) -> Store:
    """Return a VALID store of the recommended rig with a long history."""
    return cameras_in(tmp_path / "cal", 0)


@pytest.fixture
def simple(tmp_path: Path) -> CalibrationStore:
    """Return a store that was calibrated and verified."""
    store = CalibrationStore(tmp_path / "simple" / "recommended")
    store.accept(make_record(), "technician", "new", MADE)
    store.verify(make_verification(make_record()), MADE)
    return store


def state(folder: Path) -> State:
    return CalibrationStore(folder).status(NOW).state


def test_no_damage_leaves_valid(tmp_path: Path) -> None:
    count = run(8 * len(KINDS), 1, tmp_path)
    assert sum(count.done.values()) == 8 * len(KINDS)
    assert (count.valid, count.ended, count.nameless, count.unrestored) == ([], [], [], [])


def test_a_folder_that_is_set_back_as_a_whole_is_noticed_on_this_computer(tmp_path: Path) -> None:
    states, noticed, unnoticed = set_back(tmp_path)
    assert noticed == 0
    # The folder alone is no proof: the station's memory must contain its signatures.
    assert unnoticed == 0 < states


def put_earlier(store: Store, events: int) -> None:
    """Restore the state of the whole folder after the given number of events."""
    for name, versions in store.earlier.items():
        (store.folder / name).write_bytes(versions[events - 1])


def test_what_was_set_back_is_written_down_and_ends_with_a_verification(cameras: Store) -> None:
    CalibrationStore(cameras.folder)
    # After the first verification had passed, before the failed one.
    put_earlier(cameras, 2)
    store = CalibrationStore(cameras.folder)
    said = store.status(NOW)
    assert said.state is State.SUSPECT
    assert "event 7 of it is missing, which this computer has seen in" in said.reason
    assert store.events[-1].kind is EventKind.PASSED
    store.verify(make_verification(_active(store)), NOW)
    assert [one.kind for one in store.events[2:]] == [EventKind.SUSPECTED, EventKind.PASSED]
    assert store.events[2].who == "this computer"
    assert state(cameras.folder) is State.VALID


def _active(store: CalibrationStore) -> CameraRecord:
    record = store.active()
    assert record is not None
    return record


def test_all_tips_are_in_doubt_after_a_probe_was_set_back(tmp_path: Path) -> None:
    at = probe_in(tmp_path, 0)
    put_earlier(at, 2)
    store = ProbeStore(at.folder)
    assert store.status("6 mm", NOW).state is State.SUSPECT
    store.mount("6 mm", "inspector", NOW)
    assert [one.kind for one in store.events[2:]] == ["put in doubt", "tip mounted"]


def test_deleting_the_folder_and_an_old_backup_do_not_lead_to_valid(cameras: Store) -> None:
    backup = cameras.folder.with_name("backup")
    shutil.copytree(cameras.folder, backup)
    store = CalibrationStore(cameras.folder)
    store.suspect("technician", "The frame was hit.", MADE, NOW)
    running = open_calibration(RIG_DOCUMENT, cameras.folder.parent)
    shutil.rmtree(cameras.folder)
    assert (
        judge(open_calibration(RIG_DOCUMENT, cameras.folder.parent), NOW).word
        is CalibrationStatus.NONE
    )
    assert "event 8 of it is missing, which this computer has seen in" in str(
        judge(running, NOW).blocker
    )
    backup.rename(cameras.folder)
    assert state(cameras.folder) is State.SUSPECT


def test_a_lost_session_is_made_up_for_by_the_step_it_belongs_to(cameras: Store) -> None:
    store = CalibrationStore(cameras.folder)
    (cameras.folder / "sessions" / "verification-2.jsonl").unlink()
    said = store.status(NOW)
    assert said.state is State.UNUSABLE
    folder = cameras.folder / "sessions"
    assert said.reason == f"Session verification-2.jsonl in {folder} is missing."
    assert said.remedy == (
        "Restore the file from a backup. If there is none, verify the calibration; the file is "
        "then no longer needed."
    )
    store.verify(make_verification(_active(store)), NOW)
    assert store.status(NOW).state is State.VALID
    assert store.events[-1].lost == ("sessions/verification-2.jsonl",)


def test_a_lost_calibration_is_made_up_for_only_from_known_points(cameras: Store) -> None:
    store = CalibrationStore(cameras.folder)
    first = next(one.calibration for one in store.events if one.kind is EventKind.ACCEPTED)
    (cameras.folder / f"{first}.json").write_bytes(b"")
    said = store.status(NOW)
    assert (said.state, "from known points" in said.remedy) == (State.UNUSABLE, True)
    store.verify(make_verification(_active(store)), NOW)
    assert store.status(NOW).state is State.UNUSABLE
    moved = make_record(points=7, method="relocation")
    store.accept(moved, "technician", "moved", NOW)
    store.verify(make_verification(moved), NOW)
    assert store.status(NOW).state is State.UNUSABLE
    anew = make_record(points=8)
    store.accept(anew, "technician", "anew", NOW)
    assert store.status(NOW).state is State.SUSPECT
    store.verify(make_verification(anew), NOW)
    assert store.status(NOW).state is State.VALID
    # The remaining records can be viewed.
    assert [record.points for record in store.records()] == [300, 7, 8]


def old_store(folder: Path) -> None:
    """Write a folder as a version without seals did: calibrated and verified."""
    made = CalibrationStore(folder)
    made.accept(make_record(), "technician", "new", MADE)
    made.verify(make_verification(make_record()), MADE)
    unsealed = [msgspec.structs.replace(one, sealed=False) for one in made.events]
    (folder / "events.jsonl").unlink()
    (folder / SEAL).unlink()
    # Without the fields that have come since, as it wrote its lines.
    chain = folder / "events.jsonl"
    link = "0" * 64
    for number, event in enumerate(unsealed, 1):
        said = msgspec.to_builtins(event)
        item = msgspec.json.encode({k: said[k] for k in _OLD_FIELDS})
        sha = hashlib.sha256(b"%d %s " % (number, link.encode()) + item).hexdigest()
        line = b'{"number":%d,"previous":"%s","item":%s,"sha256":"%s"}\n' % (
            number, link.encode(), item, sha.encode(),
        )  # fmt: skip
        with chain.open("ab") as stream:
            stream.write(line)
        link = sha
    shutil.rmtree(Path(os.environ["XDG_STATE_HOME"]), ignore_errors=True)


_OLD_FIELDS = ("utc", "kind", "calibration", "evidence", "since_utc", "who", "reason")


def test_an_old_store_opens_and_is_renewed_by_a_verification(tmp_path: Path) -> None:
    folder = tmp_path / "recommended"
    old_store(folder)
    store = CalibrationStore(folder)
    assert len(store.events) == 2
    said = store.status(NOW)
    assert said.state is State.SUSPECT
    assert "is not signed: an earlier version" in said.reason
    assert said.remedy == "Verify the calibration or check the tip again: that signs it."
    old = (folder / "events.jsonl").read_bytes()
    store.verify(make_verification(make_record()), NOW)
    assert state(folder) is State.VALID
    # Nobody gets back to an old store: not by cutting, and not without the seal.
    (folder / SEAL).unlink()
    with pytest.raises(StorageError, match="seal of the history is missing"):
        CalibrationStore(folder)
    (folder / "events.jsonl").write_bytes(old)
    shutil.rmtree(Path(os.environ["XDG_STATE_HOME"]))
    assert state(folder) is State.SUSPECT


@pytest.mark.parametrize("torn", [0, 40, 10_000])
def test_a_crash_while_an_event_is_written_leaves_a_whole_store(
    simple: CalibrationStore, monkeypatch: pytest.MonkeyPatch, torn: int
) -> None:
    def power_fails(descriptor: int, content: bytes, offset: int) -> int:
        os.lseek(descriptor, offset, os.SEEK_SET)
        os.write(descriptor, content[:torn])
        raise OSError(5, "power")

    with monkeypatch.context() as patch:
        patch.setattr(os, "pwrite", power_fails)
        with pytest.raises(StorageError, match="could not be stored"):
            simple.suspect("monitor", "A camera has turned.", MADE, NOW)
    again = CalibrationStore(simple.folder)
    written = torn == 10_000
    assert again.status(NOW).state is (State.SUSPECT if written else State.VALID)
    if written:
        # It was sealed by the first person who opened the folder.
        chain = simple.folder / "events.jsonl"
        whole = chain.read_bytes()
        chain.write_bytes(b"".join(whole.splitlines(keepends=True)[:-1]))
        with pytest.raises(StorageError, match="1 of 3 events is missing at the end"):
            CalibrationStore(simple.folder)
        chain.write_bytes(whole)
    again.suspect("monitor", "A camera has turned.", MADE, NOW)
    assert len(CalibrationStore(simple.folder).events) == 3 + written


def test_many_write_and_read_at_once(simple: CalibrationStore) -> None:
    wrong: list[Exception] = []

    def doubt(store: CalibrationStore) -> None:
        try:
            for _ in range(10):
                store.suspect("monitor", "A camera has turned.", MADE, NOW)
        except StorageError as error:
            wrong.append(error)

    writers = [
        threading.Thread(target=doubt, args=(CalibrationStore(simple.folder),)) for _ in range(3)
    ]
    for one in writers:
        one.start()
    while any(one.is_alive() for one in writers):
        simple.refresh()
        CalibrationStore(simple.folder)
    for one in writers:
        one.join()
    assert wrong == []
    assert len(CalibrationStore(simple.folder).events) == 32


@pytest.fixture
def blind(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let all files look unchanged from outside, as after an edit that kept everything."""
    monkeypatch.setattr(evidence, "stamp_of", lambda path: (1, 2, 3, 4))
    monkeypatch.setattr(evidence, "PATROL_S", 0.0)


@pytest.mark.usefixtures("blind")
def test_an_edit_that_shows_nowhere_is_found_by_reading_in_turn(tmp_path: Path) -> None:
    names = [f"{number}.jsonl" for number in range(5)]
    for name in names:
        (tmp_path / name).write_bytes(b"spots")
    files = [KeptFile(name, hashlib.sha256(b"spots").hexdigest()) for name in names]
    check = EvidenceCheck(tmp_path)
    assert check.defect(files, thorough=True) is None
    (tmp_path / "3.jsonl").write_bytes(b"spats")
    looks = [check.defect(files, thorough=False) for _ in names]
    found = [one for one in looks if one is not None]
    assert found[0][0].name == "3.jsonl"


def test_of_many_files_the_old_ones_are_looked_at_in_turn(tmp_path: Path) -> None:
    names = [f"{number}.jsonl" for number in range(350)]
    digest = hashlib.sha256(b"spots").hexdigest()
    for name in names:
        (tmp_path / name).write_bytes(b"spots")
    files = [KeptFile(name, digest) for name in names]
    check = EvidenceCheck(tmp_path)
    assert check.defect(files, thorough=False) is None
    (tmp_path / "149.jsonl").unlink()
    # All old files were checked after these calls; findings persist.
    turns = -(-(len(files) - evidence.AT_A_LOOK) // evidence.AT_A_LOOK)
    looks = [check.defect(files, thorough=False) for _ in range(2 * turns)]
    assert all(one is not None for one in looks[turns:])
    (tmp_path / "149.jsonl").write_bytes(b"spots")
    assert check.defect(files, thorough=False) is None
    # The newest files are checked at every call.
    (tmp_path / "349.jsonl").unlink()
    assert check.defect(files, thorough=False) == (files[349], "is missing")


def test_the_store_of_another_rig_under_this_name_is_unusable(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path / "recommended")
    other = make_record(rig="bridge")
    store.accept(other, "technician", "new", MADE)
    store.verify(make_verification(other), MADE)
    view = judge(open_calibration(RIG_DOCUMENT, tmp_path), NOW)
    assert view.word is CalibrationStatus.UNUSABLE
    assert "belongs to rig 'bridge', but recommended.toml describes rig 'recommended'" in str(
        view.blocker
    )


def test_events_that_a_chain_holds_are_bound_to_its_bytes(simple: CalibrationStore) -> None:
    path = simple.folder / "events.jsonl"
    spaced = path.read_bytes().replace(b'"who":', b'"who": ', 1)
    path.write_bytes(spaced)
    with pytest.raises(StorageError, match="line 1 was changed after it was written"):
        ChainFile(path, Event)


def test_a_record_names_no_other_hash(simple: CalibrationStore) -> None:
    digest = simple.active_hash
    assert digest == record_hash(make_record())
    (simple.folder / f"{digest}.json").touch()
    # A changed modification time alone is not damage.
    assert simple.status(NOW + timedelta(days=1)).state is State.VALID
