"""An archive that is made from the files alone is the archive, row by row."""

from __future__ import annotations

from pathlib import Path

import pytest

from ocmm_core.errors import InputError
from ocmm_core.seals import KeyFolder, shown_key
from ocmm_shop.archive.checks import (
    differences,
    files_in,
    files_of,
    key_and_name,
    mark_altered,
    rebuild,
    stations_of,
    verify_archive,
    verify_files,
)
from ocmm_shop.archive.outbox import Courier, Outbox
from ocmm_shop.archive.stores import open_archive
from tests.shop.archive.conftest import Place, by_hand
from tests.shop.archive.real_jobs import RealJobs


@pytest.fixture
def filled(place: Place, real_jobs: RealJobs, tmp_path: Path) -> Place:
    with Outbox(tmp_path / "outbox") as outbox:
        outbox.put_content(real_jobs.paused_content, real_jobs.went_on)
        outbox.put(real_jobs.finished)
        outbox.put(real_jobs.went_on)
        courier = Courier(outbox, place.open, "Station 3")
        assert courier.send_waiting().sent == 3
        courier.close()
    return place


def test_an_archive_rebuilt_from_its_files_is_the_same_row_by_row(
    filled: Place, tmp_path: Path
) -> None:
    with filled.open() as archive, open_archive(str(tmp_path / "new.sqlite")) as new:
        unread: list[str] = []
        done = rebuild(new, files_in(archive, unread.append), stations_of(archive))
        assert (done.kept, done.unread, unread) == (3, (), [])
        assert differences(archive, new) == []
        with pytest.raises(InputError, match="there are jobs in it"):
            rebuild(new, files_in(archive, unread.append), {})


def test_the_job_files_of_a_folder_make_it_again(
    filled: Place, real_jobs: RealJobs, tmp_path: Path
) -> None:
    unread: list[str] = []
    folder = tmp_path / "files"
    folder.mkdir()
    for path in (real_jobs.finished, real_jobs.went_on):
        (folder / path.name).write_bytes(path.read_bytes())
    (folder / "rubbish.ocmm").write_bytes(b"rubbish" * 1000)
    with filled.open() as archive, open_archive(str(tmp_path / "new.sqlite")) as new:
        done = rebuild(new, files_of([folder], unread.append), stations_of(archive))
        assert done.kept == 2
        assert len(unread) == 1
        # Only the version of the pause is no longer a file.
        told = differences(archive, new)
        assert len(told) == 1
        assert "is only in" in told[0]


def test_a_row_that_was_changed_in_the_archive_is_found(filled: Place) -> None:
    with filled.open() as archive:
        assert verify_archive(archive).faults == ()
        by_hand(archive, "UPDATE result SET value = value + 0.001 WHERE position = 0")
        found = verify_archive(archive)
        assert found.looked_at == 3
        assert found.faults
        assert found.faults[0][1].startswith("Altered in the archive: result 1 value ")
        assert mark_altered(archive, found, "Anna") == len(found.faults)
        assert archive.query("SELECT sum(counted) FROM archived_result").rows[0][0] == 0


def test_a_job_file_that_was_altered_after_it_was_archived_is_named(
    filled: Place, real_jobs: RealJobs, tmp_path: Path
) -> None:
    folder = tmp_path / "station"
    folder.mkdir()
    (folder / "good.ocmm").write_bytes(real_jobs.finished.read_bytes())
    (folder / "older.ocmm").write_bytes(real_jobs.paused_content)
    with filled.open() as archive:
        told = [why for _, why in verify_files(archive, [folder]).faults]
        assert told == ["older.ocmm: an older copy of what is in the archive."]


def test_a_station_is_named_by_its_key_as_it_is_shown(real_jobs: RealJobs, tmp_path: Path) -> None:
    shown = KeyFolder().station_key().fingerprint
    for at, key in enumerate((shown, shown_key(shown), shown_key(shown).upper())):
        with open_archive(str(tmp_path / f"{at}.sqlite")) as new:
            stations = dict([key_and_name(f"{key}=Hall 3")])
            assert rebuild(new, files_of([real_jobs.finished], print), stations).kept == 1
            assert new.query("SELECT station FROM archived_job").rows == (("Hall 3",),)
    for text in ("Hall 3", "=Hall 3", f"{shown}=", f"{shown[:8]}=Hall 3", "station3=Hall 3"):
        with pytest.raises(InputError, match="KEY=STATION is expected"):
            key_and_name(text)
