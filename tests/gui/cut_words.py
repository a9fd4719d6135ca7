"""Texts cut off in lists, tables, their heads, choices, and self-painting widgets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from PySide6.QtCore import QModelIndex, QPoint, QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QFontMetrics, QFontMetricsF, QPainter
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QHeaderView,
    QLabel,
    QLineEdit,
    QListView,
    QPlainTextEdit,
    QPushButton,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionComboBox,
    QStyleOptionFrame,
    QStyleOptionViewItem,
    QTableView,
    QWidget,
)

_SLACK_PX = 2
_OF_HEIGHT = 0.15
"""Permitted overhang of a line: accents and tails are smaller than the font's metrics."""
_MOST_ROWS = 60
_HEAD_PADDING_PX = 8
"""As in the style sheet of the themes."""
_WRAP = int(Qt.TextFlag.TextWordWrap)


def shown_widgets(window: QWidget) -> Iterator[QWidget]:
    """Yield the widgets of a window that are seen, parents first.

    Only children of visible widgets are visited: most widgets are on hidden pages.
    """
    own = Qt.FindChildOption.FindDirectChildrenOnly
    left = window.findChildren(QWidget, options=own)[::-1]
    while left:
        widget = left.pop()
        if not widget.isVisible():
            continue
        if not widget.visibleRegion().isEmpty():
            yield widget
        left += widget.findChildren(QWidget, options=own)[::-1]


def cut_words(window: QWidget) -> Iterator[str]:
    """Yield the cut texts of a window, in addition to labels, buttons and fields of Qt."""
    for widget in shown_widgets(window):
        if isinstance(widget, QHeaderView):
            yield from _heads(widget)
        elif isinstance(widget, QTableView | QListView):
            yield from _cells(widget)
        elif isinstance(widget, QComboBox):
            yield from _choices(widget)
        elif isinstance(widget, QLineEdit):
            yield from _low(widget)
        elif isinstance(widget, QPlainTextEdit) and not widget.toPlainText():
            yield from _hint(widget)
    yield from _painted(window)


def _heads(header: QHeaderView) -> Iterator[str]:
    if header.orientation() is not Qt.Orientation.Horizontal:
        return
    model, role = header.model(), Qt.ItemDataRole.FontRole
    for column in range(header.count()):
        text = str(model.headerData(column, header.orientation()) or "")
        if header.isSectionHidden(column) or not text:
            continue
        # Not by the hint of the section: Qt has it for bold letters.
        font = model.headerData(column, header.orientation(), role) or header.font()
        need = QFontMetrics(font).horizontalAdvance(text)
        has = header.sectionSize(column) - _HEAD_PADDING_PX
        if need > has:
            yield f"head {text!r} needs {need} px, has {has}"


def _cells(view: QTableView | QListView) -> Iterator[str]:
    model = view.model()
    if model is None:
        return
    room = view.viewport().rect()
    for row in range(min(model.rowCount(), _MOST_ROWS)):
        for column in range(model.columnCount() if isinstance(view, QTableView) else 1):
            index = model.index(row, column)
            place = view.visualRect(index)
            if place.intersects(room) and not _is_painted(view.itemDelegateForIndex(index)):
                yield from _cell(view, index, place)


def _cell(view: QAbstractItemView, index: QModelIndex, place: QRect) -> Iterator[str]:
    option = QStyleOptionViewItem()
    view.initViewItemOption(option)
    option.rect = place
    delegate = view.itemDelegateForIndex(index)
    assert isinstance(delegate, QStyledItemDelegate)
    delegate.initStyleOption(option, index)
    if not option.text:
        return
    style = view.style()
    room = style.subElementRect(QStyle.SubElement.SE_ItemViewItemText, option, view)
    margin = style.pixelMetric(QStyle.PixelMetric.PM_FocusFrameHMargin, option, view) + 1
    width, metrics = room.width() - 2 * margin, QFontMetrics(option.font)
    text = option.text.replace("\N{LINE SEPARATOR}", "\n")
    if option.features & QStyleOptionViewItem.ViewItemFeature.WrapText:
        box = metrics.boundingRect(QRect(0, 0, width, 1 << 14), _WRAP, text)
        high, wide = box.height(), box.width()
    else:
        lines = text.split("\n")
        wide = max(metrics.horizontalAdvance(line) for line in lines)
        high = metrics.height() * len(lines)
    if wide > width + 1:
        yield f"cell {text!r} needs {wide} px, has {width}"
    if high > room.height() + _SLACK_PX:
        yield f"cell {text!r} needs {high} px of height, has {room.height()}"


