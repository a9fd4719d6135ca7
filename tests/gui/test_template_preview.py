"""The preview of the report template in Settings: live, next to the window, faults in words."""

from __future__ import annotations

import threading
import zlib
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.documents import read_text
from ocmm_core.export.template import standard_template
from ocmm_core.settings import SettingsFile, SettingsStore
from ocmm_gui.home import SettingsPage
from ocmm_gui.reports import PagePicture, PagePreview
from ocmm_gui.reports import _preview as side
from tests.host import HANG_MS


@pytest.mark.usefixtures("qapp")
def test_the_first_page_follows_settings_and_template(qtbot: QtBot, tmp_path: Path) -> None:
    template = tmp_path / "lab.toml"
    whole = read_text(standard_template())
    template.write_text(whole, encoding="utf-8")
    store = SettingsStore(
        SettingsFile(tmp_path / "station.toml"), SettingsFile(tmp_path / "user.toml"), {}
    )
    page = SettingsPage(store)
    qtbot.addWidget(page)
    page.resize(1280, 720)
    with qtbot.waitExposed(page):
        page.show()
    preview = page.preview
    # A hidden preview draws nothing.
    assert not preview.is_drawing()
    page.open("report")

    def drawn() -> None:
        qtbot.waitUntil(lambda: not preview.is_drawing(), timeout=HANG_MS)

    drawn()
    first = preview.page.pixmap().toImage()
    assert not first.isNull()
    page.change("report.laboratory", "Laboratory of the settings")
    drawn()
    second = preview.page.pixmap().toImage()
    assert second != first
    page.change("report.template", template)
    drawn()
    # Its author makes a mistake, and mends it, in a program of his own.
    template.write_text(whole.replace('serial = ""', "serial = 5"), encoding="utf-8")
    qtbot.waitUntil(lambda: preview.words.text().startswith("▲"), timeout=HANG_MS)
    assert "field 'machine.serial'" in preview.words.text()
    assert ", line " in preview.words.text()
    assert preview.page.pixmap().isNull()
    template.write_text(whole.replace('title = "', 'title = "Another '), encoding="utf-8")
    qtbot.waitUntil(lambda: not preview.page.pixmap().isNull(), timeout=HANG_MS)
    assert not preview.words.text().startswith("▲")
    page.close_work()


@pytest.mark.usefixtures("qapp", "fresh_sides")
def test_the_page_is_drawn_in_another_process(
    qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_given: object) -> PagePicture:
        raise AssertionError(threading.current_thread().name)

    monkeypatch.setattr(side, "template_page", never)
    store = SettingsStore(
        SettingsFile(tmp_path / "station.toml"), SettingsFile(tmp_path / "user.toml"), {}
    )
    page = SettingsPage(store)
    qtbot.addWidget(page)
    page.resize(1280, 720)
    with qtbot.waitExposed(page):
        page.show()
    page.open("report")
    qtbot.waitUntil(lambda: not page.preview.page.pixmap().isNull(), timeout=HANG_MS)
    page.close_work()


def test_a_hundred_pages_are_unpacked_where_they_are_looked_at(
    qtbot: QtBot, qapp: QApplication
) -> None:
    pages = PagePreview()
    qtbot.addWidget(pages)
    pages.resize(500, 700)
    with qtbot.waitExposed(pages):
        pages.show()
    blank = zlib.compress(bytes([255]) * (4 * 400 * 566))
    for index in range(100):
        pages.show_page(PagePicture(index, 100, 400, 566, blank))
    qapp.processEvents()
    assert 1 <= pages.unpacked().count(True) <= 5
    assert pages.page_count() == 100
    bar = pages.verticalScrollBar()
    qtbot.waitUntil(lambda: bar.maximum() > 40_000, timeout=HANG_MS)
    bar.setValue(bar.maximum())
    qapp.processEvents()
    assert pages.unpacked()[-1]
    assert not pages.unpacked()[0]
