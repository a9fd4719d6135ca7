"""The page of the probe in Maintain, and the page on which a probe is defined."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.calibration.guided import ProcedureKind
from ocmm_core.calibration.probe_design import definition_of, probe_text, read_definition
from ocmm_core.calibration.records import ProbeStore, probe_store_folder
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.tracking import load_probe
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import THEMES, NoticeCentre
from ocmm_gui.window import MainWindow
from ocmm_gui.wizards.pages import DefinitionPage
from tests.core.calibration.made_probe_records import make_probe_record, make_tip_record
from tests.host import HANG_MS

PATIENCE_MS = HANG_MS
NOW = datetime.now(UTC)


def fill(folder: Path) -> ProbeStore:
    """Return a store with two tips: one is mounted and qualified, one never was."""
    store = ProbeStore(probe_store_folder(folder, "standard"))
    for days, tip, diameter in ((60.0, "long", 0.0), (40.0, "A", 6.0), (0.1, "A", 6.003)):
        when = NOW - timedelta(days=days)
        made, until = when.isoformat(), (when + timedelta(days=90)).isoformat()
        record = make_probe_record(tip=tip, made_utc=made, valid_until_utc=until)
        store.calibrate(record, "R. Lang", "first" if days > 50.0 else "a new stylus", when)
        if diameter:
            found = make_tip_record(
                record, diameter_mm=diameter, made_utc=made, valid_until_utc=until
            )
            store.qualify(found, when + timedelta(minutes=5))
    return store


class Bench:
    """A window on a station with a folder of records of probes."""

    def __init__(self, qtbot: QtBot, folder: Path) -> None:
        request = StationRequest(
            plan=resource("plans", "quick.toml"),
            out=folder / "out",
            frame_rate_hz=800,
            speed=0.2,
            stay=True,
            probes=folder,
        )
        self.bridge = StationBridge(build_station(request).station)
        self.notices = NoticeCentre()
        self.window = MainWindow(self.bridge, self.notices, out=folder)
        self.window.resize(1024, 640)
        with qtbot.waitActive(self.window):
            self.window.show()
            self.window.activateWindow()
        self.bridge.start()

    def open_page(self) -> None:
        """Go to the page the way a technician does."""
        QTest.keyClick(self.window, Qt.Key.Key_M)
        while not self.window.maintenance.probe.isVisible():
            QTest.keyClick(self.window.maintenance.view.list, Qt.Key.Key_Down)

    def press(self, key: Qt.Key) -> None:
        widget = QApplication.focusWidget()
        QTest.keyClick(self.window if widget is None else widget, key)

    def close(self) -> None:
        """Close the window and everything behind it."""
        self.window.close()
        self.window.deleteLater()
        self.bridge.deleteLater()
        self.notices.deleteLater()


@pytest.fixture
def open_bench(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[Callable[[], Bench]]:
    opened: list[Bench] = []

    def make() -> Bench:
        opened.append(Bench(qtbot, tmp_path))
        return opened[-1]

    yield make
    for bench in opened:
        bench.close()


def test_standing_tips_trends_and_history(open_bench: Callable[[], Bench], tmp_path: Path) -> None:
    store = fill(tmp_path)
    bench = open_bench()
    bench.open_page()
    page = bench.window.maintenance.probe
    assert page.word.text() == "VALID"
    assert page.sentence.text() == "Calibrated, qualified and in date. Points can be taken."
    assert page.facts["Tip"].text() == "A"
    assert page.facts["Ball"].text() == "6.0030 mm"
    assert page.facts["Calibrated"].text().endswith("technician")
    assert page.fault.text() == ""
    assert [page.tips.cells(row)[:2] for row in range(2)] == [
        ("▶ A", "VALID"), ("   long", "SUSPECT"),
    ]  # fmt: skip
    assert page.tips.cells(0)[2].startswith("6.0030 ± ")
    assert page.tips.cells(1)[5] == "never"
    # The ball was 3 µm smaller when it was qualified for the first time.
    assert page.diameter.word() == "+3.0"
    assert page.history.rowCount() == len(store.events) == 5
    assert page.history.cells(0)[1:3] == ("Tip qualified", "A")
    assert page.history.cells(4)[4] == "first"
    for theme in THEMES:
        bench.window.use_theme(theme)
        assert not bench.window.grab().isNull()
    # Width of the smallest window minus the list of pages.
    assert page.minimumSizeHint().width() <= 824


def test_a_tip_is_mounted_with_one_key_pressed_twice_and_must_then_be_checked(
    qtbot: QtBot, open_bench: Callable[[], Bench], tmp_path: Path
) -> None:
    fill(tmp_path)
    bench = open_bench()
    bench.open_page()
    page = bench.window.maintenance.probe
    bench.press(Qt.Key.Key_N)
    qtbot.waitUntil(lambda: "Press N" in bench.window.banner.text(), timeout=PATIENCE_MS)
    assert page.word.text() == "VALID"
    bench.press(Qt.Key.Key_N)
    qtbot.waitUntil(lambda: page.word.text() == "SUSPECT", timeout=PATIENCE_MS)
    assert "quick tip check" in page.sentence.text()
    assert page.history.cells(0)[1:3] == ("Tip mounted", "A")
    assert ProbeStore(probe_store_folder(tmp_path, "standard")).events[-1].kind == "tip mounted"


@pytest.mark.parametrize(
    ("key", "kind"),
    [
        (Qt.Key.Key_P, ProcedureKind.PIVOT), (Qt.Key.Key_Q, ProcedureKind.QUALIFICATION),
        (Qt.Key.Key_H, ProcedureKind.TIP_CHECK),
    ],
)  # fmt: skip
def test_wizards_are_opened_with_one_key(
    qtbot: QtBot, open_bench: Callable[[], Bench], tmp_path: Path, key: Qt.Key, kind: ProcedureKind
) -> None:
    fill(tmp_path)
    bench = open_bench()
    bench.open_page()
    bench.press(key)
    wizard = bench.window.maintenance.wizard
    qtbot.waitUntil(wizard.isVisible, timeout=PATIENCE_MS)
    assert wizard.start.trouble.text() == ""
    assert "tip" in wizard.start.fields
    bench.press(Qt.Key.Key_Return if kind is not ProcedureKind.PIVOT else Qt.Key.Key_Escape)
    if kind is ProcedureKind.PIVOT:
        qtbot.waitUntil(bench.window.maintenance.probe.isVisible, timeout=PATIENCE_MS)


def test_a_damaged_record_is_named(open_bench: Callable[[], Bench], tmp_path: Path) -> None:
    store = fill(tmp_path)
    digest = store.active_hash("A")
    path = store.folder / f"{digest}.json"
    path.write_bytes(path.read_bytes().replace(b"technician", b"Technician", 1))
    bench = open_bench()
    bench.open_page()
    assert bench.window.maintenance.probe.word.text() == "UNUSABLE"
    assert str(digest)[:12] in bench.window.maintenance.probe.fault.text()
    assert bench.window.maintenance.probe.tips.isHidden()


@pytest.fixture
def definition(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[DefinitionPage]:
    page = DefinitionPage()
    page.resize(1024, 600)
    with qtbot.waitActive(page):
        page.show()
        page.activateWindow()
    probe = load_probe(resource("probes", "standard.toml"))
    page.open(definition_of(probe), tmp_path / "new.toml", make_probe_record())
    yield page
    page.close_examination()
    page.close()
    page.deleteLater()


@pytest.mark.slow
def test_a_probe_is_examined_while_it_is_defined_and_saved_as_a_new_document(
    qtbot: QtBot, definition: DefinitionPage, tmp_path: Path
) -> None:
    page, path = definition, tmp_path / "new.toml"
    qtbot.waitUntil(lambda: page.word() == "GOOD", timeout=PATIENCE_MS)
    assert "nearest wrong order" in page.sentence.text()
    page.form.fields["name"].setText("mine")
    page.form.fields["tip_diameter"].setText("8.002")
    _write(page, 2, 3, "173.5")
    QTest.keyClick(page, Qt.Key.Key_F8)
    qtbot.waitUntil(lambda: page.word() == "SAVED", timeout=PATIENCE_MS)
    made = load_probe(path)
    assert made.name == "mine"
    assert 2.0 * made.tip_radius == pytest.approx(8.002)
    assert made.leds_probe[2, 2] == 173.5
    assert probe_text(read_definition(path)) == path.read_text()
    # A document that may have been used is never changed.
    before = path.read_bytes()
    QTest.keyClick(page, Qt.Key.Key_F8)
    assert page.word() == "CANNOT BE USED"
    assert "this file already exists" in page.sentence.text()
    assert path.read_bytes() == before


def test_what_cannot_be_a_probe_is_said_in_words(qtbot: QtBot, definition: DefinitionPage) -> None:
    page = definition
    _write(page, 0, 1, "much")
    qtbot.waitUntil(lambda: page.word() == "CANNOT BE USED", timeout=PATIENCE_MS)
    assert page.sentence.text().startswith("The typed L1 X is 'much', which is not a number.")
    # The rectangle of the thesis without its promises: half a turn looks the same.
    page.import_panel.given.emit(resource("probes", "thesis.toml"))
    assert page.leds.rowCount() == 4
    assert page.form.fields["rules"].text().count(">") == 2
    page.form.fields["rules"].selectAll()
    QTest.keyClick(page.form.fields["rules"], Qt.Key.Key_Delete)
    qtbot.waitUntil(lambda: "346.0 mm off" in page.sentence.text(), timeout=PATIENCE_MS)
    assert page.word() == "CANNOT BE USED"


def test_leds_are_added_removed_and_taken_as_measured(definition: DefinitionPage) -> None:
    page = definition
    QTest.keyClick(page, Qt.Key.Key_F10)
    assert page.leds.rowCount() == 7
    assert page.leds.cells(6)[1:] == page.leds.cells(5)[1:]
    page.leds.setCurrentCell(0, 0)
    QTest.keyClick(page, Qt.Key.Key_F6)
    assert page.leds.rowCount() == 6
    assert page.leds.cells(0)[0] == "L1"
    assert page.leds.cells(0)[1] == "55"
    QTest.keyClick(page, Qt.Key.Key_F7)
    assert page.leds.cells(0)[1] == "30"
    assert page.form.fields["led_sigma"].text() == "0.0020"


def _write(page: DefinitionPage, row: int, column: int, text: str) -> None:
    item = page.leds.item(row, column)
    assert item is not None
    item.setText(text)
