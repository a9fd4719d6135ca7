"""The page of the probe's design, in the window and with a real process."""

from __future__ import annotations

import multiprocessing
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.tracking import load_probe
from ocmm_gui.kit import THEMES, dress
from ocmm_gui.maintain import ProbeDesignPage
from tests.gui.conftest import OpenWindow
from tests.host import HANG_MS

PATIENCE_MS = HANG_MS


@pytest.fixture
def page(qtbot: QtBot) -> ProbeDesignPage:
    rig = load_rig(resource("rigs", "thesis.toml"))
    made = ProbeDesignPage(rig, load_probe(resource("probes", "thesis.toml")))
    made.resize(1100, 660)
    qtbot.addWidget(made, before_close_func=lambda widget: widget.cancel())
    made.show()
    return made


@pytest.mark.usefixtures("fresh_sides")
def test_the_page_shows_what_the_terminal_prints(page: ProbeDesignPage, qtbot: QtBot) -> None:
    before = page.grab().toImage()
    with qtbot.waitSignal(page.shown, timeout=PATIENCE_MS):
        QTest.mouseClick(page.button, Qt.MouseButton.LeftButton)
        assert page.button.text() == "Cancel"
    # The chart's 21.9 um, minus the effect of a shallower volume.
    assert page.number.text() == "21.8 µm"
    words = page.summary()
    assert "LEDs cannot be confused" in words
    assert "1.75 µm/K" in words
    assert "42.0 nm" in words
    assert page.budget.cells(4)[0] == "Temperature of the probe, not measured"
    assert float(page.budget.cells(4)[1]) > float(page.budget.cells(5)[1]) > 0.0
    assert page.button.text() == "Examine"
    assert page.grab().toImage() != before
    for theme in THEMES.values():
        dress(page, theme)
        assert page.number.text() == "21.8 µm"


def test_an_examination_can_be_given_up(page: ProbeDesignPage, qtbot: QtBot) -> None:
    QTest.mouseClick(page.button, Qt.MouseButton.LeftButton)
    assert [child.name for child in multiprocessing.active_children()] == ["ocmm-examination"]
    QTest.mouseClick(page.button, Qt.MouseButton.LeftButton)
    assert multiprocessing.active_children() == []
    assert page.button.text() == "Examine"
    assert page.number.text() == ""


def test_a_bad_document_is_told_on_the_page(
    page: ProbeDesignPage, qtbot: QtBot, tmp_path: Path
) -> None:
    page.fields["design"].setText(str(resource("designs", "standard.toml")))
    with qtbot.waitSignal(page.failed, timeout=PATIENCE_MS):
        QTest.keyClick(page.fields["design"], Qt.Key.Key_Return)
    assert "'standard'" in page.summary()
    assert "Give the design of this probe" in page.summary()
    page.fields["design"].clear()
    page.fields["tilt"].setText("45 up 10")
    with qtbot.waitSignal(page.failed, timeout=PATIENCE_MS):
        QTest.mouseClick(page.button, Qt.MouseButton.LeftButton)
    assert "The typed tilt is 'up', which is not a number." in page.summary()
    # It ends with the window.
    qtbot.waitUntil(lambda: multiprocessing.active_children() == [], timeout=PATIENCE_MS)


def test_the_window_goes_although_something_is_examined(
    open_window: OpenWindow, qtbot: QtBot
) -> None:
    bench = open_window(speed=1.0, stay=True)
    QTest.keyClick(bench.window, Qt.Key.Key_M)
    chapters = bench.window.maintenance.view.list
    titles = [chapters.item(i) for i in range(chapters.count())]
    row = next(i for i, item in enumerate(titles) if item.text() == "Probe design")
    chapters.setCurrentRow(row)
    assert bench.window.maintenance.probe_design.isVisible()
    bench.window.maintenance.probe_design.toggle()
    # A letter in a field is a letter, and no command of the window.
    QTest.keyClick(bench.window.maintenance.probe_design.fields["probe"], Qt.Key.Key_M)
    bench.window.close()
    assert multiprocessing.active_children() == []
