"""An older job shows the fate of its calibration if the history is available."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.calibration.records import record_hash
from ocmm_core.export import write_report
from ocmm_core.export.report import report_of_job
from ocmm_core.inspection.evaluation import HoldReason, event_text
from ocmm_core.inspection.finished import ReopenedJob, reopen_job
from ocmm_core.storage import JobFile
from ocmm_core.tolerances.decisions import Verdict
from tests.core.inspection.conftest import Bench
from tests.core.inspection.recorded_jobs import Cameras, compare_jobs


@pytest.fixture
def cameras(tmp_path: Path) -> Cameras:
    return Cameras(tmp_path / "calibrations")


def opened(path: Path, cameras: Cameras) -> ReopenedJob:
    return reopen_job(path, calibrations=cameras.folder)


def verdicts(job: ReopenedJob) -> set[Verdict]:
    return {result.verdict for result in job.view.characteristics}


def test_a_verification_that_failed_later_puts_the_jobs_before_it_in_doubt(
    bench: Bench, cameras: Cameras, tmp_path: Path
) -> None:
    before = cameras.measure(bench, "A")
    cameras.verify()
    since = [cameras.measure(bench, name) for name in "BC"]
    content = [path.read_bytes() for path in since]
    assert [verdicts(opened(path, cameras)) for path in (before, *since)] == [{Verdict.CONFORM}] * 3
    cameras.verify(passed=False)
    # A was checked after it was measured; B and C were not.
    assert (opened(before, cameras).doubts, verdicts(opened(before, cameras))) == (
        (), {Verdict.CONFORM},
    )  # fmt: skip
    for path in since:
        job = opened(path, cameras)
        assert job.view.held == tuple(range(1, 15))
        assert verdicts(job) == {Verdict.NOT_PROVEN}
        (doubt,) = job.doubts
        assert doubt.startswith("The verification of 20")
        assert "14 points are suspect. Recall the jobs (ocmm recall)" in doubt
        assert report_of_job(job).notes == job.doubts
    # A passed verification proves nothing about earlier times; the files are unchanged.
    cameras.verify()
    assert [verdicts(opened(path, cameras)) for path in since] == [{Verdict.NOT_PROVEN}] * 2
    assert [path.read_bytes() for path in since] == content
    jobs = [opened(path, cameras) for path in since]
    assert all(not len(trend.values) for trend in compare_jobs(jobs))
    (written,) = write_report(report_of_job(jobs[0]), ("json",), tmp_path)
    assert "NOT PROVEN" in written.read_text()
    assert '"CONFORM"' not in written.read_text()


def test_the_command_consults_the_history(bench: Bench, cameras: Cameras) -> None:
    path = cameras.measure(bench, "B")
    cameras.verify(passed=False)
    arguments = ["report", str(path), "--format", "json", "--preview"]
    shown = CliRunner().invoke(app, [*arguments, "--calibrations", str(cameras.folder)])
    assert shown.exit_code == 0
    assert "14 points are suspect" in shown.output
    # Elsewhere only the file counts, and the output says that there is no further information.
    shown = CliRunner().invoke(app, [*arguments, "--calibrations", str(cameras.folder / "no")])
    assert "in doubt" not in shown.output
    assert "is not on this computer" in shown.output


def test_a_doubt_lasts_until_the_verification(bench: Bench, cameras: Cameras) -> None:
    path = cameras.measure(bench, "B")
    now = datetime.now(UTC)
    cameras.store.suspect("monitor", "Camera 'left' has turned.", None, now)
    job = opened(path, cameras)
    assert len(job.view.held) == 14
    assert job.doubts[0].startswith("Camera 'left' has turned. 14 points are suspect. Verify")
    cameras.verify()
    assert opened(path, cameras).doubts == ()
    assert verdicts(opened(path, cameras)) == {Verdict.CONFORM}


def test_what_the_monitor_held_back_in_the_job_is_released_by_the_verification(
    bench: Bench, cameras: Cameras
) -> None:
    path = cameras.measure(bench, "B")
    alarm, other = "Camera 'left' has turned.", "The part has moved."
    with JobFile.open(path) as job:
        job.append_event(HoldReason.CAMERAS.held, event_text([1, 2, 3], alarm))
        job.append_event(HoldReason.CAMERAS.held, event_text([8], other))
    assert opened(path, cameras).view.held == (1, 2, 3, 8)
    now = datetime.now(UTC)
    cameras.store.suspect("monitor", alarm, now, now)
    assert opened(path, cameras).view.held == (1, 2, 3, 8)
    cameras.verify()
    # A verification of the cameras proves nothing about a part that has moved.
    assert opened(path, cameras).view.held == (8,)


def test_a_point_that_was_put_back_later_is_as_old_as_it_was(
    bench: Bench, cameras: Cameras
) -> None:
    path = cameras.measure(bench, "B")
    cameras.verify(passed=False)
    cameras.verify()
    with JobFile.open(path) as job:
        point = job.points()[0]
        job.change(annul={point.number: "undone"})
        job.append_point(
            type(point)(**{name: getattr(point, name) for name in point.__slots__} | {"number": 15})
        )
    assert opened(path, cameras).view.held == (*range(2, 15), 15)


def test_a_history_that_is_not_here_or_of_another_calibration_says_nothing(
    bench: Bench, cameras: Cameras, tmp_path: Path
) -> None:
    path = cameras.measure(bench, "B")
    cameras.verify(passed=False)
    job = reopen_job(path, calibrations=tmp_path / "nowhere")
    assert (job.doubts, verdicts(job)) == ((), {Verdict.CONFORM})
    (remark,) = job.remarks
    assert remark.startswith(f"The history of calibration {record_hash(cameras.record)[:12]}")
    assert not (tmp_path / "nowhere").exists()
    others = Cameras(tmp_path / "others", made_by="somebody else")
    others.verify(passed=False)
    job = reopen_job(path, calibrations=others.folder)
    assert (job.doubts, len(job.remarks)) == ((), 1)
    # Jobs measured with the rig document have no history.
    with bench.job() as plain:
        session = bench.session(plain)
        session.touches.record_touch(bench.touches[0])
    assert reopen_job(bench.folder / "job.ocmm", calibrations=cameras.folder).remarks == ()


def test_a_history_that_cannot_be_read_is_told_and_then_nothing_is_proven(
    bench: Bench, cameras: Cameras
) -> None:
    path = cameras.measure(bench, "B")
    chain = cameras.store.folder / "events.jsonl"
    chain.write_bytes(chain.read_bytes().replace(b"technician", b"somebody--", 1))
    job = opened(path, cameras)
    assert "cannot be read" in job.doubts[0]
    assert verdicts(job) == {Verdict.NOT_PROVEN}
