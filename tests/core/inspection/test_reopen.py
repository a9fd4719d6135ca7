"""A job opened from its file alone, without disturbing the file or its writer."""

from __future__ import annotations

import hashlib
import shutil
import sqlite3
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.calibration.probe_design import (
    MaterialExpansion,
    Temperature,
    TemperatureState,
    body_in_use,
    contact_force,
    load_design,
)
from ocmm_core.calibration.records import (
    TEXT_SCHEMA,
    ProbeText,
    canonical,
    probe_from_records,
    rig_from_record,
)
from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.export import ENDING, EXPORTERS, write_report
from ocmm_core.export.report import read_report, report_of_job
from ocmm_core.inspection.evaluation import JobView, SessionOptions
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.inspection.plan import load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import Climate, MeasuredPoint, PartTemperature, Touch
from ocmm_core.storage import JobFile, make_head
from ocmm_core.tolerances.decisions import PartWord, Verdict
from ocmm_core.tracking import load_probe
from tests.core.calibration.made_probe_records import make_probe_record, make_tip_record
from tests.core.calibration.made_records import make_record
from tests.core.inspection.conftest import PLAN, PROBE, RIG, Bench

_HOLD = """
import sys
from ocmm_core.storage._job_file import JobFile
job = JobFile.open(sys.argv[1])
print("open", flush=True)
sys.stdin.readline()
job.close()
"""


def measured(bench: Bench, job: JobFile) -> InspectionSession:
    """Measure the whole plan into a job."""
    session = bench.session(job)
    session.conditions.note_calibration("DESIGN " + "0" * 64, "DESIGN standard: " + "1" * 64, "")
    session.conditions.note_climate()
    for touch in bench.touches:
        assert isinstance(session.touches.record_touch(touch), MeasuredPoint)
    return session


def numbers(view: JobView) -> list[object]:
    """Return every number that the results of a job hold."""
    fits = [None if item.fit is None else item.fit.geometry.tolist() for item in view.features]
    return [*view.characteristics, *fits]


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def once(
    quick_touches: tuple[Touch, ...], tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, JobView]:
    """Measure the whole plan once for all tests."""
    folder = tmp_path_factory.mktemp("once")
    bench = Bench(load_plan(PLAN), load_rig(RIG), load_probe(PROBE), quick_touches, folder)
    with bench.job() as job:
        view = measured(bench, job).view
    return job.path, view


@pytest.fixture
def finished(once: tuple[Path, JobView], tmp_path: Path) -> tuple[Path, JobView]:
    return Path(shutil.copy(once[0], tmp_path / once[0].name)), once[1]


def test_everything_comes_out_as_it_was_to_the_last_bit(finished: tuple[Path, JobView]) -> None:
    path, view = finished
    again = reopen_job(path)
    assert numbers(again.view) == numbers(view)
    assert again.view.complete
    assert (again.doubts, again.annulled) == ((), ())
    assert [event.kind for event in again.events][:2] == ["calibration", "probe"]
    for point, anew in zip(again.points, again.sensitivities, strict=True):
        # The mean of the frames and the frame of the means: they differ by the nonlinearity.
        assert np.linalg.norm(anew.tip_world - point.tip_world) < 0.003


def test_nothing_is_written_where_the_job_lies(finished: tuple[Path, JobView]) -> None:
    path, _ = finished
    folder = path.parent / "archive"
    folder.mkdir()
    shutil.copy(path, folder / path.name)
    before = content(folder)
    folder.chmod(0o500)
    (folder / path.name).chmod(0o400)
    try:
        assert reopen_job(folder / path.name).view.complete
        assert content(folder) == before
    finally:
        folder.chmod(0o700)


