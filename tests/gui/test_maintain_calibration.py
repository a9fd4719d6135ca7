"""The calibration in the window, on every screen and on its own page."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.calibration.records import (
    ArtefactUse,
    CalibrationStore,
    CameraRecord,
    VerificationRecord,
    store_folder,
)
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import THEMES, NoticeCentre
from ocmm_gui.window import MainWindow
from tests.core.calibration.made_records import make_record, make_verification
from tests.host import HANG_MS

PATIENCE_MS = HANG_MS
NOW = datetime.now(UTC)


def record(days_ago: float, **changes: object) -> CameraRecord:
    """Return a calibration of some days ago that is valid for a year."""
    made = NOW - timedelta(days=days_ago)
    until = made + timedelta(days=365)
    return make_record(made_utc=made.isoformat(), valid_until_utc=until.isoformat(), **changes)


def verification(of: CameraRecord, days_ago: float, error_mm: float) -> VerificationRecord:
    """Return a verification with one length wrong by this error; the limit is 0.02 mm."""
    plain = make_verification(of, passed=abs(error_mm) < 0.02)
    check = msgspec.structs.replace(plain.checks[0], measured_mm=400.0 + error_mm)
    when = (NOW - timedelta(days=days_ago)).isoformat()
    return msgspec.structs.replace(plain, checks=(check,), made_utc=when)


def fill(folder: Path) -> CalibrationStore:
    """Return a store with three calibrations; the left lens grew by 3 µm on the way."""
    store = CalibrationStore(store_folder(folder, "recommended"))
    plain = make_record()
    bar = ArtefactUse(
        name="bar", serial="LB-7", certificate="K 2291", certificate_sha256="0" * 64,
        due_utc=NOW.isoformat(),
    )  # fmt: skip
    for days_ago, grown_mm, error_mm in ((200.0, 0.0, 0.01), (100.0, 0.001, 0.03), (1.0, 0.003, 0)):
        left, right = plain.cameras
        left = msgspec.structs.replace(left, focal=left.focal + grown_mm)
        made = record(days_ago, cameras=(left, right), artefacts=(bar,), outliers=("17",))
        when = NOW - timedelta(days=days_ago)
        store.accept(made, "R. Lang", "The frame was moved.", when)
        store.verify(verification(made, days_ago, error_mm), when)
    return store


class Bench:
    """A window on a station with a folder of calibrations."""

    def __init__(self, qtbot: QtBot, folder: Path, *, uncalibrated: bool = False) -> None:
        request = StationRequest(
            plan=resource("plans", "quick.toml"),
            out=folder / "out",
            frame_rate_hz=800,
            speed=1.0,
            stay=True,
            calibrations=folder,
            uncalibrated=uncalibrated,
        )
        self.bridge = StationBridge(build_station(request).station)
        self.window = MainWindow(self.bridge, NoticeCentre(), out=folder)
        self.window.resize(1280, 720)
        with qtbot.waitActive(self.window):
            self.window.show()
            self.window.activateWindow()
        self.bridge.start()

    def open_page(self) -> None:
        """Go to the page the way a technician does."""
        QTest.keyClick(self.window, Qt.Key.Key_M)
        QTest.keyClick(self.window.maintenance.view.list, Qt.Key.Key_Down)
        assert self.window.maintenance.calibration.isVisible()

    def close(self) -> None:
        """Close the window and everything behind it."""
        self.window.close()
        self.window.deleteLater()
        self.bridge.deleteLater()


@pytest.fixture
def open_bench(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[Callable[..., Bench]]:
    opened: list[Bench] = []

    def make(*, uncalibrated: bool = False) -> Bench:
        opened.append(Bench(qtbot, tmp_path, uncalibrated=uncalibrated))
        return opened[-1]

    yield make
    for bench in opened:
        bench.close()


def test_a_valid_calibration_with_its_facts_and_history(
    open_bench: Callable[..., Bench], tmp_path: Path
) -> None:
    store = fill(tmp_path)
    bench = open_bench()
    bench.open_page()
    page = bench.window.maintenance.calibration
    assert page.word.text() == "VALID"
    assert page.sentence.text() == "Calibrated, verified and in date. Points can be taken."
    facts = {name: label.text() for name, label in page.facts.items()}
    assert facts["Cameras"] == "left 20600001, right 20600002"
    assert facts["Positions"] == "400, 1 left out"
    assert facts["Residuals"] == "0.0105 px, chi² 1.00"
    assert facts["Artefacts"] == "bar LB-7"
    assert facts["Verified"].endswith("+0.0 of ±20.0 µm")
    assert store.active_hash is not None
    assert facts["Hash"] == store.active_hash[:12]
    happened = [page.history.cells(row)[1] for row in range(page.history.rowCount())]
    assert happened == [
        "Verification passed", "Activated", "Verification FAILED", "Activated",
        "Verification passed", "Activated",
    ]  # fmt: skip
    assert page.history.cells(1)[2:4] == ("R. Lang", "The frame was moved.")
    assert page.focal.word() == "left +3.0"
    assert page.baseline.word() == "+0.0"
    assert page.error.word() == "+0"
    assert bench.window.running.trust.text() == ""


def test_a_doubt_appears_while_it_is_looked_at(
    open_bench: Callable[..., Bench], tmp_path: Path, qtbot: QtBot
) -> None:
    store = fill(tmp_path)
    bench = open_bench()
    bench.open_page()
    window = bench.window
    now = datetime.now(UTC)
    store.suspect("monitor", "Camera 'left' has turned.", now - timedelta(hours=1), now)
    qtbot.waitUntil(
        lambda: window.maintenance.calibration.word.text() == "SUSPECT", timeout=PATIENCE_MS
    )
    assert window.maintenance.calibration.sentence.text().startswith(
        "No points are taken. Camera 'left' has turned. Verify the calibration"
    )
    since = f"{(now - timedelta(hours=1)).astimezone():%Y-%m-%d %H:%M}"
    assert window.maintenance.calibration.notes.text() == (
        f"Points since {since} are suspect, also in older jobs. Recall jobs (F12) shows which "
        "of their verdicts hold."
    )
    assert window.maintenance.calibration.history.cells(0)[1:5] == (
        "Marked suspect", "monitor", "Camera 'left' has turned.", since,
    )  # fmt: skip
    qtbot.waitUntil(
        lambda: window.maintenance.view.status.text() == "NOT READY", timeout=PATIENCE_MS
    )
    assert window.running.trust.text().startswith("NO POINTS: Camera 'left' has turned.")
    # In Inspect the screen itself shows it.
    QTest.keyClick(window, Qt.Key.Key_M)
    qtbot.waitUntil(lambda: not window.running.trust.isVisible(), timeout=PATIENCE_MS)
    assert window.desk.strip.status.text() == "NOT READY"


def test_uncalibrated_is_said_on_every_screen(
    open_bench: Callable[..., Bench], qtbot: QtBot
) -> None:
    window = open_bench(uncalibrated=True).window
    desk = (
        "UNCALIBRATED: results are not proven. The cameras of rig 'recommended' were "
        "never calibrated."
    )
    qtbot.waitUntil(lambda: window.running.trust.text() == desk, timeout=PATIENCE_MS)
    QTest.keyClick(window, Qt.Key.Key_F11)
    qtbot.waitUntil(
        lambda: window.running.trust.text() == "UNCALIBRATED: no proof", timeout=PATIENCE_MS
    )
    QTest.keyClick(window, Qt.Key.Key_M)
    qtbot.waitUntil(lambda: window.running.trust.text() == desk, timeout=PATIENCE_MS)
    assert window.running.trust.isVisible()
    QTest.keyClick(window.maintenance.view.list, Qt.Key.Key_Down)
    assert window.maintenance.calibration.word.text() == "UNCALIBRATED"
    assert "every verdict is NOT PROVEN" in window.maintenance.calibration.sentence.text()


def test_the_facts_are_those_of_the_calibration_that_the_job_has(
    open_bench: Callable[..., Bench], tmp_path: Path, qtbot: QtBot
) -> None:
    store = fill(tmp_path)
    own = str(store.active_hash)
    bench = open_bench()
    bench.open_page()
    page = bench.window.maintenance.calibration
    now = datetime.now(UTC)
    other = record(0.0, points=399)
    store.accept(other, "R. Lang", "again", now)
    store.verify(verification(other, 0.0, 0.03), now)
    qtbot.waitUntil(lambda: page.word.text() == "UNUSABLE", timeout=PATIENCE_MS)
    qtbot.waitUntil(lambda: page.history.rowCount() == 8, timeout=PATIENCE_MS)
    facts = {name: label.text() for name, label in page.facts.items()}
    # Not the failed verification of the one that took its place.
    assert facts["Hash"] == own[:12]
    assert facts["Positions"] == "400, 1 left out"
    assert facts["Verified"].endswith("+0.0 of ±20.0 µm")


def test_a_damaged_record_is_said_and_the_rest_is_shown(
    open_bench: Callable[..., Bench], tmp_path: Path
) -> None:
    store = fill(tmp_path)
    oldest = store_folder(tmp_path, "recommended") / f"{store.events[0].calibration}.json"
    oldest.write_bytes(oldest.read_bytes().replace(b"LB-7", b"LB-8"))
    bench = open_bench()
    bench.open_page()
    page = bench.window.maintenance.calibration
    # The one in force is sound, but its evidence includes the earlier one.
    assert page.word.text() == "UNUSABLE"
    assert (
        f"Record {oldest.stem[:12]} in {oldest.parent} was changed after it was written"
        in page.sentence.text()
    )
    assert "If there is none, calibrate again (cameras: from known points)" in page.sentence.text()
    assert page.history.rowCount() == 6
    assert "was changed after it was written" in page.fault.text()


def test_writing_to_the_cameras_wants_its_key_twice(
    open_bench: Callable[..., Bench], tmp_path: Path, qtbot: QtBot
) -> None:
    fill(tmp_path)
    bench = open_bench()
    bench.open_page()
    banner = bench.window.banner
    QTest.keyClick(bench.window, Qt.Key.Key_W)
    qtbot.waitUntil(lambda: "Press W again" in banner.text(), timeout=PATIENCE_MS)
    QTest.keyClick(bench.window, Qt.Key.Key_W)
    # The simulated source has no cameras that could store anything.
    qtbot.waitUntil(lambda: "do not come from real cameras" in banner.text(), timeout=PATIENCE_MS)


def test_every_text_fits_in_every_size_and_theme(
    open_bench: Callable[..., Bench], tmp_path: Path, qtbot: QtBot
) -> None:
    fill(tmp_path)
    bench = open_bench()
    bench.open_page()
    window, page = bench.window, bench.window.maintenance.calibration
    for theme in THEMES:
        window.use_theme(theme)
        for size in ((1280, 720), (1920, 1080)):
            window.resize(*size)
            qtbot.wait(50)
            assert (window.width(), window.height()) == size, "the page asks for more room"
            assert not page.history.horizontalScrollBar().isVisible()
            for label in page.facts.values():
                assert label.width() >= label.sizeHint().width()
            for chart in (page.focal, *page.principal, page.baseline, page.error):
                assert chart.height() > 60
