"""The window on a whole virtual bus: a camera is switched off and on under its eyes."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from benchmarks.camera_faults import CameraDeed, DeedAnswer, FaultKind
from benchmarks.faulty_cameras import faulty_stations
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import NoticeCentre
from ocmm_gui.window import MainWindow
from tests.host import BUSY, HANG_MS, HANG_S, private_network

# Two processes must answer each other within a millisecond: not in parallel with other tests.
pytestmark = pytest.mark.timing

PATIENCE_MS = HANG_MS
LIMIT_S = 1.0
"""Limit of immediate displays; the aim is 0.2 s, and the machine may be busy."""
Record = Callable[[str, object], None]


class WireBench:
    """A window on cameras whose supply the test has in its hand."""

    def __init__(self, qtbot: QtBot, folder: Path) -> None:
        self._control = str(folder / "cameras")
        self._ask = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._ask.bind(str(folder / "test"))
        self._ask.settimeout(HANG_S)
        request = StationRequest(
            plan=resource("plans", "quick.toml"), out=folder, source="ethercat:virtual"
        )
        with faulty_stations(self._control):
            built = build_station(request)
        self.station = built.station
        self.bridge = StationBridge(built.station)
        self.window = MainWindow(self.bridge, NoticeCentre(), out=folder)
        self.window.resize(1280, 720)
        with qtbot.waitActive(self.window):
            self.window.show()
            self.window.activateWindow()
        self.bridge.start()

    def do(self, command: FaultKind) -> float:
        """Do something to the second camera and return when it took effect, s."""
        self._ask.sendto(msgspec.json.encode(CameraDeed(do=command, camera=1)), self._control)
        answer = msgspec.json.decode(self._ask.recv(4096), type=DeedAnswer)
        assert not answer.error
        return answer.monotonic_ns * 1e-9

    def close(self) -> None:
        """Close the window and everything behind it."""
        self.window.close()
        self.window.deleteLater()
        self.bridge.deleteLater()
        self._ask.close()


@pytest.fixture
def bench(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[WireBench]:
    private_network()
    made = WireBench(qtbot, tmp_path)
    yield made
    made.close()


def test_a_camera_is_switched_off_and_on(
    bench: WireBench, qtbot: QtBot, record_property: Record
) -> None:
    window = bench.window
    strip, bus = window.desk.strip, window.maintenance.bus

    def trusted() -> None:
        assert strip.status.text() in ("READY", "MEASURING"), bench.bridge.station.looks.live()

    qtbot.waitUntil(trusted, timeout=PATIENCE_MS)
    QTest.keyClick(window, Qt.Key.Key_M)
    qtbot.waitUntil(lambda: bus.phase.text() == "IN OPERATION", timeout=PATIENCE_MS)
    names = [camera.name for camera in bench.station.instruments.rig.cameras]
    # The page polls a few times a second; the first report may be older than the first frame.
    qtbot.waitUntil(
        lambda: all(int(bus.cameras.cells(row)[5]) > 0 for row in range(len(names))),
        timeout=PATIENCE_MS,
    )
    for row, camera in enumerate(bench.station.instruments.rig.cameras):
        words = bus.cameras.cells(row)
        assert words[:4] == (names[row], str(camera.serial), str(row + 1), "OP")
    report = bench.station.looks.bus_report()
    assert report is not None
    assert report.good + report.late + report.lost + report.bad == report.elapsed > 0
    assert sum(report.lateness.counts) > 0
    assert bus.wire.summary() == "2 of 2 cameras answer."
    QTest.keyClick(window, Qt.Key.Key_M)

    off = bench.do(FaultKind.POWER_OFF)
    qtbot.waitUntil(lambda: strip.status.text() == "NOT READY", timeout=PATIENCE_MS)
    seconds = time.monotonic() - off
    record_property("camera off to NOT READY, ms", round(1000 * seconds))
    assert seconds < BUSY * LIMIT_S
    assert bench.bridge.station.looks.live().tip_world is None
    # The search for who is missing takes the bring-up of the others.
    qtbot.waitUntil(
        lambda: f"'{names[1]}'" in bench.bridge.station.looks.live().reason, timeout=PATIENCE_MS
    )
    record_property("camera off to its name, ms", round(1000 * (time.monotonic() - off)))
    QTest.keyClick(window, Qt.Key.Key_M)
    qtbot.waitUntil(lambda: bus.cameras.cells(1)[3] == "NO ANSWER", timeout=PATIENCE_MS)
    assert bus.phase.text() != "IN OPERATION"
    assert names[1] in bus.trouble()
    assert f"'{names[1]}' does not answer" in bus.wire.summary()
    QTest.keyClick(window, Qt.Key.Key_M)

    on = bench.do(FaultKind.POWER_ON)
    qtbot.waitUntil(trusted, timeout=PATIENCE_MS)
    record_property("camera on to READY, ms", round(1000 * (time.monotonic() - on)))
    report = bench.station.looks.bus_report()
    assert report is not None
    assert report.recoveries >= 1
    # After the start, and again; within a second both are one line with a count of two.
    back = [event.cycles for event in report.events if event.code == "bus.operation"]
    assert sum(back) >= 2, report.events
    assert report.good + report.late + report.lost + report.bad == report.elapsed
    with qtbot.waitSignal(bench.bridge.maintenance.bus_text_saved, timeout=PATIENCE_MS) as saved:
        QTest.keyClick(window, Qt.Key.Key_M)
        QTest.keyClick(window, Qt.Key.Key_B)
    text = saved.args[0].read_text(encoding="utf-8")
    assert f"'{names[1]}'" in text
