"""The page that sets up cameras, without any: what it says, and a calibration put in force.

With software cameras it is used in tests/genicam.
"""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from ocmm_boards import run_session
from ocmm_core.calibration.records import CalibrationStore, store_folder
from ocmm_core.settings import SettingsFile, SettingsStore, Value
from ocmm_gui.home._camera_sheet import CameraSheet
from tests.boards.board_scene import scene
from tests.host import HANG_MS


def opened(qtbot: QtBot, folder: Path, source: str) -> CameraSheet:
    """Return the page with the settings of a station of this source."""
    values: dict[str, Value] = {
        "instrument.source": source,
        "instrument.calibrations": folder / "calibrations",
    }
    store = SettingsStore(SettingsFile(folder / "a.toml"), SettingsFile(folder / "b.toml"), values)
    sheet = CameraSheet(lambda: store.load().settings)
    qtbot.addWidget(sheet, before_close_func=lambda widget: widget.close_work())
    sheet.show()
    sheet.open()
    return sheet


@pytest.mark.parametrize(
    ("source", "sentence"),
    [
        ("simulated", "Cameras are set up by their serial numbers"),
        ("genicam:virtual", "Cameras are set up by their serial numbers"),
        ("genicam:101,102", "but the rig 'recommended' has 20600001, 20600002"),
    ],
)
def test_other_cameras_are_refused_with_a_sentence(
    qtbot: QtBot, tmp_path: Path, source: str, sentence: str
) -> None:
    sheet = opened(qtbot, tmp_path, source)
    qtbot.waitUntil(lambda: sentence in sheet.about(), timeout=HANG_MS)
    for key in ("settle", "darker", "brighter", "keep", "view", "accept"):
        assert not sheet.keys[key].isEnabled()


def test_a_calibration_is_put_in_force_by_its_key(qtbot: QtBot, tmp_path: Path) -> None:
    sheet = opened(qtbot, tmp_path, "simulated")
    qtbot.waitUntil(lambda: "serial numbers" in sheet.about(), timeout=HANG_MS)
    one = scene(tmp_path, 7)
    store = CalibrationStore(store_folder(tmp_path / "calibrations", one.nominal.name))
    session = run_session(
        one.nominal, store, one.board, one.views, datetime.now(UTC), who="Ann"
    )  # fmt: skip
    sheet.show_session(session)
    assert "residuals 0.0" in sheet.result.text()
    # It leaves nothing to be guessed: the warning on the scale is the core's.
    assert "The scale is not traceable" in sheet.result.text()
    assert store.active() is None
    sheet.fields["board"].setFocus()
    QTest.keyClick(sheet, Qt.Key.Key_F8)
    qtbot.waitUntil(lambda: "SUSPECT until" in sheet.result.text(), timeout=HANG_MS)
    found = CalibrationStore(store.folder).active()
    assert found is not None
    assert (found.made_by, found.method) == ("Ann", "boards")
    assert not sheet.keys["accept"].isEnabled()
    assert found == session.outcome.record