def _choices(choice: QComboBox) -> Iterator[str]:
    option = QStyleOptionComboBox()
    choice.initStyleOption(option)
    room = choice.style().subControlRect(
        QStyle.ComplexControl.CC_ComboBox, option, QStyle.SubControl.SC_ComboBoxEditField, choice
    )
    high = choice.fontMetrics().height() * (1.0 - _OF_HEIGHT)
    if high > room.height() + 1:
        yield f"choice {choice.accessibleName()!r} needs {high:.0f} px, has {room.height()}"
    for number in range(choice.count()):
        text = choice.itemText(number)
        need = choice.fontMetrics().horizontalAdvance(text)
        if need > room.width() - 2 + _SLACK_PX:
            yield f"choice {text!r} needs {need} px, has {room.width() - 2}"


def _low(field: QLineEdit) -> Iterator[str]:
    """Give a field that is too low for its line: a layout without room squeezes it."""
    option = QStyleOptionFrame()
    field.initStyleOption(option)
    room = field.style().subElementRect(QStyle.SubElement.SE_LineEditContents, option, field)
    need = field.fontMetrics().height() * (1.0 - _OF_HEIGHT)
    if need > room.height() + 1:
        yield f"field {field.accessibleName()!r} needs {need:.0f} px, has {room.height()}"


def _hint(field: QPlainTextEdit) -> Iterator[str]:
    text = field.placeholderText()
    room = field.viewport().rect().adjusted(4, 4, -4, 0)
    box = field.fontMetrics().boundingRect(room, _WRAP, text)
    if text and (box.height() > room.height() or box.width() > room.width()):
        yield f"hint {text!r} needs {box.width()} x {box.height()} px"


def _is_painted(delegate: object) -> bool:
    """Return whether rows are painted by a function of ours that does not ask the style."""
    return getattr(delegate, "paints_words", False) is True


def _painted(window: QWidget) -> Iterator[str]:
    """Give the painted words that do not fit."""
    for name, found in _repainted(window):
        yield from (
            f"{name}: {fault}" for fault in dict.fromkeys(one.fault for one in found) if fault
        )


def painted_words(window: QWidget) -> Iterator[tuple[str, str]]:
    """Yield the words painted by widgets, with the name of their class."""
    for name, found in _repainted(window):
        yield from ((name, one.text) for one in found)


def _repainted(window: QWidget) -> Iterator[tuple[str, list[PaintedWords]]]:
    """Paint everything that paints itself once more."""
    for widget in shown_widgets(window):
        if isinstance(widget, QAbstractItemView):
            if not _is_painted(widget.itemDelegate()):
                continue
            widget, name = widget.viewport(), type(widget).__name__
        elif _paints_itself(widget):
            name = type(widget).__name__
        else:
            continue
        with watched_words() as found:
            widget.repaint()
        yield name, found


def _paints_itself(widget: QWidget) -> bool:
    if isinstance(widget, QLabel | QPushButton | QLineEdit):
        return False
    return any("paintEvent" in vars(kind) for kind in type(widget).__mro__ if _is_ours(kind))


def _is_ours(kind: type) -> bool:
    return kind.__module__.startswith("ocmm_gui")


@dataclass(frozen=True, slots=True)
class PaintedWords:
    """A painted text, and its fault; empty if it is whole."""

    text: str
    fault: str


@contextmanager
def watched_words() -> Iterator[list[PaintedWords]]:
    """Give a list of all words that are painted by our own functions."""
    found: list[PaintedWords] = []
    paint = QPainter.drawText

    def watch(painter: QPainter, *given: Any) -> Any:
        text = next(one for one in reversed(given) if isinstance(one, str))
        if text.strip():
            found.append(PaintedWords(text, _fault(painter, given, text)))
        return paint(painter, *given)

    QPainter.drawText = watch  # type: ignore[method-assign, assignment] # it paints as before
    try:
        yield found
    finally:
        QPainter.drawText = paint  # type: ignore[method-assign]


def _fault(painter: QPainter, given: Sequence[Any], text: str) -> str:
    """Return the overhang of a text, or its shortening to fit into its place."""
    if text.endswith("…") and len(text) > 1:
        return f"{text!r} was shortened"
    metrics, place = QFontMetricsF(painter.font()), given[0]
    slack = _SLACK_PX + _OF_HEIGHT * metrics.height()
    if isinstance(place, QRect | QRectF):
        room, flags = QRectF(place), 0 if isinstance(given[1], str) else int(given[1])
        box = metrics.boundingRect(room, flags, text)
        if box.width() > room.width() + _SLACK_PX or box.height() > room.height() + 2.0 * slack:
            return (
                f"{text!r} needs {box.width():.0f} x {box.height():.0f} px, has "
                f"{room.width():.0f} x {room.height():.0f}"
            )
    else:
        x, y = (place.x(), place.y()) if isinstance(place, QPointF | QPoint) else given[:2]
        box = metrics.boundingRect(text).translated(x, y)
    device = painter.device()
    if not isinstance(device, QWidget):
        return ""
    whole = QRectF(device.rect()).adjusted(-slack, -slack, slack, slack)
    if whole.contains(painter.worldTransform().mapRect(box)):
        return ""
    return f"{text!r} stands outside of the picture"
