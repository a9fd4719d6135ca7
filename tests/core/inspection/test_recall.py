"""Suspect jobs are recalculated with the later calibration; their files stay unchanged."""

from __future__ import annotations

import hashlib
import sqlite3
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import numpy as np
import pytest
from typer.testing import CliRunner

from benchmarks.recall_scenes import DIAMETER, TruePart, World, base_points
from ocmm_cli import app
from ocmm_core.calibration.records import State, canonical, load_signed, record_hash
from ocmm_core.errors import InputError
from ocmm_core.inspection.finished import Outcome, RecalledJob, RecallRecord, reopen_job
from ocmm_core.inspection.recall import (
    KeptPlaces,
    artefact_wrong,
    decide,
    headline,
    job_line,
    not_judged,
    recall,
)
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.seals import Signed
from ocmm_core.storage import NAMED, JobFile
from ocmm_core.tolerances.decisions import Verdict
from tests.core.inspection.conftest import Bench
from tests.core.inspection.recorded_jobs import BAR, Cameras

TURN, SHIFT = np.array([2e-4, 1e-4, -2e-4]), np.array([0.1, 0.1, 0.1])
"""It makes the ball 0.066 mm too small, and the spots show it plainly."""
LARGE = TruePart(DIAMETER + 0.11)
"""0.03 mm above its tolerance; it looks good after the push."""


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> tuple[MeasuredPoint, ...]:
    return base_points(tmp_path_factory.mktemp("base"))


@pytest.fixture
def world(base: tuple[MeasuredPoint, ...], tmp_path: Path) -> World:
    (tmp_path / "jobs").mkdir()
    return World(base, tmp_path / "calibrations", seed=3)


def run(world: World, tmp_path: Path, who: str = "") -> dict[str, RecalledJob]:
    """Recall all jobs; return what came out by the name of the job."""
    places = KeptPlaces((tmp_path / "jobs",), world.calibrations)
    record = recall(places, datetime.now(UTC))
    if who:
        record = decide(record, places, who, datetime.now(UTC))
    return {Path(job.path).stem: job for job in record.jobs}


def outcomes(job: RecalledJob) -> dict[str, Outcome]:
    return {one.name: one.outcome for one in job.characteristics}


def test_hold_change_and_cannot_be_known(world: World, tmp_path: Path) -> None:
    jobs = tmp_path / "jobs"
    world.measure(jobs / "before.ocmm", TruePart())
    # The push comes before the last two points of the step: its datum is of another world.
    world.measure(jobs / "across.ocmm", TruePart(), (6, TURN, SHIFT))
    world.measure(jobs / "after.ocmm", TruePart(DIAMETER + 0.03))
    world.measure(jobs / "large.ocmm", LARGE)
    content = {path: path.read_bytes() for path in jobs.iterdir()}
    assert run(world, tmp_path) == {}
    world.verify(passed=False)
    # Without a later calibration the jobs stay undecided.
    found = run(world, tmp_path)
    assert len(found) == 4
    assert {job.outcome for job in found.values()} == {Outcome.UNKNOWN}
    world.calibrate()
    found = run(world, tmp_path, "Ada")
    assert {name: outcomes(job) for name, job in found.items()} == {
        "before": {"Ball diameter": Outcome.HOLDS, "Block step": Outcome.HOLDS},
        "across": {"Ball diameter": Outcome.HOLDS, "Block step": Outcome.UNKNOWN},
        # The noise check widens U of pushed cameras: NOT PROVEN becomes CONFORM.
        "after": {"Ball diameter": Outcome.CHANGES, "Block step": Outcome.HOLDS},
        "large": {"Ball diameter": Outcome.CHANGES, "Block step": Outcome.HOLDS},
    }
    changed = found["large"].characteristics[0]
    assert changed.after is not None
    assert changed.after.value is not None
    assert changed.after.expanded is not None
    # The noise check widens U of pushed cameras: the wrong value is not shown as CONFORM.
    assert changed.before.verdict == Verdict.NOT_PROVEN.value
    assert changed.after.verdict == Verdict.NOT_CONFORM.value
    # Within its own U (k = 2) and half as much again.
    assert abs(changed.after.value - LARGE.diameter) < 1.5 * changed.after.expanded
    assert found["before"].released == tuple(range(1, 15))
    for name in ("after", "large"):
        assert not set(found[name].released) & set(range(9, 15))
    # The ball is off by 0.07 mm, within the U of 0.10 mm that was stated for it.
    across = found["across"].characteristics[0]
    assert across.before.value is not None
    assert across.before.expanded is not None
    assert across.after is not None
    assert across.after.value is not None
    assert abs(across.after.value - across.before.value) < across.before.expanded
    assert set(range(9, 15)) <= set(found["across"].released)
    # The jobs are unchanged, and the recall names its inputs.
    assert {path: path.read_bytes() for path in jobs.iterdir()} == content
    for name, job in found.items():
        read = content[jobs / f"{name}.ocmm"]
        assert job.sha256 == hashlib.sha256(read).hexdigest()
    verdicts = {
        name: [
            result.verdict
            for result in reopen_job(
                jobs / f"{name}.ocmm", calibrations=world.calibrations
            ).view.characteristics
        ]
        for name in ("before", "large")
    }
    assert verdicts["before"] == [Verdict.CONFORM, Verdict.CONFORM]
    assert verdicts["large"] == [Verdict.NOT_PROVEN, Verdict.CONFORM]


