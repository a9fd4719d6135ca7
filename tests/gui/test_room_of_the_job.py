"""Ambient readings are typed on the page of the job, and stored in its file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from ocmm_core.inspection.plan import noted_rooms
from ocmm_core.storage import JobFile
from tests.host import HANG_MS

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow


def test_the_room_is_typed_by_keyboard_and_kept_in_the_job(
    qtbot: QtBot, open_window: OpenWindow
) -> None:
    bench = open_window(start=False)
    sheet, job = bench.window.sheets.job, bench.window.sheets.job.room
    sheet.open(bench.built.station.job.view())
    for field, typed in (("room", "20,1"), ("humidity", "45")):
        job[field].setText(typed)
        QTest.keyClick(job[field], Qt.Key.Key_Return)
    QTest.keyClick(job["pressure"], Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: bench.built.station.job.view().room != (), timeout=HANG_MS)
    qtbot.waitUntil(lambda: job["room"].text() == "", timeout=HANG_MS)
    assert dict(bench.built.station.job.view().room) == {
        "room": "Room 20.1 °C at the begin.",
        "humidity": "Humidity 45 % at the begin.",
    }
    # An invalid reading is reported, and stays in its field.
    job["room"].setText("68 °F")
    with qtbot.waitSignal(bench.bridge.failed, timeout=HANG_MS) as told:
        QTest.keyClick(job["pressure"], Qt.Key.Key_Return)
    assert "'room'" in told.args[0].what
    assert job["room"].text() == "68 °F"
    path = bench.built.job_path
    bench.bridge.close()
    with JobFile.open(path, read_only=True) as kept:
        (noted,) = noted_rooms(kept.events())
    assert (noted.room, noted.humidity, noted.points) == ("20,1", "45", 0)