def test_a_job_that_is_being_measured_is_seen_as_it_stands(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    for touch in bench.touches[:3]:
        session.touches.record_touch(touch)
    first = reopen_job(job.path)
    assert len(first.points) == 3
    # The lock of the program that measures, here this very process, is still there.
    script = f"from ocmm_core.storage._job_file import JobFile; JobFile.open({str(job.path)!r})"
    other = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert "in use by another program" in other.stderr
    session.touches.record_touch(bench.touches[3])
    assert len(reopen_job(job.path).points) == 4
    assert len(first.points) == 3


def test_a_job_that_another_program_measures_can_be_read(finished: tuple[Path, JobView]) -> None:
    path, view = finished
    holder = subprocess.Popen(
        [sys.executable, "-c", _HOLD, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    try:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"open\n"
        with pytest.raises(StorageError, match="in use"):
            JobFile.open(path)
        assert numbers(reopen_job(path).view) == numbers(view)
    finally:
        holder.communicate(b"\n")


def test_a_job_whose_program_was_killed_is_whole(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    for touch in bench.touches[:5]:
        session.touches.record_touch(touch)
    # State after a kill: the file and its log as on the disk.
    folder = bench.folder / "after"
    folder.mkdir()
    for name in (job.path.name, f"{job.path.name}-wal"):
        shutil.copy(job.path.with_name(name), folder / name)
    before = content(folder)
    again = reopen_job(folder / job.path.name)
    assert (len(again.points), again.faults) == (5, ())
    assert content(folder) == before


def test_a_point_that_was_taken_back_is_told_with_its_reason(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    for touch in bench.touches[:3]:
        session.touches.record_touch(touch)
    session.steps.undo()
    again = reopen_job(job.path)
    assert (again.annulled, len(again.points)) == ((3,), 2)
    data = report_of_job(again)
    (path,) = write_report(data, ("json",), bench.folder / "out", incomplete=True)
    (told,) = read_report(path.read_bytes()).taken_back
    ((point, reason),) = job.annulled()
    assert told.observation.tip_world == tuple(point.tip_world.tolist())
    assert told.reason == reason != ""


def test_a_job_with_records_brings_its_own_cameras_and_probe(bench: Bench) -> None:
    record, calibration = make_record(), make_probe_record()
    tip = make_tip_record(calibration)
    text = canonical(
        ProbeText(
            schema=TEXT_SCHEMA,
            document=PROBE.read_bytes().decode("utf-8"),
            calibration=calibration,
            qualification=tip,
        )
    )
    head = make_head(plan=PLAN, rig=RIG, probe=PROBE, operator="me", part="P", serial="1")
    head = replace(head, rig_text=canonical(record).decode(), probe_text=text.decode())
    rig = rig_from_record(record)
    body = probe_from_records(bench.body, calibration, tip)
    body = replace(body, identity=hashlib.sha256(text).hexdigest())
    path = bench.folder / "records.ocmm"
    with JobFile.create(path, head) as job:
        session = InspectionSession(bench.plan, rig, body, job, SessionOptions())
        for touch in bench.touches:
            session.touches.record_touch(touch)
        view = session.view
    again = reopen_job(path)
    assert numbers(again.view) == numbers(view)
    assert again.body.tip_radius == 0.5 * tip.diameter_mm
    assert again.rig.identity == rig.identity
    assert again.doubts == ()


def test_temperatures_and_the_design_of_the_probe_come_from_the_file(bench: Bench) -> None:
    design = load_design(resource("designs", "standard.toml"), bench.body)
    warm = Temperature(23.0, 0.5, "given by the operator")
    climate = Climate(
        TemperatureState(warm, Temperature(20.0, 0.5, "design of the probe")),
        PartTemperature(warm, MaterialExpansion("steel", 11.5e-6, 1e-6), compensated=True),
        design.text,
    )
    body = body_in_use(bench.body, design, climate.probe)
    options = SessionOptions(climate=climate, contact=contact_force(design, body))
    with bench.job() as job:
        session = InspectionSession(bench.plan, bench.rig, body, job, options)
        session.conditions.note_climate()
        for touch in bench.touches:
            session.touches.record_touch(touch)
        view = session.view
    again = reopen_job(job.path)
    assert numbers(again.view) == numbers(view)
    assert again.view.at_20_c
    assert again.climate.summary == climate.summary
    # Without the record of temperatures the same points say something else.
    plain = bench.folder / "plain.ocmm"
    with JobFile.create(plain, again.head) as other:
        for one in again.points:
            other.append_point(one)
    assert numbers(reopen_job(plain).view) != numbers(view)


def test_a_point_that_its_spots_do_not_show_is_told_and_proves_nothing(
    finished: tuple[Path, JobView],
) -> None:
    path, view = finished
    assert Verdict.CONFORM in {result.verdict for result in view.characteristics}
    honest = reopen_job(path)
    forged = path.with_name("forged.ocmm")
    with JobFile.create(forged, honest.head) as job:
        for one in honest.points:
            moved = one.tip_world + np.array([0.0, 0.0, 0.03 if one.number == 2 else 0.0])
            job.append_point(replace(one, tip_world=moved))
    again = reopen_job(forged)
    assert again.faults == ()
    assert len(again.differences) == 1
    assert again.differences[0].startswith("Point 2 is 0.0")
    assert "Point 2" in again.view.unproven
    verdicts = {result.verdict for result in again.view.characteristics}
    assert verdicts <= {Verdict.NOT_PROVEN, Verdict.NOT_MEASURED}
    assert again.view.part_verdict.word is PartWord.NOT_PROVEN


def test_a_ball_of_another_size_is_told(finished: tuple[Path, JobView]) -> None:
    path, _ = finished
    honest = reopen_job(path)
    forged = path.with_name("forged.ocmm")
    with JobFile.create(forged, honest.head) as job:
        for one in honest.points:
            job.append_point(replace(one, tip_radius=np.nextafter(one.tip_radius, 9.0)))
    assert len(reopen_job(forged).differences) == len(honest.points)


def test_a_changed_row_shows_in_the_audit(finished: tuple[Path, JobView]) -> None:
    path, _ = finished
    with sqlite3.connect(path) as db:
        db.execute("DROP TRIGGER event_no_update")
        db.execute("UPDATE event SET text = 'VALID ' || substr(text, 8) WHERE kind = 'calibration'")
    db.close()
    again = reopen_job(path)
    assert any("event" in fault for fault in again.faults)
    assert again.view.unproven


def test_a_job_of_an_older_version_is_read_without_changing_it(
    finished: tuple[Path, JobView],
) -> None:
    path, view = finished
    with sqlite3.connect(path) as db:
        # Version 1 knew no reference bodies; later versions only add tables.
        version = db.execute("PRAGMA user_version").fetchone()[0]
        for table in ("reference_observation", "reference", "seal", "part"):
            db.execute(f"DROP TABLE {table}")
        db.execute("PRAGMA user_version = 1")
    db.close()
    assert version == 4
    before = content(path.parent)
    again = reopen_job(path)
    assert content(path.parent) == before
    # It proves nothing until a person takes responsibility for it.
    assert [doubt[:22] for doubt in again.doubts] == ["The job is not signed:"]
    with JobFile.open(path) as job:
        job.adopt("Ada Lovelace", "made before jobs were signed")
    taken = reopen_job(path)
    assert (taken.doubts, numbers(taken.view)) == ((), numbers(view))
    assert "taken over by Ada Lovelace: made before jobs were signed." in taken.remarks[0]


@pytest.mark.parametrize("kind", ["missing", "folder", "text", "cut", "empty"])
def test_what_is_no_job_is_one_sentence_that_names_it(
    finished: tuple[Path, JobView], kind: str
) -> None:
    path, _ = finished
    bad = path.with_name("bad.ocmm")
    if kind == "folder":
        bad.mkdir()
    elif kind == "text":
        bad.write_text("no job at all\n" * 100)
    elif kind == "cut":
        bad.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    elif kind == "empty":
        bad.touch()
    with pytest.raises(StorageError) as caught:
        reopen_job(bad)
    assert str(bad) in caught.value.what


def test_a_document_that_cannot_be_used_is_named_with_its_job(bench: Bench) -> None:
    head = make_head(plan=PLAN, rig=RIG, probe=PROBE, operator="me", part="P", serial="1")
    head = replace(head, plan_text=head.plan_text.replace('"Sphere"', '"Egg"'))
    path = bench.folder / "egg.ocmm"
    JobFile.create(path, head).close()
    with pytest.raises(InputError) as caught:
        reopen_job(path)
    assert f"{path} (plan)" in caught.value.what
    assert "Egg" in caught.value.what
    assert isinstance(caught.value, OcmmError)


def test_the_command_reports_a_job_in_every_format_of_data(
    finished: tuple[Path, JobView], monkeypatch: pytest.MonkeyPatch
) -> None:
    path, view = finished
    monkeypatch.chdir(path.parent)
    command = ["report", path.name]
    for name in EXPORTERS:
        command += ["--format", name]
    done = CliRunner().invoke(app, [*command, "--out", "out"])
    assert (done.exit_code, done.stderr) == (0, "")
    written = sorted(file.name for file in (path.parent / "out").iterdir())
    verdict, *told = done.stdout.splitlines()
    assert verdict.startswith(f"{path.stem}: PART CONFORMS: ")
    written.remove(f"{path.stem}{ENDING}")
    assert [f"Report  out/{name}" for name in written] == sorted(told)
    kinds = {file.rpartition(".")[2] for file in written} - {"parquet"}
    assert kinds == {"csv", "asc", "pwmacro", "qif", "dfq", "xlsx", "json", "xyz", "ply"}
    report = (path.parent / "out" / f"{path.stem}_report.csv").read_text("ascii")
    for result in view.characteristics:
        assert f"{result.measured:.4f}" in report


def test_a_preview_writes_nothing_and_a_wrong_format_is_named(
    finished: tuple[Path, JobView],
) -> None:
    path, view = finished
    before = content(path.parent)
    shown = CliRunner().invoke(app, ["report", str(path), "--format", "dfq", "--preview"])
    assert shown.exit_code == 0
    assert f"{view.characteristics[0].measured:.4f}" in shown.stdout
    wrong = CliRunner().invoke(app, ["report", str(path), "--format", "doc"])
    assert isinstance(wrong.exception, InputError)
    assert "'doc'" in str(wrong.exception)
    assert content(path.parent) == before


@pytest.mark.parametrize("loss", ["removed", "replaced by a copy", "moved"])
def test_no_report_replaces_another_when_the_job_is_lost_after_reading(
    finished: tuple[Path, JobView], loss: str
) -> None:
    path, _ = finished
    out = path.parent / "out"
    report = report_of_job(reopen_job(path))
    write_report(report, ["json"], out)
    before = content(out)
    if loss == "replaced by a copy":
        copy = Path(shutil.copy(path, path.with_name("copy")))
        copy.replace(path)
    elif loss == "moved":
        path.rename(path.with_name("moved.ocmm"))
    else:
        path.unlink()
    with pytest.raises(StorageError, match="after it was read"):
        write_report(report, ["json", "qif"], out)
    assert content(out) == before
