"""The Settings page: everything is checked while it is typed, kept at once, and used at once."""

from __future__ import annotations

import shutil
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QFocusEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QLineEdit, QPushButton, QWidget
from pytestqt.qtbot import QtBot

from ocmm_core.documents import resource
from ocmm_core.export.template import load_paper, standard_template, template_in_use
from ocmm_core.settings import SETTINGS, Kind, SettingsFile, SettingsStore, Value
from ocmm_gui.home import SettingsPage
from ocmm_gui.kit import ACTIONS, Mode, usable_keys

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

MakePage = Callable[..., SettingsPage]


def _store(folder: Path, given: dict[str, Value] | None = None) -> SettingsStore:
    return SettingsStore(
        SettingsFile(folder / "station" / "settings.toml"),
        SettingsFile(folder / "user" / "settings.toml"),
        given or {},
    )


@pytest.fixture
def make_page(qtbot: QtBot, tmp_path: Path) -> Iterator[MakePage]:
    made: list[SettingsPage] = []

    def make(
        given: dict[str, Value] | None = None, apply: Callable[[], None] | None = None
    ) -> SettingsPage:
        page = SettingsPage(_store(tmp_path, given), apply)
        qtbot.addWidget(page)
        page.resize(1280, 720)
        with qtbot.waitExposed(page):
            page.show()
        made.append(page)
        return page

    yield make
    for page in made:
        page.close_work()


def _type(qtbot: QtBot, field: QLineEdit, text: str) -> None:
    field.setFocus()
    field.selectAll()
    QTest.keyClicks(field, text)


def test_every_setting_has_a_row_or_is_a_list_of_keys(make_page: MakePage) -> None:
    page = make_page()
    shown = {spec.key for spec in SETTINGS if spec.kind is not Kind.KEYS}
    assert set(page.rows) == shown
    # A field's placeholder does not repeat the text next to it.
    assert not any(row.field.placeholderText() for row in page.rows.values())


def test_what_is_typed_is_judged_at_once_and_kept_with_return(
    make_page: MakePage, qtbot: QtBot
) -> None:
    page = make_page()
    row = page.rows["instrument.check_after_h"]
    _type(qtbot, row.field, "9999")
    assert "0.1 to 168 h" in row.fault()
    QTest.keyClick(row.field, Qt.Key.Key_Return)
    assert page.loaded.settings.instrument_check_after_h == 8.0
    _type(qtbot, row.field, "4,5")
    assert not row.fault()
    QTest.keyClick(row.field, Qt.Key.Key_Return)
    assert page.loaded.settings.instrument_check_after_h == 4.5
    assert row.mark.text()
    assert "Default: 8." in row.told.text()
    assert row.reset.isVisible()
    row.reset.click()
    assert page.loaded.settings.instrument_check_after_h == 8.0
    assert not row.mark.text()
    assert not row.reset.isVisible()


def test_escape_takes_back_what_was_typed_and_then_leaves(
    make_page: MakePage, qtbot: QtBot
) -> None:
    page = make_page()
    row = page.rows["job.operator"]
    page.show_section(1)
    _type(qtbot, row.field, "Anna")
    QTest.keyClick(row.field, Qt.Key.Key_Escape)
    assert row.field.text() == ""
    assert row.told.text()
    with qtbot.waitSignal(page.left):
        QTest.keyClick(row.field, Qt.Key.Key_Escape)


def test_a_rig_that_is_none_is_refused_while_it_is_typed(make_page: MakePage, qtbot: QtBot) -> None:
    page = make_page()
    row = page.rows["instrument.rig"]
    _type(qtbot, row.field, str(resource("probes", "standard.toml")))
    assert "ocmm.rig/1" in row.fault()
    row.set_text(str(resource("rigs", "thesis.toml")))
    assert page.loaded.settings.instrument_rig == resource("rigs", "thesis.toml")


def test_what_the_start_gave_wins_and_says_so(make_page: MakePage) -> None:
    page = make_page({"window.theme": "light"})
    row = page.rows["window.theme"]
    assert not row.editor.isEnabled()
    assert "Given at the start" in row.told.text()
    assert "--" not in row.told.text()


