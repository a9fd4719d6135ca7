"""The archive anchors the ends of histories; other computers and set-back memories learn them."""

from __future__ import annotations

import contextlib
import shutil
import sqlite3
from datetime import timedelta
from pathlib import Path
from typing import Any

import msgspec
import pytest

from ocmm_core.calibration.records import CalibrationStore, State
from ocmm_core.documents import resource
from ocmm_core.errors import StorageError
from ocmm_core.seals import (
    KeyFolder,
    KnownEnd,
    known_ends,
    learn_heads,
    memory_file,
    memory_folder,
    recall,
    remember,
    signed_heads,
    signed_job_heads,
)
from ocmm_core.side_files import read_guarded
from ocmm_core.storage import JobFile, JobHead, make_head
from ocmm_shop.archive.outbox import exchange_heads
from ocmm_shop.archive.stores import HEADS, open_archive
from tests.core.calibration.made_records import MADE, make_record, make_verification
from tests.other_station import other_station

NOW = MADE + timedelta(days=2)


def calibrated(folder: Path) -> Path:
    """Return an older copy of a history that went on."""
    store = CalibrationStore(folder / "recommended")
    store.accept(make_record(), "technician", "new", MADE)
    store.verify(make_verification(make_record()), MADE)
    older = shutil.copytree(store.folder, folder / "older")
    store.suspect("technician", "A camera was hit.", None, MADE + timedelta(hours=1))
    return Path(older)


def test_a_second_computer_knows_the_ends_by_the_archive(tmp_path: Path) -> None:
    with other_station(tmp_path / "first"):
        older = calibrated(tmp_path)
        public = KeyFolder().station_key().public
        archive = open_archive(str(tmp_path / "archive.sqlite"), set_up=True)
        for _ in range(3):
            exchange_heads(archive, "Station 1")
        # Nothing new, nothing more is stored.
        assert [one.kind for one in archive.findings()] == [HEADS]
    with other_station(tmp_path / "second"):
        exchange_heads(archive, "Station 2")
        KeyFolder().trust(public, "Station 1", "Ada", "compared", NOW)
        assert CalibrationStore(older).status(NOW).state is State.VALID
        exchange_heads(archive, "Station 2")
        said = CalibrationStore(older).status(NOW)
        assert said.state is State.SUSPECT
        assert "archive.sqlite" in said.reason
    archive.close()


def test_a_second_computer_knows_the_ends_of_jobs_by_the_archive(tmp_path: Path) -> None:
    head = made_head()
    path, older = tmp_path / "a.ocmm", tmp_path / "older.ocmm"
    with other_station(tmp_path / "first"):
        with JobFile.create(path, head) as job:
            job.append_event("note", "one")
        shutil.copy(path, older)
        with JobFile.open(path) as job:
            job.append_event("note", "two")
        public = KeyFolder().station_key().public
        archive = open_archive(str(tmp_path / "archive.sqlite"), set_up=True)
        for _ in range(3):
            exchange_heads(archive, "Station 1")
        assert len(archive.findings()) == 1
    with other_station(tmp_path / "second"):
        KeyFolder().trust(public, "Station 1", "Ada", "compared", NOW)
        assert doubts(older) == ""
        exchange_heads(archive, "Station 2")
        assert "missing at the end" in doubts(older)
        assert doubts(path) == ""
        # Another station's statements about a job written here do not count.
        with JobFile.create(tmp_path / "b.ocmm", made_head()) as own:
            own.append_event("note", "one")
        seen = recall(f"job {own.head.job_uuid}")
        assert seen is not None
    with other_station(tmp_path / "first"):
        remember(msgspec.structs.replace(seen, count=seen.count + 5, link="f" * 64))
        exchange_heads(archive, "Station 1")
    with other_station(tmp_path / "second"):
        exchange_heads(archive, "Station 2")
        assert recall(seen.name) == seen
    archive.close()


def doubts(path: Path) -> str:
    """Return what speaks against the signature of a job on this computer."""
    with JobFile.read(path) as job:
        return " ".join(job.seal().doubts)


def made_head() -> JobHead:
    """Return the head of a new job."""
    plan, rig = resource("plans", "quick.toml"), resource("rigs", "recommended.toml")
    probe = resource("probes", "standard.toml")
    return make_head(plan=plan, rig=rig, probe=probe, operator="me", part="P", serial="1")


