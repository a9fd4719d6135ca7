"""F1 opens the section of the page one is on; the manual is read, searched and left by keys."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMainWindow, QWidget
from pytestqt.qtbot import QtBot

from ocmm_core.calibration.guided import ProcedureKind
from ocmm_core.manual import ManualPart, Place, load_manual
from ocmm_core.settings import SettingsFile, SettingsStore
from ocmm_gui.access import PageStack
from ocmm_gui.home import StartWindow
from ocmm_gui.kit import LANGUAGES, THEMES, NoticeCentre, RecentPlaces, dress, use_language
from ocmm_gui.manual import PLACES, ManualSheet, place_of
from ocmm_gui.manual._reading import FIRST, DocumentView
from tests.gui.conftest import OpenWindow
from tests.gui.window_pages import pages

_GUI = Path(__file__).resolve().parents[2] / "ocmm_gui"
_BASES = ("Sheet", "WorkSheet", "StatusPage")


@pytest.fixture
def sheet(qtbot: QtBot, qapp: QApplication) -> ManualSheet:
    """Return a manual on the screen, 1280 x 720."""
    qapp.setStyle("Fusion")
    sheet = ManualSheet()
    qtbot.addWidget(sheet)
    sheet.resize(1280, 720)
    with qtbot.waitActive(sheet):
        sheet.show()
        sheet.activateWindow()
    return sheet


def _stack(window: QMainWindow) -> PageStack:
    """Return what holds the pages of a window."""
    return window.findChildren(PageStack)[0]


def _reading(sheet: ManualSheet) -> DocumentView:
    assert sheet.text is not None
    return sheet.text


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_place_of_the_register_is_a_section_of_the_manual(language: str) -> None:
    manual = load_manual(language=language)
    lost = {
        name: place
        for name, place in PLACES.items()
        if manual.section(Place.from_reference(place)) is None
    }
    assert not lost
    assert manual.section(Place.from_reference(FIRST)) is not None
    # Every one names a section: a document alone is a long way to read.
    assert all("#" in place for place in PLACES.values())


def test_every_sheet_of_the_window_and_every_wizard_has_a_place() -> None:
    found = set()
    for path in _GUI.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ClassDef):
                # `Sheet`, `kit.Sheet` and `Sheet[T]`.
                named = [
                    base.value if isinstance(base, ast.Subscript) else base for base in node.bases
                ]
                bases = {getattr(base, "attr", getattr(base, "id", "")) for base in named}
                if bases & set(_BASES) and node.name not in _BASES:
                    found.add(node.name)
    assert len(found) > 12
    assert found <= set(PLACES), found - set(PLACES)
    assert {f"Wizard {kind.value}" for kind in ProcedureKind} <= set(PLACES)


def test_f1_opens_the_section_of_every_page_and_esc_goes_back_to_it(
    open_window: OpenWindow, qapp: QApplication
) -> None:
    window = open_window(start=False).window
    stack = _stack(window)
    seen = {}
    for name, open_page in pages(window):
        open_page()
        qapp.processEvents()
        page = stack.currentWidget()
        # Its own entry, not the one for unknown faults.
        assert place_of(page) != FIRST, name
        assert window.actions_by_key["manual"].isEnabled(), name
        enabled = {key for key, action in window.actions_by_key.items() if action.isEnabled()}
        window.actions_by_key["manual"].trigger()
        manual = window.sheets.manual
        assert stack.currentWidget() is manual
        assert str(manual.place()) == place_of(page), name
        assert not window.actions_by_key["take"].isEnabled()
        manual.keys["leave"].trigger()
        assert stack.currentWidget() is page, name
        after = {key for key, action in window.actions_by_key.items() if action.isEnabled()}
        assert after == enabled, name
        seen[name] = place_of(page)
    assert len(set(seen.values())) >= 20


def test_f1_in_the_manual_opens_its_own_page_and_esc_still_leads_back(
    open_window: OpenWindow,
) -> None:
    window = open_window(start=False).window
    window.sheets.show_sheet("results")
    results = _stack(window).currentWidget()
    for _ in range(2):
        window.actions_by_key["manual"].trigger()
    assert str(window.sheets.manual.place()) == PLACES["ManualSheet"]
    window.sheets.manual.keys["leave"].trigger()
    assert _stack(window).currentWidget() is results


def test_f1_is_a_key_of_a_field_in_which_somebody_types(
    open_window: OpenWindow, qtbot: QtBot
) -> None:
    window = open_window(start=False).window
    window.sheets.open_job()
    field = window.focusWidget()
    assert field is not None
    QTest.keyClick(field, Qt.Key.Key_F1)
    assert _stack(window).currentWidget() is window.sheets.manual
    QTest.keyClick(_reading(window.sheets.manual), Qt.Key.Key_Escape)
    assert _stack(window).currentWidget() is window.sheets.job
    assert window.focusWidget() is field


def test_the_start_window_has_the_manual_on_all_its_pages(
    qtbot: QtBot, qapp: QApplication, tmp_path: Path
) -> None:
    store = SettingsStore(
        SettingsFile(tmp_path / "station.toml"), SettingsFile(tmp_path / "user.toml")
    )
    window = StartWindow(store, NoticeCentre(), RecentPlaces(tmp_path / "recent.json"))
    qtbot.addWidget(window)
    with qtbot.waitActive(window):
        window.show()
        window.activateWindow()
    for page in (window.page, window.settings, window.plans, window.browser):
        _stack(window).setCurrentWidget(page)
        page.setFocus()
        QTest.keyClick(_focused(window), Qt.Key.Key_F1)
        manual = window.manual
        assert manual is not None
        assert _stack(window).currentWidget() is manual, page
        assert str(manual.place()) == place_of(page)
        QTest.keyClick(_reading(manual), Qt.Key.Key_Escape)
        assert _stack(window).currentWidget() is page
    window.close()


def _focused(window: QWidget) -> QWidget:
    focused: QWidget | None = window.focusWidget()
    return window if focused is None else focused


@pytest.fixture
def german(qapp: QApplication) -> Iterator[QApplication]:
    """Let windows that are made now be German."""
    assert use_language(qapp, "de")
    yield qapp
    use_language(qapp, "en")


def test_a_german_window_reads_german_pages_and_says_which_are_in_english_only(
    qtbot: QtBot, german: QApplication
) -> None:
    sheet = ManualSheet()
    qtbot.addWidget(sheet)
    sheet.resize(1280, 720)
    with qtbot.waitExposed(sheet):
        sheet.show()
    manual, text = load_manual(language="de"), _reading(sheet)
    seen = {"de": 0, "en": 0}
    for chapter in manual.chapters:
        if chapter.part is ManualPart.DECISIONS and seen["en"]:
            continue
        sheet.open(chapter.name)
        seen[chapter.language] += 1
        shown = [anchor for anchor, _block in text.headings()]
        assert shown == [section.anchor for section in chapter.sections], chapter.name
        english_only = chapter.language == "en"
        assert sheet.remark.isVisibleTo(sheet) is english_only, chapter.name
        assert ("nur auf Englisch" in sheet.remark.text()) is english_only, chapter.name
    assert min(seen.values()) > 5
    sheet.open("inspector/inspecting.md#results-f3")
    assert text.place() == Place("inspector/inspecting.md", "results-f3")
    kind = 2  # QTextDocument.ImageResource
    assert text.loadResource(kind, "../images/far_dark.png") is not None
    assert text.loadResource(kind, "../../README.md") is None


def test_a_german_search_marks_the_word_inside_others(qtbot: QtBot, german: QApplication) -> None:
    sheet = ManualSheet()
    qtbot.addWidget(sheet)
    sheet.open()
    sheet.field.setText("größer")
    assert sheet.list.count() > 1
    sheet.field.setText("unsicherheit")
    QTest.keyClick(sheet.field, Qt.Key.Key_Return)
    place, text = sheet.place(), _reading(sheet)
    assert place is not None
    before = {
        text.document().characterAt(one.cursor.selectionStart() - 1)
        for one in text.extraSelections()
    }
    # Messunsicherheit, Standardunsicherheit.
    assert {"s", "d"} & before, place


def test_a_page_that_is_older_than_the_english_one_says_so(
    qtbot: QtBot, german: QApplication, tmp_path: Path
) -> None:
    for folder in (tmp_path / "inspector", tmp_path / "de" / "inspector"):
        folder.mkdir(parents=True)
    (tmp_path / "inspector" / "start.md").write_text("# First\n")
    (tmp_path / "de" / "inspector" / "start.md").write_text(
        "<!-- English: 0123456789abcdef -->\n# Zuerst\n"
    )
    sheet = ManualSheet(load_manual(tmp_path, "de"))
    qtbot.addWidget(sheet)
    sheet.open("inspector/start.md")
    assert sheet.remark.isVisibleTo(sheet)
    assert "nur auf Englisch" not in sheet.remark.text()


def test_headings_on_the_screen_are_the_sections_of_the_manual(sheet: ManualSheet) -> None:
    """So every link finds its heading, in every document."""
    manual, text = load_manual(), _reading(sheet)
    different = []
    for chapter in manual.chapters:
        sheet.open(chapter.name)
        shown = [anchor for anchor, _block in text.headings()]
        if shown != [section.anchor for section in chapter.sections]:
            different.append(chapter.name)
    assert not different


def test_links_lead_on_and_back_by_keys_alone(sheet: ManualSheet, qtbot: QtBot) -> None:
    sheet.open("inspector/colours.md#cameras-probe-and-tip")
    text = _reading(sheet)
    assert text.hasFocus()
    QTest.keyClick(text, Qt.Key.Key_Tab)
    QTest.keyClick(text, Qt.Key.Key_Return)
    there = sheet.place()
    assert there is not None
    assert there.document != "inspector/colours.md"
    QTest.keyClick(text, Qt.Key.Key_F9)
    back = sheet.place()
    assert back is not None
    assert back.document == "inspector/colours.md"
    assert not sheet.keys["before"].isEnabled()
    QTest.keyClick(text, Qt.Key.Key_F10)
    assert sheet.place() == there
    assert not sheet.keys["after"].isEnabled()


def test_a_link_out_of_the_manual_is_told_and_opens_nothing(sheet: ManualSheet) -> None:
    sheet.open("technician/doctor.md")
    before = sheet.place()
    _reading(sheet).link_wanted.emit("https://example.org/x")
    assert "https://example.org/x" in sheet.about()
    assert sheet.place() == before


def test_a_search_by_keys_opens_the_hit_with_its_words_marked(
    sheet: ManualSheet, qtbot: QtBot
) -> None:
    sheet.open()
    QTest.keyClick(_reading(sheet), Qt.Key.Key_F8)
    assert sheet.field.hasFocus()
    QTest.keyClicks(sheet.field, "yellow bands")
    assert "Yellow bands" in sheet.list.item(0).text()
    QTest.keyClick(sheet.field, Qt.Key.Key_Return)
    assert sheet.place() == Place("inspector/colours.md", "yellow-bands")
    text = _reading(sheet)
    assert text.hasFocus()
    assert text.marked() >= 2
    # The section is on the screen.
    anchor, block = next(one for one in text.headings() if one[0] == "yellow-bands")
    top = text.document().documentLayout().blockBoundingRect(block).top()
    value = text.verticalScrollBar().value()
    assert value <= top <= value + text.viewport().height(), anchor
    sheet.field.setText("nonsenseword")
    assert "Nothing found" in sheet.list.item(0).text()


def test_pictures_are_no_wider_than_the_page_and_come_from_the_manual_alone(
    sheet: ManualSheet,
) -> None:
    sheet.open("inspector/inspecting.md")
    text = _reading(sheet)
    assert text.document().idealWidth() <= text.viewport().width()
    kind = 2  # QTextDocument.ImageResource
    for out in ("https://example.org/x.png", "../README.md", "/etc/hostname"):
        assert text.loadResource(kind, out) is None
    assert text.loadResource(kind, "../images/far_dark.png") is not None


@pytest.mark.parametrize("theme", THEMES)
def test_text_has_the_colours_of_the_theme_and_keeps_its_place(
    sheet: ManualSheet, theme: str
) -> None:
    sheet.open("inspector/inspecting.md#results-f3")
    dress(sheet, THEMES[theme])
    text = _reading(sheet)
    found = set()
    block = text.document().begin()
    while block.isValid():
        turn = block.begin()
        while not turn.atEnd():
            style = turn.fragment().charFormat()
            if not style.isImageFormat():
                found.add(style.foreground().color().name())
            turn += 1
        block = block.next()
    assert found == {THEMES[theme].text, THEMES[theme].accent}
    assert text.place() == Place("inspector/inspecting.md", "results-f3")
    size = text.document().defaultFont().pixelSize()
    text.zoom(2)
    assert text.document().defaultFont().pixelSize() > size
    assert text.place() == Place("inspector/inspecting.md", "results-f3")