def test_a_simulated_job_says_so_and_older_recalls_keep_their_hash() -> None:
    job = RecalledJob(
        path="jobs/A-1.ocmm", sha256="0", job_uuid="1", part="P", serial="-", created_utc="",
        rig="rig", calibration="2", in_doubt=(1,), why=("Pushed.",), later="", judgement="So.",
        characteristics=(), released=(), points_sha256="3",
    )  # fmt: skip
    assert job_line(job) == "A-1, part P: CANNOT BE KNOWN. So."
    # A record of an earlier version, read and written again, must come out byte for byte.
    assert b"simulated" not in canonical(job)
    simulated = msgspec.structs.replace(job, simulated=True, serial="7")
    assert job_line(simulated) == "SIMULATED, A-1, part P, serial 7: CANNOT BE KNOWN. So."
    assert msgspec.json.decode(canonical(simulated), type=RecalledJob) == simulated


def test_a_job_without_its_history_is_not_called_good(world: World, tmp_path: Path) -> None:
    jobs = tmp_path / "jobs"
    world.measure(jobs / "one.ocmm", TruePart())
    (jobs / "hostile.ocmm").write_bytes(b"SQLite format 3\0 and nothing more")
    world.verify(passed=False)
    places = KeptPlaces((jobs,), tmp_path / "elsewhere", tmp_path / "probes")
    record = recall(places, datetime.now(UTC))
    assert not record.jobs
    assert headline(record) == "2 NOT JUDGED of 2 checked"
    assert "so it is unknown here whether it failed" in not_judged(record)[1]
    assert not_judged(record, 1)[-1] == "Not judged: 1 more; all are in the PDF."


def test_spots_that_fit_neither_calibration(world: World, tmp_path: Path) -> None:
    world.push(-TURN, SHIFT)
    world.measure(tmp_path / "jobs" / "third.ocmm", TruePart())
    world.push(2.5 * TURN, SHIFT)
    world.verify(passed=False)
    world.calibrate()
    (job,) = run(world, tmp_path).values()
    assert job.outcome is Outcome.UNKNOWN
    assert job.judgement.startswith("The spots fit neither")


def test_a_push_that_no_residual_shows_excludes_nothing(world: World, tmp_path: Path) -> None:
    jobs = tmp_path / "jobs"
    # Along the baseline: the scale of everything changes, and no ray misses another one.
    world.measure(jobs / "before.ocmm", TruePart())
    world.push(np.array([0.0, 2e-6, 0.0]), np.array([0.02, 0.0, 0.0]))
    world.measure(jobs / "after.ocmm", TruePart())
    world.verify(passed=False)
    world.calibrate()
    for job in run(world, tmp_path).values():
        said = job.judgement
        assert "both calibrations" in said or "may have changed" in said


def test_what_is_decided_ends_where_more_becomes_known(world: World, tmp_path: Path) -> None:
    path = tmp_path / "jobs" / "before.ocmm"
    world.measure(path, TruePart())
    world.push(TURN, SHIFT)
    world.verify(passed=False)
    world.calibrate()

    def held() -> tuple[int, ...]:
        return reopen_job(path, calibrations=world.calibrations).view.held

    assert len(held()) == 14
    run(world, tmp_path)
    assert len(held()) == 14, "a trial decides nothing"
    run(world, tmp_path, "Ada")
    assert held() == ()
    # Again: a released job is judged again, and not treated as unaffected.
    (again,) = run(world, tmp_path, "Bob").values()
    assert again.in_doubt == again.released == tuple(range(1, 15))
    assert held() == ()
    # The calibration that the recall rests on turns out to rest on a wrong artefact.
    later = str(world.store.active_hash)
    now = datetime.now(UTC)
    world.store.refresh()
    world.store.fall(later, "", who="Ada", reason="The bar is wrong.", since=now, now=now)
    assert len(held()) == 14


def test_a_record_that_was_changed_releases_nothing(world: World, tmp_path: Path) -> None:
    path = tmp_path / "jobs" / "before.ocmm"
    world.measure(path, TruePart())
    world.verify(passed=False)
    world.calibrate()
    run(world, tmp_path, "Ada")
    world.store.refresh()
    sealed = world.store.folder / f"{world.store.events[-1].evidence}.json"
    sealed.write_bytes(sealed.read_bytes().replace(b'"Ada"', b'"Bob"', 1))
    again = reopen_job(path, calibrations=world.calibrations)
    assert "cannot be read" in again.doubts[0]
    assert {one.verdict for one in again.view.characteristics} == {Verdict.NOT_PROVEN}