def test_a_damaged_document_is_named_on_the_page(make_page: MakePage, tmp_path: Path) -> None:
    path = tmp_path / "user" / "settings.toml"
    path.parent.mkdir()
    path.write_bytes(b"\x00")
    page = make_page()
    assert page.notes.isVisible()
    assert str(path) in page.notes.text()
    page.change("window.sounds", False)
    assert not page.notes.isVisible()
    assert tomllib.loads(path.read_text())["window"] == {"sounds": False}


def test_what_a_job_cannot_take_waits_for_the_key(make_page: MakePage) -> None:
    asked: list[bool] = []
    page = make_page(apply=lambda: asked.append(True))
    page.change("window.theme", "light")
    assert not page.waits()
    page.change("instrument.tip", "long")
    assert page.waits()
    assert "Tip" in page.about()
    page.keys["apply"].trigger()
    assert asked


def test_everything_that_is_touched_is_15_mm_high(make_page: MakePage) -> None:
    page = make_page()
    for number in range(7):
        page.show_section(number)
        for widget in page.findChildren(QAbstractButton) + page.findChildren(QLineEdit):
            if widget.isVisible():
                # 57 px are 15.1 mm at 96 dots an inch.
                assert widget.height() >= 57, widget.accessibleName()


def test_a_key_is_changed_by_pressing_it_and_a_taken_one_is_refused(
    make_page: MakePage, qtbot: QtBot
) -> None:
    page = make_page()
    page.show_section(6)
    keys = page.keys_list
    keys.select("flip")
    keys.list.itemActivated.emit(keys.list.currentItem())
    QTest.keyClick(keys.capture, Qt.Key.Key_Space)
    assert "already Take" in keys.told.text()
    assert not page.loaded.settings.window_keys
    keys.list.itemActivated.emit(keys.list.currentItem())
    QTest.keyClick(keys.capture, Qt.Key.Key_U, Qt.KeyboardModifier.ControlModifier)
    assert page.loaded.settings.window_keys == {"flip": ("Ctrl+U",)}
    # Whoever clicks elsewhere while a key is waited for does not mean the next one for it.
    keys.list.itemActivated.emit(keys.list.currentItem())
    QApplication.sendEvent(keys.capture, QFocusEvent(QEvent.Type.FocusOut))
    assert "not changed" in keys.told.text()
    assert QWidget.keyboardGrabber() is None
    QTest.keyClick(keys.capture, Qt.Key.Key_F9)
    assert page.loaded.settings.window_keys == {"flip": ("Ctrl+U",)}
    keys.select("take")
    keys.assign("F16")
    # The foot switch keeps its key in addition to the new one.
    assert page.loaded.settings.window_keys["take"] == ("F16", "F13")
    keys.assign("Esc")
    assert page.loaded.settings.window_keys["take"] == ("F16", "F13")
    keys.restore()
    assert page.loaded.settings.window_keys == {"flip": ("Ctrl+U",)}


def test_keys_of_a_document_that_clash_are_passed_over() -> None:
    assert usable_keys({"flip": ("Space",)}) == {}
    assert usable_keys({"flip": ("Ctrl+U",), "skip": ("Ctrl+U",)}) == {"flip": ("Ctrl+U",)}
    assert usable_keys({"moon": ("Ctrl+M",), "flip": ("",)}) == {}


def test_the_window_uses_settings_without_a_new_start(
    open_window: OpenWindow, qtbot: QtBot
) -> None:
    bench = open_window(start=False)
    window = bench.window
    window.actions_by_key["settings"].trigger()
    page = window.sheets.settings
    page.change("window.theme", "light")
    assert window.palette().window().color().lightness() > 128
    page.change("window.keys", {"flip": ("Ctrl+U",)})
    assert window.actions_by_key["flip"].shortcut().toString() == "Ctrl+U"
    page.change("job.operators", ("Anna", "Ben"))
    page.left.emit()
    window.actions_by_key["job"].trigger()
    fields = window.sheets.job.fields
    QTest.keyClick(fields["operator"], Qt.Key.Key_Return)
    # Typing replaces the proposed serial number.
    assert fields["serial"].selectedText() == fields["serial"].text() != ""
    completer = fields["operator"].completer()
    assert completer is not None
    completer.setCompletionPrefix("an")
    assert completer.currentCompletion() == "Anna"
    window.sheets.job.left.emit()
    window.actions_by_key["theme"].trigger()
    assert SettingsStore.of_this_user().load().settings.window_theme == "contrast"
    SettingsStore.of_this_user().change(
        {"window.theme": None, "window.keys": None, "job.operators": None}
    )


