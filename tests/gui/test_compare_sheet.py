"""The batch comparison in the window: read in a separate process, and cancelled at once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_gui.results import CompareSheet
from tests.host import HANG_MS, HANG_S

JOBS = 3
TIMEOUT_MS = HANG_MS


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with jobs of one plan, measured on the virtual rig."""
    found = tmp_path_factory.mktemp("batch")
    for seed in range(JOBS):
        request = StationRequest(
            plan=resource("plans", "quick.toml"), out=found, frame_rate_hz=500, seed=seed
        )
        built = build_station(request)
        try:
            built.station.start()
            assert built.station.wait_finished(HANG_S)
        finally:
            built.station.close()
    return found


@pytest.fixture
def sheet(qtbot: QtBot) -> Iterator[CompareSheet]:
    made = CompareSheet()
    qtbot.addWidget(made)
    made.resize(1280, 720)
    made.show()
    yield made
    made.close_work()


def test_the_jobs_of_a_folder_are_shown_with_the_count_they_rest_on(
    qtbot: QtBot, sheet: CompareSheet, folder: Path
) -> None:
    sheet.open(folder)
    assert sheet.is_working()
    assert "F9 stops." in sheet.working.message()
    qtbot.waitUntil(lambda: not sheet.is_working(), timeout=TIMEOUT_MS)
    assert sheet.working.message() == ""
    assert f"{JOBS} jobs of plan QUICK" in sheet.about()
    assert sheet.table.rowCount() == 2
    assert f"{JOBS} of {JOBS}" in sheet.table.cells(0)
    # Three values are too few for a scatter, and a dash replaces the numbers.
    assert sheet.table.cells(0)[3:5] == ("–", "–")
    assert "Measure 2 more parts" in sheet.words.text()
    assert "3 parts" in sheet.chart.accessibleDescription()


def test_reading_is_given_up_at_once(qtbot: QtBot, sheet: CompareSheet, folder: Path) -> None:
    sheet.read(folder)
    sheet.keys["stop"].trigger()
    assert not sheet.is_working()
    assert "nothing was changed" in sheet.about()
    assert sheet.working.message() == ""


def test_a_folder_without_jobs_is_told(qtbot: QtBot, sheet: CompareSheet, tmp_path: Path) -> None:
    errors: list[OcmmError] = []
    sheet.failed.connect(errors.append)
    sheet.read(tmp_path)
    qtbot.waitUntil(lambda: bool(errors), timeout=TIMEOUT_MS)
    assert sheet.working.message() == ""
    assert errors[0].code == "compare.too_few"
    assert "no job" in errors[0].what


@pytest.mark.usefixtures("fresh_sides")
def test_the_batch_is_filtered_by_feature_and_written_as_a_table(
    qtbot: QtBot, sheet: CompareSheet, folder: Path, tmp_path: Path
) -> None:
    sheet.open(folder)
    qtbot.waitUntil(lambda: not sheet.is_working(), timeout=TIMEOUT_MS)
    chosen = sheet.table.chosen()
    assert chosen is not None
    name = chosen.features[0]
    sheet.feature.setText("")
    QTest.keyClicks(sheet.feature, name)
    assert 1 <= sheet.table.rowCount() <= 2
    assert name in set(sheet.table.chosen().features)  # type: ignore[union-attr]
    sheet.feature.setText("")
    QTest.keyClicks(sheet.feature, "NONE")
    # An unknown name shows everything, with a list of the valid names.
    assert sheet.table.rowCount() == 2
    assert "Choose from" in sheet.about()
    sheet.keys["export"].trigger()
    target = tmp_path / "batch.csv"
    sheet.target.given.emit(target)
    assert target.read_bytes().startswith(b"\xef\xbb\xbfCharacteristic,Features,")
    assert str(target) in sheet.about()
