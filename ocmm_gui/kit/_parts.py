"""Building blocks of pages: layouts in one call, and parts of the Maintain mode."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TypeVar

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRect, Qt, QTimer
from PySide6.QtGui import QColor, QFont, QPainter, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QBoxLayout,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLayout,
    QScrollArea,
    QSizePolicy,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from ocmm_gui.kit._narrow import PlainLabel
from ocmm_gui.kit._texts import literal
from ocmm_gui.kit._theme import DEFAULT_THEME, LEFT, RIGHT, THEMES, Themed, digit_font, text_font

Part = QWidget | QLayout | int | tuple[QWidget | QLayout, int]
"""Widget or layout, with its stretch if not zero; the stretch alone is empty room."""
B = TypeVar("B", bound=QBoxLayout)
W = TypeVar("W", bound=QWidget)


def vbox(
    *parts: Part,
    parent: QWidget | None = None,
    spacing: int | None = None,
    margins: int | tuple[int, int, int, int] | None = None,
) -> QVBoxLayout:
    """Return a column; ``margins`` are equal, or left, top, right, bottom; None: as the style."""
    made = QVBoxLayout() if parent is None else QVBoxLayout(parent)
    return _filled(made, parts, spacing, margins)


def hbox(
    *parts: Part,
    parent: QWidget | None = None,
    spacing: int | None = None,
    margins: int | tuple[int, int, int, int] | None = None,
) -> QHBoxLayout:
    """Return a row; see `vbox`."""
    made = QHBoxLayout() if parent is None else QHBoxLayout(parent)
    return _filled(made, parts, spacing, margins)


def fill(layout: QBoxLayout, *parts: Part) -> None:
    """Append parts to a layout."""
    for part in parts:
        if isinstance(part, int):
            layout.addStretch(part)
            continue
        content, stretch = part if isinstance(part, tuple) else (part, 0)
        if isinstance(content, QWidget):
            layout.addWidget(content, stretch)
        else:
            layout.addLayout(content, stretch)


def dressed(
    widget: W,
    name: str = "",
    tip: str = "",
    *,
    font: QFont | None = None,
    role: str = "",
    high: int = 0,
    key: str = "",
) -> W:
    """Return a widget with its name and tip, also for screen readers, font, role, and object name.

    ``high``: least height, px.
    """
    if key:
        widget.setObjectName(key)
    if name:
        widget.setAccessibleName(name)
    if tip:
        widget.setAccessibleDescription(tip)
        widget.setToolTip(literal(tip))
    if font is not None:
        widget.setFont(font)
    if role:
        widget.setProperty("role", role)
    if high:
        widget.setMinimumHeight(high)
    return widget


def _filled(
    layout: B,
    parts: tuple[Part, ...],
    spacing: int | None,
    margins: int | tuple[int, int, int, int] | None,
) -> B:
    if spacing is not None:
        layout.setSpacing(spacing)
    if margins is not None:
        left, top, right, bottom = (margins,) * 4 if isinstance(margins, int) else margins
        layout.setContentsMargins(left, top, right, bottom)
    fill(layout, *parts)
    return layout


class ColouredRow(QStyledItemDelegate):
    """Cells keep their colours in the selected row."""

    theme = THEMES[DEFAULT_THEME]

    def paint(
        self,
        painter: QPainter,
        option: QStyleOptionViewItem,
        index: QModelIndex | QPersistentModelIndex,
    ) -> None:
        """Mark the selected row by a line below it."""
        cell = QStyleOptionViewItem(option)
        if cell.state & QStyle.StateFlag.State_Selected:
            painter.fillRect(cell.rect, QColor(self.theme.background))
            painter.fillRect(
                QRect(cell.rect.left(), cell.rect.bottom() - 1, cell.rect.width(), 2),
                QColor(self.theme.accent),
            )
        for flag in (QStyle.StateFlag.State_Selected, QStyle.StateFlag.State_HasFocus):
            cell.state &= ~flag
        super().paint(painter, cell, index)


_AROUND_PX = 17
"""Width taken by padding, margins and grid of a cell."""
_ABOVE_PX = 6
_HIGH_PX = 1 << 14


_COLOUR = Qt.ItemDataRole(Qt.ItemDataRole.UserRole + 96)
"""Name of the colour of a cell."""


class DataTable(Themed, QTableWidget):
    """A read-only table, whose cells have colours of the theme.

    `columns`: Title and explanation of each.
    `font`: Font of the cells. Fonts set later are overridden by an applied style sheet.
    """

    def __init__(
        self, name: str, columns: Sequence[tuple[str, str]], *, font: QFont | None = None
    ) -> None:
        super().__init__(0, len(columns))
        self.setFont(font or text_font(13))
        self.setAccessibleName(name)
        self._wraps = False
        for column, (title, tip) in enumerate(columns):
            item = QTableWidgetItem(title)
            item.setToolTip(literal(tip))
            item.setTextAlignment(LEFT)
            self.setHorizontalHeaderItem(column, item)
        self.horizontalHeader().setFont(text_font(12))
        self.horizontalHeader().setHighlightSections(False)
        self.horizontalHeader().setMinimumSectionSize(36)
        self.verticalHeader().hide()
        self.setShowGrid(False)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setTabKeyNavigation(False)
        self.setHorizontalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fit the row heights once the columns have their widths."""
        super().resizeEvent(event)
        if self.wordWrap():
            QTimer.singleShot(0, self, self.resizeRowsToContents)

    def setWordWrap(self, on: bool) -> None:
        """Show long cells on several lines, with sufficient row height."""
        super().setWordWrap(on)
        self._wraps = on

    def sizeHintForRow(self, row: int) -> int:
        """Return the height of a row with all lines of its cells.

        Qt breaks lines for the whole width of a cell but paints within the style sheet's padding: a
        word that barely fits would not be painted.
        """
        high = super().sizeHintForRow(row)
        if not self._wraps:
            return high
        metrics = self.fontMetrics()
        for column in range(self.columnCount()):
            item = self.item(row, column)
            room = self.columnWidth(column) - _AROUND_PX
            if item is None or room <= 0 or metrics.horizontalAdvance(item.text()) <= room:
                continue
            box = QRect(0, 0, room, _HIGH_PX)
            needed = metrics.boundingRect(box, Qt.TextFlag.TextWordWrap, item.text()).height()
            high = max(high, needed + _ABOVE_PX)
        return high

    def fit_columns(self, *stretched: int) -> None:
        """Make columns as wide as their cells; those that stretch share the remaining width."""
        header = self.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        for column in stretched:
            header.setSectionResizeMode(column, QHeaderView.ResizeMode.Stretch)

    def show_words(
        self, row: int, words: Sequence[str], colours: Mapping[int, str] | None = None
    ) -> None:
        """Show a row; `colours`: of the theme by name, by column; others are that of text."""
        for column, word in enumerate(words):
            self._write(row, column, word, (colours or {}).get(column, "text"))

    def right_heads(self, columns: Iterable[int]) -> None:
        for column in columns:
            head = self.horizontalHeaderItem(column)
            if head is not None:
                head.setTextAlignment(RIGHT)

    def show_digits(self, row: int, columns: Iterable[int], pixels: int) -> None:
        """Write cells at the right, in digits of equal width."""
        for column in columns:
            self._cell(row, column).setFont(digit_font(pixels, bold=False))
            self._cell(row, column).setTextAlignment(RIGHT)

    def cells(self, row: int) -> tuple[str, ...]:
        return tuple(self._cell(row, column).text() for column in range(self.columnCount()))

    def _cell(self, row: int, column: int) -> QTableWidgetItem:
        item = self.item(row, column)
        if item is None:
            item = QTableWidgetItem()
            self.setItem(row, column, item)
        return item

    def _paint(self) -> None:
        delegate = self.itemDelegate()
        if isinstance(delegate, ColouredRow):
            delegate.theme = self._theme
        self.blockSignals(True)
        for row in range(self.rowCount()):
            for column in range(self.columnCount()):
                item = self.item(row, column)
                if item is not None:
                    item.setForeground(QColor(self._theme.colour(item.data(_COLOUR) or "text")))
        self.blockSignals(False)
        self.viewport().update()

    def _write(self, row: int, column: int, text: str, colour: str = "text") -> None:
        item = self._cell(row, column)
        if item.text() != text:
            item.setText(text)
            item.setToolTip(literal(text))
        item.setData(_COLOUR, colour)
        item.setForeground(QColor(self._theme.colour(colour)))


