"""Targets for gloves: 15 mm in both directions, by the physical size of the screen."""

from __future__ import annotations

import math
from collections.abc import Iterator

from PySide6.QtCore import QObject, QPoint, QRect, QSize, Qt, QTimer
from PySide6.QtWidgets import (
    QAbstractButton,
    QComboBox,
    QLineEdit,
    QListWidget,
    QTabBar,
    QTableWidget,
    QWidget,
)

TARGET_MM = 15.0
"""A gloved finger; source in decision 74."""

_EVERY_MS = 250
"""ms: new rows and buttons may be small for as long."""
_LEAST, _MOST = "ocmm_least_before", "ocmm_most_before"
_ROW = Qt.ItemDataRole(Qt.ItemDataRole.UserRole + 97)
_MOST_PX = 16777215
_PARTS = ("qt_", "Scroll", "ExtensionButton")
"""Names of Qt's internal widgets."""


class TouchTargets(QObject):
    """Enlarge all controls of a window to a minimum size."""

    def __init__(self, window: QWidget) -> None:
        super().__init__(window)
        self._window = window
        self._px = 0
        self._timer = QTimer(self)
        self._timer.setInterval(_EVERY_MS)
        self._timer.timeout.connect(self.fit)

    def pixels(self) -> int:
        """Return the minimum size of a target, px; zero for none."""
        return self._px

    def use(self, mm_per_px: float | None) -> None:
        """Use targets of `TARGET_MM`; None restores the original sizes."""
        px = 0 if mm_per_px is None else math.ceil(TARGET_MM / mm_per_px - 1e-9)
        if px == self._px:
            return
        if self._px:
            for widget in _controls(self._window):
                _restore(widget)
        self._px = px
        if px:
            self.fit()
            self._timer.start()
        else:
            self._timer.stop()

    def fit(self) -> None:
        if not self._px:
            return
        for widget in _controls(self._window):
            if widget.isVisible():
                _enlarge(widget, self._px)


def _controls(window: QWidget) -> Iterator[QWidget]:
    for kind in (QAbstractButton, QLineEdit, QComboBox, QListWidget, QTableWidget, QTabBar):
        for widget in window.findChildren(kind):
            inner = isinstance(widget, QLineEdit) and isinstance(widget.parent(), QComboBox)
            if not inner and not widget.objectName().startswith(_PARTS) and _is_ours(widget):
                yield widget


def _is_ours(widget: QWidget) -> bool:
    # The corner of a table is a button of Qt without a name.
    return not (isinstance(widget, QAbstractButton) and isinstance(widget.parent(), QTableWidget))


def _is_pressed(widget: QWidget) -> bool:
    """Return whether rows can be pressed."""
    return bool(widget.focusPolicy().value & Qt.FocusPolicy.ClickFocus.value)


def _enlarge(widget: QWidget, px: int) -> None:
    if isinstance(widget, QListWidget):
        _enlarge_rows(widget, px)
        return
    if isinstance(widget, QTableWidget):
        if _is_pressed(widget):
            header = widget.verticalHeader()
            if widget.property(_LEAST) is None:
                kept = QSize(header.minimumSectionSize(), header.defaultSectionSize())
                widget.setProperty(_LEAST, kept)
            header.setMinimumSectionSize(px)
            header.setDefaultSectionSize(max(px, header.defaultSectionSize()))
            for row in range(widget.rowCount()):
                if widget.rowHeight(row) < px and not widget.isRowHidden(row):
                    widget.setRowHeight(row, px)
        return
    least, most, hint = widget.minimumSize(), widget.maximumSize(), widget.minimumSizeHint()
    before = widget.property(_LEAST)
    if not isinstance(before, QSize):
        before = least
    # An explicit minimum size replaces that of the text: it is set only if larger.
    wanted = QSize(before)
    if max(before.height(), 0 if before.height() else hint.height()) < px:
        wanted.setHeight(px)
    if isinstance(widget, QAbstractButton):
        need = before.width() or hint.width()
        if need < px:
            wanted.setWidth(px)
    if wanted != least:
        widget.setProperty(_LEAST, before)
        widget.setMinimumSize(wanted)
    if most.height() < px or (isinstance(widget, QAbstractButton) and most.width() < px):
        widget.setProperty(_MOST, most)
        widget.setMaximumSize(most.expandedTo(QSize(px, px)))


def _enlarge_rows(view: QListWidget, px: int) -> None:
    for row in range(view.count()):
        item = view.item(row)
        if view.sizeHintForIndex(view.indexFromItem(item)).height() < px:
            if item.data(_ROW) is None:
                item.setData(_ROW, item.sizeHint())
            item.setSizeHint(QSize(max(item.sizeHint().width(), 40), px))


def _restore(widget: QWidget) -> None:
    least, most = widget.property(_LEAST), widget.property(_MOST)
    if isinstance(widget, QListWidget):
        for row in range(widget.count()):
            item = widget.item(row)
            if isinstance(item.data(_ROW), QSize):
                item.setSizeHint(item.data(_ROW))
                item.setData(_ROW, None)
        return
    if isinstance(widget, QTableWidget):
        if isinstance(least, QSize):
            header = widget.verticalHeader()
            header.setMinimumSectionSize(least.width())
            header.setDefaultSectionSize(least.height())
            for row in range(widget.rowCount()):
                widget.setRowHeight(row, least.height())
            widget.setProperty(_LEAST, None)
        return
    if isinstance(most, QSize):
        widget.setMaximumSize(most)
        widget.setProperty(_MOST, None)
    if isinstance(least, QSize):
        widget.setMinimumSize(least)
        widget.setProperty(_LEAST, None)


def _row_heights(view: QListWidget | QTableWidget) -> Iterator[int]:
    """Yield the heights of the rows that are at least partly visible."""
    room = QRect(QPoint(0, 0), view.viewport().size())
    if isinstance(view, QListWidget):
        for row in range(view.count()):
            box = view.visualItemRect(view.item(row))
            if box.intersects(room):
                yield box.height()
        return
    for row in range(view.rowCount()):
        if not view.isRowHidden(row):
            yield view.rowHeight(row)