def test_a_memory_that_was_set_back_learns_its_own_ends(tmp_path: Path) -> None:
    with other_station(tmp_path / "home"):
        kept = tmp_path / "kept"
        store = CalibrationStore(tmp_path / "recommended")
        store.accept(make_record(), "technician", "new", MADE)
        store.verify(make_verification(make_record()), MADE)
        shutil.copytree(memory_folder(), kept)
        older = Path(shutil.copytree(store.folder, tmp_path / "older"))
        store.suspect("technician", "A camera was hit.", None, MADE + timedelta(hours=1))
        [text] = signed_heads(KeyFolder())
        assert signed_heads(KeyFolder(), [text]) == []
        shutil.rmtree(memory_folder())
        shutil.copytree(kept, memory_folder())
        assert CalibrationStore(older).status(NOW).state is State.VALID
        assert learn_heads(text, "archive", KeyFolder()) == 2
        assert learn_heads(text, "archive", KeyFolder()) == 0
        assert CalibrationStore(older).status(NOW).state is State.SUSPECT
        for bad in (text.replace('"count":3', '"count":9'), text[:-9], "{}", ""):
            with pytest.raises(StorageError, match="is not taken over"):
                learn_heads(bad, "archive", KeyFolder())


def test_an_unknown_station_teaches_nothing(tmp_path: Path) -> None:
    with other_station(tmp_path / "stranger"):
        calibrated(tmp_path)
        [text] = signed_heads(KeyFolder())
    with (
        other_station(tmp_path / "home"),
        pytest.raises(StorageError, match="its signature is UNKNOWN KEY"),
    ):
        learn_heads(text, "archive", KeyFolder())


@pytest.mark.parametrize("prefix", ["history ", "job "])
def test_lists_leave_no_end_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, prefix: str
) -> None:
    monkeypatch.setattr("ocmm_core.seals._anchor._PAGE", 50)
    make = signed_job_heads if prefix == "job " else signed_heads
    with other_station(tmp_path / "home"):
        names = {f"{prefix}{number}" for number in range(223)}
        for name in sorted(names):
            remember(KnownEnd(name=name, count=1, link="a", first="b"), sync=False)
        lists = make(KeyFolder())
        shutil.rmtree(memory_folder())
        assert sum(learn_heads(text, "archive", KeyFolder()) for text in lists) == len(names)
        assert all(recall(name) is not None for name in names)
        # Nothing new, no further list; the new end alone otherwise.
        assert make(KeyFolder(), lists[::-1]) == []
        remember(KnownEnd(name=f"{prefix}new", count=1, link="a", first="b"), sync=False)
        assert len(make(KeyFolder(), lists[::-1])) <= len(lists)


def test_the_index_of_ends_reads_what_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[str] = []

    def counting(path: Path, *more: Any, **named: Any) -> bytes:
        read.append(path.stem)
        return read_guarded(path, *more, **named)

    monkeypatch.setattr("ocmm_core.seals._anchor.read_guarded", counting)
    with other_station(tmp_path / "home"):
        for number in range(30):
            remember(KnownEnd(name=f"job {number}", count=1, link="a", utc="2026-11-27T00:00:00Z"))
        first = known_ends()
        assert (len(first), len(read)) == (30, 31)  # with the clock
        read.clear()
        assert known_ends() == first
        assert read == []
        # An end that went on, a new one, one that others can write, and one that is gone.
        remember(KnownEnd(name="job 3", count=2, link="b"))
        remember(KnownEnd(name="job new", count=1, link="c"))
        memory_file("job 4").chmod(0o666)
        memory_file("job 5").unlink()
        now = known_ends()
        assert sorted(read) == sorted(memory_file(f"job {one}").stem for one in ("3", "new", "4"))
        assert len(now) == 29
        assert {one.name for one in now[:2]} == {"job 3", "job new"}
        assert max(one.count for one in now) == 2
        # Without a usable index everything is read, with the same result.
        for spoiled in (b"{", b"{}"):
            (memory_folder() / "ends.index").write_bytes(spoiled)
            assert known_ends() == now
        (memory_folder() / "ends.index").chmod(0o666)
        read.clear()
        assert known_ends() == now
        assert len(read) >= 29