_ROW_PX = 28


class NumberTable(DataTable):
    """A small table of numbers without horizontal scrolling."""

    def __init__(
        self,
        name: str,
        columns: Sequence[tuple[str, str]],
        *,
        whole: bool = True,
        font: QFont | None = None,
    ) -> None:
        super().__init__(name, columns, font=font or digit_font(15, bold=False))
        self._whole = whole
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        # Names are cut before numbers.
        self.fit_columns(0)
        self.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.setWordWrap(False)

    def show_rows(self, rows: Sequence[Sequence[str]]) -> None:
        self.setRowCount(len(rows))
        for row, words in enumerate(rows):
            self.show_words(row, words)
        if self._whole:
            head = self.horizontalHeader().sizeHint().height()
            self.setFixedHeight(head + _ROW_PX * len(rows) + 6)


def panel(layout: QVBoxLayout | QGridLayout) -> QFrame:
    frame = QFrame()
    frame.setProperty("role", "panel")
    layout.setContentsMargins(10, 6, 10, 6)
    frame.setLayout(layout)
    return frame


def scrolled(content: QWidget) -> QScrollArea:
    """Return an area that scrolls up and down where its content is higher."""
    area = QScrollArea()
    area.setWidgetResizable(True)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    area.setWidget(content)
    return area


def stacked(*widgets: QWidget) -> QVBoxLayout:
    """Return a layout of vertically stacked widgets of equal height."""
    layout = vbox(spacing=4)
    for widget in widgets:
        layout.addWidget(widget, 1)
    return layout


def sentence_label(
    name: str, pixels: int, text: str = "", *, role: str = "", middle: bool = False
) -> PlainLabel:
    """Return a label for running text that wraps and requests no additional width.

    `role`: of the styles. `middle`: at half the height of its place instead of the top.
    """
    label = dressed(PlainLabel(text), name, font=text_font(pixels), role=role)
    label.setWordWrap(True)
    if not middle:
        label.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop)
    label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
    return label


def value_label(name: str, tip: str) -> QLabel:
    """Return a label for a number to the right of its caption."""
    label = dressed(PlainLabel("–"), name, tip, font=digit_font(13))
    label.setAlignment(RIGHT)
    return label
