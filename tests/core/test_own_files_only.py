"""Only own files are removed, and a recorded file is not accepted as empty."""

from __future__ import annotations

import errno
from datetime import UTC, datetime
from pathlib import Path

import pytest

from ocmm_core import documents
from ocmm_core.errors import OcmmError
from ocmm_core.export import write_together
from ocmm_core.host import HOST
from ocmm_core.seals import KeyFolder
from ocmm_core.settings import SettingsFile
from ocmm_core.storage import JobFile
from ocmm_shop.archive.outbox import Outbox, sweep
from tests.core.storage.conftest import HEAD

_OTHER = b"of another program"


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("DATA", "STATE", "CONFIG"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name))
    return tmp_path


def test_keeps_a_file_put_in_place_of_an_empty_job(home: Path) -> None:
    for replaced in (False, True):
        job = JobFile.create(home / "A.ocmm", HEAD)
        if replaced:
            job.path.rename(home / "B.ocmm")
            job.path.write_bytes(_OTHER)
        job.close(remove=True)
        assert job.path.exists() is replaced
        assert not list(home.glob("A.ocmm-*"))
    assert (home / "A.ocmm").read_bytes() == _OTHER


def test_keeps_a_file_put_in_place_of_a_failed_one(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder cannot be synced, and another program writes the same names meanwhile."""
    names = home / "one.csv", home / "two.csv"

    def fail(folder: Path) -> None:
        for path in names:
            Path(f"{path}.new").write_bytes(_OTHER)
            Path(f"{path}.new").replace(path)
        raise OSError(errno.EIO, "no sync", str(folder))

    monkeypatch.setattr(HOST, "sync_folder", fail)
    with pytest.raises(OcmmError, match="cannot be written"):
        write_together(dict.fromkeys(names, b"report"))
    with pytest.raises(OSError, match="no sync"):
        documents.write_new(home / "three", b"new")
    assert not (home / "three").exists()
    assert [path.read_bytes() for path in names] == [_OTHER, _OTHER]


def test_a_lost_key_is_replaced_by_name_only(home: Path) -> None:
    old = KeyFolder().station_key()
    (KeyFolder().folder / "station.key").unlink()
    with pytest.raises(OcmmError, match="key of this station is missing"):
        KeyFolder().station_key()
    new = KeyFolder().replace("A. Example", "disk lost", datetime.now(UTC))
    assert KeyFolder().station_key().public == new.public != old.public
    # Files of the lost key are those of a former key of this station.
    assert [key.fingerprint for key in KeyFolder().known()] == [old.fingerprint]
    with pytest.raises(OcmmError, match="means the computer itself"):
        KeyFolder().trust(bytes(32), " This  Station", "Eve", "x", datetime.now(UTC))


def test_lost_settings_are_reported(home: Path) -> None:
    file = SettingsFile(home / "settings.toml")
    file.change({"job.released_only": True})
    assert file.read().notes == ()
    whole = file.path.read_bytes()
    for content in (None, b'schema = "ocmm.settings/1"\n'):
        file.path.unlink()
        if content is not None:
            file.path.write_bytes(content)
        (note,) = file.read().notes
        assert "are missing" in note.what or "edited outside" in note.what
        # A later change by the program does not vouch for it.
        file.change({"job.released_only": True, "job.operator": "A"})
        assert len(file.read().notes) == 1
    file.path.write_bytes(whole)
    assert file.read().notes == ()


def test_jobs_of_a_lost_outbox_are_queued_again(home: Path) -> None:
    with JobFile.create(home / "A.ocmm", HEAD) as job:
        job.append_event("x", "y")
    with Outbox(home / "box") as outbox:
        assert outbox.put(home / "A.ocmm") is not None
    (home / "box" / "outbox.sqlite").unlink()
    with Outbox(home / "box") as outbox:
        assert sweep(outbox) == 1
        (item,) = outbox.waiting()
        assert outbox.content(item) == (home / "A.ocmm").read_bytes()
        assert sweep(outbox) == 0