def test_the_command_writes_the_sealed_recall_and_its_pages(world: World, tmp_path: Path) -> None:
    world.measure(tmp_path / "jobs" / "before.ocmm", TruePart())
    world.push(TURN, SHIFT)
    world.measure(tmp_path / "jobs" / "large.ocmm", LARGE)
    world.verify(passed=False)
    world.calibrate()
    sealed, pages = tmp_path / "recall.json", tmp_path / "recall.pdf"
    arguments = ["recall", str(tmp_path / "jobs"), "--calibrations", str(world.calibrations)]
    shown = CliRunner().invoke(app, [*arguments, "--json", str(sealed), "--pdf", str(pages)])
    assert shown.exit_code == 1, shown.output
    assert "0 CANNOT BE KNOWN   1 CHANGES   1 HOLDS" in shown.output
    assert "Not decided" in shown.output
    record = load_signed(sealed, RecallRecord, Signed.RECALL).record
    assert record.count(Outcome.CHANGES) == 1
    assert pages.read_bytes().startswith(b"%PDF")
    assert record_hash(record)
    # Somebody verifies between the looking and the deciding.
    places = KeptPlaces((tmp_path / "jobs",), world.calibrations)
    shown_record = recall(places, datetime.now(UTC))
    world.store.refresh()
    world.verify()
    with pytest.raises(InputError, match="since the recall"):
        decide(shown_record, places, "Ada", datetime.now(UTC))
    nowhere = CliRunner().invoke(app, ["recall", str(tmp_path / "nowhere")])
    assert isinstance(nowhere.exception, InputError)


def test_an_artefact_that_was_wrong_lets_fall_what_rests_on_it(
    bench: Bench, tmp_path: Path
) -> None:
    cameras = Cameras(tmp_path / "calibrations")
    path = cameras.measure(bench, "A")
    day = datetime.now(UTC) - timedelta(days=1)
    with pytest.raises(InputError, match="No calibration or verification"):
        artefact_wrong(cameras.folder, "B-17", day, "Ada", datetime.now(UTC))
    cameras.verify(artefacts=(BAR,))
    assert reopen_job(path, calibrations=cameras.folder).doubts == ()
    # Without a letter or digit it is the number of no artefact.
    with pytest.raises(InputError, match="No calibration or verification"):
        artefact_wrong(cameras.folder, "-", day, "Ada", datetime.now(UTC))
    # Written as on its label, not as in its document.
    fallen = artefact_wrong(cameras.folder, "b 17", day, "Ada", datetime.now(UTC))
    assert [one.kind for one in fallen] == ["verification"]
    cameras.store.refresh()
    assert cameras.store.status(datetime.now(UTC)).state is State.SUSPECT
    (doubt,) = reopen_job(path, calibrations=cameras.folder).doubts
    assert doubt.startswith("Artefact b 17 was found to be wrong since")
    # It falls once; a good bar answers it.
    assert artefact_wrong(cameras.folder, "B-17", day, "Ada", datetime.now(UTC)) == ()
    cameras.verify()
    assert reopen_job(path, calibrations=cameras.folder).doubts == ()
    assert cameras.store.status(datetime.now(UTC)).state is not State.SUSPECT


def test_a_job_that_was_altered_is_told_by_its_own_name_in_doubt_or_not(
    world: World, tmp_path: Path
) -> None:
    jobs = tmp_path / "jobs"
    for name in ("sound", "altered"):
        world.measure(jobs / f"{name}.ocmm", TruePart())
    with sqlite3.connect(jobs / "altered.ocmm") as db:
        db.execute("DROP TRIGGER observation_no_update")
        db.execute("UPDATE observation SET chi2_per_dof = chi2_per_dof + 1 WHERE number = 3")
    db.close()
    places = KeptPlaces((jobs,), world.calibrations)
    told = f"{jobs / 'altered.ocmm'}: the job file is damaged"
    well = recall(places, datetime.now(UTC))
    world.verify(passed=False)
    world.calibrate()
    doubted = recall(places, datetime.now(UTC))
    assert (len(well.jobs), len(doubted.jobs)) == (0, 1)
    for record in (well, doubted):
        assert [one.partition(" (")[0] for one in record.unread] == [told]
        assert "point 3 was changed" in record.unread[0]


def test_names_what_is_not_searched_and_jobs_whose_file_was_renamed(
    world: World, tmp_path: Path
) -> None:
    jobs, elsewhere = tmp_path / "jobs", tmp_path / "elsewhere"
    elsewhere.mkdir()
    (jobs / "linked").symlink_to(elsewhere)
    path = jobs / "one.ocmm"
    world.measure(path, TruePart())
    with JobFile.open(path) as job:
        job.append_event(NAMED, "one")
    path.rename(jobs / "TWO.OCMM")
    world.verify(passed=False)
    record = recall(KeptPlaces((jobs,), world.calibrations), datetime.now(UTC))
    assert [one.label for one in record.jobs] == ["one (TWO.OCMM)"]
    assert job_line(record.jobs[0]).startswith("one (TWO.OCMM), part P, serial one")
    assert "linked: this folder is a link" in not_judged(record)[0]
