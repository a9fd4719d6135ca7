"""Every control of every page is reached with Tab alone, shows that it is, and lets go again."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QAccessible, QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QApplication,
    QComboBox,
    QLineEdit,
    QWidget,
)

from ocmm_gui.window import MainWindow
from tests.gui.window_pages import pages

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

MOST_TABS = 300
MOST_ROUNDS = 5
_QT_PARTS = ("qt_", "Scroll", "ExtensionButton")


def controls(window: QWidget) -> Iterator[QWidget]:
    """Yield the usable widgets of the shown page."""
    for kind in (QAbstractButton, QLineEdit, QComboBox, QAbstractItemView):
        for widget in window.findChildren(kind):
            # Within a list or table they are its cells, while one is written in.
            holder = widget.parent()
            inner = isinstance(holder, QComboBox | QAbstractItemView)
            inner = inner or (
                isinstance(holder, QWidget) and isinstance(holder.parent(), QAbstractItemView)
            )
            ours = not inner and not widget.objectName().startswith(_QT_PARTS)
            if ours and widget.isVisible() and widget.isEnabled():
                yield widget


def _picture(widget: QWidget) -> QImage:
    # The frame of a list belongs to the whole of it.
    return widget.grab().toImage()


def faults(window: MainWindow, app: QApplication) -> Iterator[str]:
    """Yield widgets that the keyboard does not reach, highlight or leave."""
    seen: list[QWidget] = []
    # The first focus, of the window or set by a page, may be outside the tab order.
    QTest.keyClick(app.focusWidget() or window, Qt.Key.Key_Tab)
    app.processEvents()
    start = app.focusWidget() or window
    before, same, rounds = start, 0, 0
    for _ in range(MOST_TABS):
        widget = app.focusWidget() or window
        lit = _picture(widget) if widget not in seen else None
        QTest.keyClick(widget, Qt.Key.Key_Tab)
        app.processEvents()
        after = app.focusWidget() or window
        if after is widget:
            same += 1
            if same > 1:
                yield f"{_name(widget)} is not left with Tab"
                return
        else:
            same = 0
            if lit is not None and widget.isVisible() and lit == _picture(widget):
                yield f"{_name(widget)} does not show that it has the keyboard"
        if widget not in seen:
            seen.append(widget)
        elif widget is start and before is not start:
            # Several rounds: a page whose facts come late moves the keyboard on its way.
            rounds += 1
            if rounds == MOST_ROUNDS or (rounds > 1 and not list(_unreached(window, seen))):
                break
        before = widget
    else:
        yield f"Tab does not come round in {MOST_TABS} steps"
    for widget in controls(window):
        name = QAccessible.queryAccessibleInterface(widget).text(QAccessible.Text.Name)
        if not name.strip():
            yield f"{_name(widget)} has no name for a screen reader"
    for widget in _unreached(window, seen):
        yield f"{_name(widget)} is not reached"


def _unreached(window: MainWindow, seen: list[QWidget]) -> Iterator[QWidget]:
    for widget in controls(window):
        if widget in seen or any(widget.isAncestorOf(one) for one in seen):
            continue
        if isinstance(widget, QAbstractButton) and widget.group() is not None:
            # Arrows walk within a group.
            continue
        # A page with its own navigation keys shows them on its buttons.
        keys = "[" in getattr(widget, "text", str)() or "(" in widget.toolTip()
        if not keys:
            yield widget


def _name(widget: QWidget) -> str:
    return f"{type(widget).__name__} {widget.objectName()} {widget.accessibleName()!r}"


@pytest.mark.slow
def test_every_page_is_used_with_the_keyboard_alone(
    open_window: OpenWindow, qapp: QApplication
) -> None:
    window = open_window(speed=0.1, tests=True).window
    found = []
    for name, open_page in pages(window):
        open_page()
        for _ in range(5):
            qapp.processEvents()
        found += [f"{name}: {fault}" for fault in faults(window, qapp)]
    assert not found, "\n".join(found)


def test_a_list_a_field_and_a_text_are_left_with_tab(
    open_window: OpenWindow, qapp: QApplication
) -> None:
    window = open_window(speed=0.1).window
    window.sheets.open_job()
    qapp.processEvents()
    assert not [fault for fault in faults(window, qapp) if "left" in fault or "round" in fault]
