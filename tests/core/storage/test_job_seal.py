"""Nobody without the key writes a job that passes for one of this station, nor cuts one short."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from ocmm_core.errors import InputError, StorageError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.seals import KeyFolder, SealWord
from ocmm_core.storage import ADOPTED, JobFile, JobHead
from tests.other_station import other_station

MakePoint = Callable[[int], MeasuredPoint]
NOW = datetime(2026, 11, 1, 8, 0, tzinfo=UTC)


def measured(path: Path, head: JobHead, make_point: MakePoint, points: int = 3) -> Path:
    with JobFile.create(path, head) as job:
        for number in range(1, points + 1):
            job.append_point(make_point(number))
    return path


def doubts(path: Path) -> list[str]:
    with JobFile.open(path) as job:
        return job.verify()


def tamper(path: Path, *statements: str) -> None:
    db = sqlite3.connect(path)
    for statement in statements:
        db.execute(statement)
    db.commit()
    db.close()


def test_every_step_is_signed_by_this_station(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    path = measured(tmp_path / "a.ocmm", head, make_point)
    with JobFile.open(path) as job:
        assert job.verify() == []
        seal = job.seal()
        assert (seal.state.word, seal.steps, seal.doubts) == (SealWord.SEALED, 4, ())
        job.append_event("note", "goes on")
        assert job.seal().steps == 5
        assert job.verify() == []


def test_a_job_written_anew_without_the_key_is_a_strangers(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    # The whole chain is computed again, with every limit wider.
    measured(tmp_path / "a.ocmm", head, make_point)
    with other_station(tmp_path / "home"):
        forged = replace(head, plan_text=head.plan_text.replace("1", "9"))
        measured(tmp_path / "b.ocmm", forged, make_point)
        assert doubts(tmp_path / "b.ocmm") == []
    found = doubts(tmp_path / "b.ocmm")
    assert found[0].startswith("The job was signed by a station that this computer does not know")
    # Its uuid is that of a job that was seen here with other steps.
    assert found[1] == ("Step 4 is not the one that this computer has seen: the job was replaced.")
    with (
        JobFile.open(tmp_path / "b.ocmm") as job,
        pytest.raises(StorageError, match="nothing can be added") as caught,
    ):
        job.append_point(make_point(4))
    assert "Start a new job" in caught.value.remedy


@pytest.mark.parametrize("how", ["removed", "downgraded"])
def test_without_its_signatures_a_job_proves_nothing(
    tmp_path: Path, head: JobHead, make_point: MakePoint, how: str
) -> None:
    path = measured(tmp_path / "a.ocmm", head, make_point)
    if how == "removed":
        tamper(path, "DROP TRIGGER seal_no_delete", "DELETE FROM seal")
    else:
        tamper(path, "DROP TABLE seal", "DROP TABLE part", "PRAGMA user_version = 2")
    (found,) = doubts(path)
    assert found.startswith("The job is not signed")


def test_a_signature_of_an_earlier_step_does_not_fit(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    path = measured(tmp_path / "a.ocmm", head, make_point)
    tamper(
        path,
        "DROP TRIGGER seal_no_update",
        "UPDATE seal SET signature = (SELECT signature FROM seal WHERE sequence = 3) "
        "WHERE sequence = 4",
    )
    assert doubts(path) == ["The signature of the job does not belong to it."]
    with JobFile.open(path) as job, pytest.raises(StorageError) as caught:
        job.adopt("Mallory", "please")
    assert caught.value.code == "job.not_adopted"


def test_an_end_that_was_removed_shows_here_and_on_paper_elsewhere(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    path = measured(tmp_path / "a.ocmm", head, make_point)
    with JobFile.open(path) as job:
        line = job.seal().line
        assert job.check_line(line).startswith("The report was made from this job at step 4.")
    triggers = ("audit_no_delete", "observation_no_delete", "seal_no_delete")
    tamper(
        path,
        *(f"DROP TRIGGER {name}" for name in triggers),
        "DELETE FROM seal WHERE sequence = 4",
        "DELETE FROM audit WHERE sequence = 4",
        "DELETE FROM observation WHERE number = 3",
    )
    assert doubts(path) == [
        "1 of 4 steps that this computer has seen are missing at the end: it is an older copy of "
        "the job, or its end was removed."
    ]
    keys = KeyFolder()
    with other_station(tmp_path / "home"):
        # An auditor trusts the key of the station and has no memory of its jobs; the report states
        # that.
        KeyFolder().trust(keys.station_key().public, "Cell 1", "Ada", "compared", NOW)
        assert doubts(path) == []
        with (
            JobFile.open(path) as job,
            pytest.raises(StorageError, match="which the file does not hold") as caught,
        ):
            job.check_line(line)
        assert caught.value.code == "job.line_differs"


def test_an_older_copy_is_known_by_its_job_wherever_it_lies(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    path = measured(tmp_path / "a.ocmm", head, make_point, 2)
    older = tmp_path / "elsewhere.ocmm"
    shutil.copy(path, older)
    with JobFile.open(path) as job:
        job.change(annul={2: "a burr"})
    assert doubts(path) == []
    assert [doubt[:11] for doubt in doubts(older)] == ["1 of 4 step"]


def test_a_line_on_paper_is_of_one_job_and_cannot_be_written(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    path = measured(tmp_path / "a.ocmm", head, make_point)
    other = measured(tmp_path / "b.ocmm", replace(head, job_uuid="b"), make_point)
    with JobFile.open(path) as job, JobFile.open(other) as second:
        line = job.seal().line
        with pytest.raises(StorageError, match="about another job"):
            second.check_line(line)
        for bad in (line.replace(":4:", ":3:", 1), line[:-6] + "AAAA=="):
            with pytest.raises(StorageError, match="not as it was signed"):
                job.check_line(bad)
        for bad in ("", "x", line + ":1", line.replace(":4:", ":-4:", 1)):
            with pytest.raises(InputError, match="not the line of a job report"):
                job.check_line(bad)
        job.append_point(make_point(4))
        assert "1 step came after it" in job.check_line(line)


def test_who_takes_over_an_old_job_is_kept_in_it(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    path = measured(tmp_path / "a.ocmm", head, make_point)
    tamper(path, "DROP TABLE seal", "DROP TABLE part", "PRAGMA user_version = 2")
    with JobFile.open(path) as job:
        job.adopt("Ada", "made before jobs were signed")
        assert job.verify() == []
        assert job.seal().unsigned == 4
        (event,) = job.events()
        assert event.kind == ADOPTED
        assert event.text.startswith("Steps 1 to 4 were taken over by Ada: made before")
        with pytest.raises(StorageError, match="sealed already"):
            job.adopt("Ada", "again")


def test_a_changed_old_job_is_not_taken_over(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    path = measured(tmp_path / "a.ocmm", head, make_point)
    tamper(
        path, "DROP TABLE seal", "DROP TABLE part", "PRAGMA user_version = 2",
        "DROP TRIGGER observation_no_update",
        "UPDATE observation SET tip_radius = 1.4 WHERE number = 2",
    )  # fmt: skip
    with JobFile.open(path) as job, pytest.raises(StorageError, match="was changed") as caught:
        job.adopt("Ada", "old")
    assert caught.value.code == "job.not_adopted"


def test_no_job_is_made_without_a_key(tmp_path: Path, head: JobHead) -> None:
    with other_station(tmp_path / "home"):
        (tmp_path / "home").mkdir()
        (tmp_path / "home" / "xdg_data_home").write_text("a file where a folder should be")
        with pytest.raises(StorageError, match="cannot be read") as caught:
            JobFile.create(tmp_path / "a.ocmm", head)
    assert caught.value.code == "key.unreadable"
    assert not (tmp_path / "a.ocmm").exists()
