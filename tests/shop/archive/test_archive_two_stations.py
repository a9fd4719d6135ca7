"""Two stations and one server: a later finding at one of them is held back at every display."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

import platformdirs
import pytest

from benchmarks.recall_scenes import TruePart, World, base_points
from ocmm_core.inspection.finished import Outcome, reopen_job
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.tolerances.decisions import Verdict
from ocmm_shop.archive.outbox import ArchivePlace, Outbox, hand_over
from ocmm_shop.archive.stores import open_archive
from ocmm_shop.recalls import ShopPlaces, decide_archived, recall_archive
from tests.core.inspection.test_recall import LARGE, SHIFT, TURN
from tests.shop.archive.conftest import Place


class Station:
    """A station with its own data folder, jobs, outbox and login."""

    def __init__(
        self, folder: Path, name: str, address: str, base: Sequence[MeasuredPoint], seed: int
    ) -> None:
        self.data, self.jobs = folder / "data", folder / "jobs"
        self.jobs.mkdir(parents=True)
        self.place = ArchivePlace(address, name, folder / "outbox")
        self.world = World(base, folder / "calibrations", seed=seed)

    def measure(self, name: str, part: TruePart) -> Path:
        path = self.jobs / f"{name}.ocmm"
        self.world.measure(path, part)
        with Outbox(self.place.outbox) as outbox:
            outbox.put(path)
        return path

    @contextlib.contextmanager
    def at_home(self) -> Iterator[None]:
        """Work at this station: its memory is in its own data folder."""
        with pytest.MonkeyPatch.context() as environment:
            environment.setenv("XDG_DATA_HOME", str(self.data))
            yield

    def hand_over(self) -> int:
        """Send the queue and receive the findings, as this station's process does."""
        if not self.data.exists():
            # With the key that signed its jobs.
            shutil.copytree(platformdirs.user_data_path("ocmm"), self.data / "ocmm")
        with self.at_home(), Outbox(self.place.outbox) as outbox:
            courier = self.place.courier(outbox)
            try:
                handed = courier.send_waiting()
            finally:
                courier.close()
        assert handed.error is None
        assert hand_over(self.place.outbox).line == ""
        return handed.sent

    def held_back(self, path: Path) -> str:
        """Return why a job is held back by the archive when it is opened here; empty: it is not."""
        with self.at_home():
            job = reopen_job(path, calibrations=self.data / "nothing")
        said = [one for one in job.recalled if one.startswith("Held back by the archive")]
        if said:
            assert {one.verdict for one in job.view.characteristics} == {Verdict.NOT_PROVEN}
        return "".join(said)


@pytest.mark.slow
def test_a_finding_at_one_station_is_held_back_by_it_and_not_by_the_other(
    new_database: Callable[[], Place], tmp_path: Path
) -> None:
    shop = new_database()
    assert shop.server is not None
    base = base_points(tmp_path)
    one, two = (
        Station(
            tmp_path / f"{number}", f"Station {number}",
            shop.server.address(shop.database, f"station{number}"), base, number + 2,
        )
        for number in (1, 2)
    )  # fmt: skip
    before = one.measure("before", TruePart())
    one.world.push(TURN, SHIFT)
    wrong = one.measure("large", LARGE)
    sound = two.measure("sound", TruePart())
    assert one.hand_over() == 2
    assert two.hand_over() == 1
    # A later finding.
    one.world.verify(passed=False)
    one.world.calibrate()
    quality = shop.server.address(shop.database, "anna")
    places = ShopPlaces(quality, (tmp_path / "1/calibrations", tmp_path / "2/calibrations"))
    now = datetime.now(UTC)
    record = recall_archive(places, now)
    assert record.unread == ()
    assert {job.serial: job.outcome for job in record.jobs} == {
        "before": Outcome.HOLDS, "large": Outcome.CHANGES,
    }  # fmt: skip
    with open_archive(quality) as archive:
        decide_archived(archive, record, "Anna", now + timedelta(seconds=1))
    # A station learns of it at its next hand-over, which needs no job.
    assert one.held_back(wrong) == ""
    assert one.hand_over() == two.hand_over() == 0
    assert "Recall: CHANGES." in one.held_back(wrong)
    assert "(Anna, " in one.held_back(wrong)
    assert one.held_back(before) == ""
    assert two.held_back(sound) == ""
    # The other station, which opens a copy of that job, holds it back as well.
    copied = two.jobs / "copied.ocmm"
    copied.write_bytes(wrong.read_bytes())
    assert "Recall: CHANGES." in two.held_back(copied)
    with open_archive(shop.server.address(shop.database, "looker")) as archive:
        rows = archive.query("SELECT serial, held FROM archived_job ORDER BY serial").rows
        assert rows == (("before", 0), ("large", 1), ("sound", 0))
        (role,) = archive.query("SELECT DISTINCT role FROM archive_mark").rows
        assert role == ("anna",)
