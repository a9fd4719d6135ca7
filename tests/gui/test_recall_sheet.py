"""The recall in the window: totals, table, and the decision in the name of the operator."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtWidgets import QLineEdit
from pytestqt.qtbot import QtBot

from benchmarks.recall_scenes import DIAMETER, TruePart, World, base_points
from ocmm_core.calibration.records import EventKind
from ocmm_core.errors import OcmmError
from ocmm_gui.maintain import RecallSheet
from tests.host import HANG_MS


@pytest.fixture
def world(tmp_path: Path) -> World:
    """Return a rig whose camera was pushed between two jobs, found out and calibrated since."""
    jobs = tmp_path / "jobs"
    jobs.mkdir()
    made = World(base_points(tmp_path), tmp_path / "calibrations", seed=3)
    made.measure(jobs / "before.ocmm", TruePart())
    made.push(np.array([2e-4, 1e-4, -2e-4]), np.array([0.1, 0.1, 0.1]))
    made.measure(jobs / "large.ocmm", TruePart(DIAMETER + 0.11))
    made.verify(passed=False)
    made.calibrate()
    return made


@pytest.fixture
def sheet(qtbot: QtBot, world: World, tmp_path: Path) -> Iterator[RecallSheet]:
    made = RecallSheet(
        lambda: tmp_path / "jobs", lambda: world.calibrations, lambda: tmp_path / "probes",
        lambda: "Ada",
    )  # fmt: skip
    qtbot.addWidget(made)
    made.resize(1280, 720)
    made.show()
    yield made
    made.close_work()


@pytest.mark.usefixtures("fresh_sides")
def test_totals_table_and_decision(
    qtbot: QtBot, sheet: RecallSheet, world: World, tmp_path: Path
) -> None:
    errors: list[OcmmError] = []
    sheet.failed.connect(errors.append)
    sheet.keys["decide"].trigger()
    assert errors[-1].code == "recall.nothing"
    sheet.open()
    assert sheet.is_working()
    assert "F9 stops." in sheet.working.message()
    qtbot.waitUntil(lambda: not sheet.is_working(), timeout=HANG_MS)
    assert sheet.working.message() == ""
    assert sheet.result.headline.text() == "0 CANNOT BE KNOWN   1 CHANGES   1 HOLDS"
    # Jobs that need a decision come first.
    assert sheet.result.table.rowCount() == 4
    assert sheet.result.table.cells(0)[:2] == ("large", "Ball diameter")
    assert sheet.result.table.cells(0)[4] == "CHANGES"
    assert "SHA-256" in sheet.result.about_job.text()
    assert "Not decided" in sheet.result.totals.text()
    # Another folder that is given up leaves the decision about this one to this one.
    sheet.read(tmp_path / "elsewhere")
    assert str(tmp_path / "elsewhere") in sheet.about()
    sheet.keys["decide"].trigger()
    assert errors[-1].code == "recall.busy"
    sheet.keys["stop"].trigger()
    sheet.keys["decide"].trigger()
    qtbot.waitUntil(lambda: "Decided by Ada" in sheet.result.totals.text(), timeout=HANG_MS)
    world.store.refresh()
    assert world.store.events[-1].kind is EventKind.RECALLED
    assert world.store.events[-1].who == "Ada"
    # The cancelled folder is not that of the shown result.
    sheet.keys["pages"].trigger()
    field = sheet.pages.findChild(QLineEdit, "path")
    assert field is not None
    assert Path(field.text()).parent == tmp_path / "jobs"
    pages = tmp_path / "recall.pdf"
    sheet.write(pages)
    qtbot.waitUntil(lambda: not sheet.is_working(), timeout=HANG_MS)
    assert pages.read_bytes().startswith(b"%PDF")
    assert sheet.working.message() == ""
    assert [one.code for one in errors] == ["recall.nothing", "recall.busy"]


def test_it_is_given_up_at_once(sheet: RecallSheet) -> None:
    sheet.open()
    sheet.keys["stop"].trigger()
    assert not sheet.is_working()
    assert "nothing was changed" in sheet.about()
    assert sheet.working.message() == ""
