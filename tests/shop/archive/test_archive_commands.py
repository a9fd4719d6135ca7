"""``ocmm archive``: each command on a real archive, its words and its exit code."""

from __future__ import annotations

import contextlib
import shutil
import socket
import sqlite3
from collections.abc import Callable
from pathlib import Path

import platformdirs
import pytest
from typer.testing import CliRunner, Result

from ocmm_cli import app
from ocmm_core.errors import InputError, OcmmError
from ocmm_shop.archive.checks import files_of
from ocmm_shop.archive.outbox import JobNote
from ocmm_shop.archive.stores import open_archive
from tests.host import needs_package
from tests.shop.archive.conftest import Place, by_hand
from tests.shop.archive.made_jobs import START, made_delivery, made_sender
from tests.shop.archive.real_jobs import RealJobs


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["archive", *map(str, arguments)], env={"COLUMNS": "200"})


def refused(*arguments: str | Path) -> OcmmError:
    error = run(*arguments).exception
    assert isinstance(error, OcmmError)
    return error


@pytest.fixture
def filled(place: Place) -> Place:
    with place.open() as archive:
        archive.put_all(
            [
                made_delivery(
                    4 * part + 2 * station + trial, made_sender(f"Station {station}", 9 + station)
                )
                for part in range(8)
                for station in (0, 1)
                for trial in (0, 1)
            ]
        )
    return place


@pytest.fixture
def job(real_jobs: RealJobs, tmp_path: Path) -> Path:
    return Path(shutil.copy(real_jobs.finished, tmp_path / "job.ocmm"))


def test_a_job_is_sent_and_the_status_says_so(place: Place, job: Path, tmp_path: Path) -> None:
    where = ("--archive", place.address, "--outbox", tmp_path / "outbox")
    sent = run("send", job, *where)
    assert sent.exit_code == 0, sent.output
    assert "Nothing waits for the archive." in sent.output
    told = run("status", *where)
    assert told.exit_code == 0, told.output
    assert "Jobs     1 of 1 station" in told.output
    assert "Waiting  0, set aside 0" in told.output
    assert ("TLS      no" in told.output) is (place.store == "postgresql")
    assert run("send", tmp_path / "missing.ocmm", *where).exit_code == 1


def test_a_folder_that_is_left_out_is_named(place: Place, job: Path, tmp_path: Path) -> None:
    where = ("--archive", place.address, "--outbox", tmp_path / "outbox")
    (tmp_path / "jobs").mkdir()
    (tmp_path / "away").mkdir()
    job.rename(tmp_path / "jobs" / "job.ocmm")
    (tmp_path / "jobs" / "linked").symlink_to(tmp_path / "away")
    sent = run("send", tmp_path / "jobs", *where)
    assert sent.exit_code == 1, sent.output
    assert "linked: this folder is a link, which is not searched" in " ".join(sent.output.split())
    assert "Jobs     1 of 1 station" in run("status", *where).output
    unread: list[str] = []
    assert len(list(files_of([tmp_path / "jobs"], unread.append))) == 1
    assert "linked: this folder is a link" in unread[0]


def test_what_a_killed_program_left_is_sent(place: Place, job: Path, tmp_path: Path) -> None:
    JobNote(tmp_path / "outbox", job).let_go()
    sent = run("send", "--archive", place.address, "--outbox", tmp_path / "outbox")
    assert sent.exit_code == 0, sent.output
    with place.open() as archive:
        assert archive.query("SELECT count(*) FROM job").rows == ((1,),)


def test_a_file_that_is_no_job_is_set_aside_named_and_tried_again(
    place: Place, tmp_path: Path
) -> None:
    bad = tmp_path / "bad.ocmm"
    bad.write_bytes(b"\0" * 5000)
    where = ("--archive", place.address, "--outbox", tmp_path / "outbox")
    JobNote(tmp_path / "outbox", bad).let_go()
    assert run("send", *where).exit_code == 1
    told = run("status", *where)
    assert told.exit_code == 1
    assert "set aside 1" in told.output
    assert "bad.ocmm" in told.output
    assert run("send", "--retry", *where).exit_code == 1


def test_a_server_that_is_gone_is_said_with_what_waits(job: Path, tmp_path: Path) -> None:
    needs_package("psycopg", "extra `shop`")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    where = ("--archive", f"postgresql://me@127.0.0.1:{port}/ocmm", "--outbox", tmp_path / "outbox")
    sent = run("send", job, *where)
    assert sent.exit_code == 1
    assert "1 job waits for the archive; server not reached since" in sent.output
    told = run("status", *where)
    assert told.exit_code == 1
    assert "the server is not reached" in told.output
    assert "Waiting  1, set aside 0" in told.output


