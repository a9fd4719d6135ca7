"""A finding over archived jobs of two stations; stations hold back unreleased jobs."""

from __future__ import annotations

import uuid
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from typer.testing import CliRunner

from benchmarks.recall_scenes import TruePart, World, base_points
from ocmm_cli import app
from ocmm_core.calibration.records import seal
from ocmm_core.cluster import Site
from ocmm_core.errors import InputError
from ocmm_core.inspection.finished import Outcome, RecallRecord, reopen_job
from ocmm_core.inspection.recall import KeptPlaces, recall
from ocmm_core.storage import held_jobs_file
from ocmm_core.tolerances.decisions import Verdict
from ocmm_shop.archive.outbox import learn_marks
from ocmm_shop.archive.records import Delivery, Sender, extract_job, snapshot
from ocmm_shop.archive.stores import open_archive
from ocmm_shop.recalls import ArchiveFinding, ShopPlaces, decide_archived, recall_archive
from tests.core.inspection.test_recall import LARGE, SHIFT, TURN


@pytest.fixture
def now() -> datetime:
    """Return the time of the test, which is after its jobs and histories."""
    return datetime.now(UTC)


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> tuple[ShopPlaces, Path, World]:
    """Return an archive with jobs of two stations, one of whose calibrations failed."""
    folder = tmp_path_factory.mktemp("shop")
    base = base_points(folder)
    address = str(folder / "archive.sqlite")
    places = ShopPlaces(address, (folder / "one" / "calibrations", folder / "two" / "calibrations"))
    one, two = (World(base, places.calibrations[at], seed=at + 3) for at in (0, 1))
    jobs = folder / "jobs"
    jobs.mkdir()
    one.measure(jobs / "before.ocmm", TruePart())
    one.push(TURN, SHIFT)
    one.measure(jobs / "large.ocmm", LARGE)
    two.measure(jobs / "sound.ocmm", TruePart())
    one.verify(passed=False)
    one.calibrate()
    with open_archive(address) as archive:
        for at, name in enumerate(("before", "large", "sound")):
            station = "Station 2" if name == "sound" else "Station 1"
            found = extract_job(snapshot(jobs / f"{name}.ocmm"), name, station)
            sender = Sender(
                outbox=str(uuid.UUID(int=1 + at // 2)), station=station, machine=station,
                host=station, user="me",
            )  # fmt: skip
            archive.put(
                Delivery(
                    sender=sender, sequence=at + 1, sent_utc=datetime.now(UTC).isoformat(),
                    record=found.record, content=found.content,
                )
            )  # fmt: skip
    return places, jobs, one


def outcomes(record: RecallRecord) -> dict[str, Outcome]:
    return {job.serial: job.outcome for job in record.jobs}


def test_jobs_of_all_stations_are_recalled_and_held_back(
    shop: tuple[ShopPlaces, Path, World], now: datetime
) -> None:
    places, jobs, world = shop
    record = recall_archive(places, now)
    assert record.looked_at == 3
    assert outcomes(record) == {"before": Outcome.HOLDS, "large": Outcome.CHANGES}
    assert record.unread == ()
    # As the station itself finds them, job by job.
    own = recall(KeptPlaces((jobs / "before.ocmm", jobs / "large.ocmm"), world.calibrations), now)
    assert [job.characteristics for job in own.jobs] == [job.characteristics for job in record.jobs]
    assert seal(recall_archive(places, now, site=Site(workers=2))) == seal(record)
    # Jobs without an available history are named.
    partly = recall_archive(ShopPlaces(places.address, places.calibrations[1:]), now)
    assert partly.jobs == ()
    assert "2 jobs of station Station 1: the history of their calibration" in partly.unread[0]
    with open_archive(places.address) as archive:
        with pytest.raises(InputError, match="No name"):
            decide_archived(archive, record, "", now)
        assert learn_marks(archive) == 0
        decided, number = decide_archived(archive, record, "Ada", now + timedelta(seconds=1))
        assert decided.made_by == "Ada"
        assert archive.findings()[-1].id == number
        rows = archive.query("SELECT serial, held FROM archived_job").rows
        held = {row[0]: row[1] for row in rows}
        assert held == {"before": 0, "large": 1, "sound": 0}
        with pytest.raises(InputError, match="another recall"):
            decide_archived(archive, record, "Bob", now)
        # The station learns of it and shows nothing of it as proven, also without the archive.
        assert learn_marks(archive) == 2
        assert learn_marks(archive) == 0
    try:
        elsewhere = jobs.parent / "nothing"
        shown = reopen_job(jobs / "large.ocmm", calibrations=elsewhere)
        assert {one.verdict for one in shown.view.characteristics} == {Verdict.NOT_PROVEN}
        assert shown.recalled[0].startswith("Held back by the archive: Recall: CHANGES.")
        assert reopen_job(jobs / "sound.ocmm", calibrations=elsewhere).recalled == ()
        # Its mark does not keep the next recall from looking.
        assert outcomes(recall_archive(places, now)) == outcomes(record)
        held_jobs_file().write_bytes(b"{")
        (said,) = reopen_job(jobs / "sound.ocmm", calibrations=elsewhere).recalled
        assert "cannot be read" in said
    finally:
        held_jobs_file().unlink()


def test_a_finding_without_a_history_cannot_be_known(
    shop: tuple[ShopPlaces, Path, World], now: datetime
) -> None:
    places, _, world = shop
    day = now - timedelta(days=1)
    calibration = str(world.store.events[0].calibration)
    alone = ShopPlaces(places.address, places.calibrations[1:])
    found = recall_archive(alone, now, finding=ArchiveFinding("calibration", calibration, day))
    assert outcomes(found) == {"before": Outcome.UNKNOWN, "large": Outcome.UNKNOWN}
    assert found.jobs[0].characteristics[0].before.value is not None
    later = ArchiveFinding("calibration", calibration, now + timedelta(days=1))
    assert recall_archive(alone, now, finding=later).jobs == ()


def test_the_command(shop: tuple[ShopPlaces, Path, World], tmp_path: Path) -> None:
    places, _, _ = shop
    arguments = ["archive", "recall", "--archive", places.address]
    for folder in places.calibrations:
        arguments += ["--calibrations", str(folder)]
    sealed = tmp_path / "recall.json"
    shown = CliRunner().invoke(app, [*arguments, "--json", str(sealed)])
    assert shown.exit_code == 1, shown.output
    assert "1 CHANGES   1 HOLDS" in shown.output
    assert sealed.exists()
    refused = CliRunner().invoke(app, [*arguments, "--tip", "T1"])
    assert isinstance(refused.exception, InputError)
