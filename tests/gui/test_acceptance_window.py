"""Acceptance tests in the main window, by keyboard alone, on the virtual rig."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QAccessible
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QLineEdit, QListWidget, QWidget
from pytestqt.qtbot import QtBot

from ocmm_core.acceptance import (
    AcceptanceVerdict,
    GuidedAcceptanceView,
    ProcedureOffer,
    differences,
    load_signed_record,
    procedure_files,
    recompute,
    typed_entry,
)
from ocmm_core.composition import AcceptanceBench, StationRequest, build_station
from ocmm_core.composition.hands import VirtualHand
from ocmm_core.documents import resource
from ocmm_gui.acceptance._measure_pages import AcceptanceVerdictPage, MeasurePage
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import DEBOUNCE_S, THEMES, Notice, NoticeCentre, ThemedWidget, use_language
from ocmm_gui.window import MainWindow
from ocmm_gui.wizards import Runner
from tests.gui.shown_english import foreign_in
from tests.gui.window_pages import faults
from tests.host import HANG_MS, long_form
from tests.slow_rig import CALM_HZ, slow_rig_in
from tests.waiting import let_pass


@dataclass
class Desk:
    """A window with acceptance tests in separate folders."""

    qtbot: QtBot
    window: MainWindow
    bridge: StationBridge
    notices: list[Notice]
    bench: AcceptanceBench

    @property
    def runner(self) -> Runner:
        """Return the test that runs."""
        runner = self.window.tests.desk.runner
        assert runner is not None, self.window.tests.desk.start.trouble.text()
        return runner

    @property
    def view(self) -> GuidedAcceptanceView:
        """Return the shown view."""
        return self.runner.driver.now.view_as(GuidedAcceptanceView)

    def key(self, key: Qt.Key, modifier: Qt.KeyboardModifier | None = None) -> None:
        """Press a key at the widget with the focus."""
        widget = QApplication.focusWidget()
        assert widget is not None
        QTest.keyClick(widget, key, modifier or Qt.KeyboardModifier.NoModifier)

    def until(self, condition: Callable[[], bool]) -> None:
        """Wait until something is so."""
        self.qtbot.waitUntil(condition, timeout=HANG_MS)

    def choose(self, name: str) -> None:
        """Open the desk and go down to a procedure."""
        if not self.window.maintenance.view.isVisible():
            self.key(Qt.Key.Key_M)
            self.until(self.window.maintenance.view.isVisible)
        self.key(Qt.Key.Key_F7)
        desk = self.window.tests.desk
        self.until(desk.start.isVisible)
        # Procedures, then artefacts, are read aside.
        self.until(desk.start.begin_button.isEnabled)
        names = [one.procedure.id for one in desk.procedures]
        for _ in range(names.index(name)):
            self.key(Qt.Key.Key_Down)
        assert desk.start.row() == names.index(name)
        self.until(desk.start.begin_button.isEnabled)

    def begin(self) -> None:
        """Start the selected test, and go on to the measuring with automatic taking."""
        self.until(self.window.tests.desk.start.begin_button.isEnabled)
        self.key(Qt.Key.Key_Return)
        self.measure()

    def measure(self) -> None:
        """Go on to the measuring and take each finished point."""
        self.until(lambda: self.window.tests.desk.runner is not None)
        if self.view.base.step.name == "prepare":
            let_pass(DEBOUNCE_S)
            self.key(Qt.Key.Key_Return)
        self.until(lambda: self.view.base.step.name == "measure")
        self.until(self.runner.pages["measure"].isVisible)
        self.key(Qt.Key.Key_Y)

    def verdict(self) -> AcceptanceVerdictPage:
        """Wait for the last point and go on to the verdict."""
        self.until(lambda: self.view.base.step.gate.open)
        self.until(lambda: self.runner.actions_by_key["next"].isEnabled())
        let_pass(DEBOUNCE_S)
        self.key(Qt.Key.Key_Return)
        page = self.runner.pages["result"]
        assert isinstance(page, AcceptanceVerdictPage)
        self.until(lambda: self.view.outcome is not None and page.isVisible())
        self.until(lambda: page.word() not in ("", "NOT CALCULATED"))
        return page

    def store(self) -> Path:
        """Store the verdict and return the record."""
        self.key(Qt.Key.Key_A)
        self.until(self.runner.decision.isVisible)
        self.key(Qt.Key.Key_Return)
        self.until(lambda: self.view.base.stored)
        outcome = self.view.outcome
        assert outcome is not None
        assert outcome.file is not None
        return outcome.file


@pytest.fixture
def desk(
    qtbot: QtBot, qapp: QApplication, tmp_path: Path, request: pytest.FixtureRequest
) -> Iterator[Desk]:
    """Open a window in English, or in the language of the parameter."""
    qapp.setStyle("Fusion")
    use_language(qapp, getattr(request, "param", "en"))
    wanted = StationRequest(
        plan=resource("plans", "quick.toml"), out=tmp_path / "job", speed=0.1, stay=True,
        frame_rate_hz=800, rig=slow_rig_in(tmp_path, CALM_HZ),
    )  # fmt: skip
    built = build_station(wanted)
    bench = AcceptanceBench(
        replace(wanted, speed=0.0), folder=tmp_path / "tests", register=tmp_path / "artefacts"
    )
    bridge, centre = StationBridge(built.station), NoticeCentre()
    told: list[Notice] = []
    centre.posted.connect(told.append)
    window = MainWindow(bridge, centre, out=tmp_path / "papers", bench=bench)
    window.resize(1280, 720)
    with qtbot.waitActive(window):
        window.show()
        window.activateWindow()
    bridge.start()
    yield Desk(qtbot, window, bridge, told, bench)
    window.close()
    window.deleteLater()
    bridge.deleteLater()
    centre.deleteLater()
    use_language(qapp, "en")


def _hand(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> list[VirtualHand]:
    """Return the list that receives the hands of tests when they begin."""
    made: list[VirtualHand] = []
    ask = AcceptanceBench.hand

    def asked(bench: AcceptanceBench, *given: object) -> VirtualHand | None:
        hand = ask(bench, *given)  # type: ignore[arg-type]  # as it was called
        assert isinstance(hand, VirtualHand)
        made.append(hand)
        return hand

    monkeypatch.setattr(AcceptanceBench, "hand", asked)
    return made


def _told(page: MeasurePage) -> bool:
    return "limit" in page.last.text()


@pytest.mark.slow
def test_lengths_and_sphere_by_keyboard_in_the_promised_time(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    hands = _hand(desk, monkeypatch)
    for name, points, values, promised_s in (
        ("LENGTH-7x5", 42, 35, 25 * 60.0),
        ("SPHERE-25", 50, 4, 6 * 60.0),
    ):
        desk.choose(name)
        desk.begin()
        measure = desk.runner.pages["measure"]
        assert isinstance(measure, MeasurePage)
        desk.until(lambda: bool(desk.view.latest))
        desk.until(partial(_told, measure))
        assert "Position" in measure.place.text()
        page = desk.verdict()
        assert page.word() == "PASSED"
        assert measure.score.number() == f"{points} / {points}"
        record = load_signed_record(desk.store()).record
        assert (record.verdict, len(record.values)) == (AcceptanceVerdict.PASS, values)
        assert record.instrument.simulated
        assert differences(record, recompute(record)) == []
        assert hands[-1].shown_s < promised_s
        desk.until(page.paper.isEnabled)
        desk.key(Qt.Key.Key_Escape)
        desk.until(desk.window.maintenance.view.isVisible)
    assert not [one for one in desk.notices if one.remedy]


@pytest.mark.slow
def test_a_test_that_was_left_goes_on_and_gets_its_certificate(desk: Desk, tmp_path: Path) -> None:
    desk.choose("EFFECTIVE-DIAMETER")
    desk.begin()
    desk.until(lambda: desk.view.base.step.done >= 5)
    desk.key(Qt.Key.Key_Escape)
    desk.until(desk.window.maintenance.view.isVisible)
    desk.key(Qt.Key.Key_F7)
    start = desk.window.tests.desk.start
    desk.until(start.isVisible)
    (left,) = desk.bench.unfinished(datetime.now(UTC))
    assert 5 <= left.done < left.wanted == 27
    desk.until(start.resume_button.isEnabled)
    desk.key(Qt.Key.Key_G)
    desk.until(lambda: desk.window.tests.desk.runner is not None)
    assert desk.view.base.step.done == left.done
    desk.measure()
    page = desk.verdict()
    assert page.word() == "PASSED"
    assert not page.paper.isEnabled()
    desk.store()
    desk.until(page.paper.isEnabled)
    written: list[object] = []
    desk.window.tests.papers.written.connect(written.append)
    desk.key(Qt.Key.Key_2)
    assert page.values.cells(0)[0] == "D_eff"
    desk.key(Qt.Key.Key_P)
    desk.until(desk.window.tests.papers.panel.isVisible)
    desk.key(Qt.Key.Key_Return)
    desk.until(lambda: bool(written))
    names = sorted(one.name for one in (tmp_path / "papers").iterdir())
    number = load_signed_record(next((tmp_path / "tests" / "records").glob("*.json"))).record.number
    assert f"A-{number}.pdf" in names
    assert f"A-{number}.dcc.xml" in names
    dcc = (tmp_path / "papers" / f"A-{number}.dcc.xml").read_text(encoding="utf-8")
    assert "SIMULATED" in dcc
    # Nothing is left to resume, and the page of Maintain has the record.
    desk.runner.setFocus()
    desk.key(Qt.Key.Key_Escape)
    desk.until(desk.window.maintenance.view.isVisible)
    assert desk.bench.unfinished(datetime.now(UTC)) == ()
    desk.window.maintenance.view.list.setCurrentRow(3)
    shown = desk.window.tests.page
    desk.until(lambda: shown.table.rowCount() == 1)
    assert shown.table.cells(0)[0] == "SIMULATED PASS"
    desk.key(Qt.Key.Key_P, Qt.KeyboardModifier.ControlModifier)
    desk.until(desk.window.tests.papers.panel.isVisible)


@pytest.mark.slow
def test_the_interim_check_is_charted_and_points_are_taken_by_hand(desk: Desk) -> None:
    desk.key(Qt.Key.Key_M)
    desk.key(Qt.Key.Key_F8)
    desk.until(desk.window.tests.desk.start.isVisible)
    desk.begin()
    # Y again: nothing is taken automatically, and the hand waits for the key.
    let_pass(DEBOUNCE_S)
    desk.key(Qt.Key.Key_Y)
    desk.until(lambda: not desk.runner.driver.now.automatic)
    done = desk.view.base.step.done
    procedure = desk.runner.driver.procedure
    desk.until(lambda: procedure.base.live.ready)
    QTest.qWait(300)
    assert procedure.base.step.done == done
    desk.key(Qt.Key.Key_Space)
    desk.until(lambda: procedure.base.step.done == done + 1)
    let_pass(DEBOUNCE_S)
    desk.key(Qt.Key.Key_Y)
    page = desk.verdict()
    desk.store()
    desk.until(lambda: page.interim.word().startswith("1 check,"))
    assert "learns" in page.sentence.text()


_READ = [
    (language, name)
    for language in ("en", "de")
    for name in (procedure_files() if long_form() else ())
] or [("de", "INTERIM")]


@pytest.mark.slow
@pytest.mark.parametrize(("desk", "name"), _READ, indirect=["desk"])
def test_a_procedure_is_shown_in_one_language_to_its_end(
    desk: Desk, name: str, request: pytest.FixtureRequest
) -> None:
    """Each sentence is read; in the long form of all procedures in both languages."""
    language = request.node.callspec.params["desk"]
    wrong, told = set[str](), set[str]()

    def read() -> bool:
        note = re.sub(
            r"[-\d,.]+", "", f"{desk.view.base.step.instruction}{desk.runner.gate.text()}"
        )
        if note not in told:
            told.add(note)
            wrong.update(foreign_in(desk.window, language))
        return desk.view.base.step.gate.open

    desk.choose(name)
    wrong.update(foreign_in(desk.window, language))
    desk.begin()
    desk.until(read)
    desk.until(lambda: desk.runner.actions_by_key["next"].isEnabled())
    let_pass(DEBOUNCE_S)
    desk.key(Qt.Key.Key_Return)
    page = desk.runner.pages["result"]
    desk.until(lambda: desk.view.outcome is not None and page.isVisible())
    desk.until(lambda: desk.runner.actions_by_key["accept"].isEnabled())
    for key in (Qt.Key.Key_1, Qt.Key.Key_2):
        desk.key(key)
        QApplication.processEvents()
        wrong.update(foreign_in(desk.window, language))
    desk.store()
    wrong.update(foreign_in(desk.window, language))
    assert not wrong, "\n".join(sorted(wrong))

    def laid_out() -> None:
        # A busy window lays out its labels after the key.
        assert not (left := list(faults(desk.window))), left

    desk.qtbot.waitUntil(laid_out, timeout=HANG_MS)


def test_a_refused_artefact_says_why_and_cannot_begin(desk: Desk) -> None:
    now = datetime.now(UTC)
    base = {
        "kind": "sphere", "name": "Old sphere", "laboratory": "Lab", "due_utc": "2099-01-01",
        "certificate": "C-9", "expansion": "1e-5", "expansion_sigma": "1e-6", "sizes": "25.0",
    }  # fmt: skip
    coarse = typed_entry({**base, "id": "S-9", "serial": "S9", "expanded": "0.5"})
    desk.bench.artefacts().add(coarse, "technician", now)
    desk.choose("SPHERE-25")
    start = desk.window.tests.desk.start
    # The usable ones first.
    assert start.artefacts.count() == 2
    assert start.artefacts.item(1).text().startswith("▲ Old sphere")
    start.artefacts.setFocus()
    desk.key(Qt.Key.Key_Down)
    chosen = start.artefact()
    assert chosen is not None
    assert chosen.refusal
    assert start.note.text() == chosen.refusal
    desk.key(Qt.Key.Key_Return)
    desk.until(lambda: chosen.refusal in start.trouble.text())
    assert desk.window.tests.desk.runner is None
    # Also without a name.
    desk.key(Qt.Key.Key_Up)
    start.fields["who"].setText("")
    desk.key(Qt.Key.Key_Return)
    desk.until(lambda: "No name given" in start.trouble.text())
    desk.key(Qt.Key.Key_Escape)
    desk.until(desk.window.maintenance.view.isVisible)


def test_procedures_and_artefacts_are_read_beside_the_window(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A register on a slow disk delays no key; skipped entries are not read."""
    going, read, inside = threading.Event(), [], threading.current_thread()
    ask = AcceptanceBench.offers

    def slow(bench: AcceptanceBench, offer: ProcedureOffer, *given: object) -> object:
        assert threading.current_thread() is not inside
        read.append(offer.procedure.id)
        assert going.wait(HANG_MS / 1000)
        return ask(bench, offer, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(AcceptanceBench, "offers", slow)
    desk.key(Qt.Key.Key_M)
    desk.key(Qt.Key.Key_F7)
    start = desk.window.tests.desk.start
    desk.until(lambda: bool(read))
    for _ in range(3):
        desk.key(Qt.Key.Key_Down)
    assert start.row() == 3
    assert not start.begin_button.isEnabled()
    assert start.artefact() is None
    going.set()
    desk.until(start.begin_button.isEnabled)
    # The first one was started, the last one is requested; those between are not read.
    names = [one.procedure.id for one in desk.window.tests.desk.procedures]
    assert read == [names[0], names[3]]


def test_pages_are_named_fit_and_use_every_theme(desk: Desk) -> None:
    desk.choose("SPHERE-25")
    desk.key(Qt.Key.Key_Return)
    desk.until(lambda: desk.window.tests.desk.runner is not None)
    runner = desk.runner
    for page in runner.pages.values():
        runner.show_page(page)
        QTest.qWait(30)
        assert (desk.window.width(), desk.window.height()) == (1280, 720)
        for button in runner.buttons.values():
            if button.isVisible():
                assert button.width() >= button.minimumSizeHint().width(), button.text()
        for theme in THEMES.values():
            for widget in page.findChildren(QWidget):
                if isinstance(widget, ThemedWidget):
                    widget.set_theme(theme)
            assert not page.grab().isNull()
    for widget in desk.window.tests.desk.findChildren(QWidget):
        if isinstance(widget, QAbstractButton | QLineEdit | QListWidget) and not (
            widget.objectName().startswith(("qt_", "Scroll", "ExtensionButton"))
        ):
            interface = QAccessible.queryAccessibleInterface(widget)
            assert interface is not None
            assert interface.text(QAccessible.Text.Name).strip(), widget