def test_no_number_of_lists_hides_an_older_one(tmp_path: Path) -> None:
    place = tmp_path / "archive.sqlite"
    with other_station(tmp_path / "first"):
        older = calibrated(tmp_path)
        public = KeyFolder().station_key().public
        archive = open_archive(str(place), set_up=True)
        exchange_heads(archive, "Station 1")
        [text] = [one.document for one in archive.findings()]
    utc = NOW.isoformat()
    # Copies with a broken signature, text of no list, bytes, and text that is not UTF-8.
    flood = [text.replace('"count":3', f'"count":{number}') for number in range(4, 300)]
    for junk in (*flood, *(["{}", "", '{"content":{"jobs":['] * 100)):
        archive.add_finding(HEADS, "Station 1", junk, "Station 1", utc)
    archive.close()
    with contextlib.closing(sqlite3.connect(place)) as db:
        db.execute(
            "INSERT INTO finding (kind, subject, document, who, utc)"
            " VALUES ('heads', '', ?, '', ''), ('heads', '', CAST(x'ff' AS TEXT), '', '')",
            (b"bytes",),
        )
        db.commit()
    archive = open_archive(str(place))
    with other_station(tmp_path / "second"):
        exchange_heads(archive, "Station 2")
        KeyFolder().trust(public, "Station 1", "Ada", "compared", NOW)
        assert CalibrationStore(older).status(NOW).state is State.VALID
        exchange_heads(archive, "Station 2")
        assert CalibrationStore(older).status(NOW).state is State.SUSPECT
    with other_station(tmp_path / "first"):
        before = archive.query("SELECT count(*) FROM finding").rows
        exchange_heads(archive, "Station 1")
        # The own list is found behind all of them, and not stored again.
        assert archive.query("SELECT count(*) FROM finding").rows == before
    archive.close()


def test_lists_are_read_once_and_again_after_a_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ocmm_shop.archive.outbox._courier._SETTLED", timedelta(hours=-1))
    read: list[str] = []
    monkeypatch.setattr("ocmm_core.seals.learn_heads", lambda text, *_: read.append(text))
    place = tmp_path / "archive.sqlite"
    archive = open_archive(str(place), set_up=True)
    for number in range(120):
        archive.add_finding(HEADS, "Station 1", str(number), "Station 1", NOW.isoformat())
    with other_station(tmp_path / "home"):
        exchange_heads(archive, "Station 2")
        assert read == [str(number) for number in range(120)][::-1]
        exchange_heads(archive, "Station 2")
        archive.add_finding(HEADS, "Station 1", "new", "Station 1", NOW.isoformat())
        exchange_heads(archive, "Station 2")
        assert read[120:] == ["new"]
        # A restored archive: the same number means another list.
        archive.close()
        with contextlib.closing(sqlite3.connect(place)) as db:
            db.execute("UPDATE finding SET document = 'other' WHERE document = 'new'")
            db.commit()
        archive = open_archive(str(place))
        exchange_heads(archive, "Station 2")
        assert len(read) == 242
        KeyFolder().trust(b"k" * 32, "Station 1", "Ada", "compared", NOW)
        exchange_heads(archive, "Station 2")
        assert len(read) == 363
    archive.close()


def test_a_lost_archive_is_reported_until_it_is_set_up_again(tmp_path: Path) -> None:
    path = tmp_path / "archive.sqlite"
    with other_station(tmp_path / "home"):
        with pytest.raises(StorageError, match="there is no archive yet"):
            open_archive(str(path), read_only=True)
        open_archive(str(path)).close()
        path.rename(tmp_path / "away.sqlite")
        for read_only in (True, False):
            with pytest.raises(StorageError, match=r"archive\.sqlite: the archive .* is missing"):
                open_archive(str(path), read_only=read_only)
        assert not path.exists()
        open_archive(str(path), set_up=True).close()
        open_archive(str(path), read_only=True).close()


@pytest.mark.parametrize(
    "change",
    [
        "CREATE TRIGGER evil AFTER INSERT ON result BEGIN DELETE FROM result; END",
        "DROP VIEW archived_job",
        "CREATE VIEW archived_job AS SELECT * FROM archived_line WHERE 0",
    ],
)
def test_changed_views_and_triggers_are_refused(tmp_path: Path, change: str) -> None:
    path = tmp_path / "archive.sqlite"
    with other_station(tmp_path / "home"):
        open_archive(str(path)).close()
        with contextlib.closing(sqlite3.connect(path)) as db:
            db.execute("CREATE INDEX mine ON result (part)")
            db.execute("CREATE VIEW mine_also AS SELECT 1")
            db.commit()
        # Indexes and views of a dashboard change nothing.
        open_archive(str(path)).close()
        with contextlib.closing(sqlite3.connect(path)) as db:
            if change.startswith("CREATE VIEW"):
                db.execute("DROP VIEW archived_job")
            db.execute(change)
            db.commit()
        for read_only in (True, False):
            with pytest.raises(StorageError, match=r"changed views or triggers \((evil|archived)"):
                open_archive(str(path), read_only=read_only)