def test_the_search_does_what_was_typed(open_window: OpenWindow, qtbot: QtBot) -> None:
    window = open_window(start=False).window
    window.actions_by_key["find"].trigger()
    assert window.search.isVisible()
    QTest.keyClicks(window.search.field, "unfinished")
    QTest.keyClick(window.search.field, Qt.Key.Key_Return)
    assert not window.search.isVisible()
    assert window.centralWidget() is not None
    qtbot.waitUntil(lambda: window.sheets.is_made("job"))
    # On a page its own actions are found as well.
    window.actions_by_key["find"].trigger()
    QTest.keyClicks(window.search.field, "next part")
    assert window.search.list.count() >= 1
    QTest.keyClick(window.search.field, Qt.Key.Key_Escape)
    assert not window.search.isVisible()
    # An action of Maintain is found in Inspect, and executed in Maintain.
    window.pages.show_mode(Mode.INSPECT)
    window.actions_by_key["find"].trigger()
    QTest.keyClicks(window.search.field, "recalculate older jobs")
    QTest.keyClick(window.search.field, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: window.sheets.is_made("recall"))
    assert window.sheets.recall.isVisible()
    window.actions_by_key["find"].trigger()
    QTest.keyClicks(window.search.field, "zzzz")
    assert [window.search.list.item(0).text()] == ["Nothing found. Type less."]
    QTest.keyClick(window.search.field, Qt.Key.Key_Return)
    assert window.sheets.recall.isVisible()


def test_every_action_can_be_found_by_its_name(open_window: OpenWindow) -> None:
    window = open_window(start=False).window
    for info in ACTIONS:
        if window.actions_by_key[info.key].isEnabled() and info.key != "find":
            window.search.ask(window.actions_by_key)
            window.search.field.setText(info.text)
            window.search.field.textEdited.emit(info.text)
            item = window.search.list.item(0)
            assert item is not None, info.key
            assert window.search.list.count() >= 1


def test_the_head_of_reports_is_kept_for_every_route(make_page: MakePage, tmp_path: Path) -> None:
    logo = tmp_path / "our.png"
    logo.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(64))
    page = make_page()
    page.change("report.laboratory", "Laboratory of tests")
    page.change("report.address", ("1 Long Road", "Town"))
    page.change("report.logo", logo)
    paper = load_paper(template_in_use())
    assert paper.template.laboratory.name == "Laboratory of tests"
    assert paper.template.laboratory.address == ["1 Long Road", "Town"]
    assert paper.logo == logo.read_bytes()
    # The other contents of the template remain.
    assert paper.template.signatures == load_paper(standard_template()).template.signatures
    shutil.rmtree(template_in_use().parent)


def test_the_key_writes_the_formats_of_the_station_and_its_button_says_which(
    open_window: OpenWindow,
) -> None:
    window = open_window(start=False).window
    (button,) = [
        one
        for one in window.desk.findChildren(QPushButton)
        if one.accessibleName().startswith("Export")
    ]
    assert button.text() == "PolyWorks  [E]"
    store = SettingsStore.of_this_user()
    store.change({"report.formats": ("xlsx", "json", "pdf")})
    window.sheets.settings_changed.emit(store.load())
    assert window.output.formats == ("xlsx", "json", "pdf")
    assert button.text() == "XLSX + 2  [E]"
    assert "Workbook (XLSX), JSON with raw observations, PDF" in button.toolTip()
    assert window.sheets.report.marked() == ("xlsx", "json", "pdf")
    store.change({"report.formats": ("polyworks",)})
