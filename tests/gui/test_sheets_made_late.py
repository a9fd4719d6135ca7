"""A sheet is made at its first look, once, and looks as if it had always been there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from ocmm_gui.kit import Mode, Sheet, Theme, counted_line

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

_OPENED = ("results", "job", "plan", "alignment", "keys", "recall")
"""Opened by a key of the window; report and batch are opened from the results."""


@pytest.mark.parametrize("name", _OPENED)
def test_a_sheet_is_made_when_it_is_first_shown_and_kept(
    open_window: OpenWindow, name: str
) -> None:
    window = open_window(start=False).window
    if name == "recall":
        window.show_mode(Mode.MAINTAIN)
    assert window.findChildren(Sheet) == []
    window.actions_by_key[name].trigger()
    made = window.findChildren(Sheet)
    assert made == [getattr(window.sheets, name)]
    assert made[0].isVisible()
    made[0].left.emit()
    assert not made[0].isVisible()
    window.actions_by_key[name].trigger()
    assert window.findChildren(Sheet) == made


@pytest.mark.parametrize("name", ["job", "plan", "alignment", "results"])
@pytest.mark.usefixtures("fresh_sides")
def test_a_late_sheet_wears_the_theme_of_the_window(open_window: OpenWindow, name: str) -> None:
    window = open_window(start=False).window
    # Not the default theme of the widgets.
    window.use_theme("light")
    if name == "job":
        window.sheets.open_job()
    else:
        window.sheets.show_sheet(name)
    sheet: Sheet = getattr(window.sheets, name)
    worn = [
        theme.name
        for widget in (sheet, *sheet.findChildren(QWidget))
        for theme in [vars(widget).get("_theme")]
        if isinstance(theme, Theme)
    ]
    assert worn
    assert set(worn) == {"light"}


def test_a_late_sheet_has_what_was_measured_before_it_was_made(
    open_window: OpenWindow, qtbot: QtBot
) -> None:
    bench = open_window(stay=True)
    window, bridge = bench.window, bench.bridge
    bench.wait_complete(qtbot)
    assert window.findChildren(Sheet) == []
    window.sheets.show_sheet("results")
    results = window.sheets.results
    assert results.table.rowCount() == len(bridge.shown.job.characteristics) > 0
    assert results.summary.text() == counted_line(bridge.shown.job)