def test_questions_answer_and_export(filled: Place, tmp_path: Path) -> None:
    archive = ("--archive", filled.address)
    day = START.astimezone().date().isoformat()
    table = tmp_path / "t.csv"
    assert "Measured on" in run("today", "--from", day, *archive, "--export", table).output
    assert table.read_text("utf-8").startswith("Time,Station,Part")
    part = ("--part", "FLANGE", "--characteristic", "D1")
    assert "FLANGE: D1" in run("trend", *part, *archive).output
    assert "Measured with artefact B-17" in run("used", "artefact", "B-17", *archive).output
    assert "capability by month" in run("cpk", "--part", "FLANGE", *archive).output
    assert "Who passed what" in run("passed", *archive).output
    assert refused("cpk", "--part", "FLANGE", "--by", "week", *archive).code == "archive.by"
    assert refused("today", "--from", "yesterday", *archive).code == "archive.day"
    assert refused("used", "screw", "X", *archive).code == "archive.used"
    assert refused("trend", "--part", "NONE", "--characteristic", "D1", *archive).code == (
        "archive.part"
    )
    # Every part was measured once, with a unique serial number: there is no study.
    assert refused("rr", *part, *archive).code == "archive.rr"


def test_an_archive_is_rebuilt_compared_and_verified(
    place: Place, job: Path, tmp_path: Path
) -> None:
    archive = ("--archive", place.address)
    assert run("send", job, *archive, "--outbox", tmp_path / "outbox").exit_code == 0
    assert "Checked 1, wrong 0" in run("verify", *archive).output
    assert "Checked 1, wrong 0" in run("verify", job, *archive).output
    new = tmp_path / "new.sqlite"
    assert "Kept 1 job in" in run("rebuild", new, *archive).output
    same = run("verify", "--against", new, *archive)
    assert same.exit_code == 0, same.output
    assert "The same rows." in same.output
    with place.open() as opened:
        by_hand(opened, "UPDATE result SET value = value + 1.0 WHERE position = 0")
    wrong = run("verify", *archive)
    assert wrong.exit_code == 1
    assert "result 1 value" in wrong.output
    assert refused("verify", "--mark", *archive).code == "archive.by"
    assert "Marked 1 job" in run("verify", "--mark", "--by", "Anna", *archive).output
    with place.open() as opened:
        assert opened.query("SELECT held FROM archived_job").rows == ((1,),)
    assert run("verify", "--against", new, *archive).exit_code == 1
    assert refused("rebuild", new, *archive).code == "archive.not_empty"


@pytest.mark.parametrize("removed", [("delivery", "result", "used", "finding", "job"), ("job",)])
def test_removed_rows_are_named(
    job: Path, removed: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With and without the row of the delivery; N = 2."""
    for name in ("DATA", "STATE"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name))
    address = platformdirs.user_data_path("ocmm") / "archive.sqlite"
    assert run("send", job).exit_code == 0
    assert "Checked 1, wrong 0" in run("verify").output
    with contextlib.closing(sqlite3.connect(address)) as db, db:
        for table in removed:
            db.execute(f"DELETE FROM {table}")  # noqa: S608
    told = run("verify")
    assert told.exit_code == 1
    assert "Checked 0, wrong " in told.output
    assert ("job.ocmm was delivered" if len(removed) > 1 else "was removed") in told.output


def test_views_and_roles(filled: Place, tmp_path: Path) -> None:
    file = tmp_path / "v.csv"
    done = run("export", "archived_result", file, "--archive", filled.address)
    assert "96 rows" in done.output
    assert refused("export", "job", file, "--archive", filled.address).code == "archive.view"
    printed = run("roles").output
    assert "CREATE ROLE ocmm_station NOLOGIN" in printed
    assert "archive_characteristic" in printed


def test_a_server_is_set_up_by_its_owner_alone(new_database: Callable[[], Place]) -> None:
    place = new_database()
    assert place.server is not None
    place.server.sql("postgres", f"CREATE DATABASE {place.database}_new")
    address = place.server.address(f"{place.database}_new")
    assert refused("status", "--archive", "postgresql://me:pw@db/x").code == "archive.password"
    done = run("set-up", "--archive", address)
    assert done.exit_code == 0, done.output
    assert "archive of version" in done.output
    login = place.server.address(f"{place.database}_new", "looker")
    with open_archive(login, read_only=True) as archive:
        assert archive.query("SELECT count(*) FROM archive_characteristic").rows == ((0,),)
    assert isinstance(run("set-up", "--archive", login).exception, OcmmError)


def test_another_computer_and_another_outbox(place: Place, job: Path, tmp_path: Path) -> None:
    where = ("--archive", place.address, "--outbox", tmp_path / "outbox")
    assert run("send", job, *where).exit_code == 0
    station = place.open()
    with station:
        name = str(station.query("SELECT station FROM archive_station").rows[0][0])
        by_hand(station, "UPDATE station SET machine = 'another computer'")
    other = tmp_path / "other.ocmm"
    shutil.copy(job, other)
    again = run("send", other, "--archive", place.address, "--outbox", tmp_path / "second")
    assert again.exit_code == 1
    assert "name of the station taken" in again.output
    done = run(
        "replace-computer", name, "--archive", place.address, "--outbox", tmp_path / "second"
    )
    assert done.exit_code == 0, done.output
    assert run("send", "--archive", place.address, "--outbox", tmp_path / "second").exit_code == 0
    assert "Outbox" in run("new-outbox", "--outbox", tmp_path / "second").output


def test_an_archive_that_is_off_is_said() -> None:
    error = refused("today", "--archive", "off")
    assert isinstance(error, InputError)
    assert "The archive is off." in error.what
