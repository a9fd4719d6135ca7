"""The Archive page: queried in a separate process, by keys, and stopped at once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from benchmarks.recall_scenes import TruePart, World, base_points
from ocmm_core.errors import OcmmError
from ocmm_core.inspection.finished import Outcome
from ocmm_core.inspection.recall import headline
from ocmm_gui.archive import ArchiveSheet
from ocmm_gui.kit import use_language
from ocmm_shop.archive.outbox import ArchivePlace, Outbox
from ocmm_shop.archive.questions import QUESTIONS
from ocmm_shop.archive.stores import open_archive
from tests.core.inspection.test_recall import LARGE, SHIFT, TURN
from tests.host import HANG_MS
from tests.shop.archive.made_jobs import START, made_delivery

NAMES = [one.name for one in QUESTIONS]


@pytest.fixture
def place(tmp_path: Path) -> ArchivePlace:
    address = str(tmp_path / "archive.sqlite")
    with open_archive(address) as archive:
        archive.put_all([made_delivery(seed) for seed in range(30)])
        archive.put(made_delivery(40, fault="Altered after it was archived: step 3."))
    return ArchivePlace(address, "Station 1", tmp_path / "outbox")


@pytest.fixture
def sheet(qtbot: QtBot, place: ArchivePlace, tmp_path: Path) -> Iterator[ArchiveSheet]:
    made = ArchiveSheet(lambda: place, lambda: tmp_path)
    qtbot.addWidget(made)
    made.resize(1280, 720)
    made.show()
    yield made
    made.close_work()


def ask(qtbot: QtBot, sheet: ArchiveSheet, name: str, **fields: str) -> None:
    sheet.question.setCurrentIndex(NAMES.index(name))
    for key, text in fields.items():
        sheet.fields[key].setText(text)
    sheet.keys["ask"].trigger()
    qtbot.waitUntil(lambda: not sheet.is_working(), timeout=HANG_MS)


def test_a_trend_is_shown_with_its_chart_and_exported(
    qtbot: QtBot, sheet: ArchiveSheet, tmp_path: Path
) -> None:
    ask(qtbot, sheet, "trend", part="FLANGE", characteristic="D1")
    assert sheet.table.rowCount() == 31
    assert sheet.chart.isVisible()
    assert "31 rows" in sheet.about()
    assert "Cpk" in sheet.notes.text()
    assert sheet.standing.text() == "Everything measured here is in the archive."
    sheet.keys["export"].trigger()
    sheet.target.given.emit(tmp_path / "t.csv")
    assert (tmp_path / "t.csv").read_text("utf-8").count("\n") == 32


@pytest.mark.usefixtures("fresh_sides")
def test_a_day_has_its_jobs_and_only_the_fields_it_takes(qtbot: QtBot, sheet: ArchiveSheet) -> None:
    ask(qtbot, sheet, "today", first=START.astimezone().date().isoformat())
    assert sheet.table.rowCount() == 31
    assert not sheet.chart.isVisible()
    assert sheet.fields["first"].isVisible()
    assert not sheet.fields["part"].isVisible()


@pytest.fixture
def german(qapp: QApplication) -> Iterator[None]:
    use_language(qapp, "de")
    yield
    use_language(qapp, "en")


@pytest.mark.usefixtures("german")
def test_notes_and_title_are_in_the_language_of_the_window(
    qtbot: QtBot, sheet: ArchiveSheet
) -> None:
    ask(qtbot, sheet, "today", first=START.astimezone().date().isoformat())
    assert "Fertige reale Werkstücke" in sheet.notes.text()
    assert "Gemessen" in sheet.about()


def test_what_is_missing_is_asked_for(qtbot: QtBot, sheet: ArchiveSheet) -> None:
    ask(qtbot, sheet, "used")
    assert "Fill in what it is about" in sheet.about()
    ask(qtbot, sheet, "used", what="B-17")
    # The kind is calibration; none has that name.
    assert sheet.table.rowCount() == 0


def test_a_question_that_has_no_answer_says_why(qtbot: QtBot, sheet: ArchiveSheet) -> None:
    told: list[OcmmError] = []
    sheet.failed.connect(told.append)
    ask(qtbot, sheet, "trend", part="OTHER", characteristic="D1")
    assert "No archived part is called 'OTHER'" in told[0].what
    sheet.question.setCurrentIndex(NAMES.index("today"))
    sheet.fields["first"].setText("yesterday")
    sheet.keys["ask"].trigger()
    assert "yesterday is no day." in told[1].what


def test_asking_is_given_up_at_once(sheet: ArchiveSheet) -> None:
    sheet.query()
    assert sheet.is_working()
    sheet.keys["stop"].trigger()
    assert not sheet.is_working()


def test_an_archive_that_is_off_is_said(qtbot: QtBot, tmp_path: Path) -> None:
    sheet = ArchiveSheet(lambda: None, lambda: tmp_path)
    qtbot.addWidget(sheet)
    sheet.query()
    assert "The archive is off" in sheet.about()


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> tuple[ArchivePlace, Path]:
    """Return an archive with two jobs of a calibration that failed, and its history."""
    folder = tmp_path_factory.mktemp("shop")
    world = World(base_points(folder), folder / "calibrations", seed=3)
    for name, part in (("before", TruePart()), ("large", LARGE)):
        world.measure(folder / f"{name}.ocmm", part)
        if name == "before":
            world.push(TURN, SHIFT)
    world.verify(passed=False)
    world.calibrate()
    place = ArchivePlace(str(folder / "archive.sqlite"), "Station 1", folder / "outbox")
    with Outbox(place.outbox) as outbox:
        for name in ("before", "large"):
            outbox.put(folder / f"{name}.ocmm")
        courier = place.courier(outbox)
        assert courier.send_waiting().sent == 2
        courier.close()
    return place, folder / "calibrations"


def test_a_recall_is_computed_shown_stored_and_printed(
    qtbot: QtBot, shop: tuple[ArchivePlace, Path], tmp_path: Path
) -> None:
    place, calibrations = shop
    sheet = ArchiveSheet(lambda: place, lambda: tmp_path)
    qtbot.addWidget(sheet)
    sheet.resize(1280, 720)
    sheet.show()
    told: list[OcmmError] = []
    sheet.failed.connect(told.append)

    def done() -> None:
        qtbot.waitUntil(lambda: not sheet.is_working(), timeout=HANG_MS)

    sheet.keys["store"].trigger()
    assert "Turn to the recall first" in sheet.about()
    sheet.keys["recall"].trigger()
    assert sheet.recall.isVisible()
    assert not sheet.table.isVisible()
    sheet.recall.fields["folders"].setText(str(calibrations))
    sheet.keys["store"].trigger()
    assert told.pop().code == "recall.nothing"
    # Cancelled at once; the shown rows stay.
    sheet.keys["ask"].trigger()
    assert sheet.is_working()
    sheet.keys["stop"].trigger()
    assert not sheet.is_working()
    sheet.keys["ask"].trigger()
    done()
    assert not told
    assert sheet.recall.result.table.rowCount() >= 2
    record = sheet.recall.result.record
    assert record is not None
    assert {job.serial: job.outcome for job in record.jobs} == {
        "before": Outcome.HOLDS, "large": Outcome.CHANGES,
    }  # fmt: skip
    assert sheet.recall.result.headline.text() == headline(record)
    # Without a name: the core reports it.
    sheet.keys["store"].trigger()
    done()
    assert told.pop().code == "recall.nobody"
    sheet.keys["export"].trigger()
    sheet.target.given.emit(tmp_path / "recall.pdf")
    done()
    assert (tmp_path / "recall.pdf").read_bytes().startswith(b"%PDF")
    sheet.recall.fields["who"].setText("Anna")
    sheet.keys["store"].trigger()
    done()
    assert not told
    assert "Anna" in sheet.recall.result.totals.text()
    with open_archive(place.address) as archive:
        rows = archive.query("SELECT serial, held FROM archived_job ORDER BY serial").rows
        assert rows == (("before", 0), ("large", 1))
    # A finding that is named needs to say what, and since when.
    sheet.recall.finding.setCurrentIndex(1)
    sheet.keys["ask"].trigger()
    assert told.pop().code == "recall.finding"
    sheet.recall.fields["what"].setText("B-17")
    sheet.recall.fields["since"].setText("last week")
    sheet.keys["ask"].trigger()
    assert "last week is no day." in told.pop().what
    sheet.keys["recall"].trigger()
    assert sheet.question.isVisible()
    sheet.close_work()


def test_everything_has_an_accessible_name(sheet: ArchiveSheet) -> None:
    for widget in (
        sheet.question, sheet.kind, sheet.table, sheet.notes, sheet.standing,
        *sheet.fields.values(), sheet.recall.finding, *sheet.recall.fields.values(),
        sheet.recall.result.table, sheet.recall.result.totals,
    ):  # fmt: skip
        assert widget.accessibleName()
