"""Widgets that keep longer translations fully visible.

English fits, but for some buttons, and is painted by Qt. In other languages labels, buttons and
field hints first use a second line, if high enough, then smaller type, down to `LEAST` of their
size. Their minimum width follows, so that no page becomes wider than its window.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import PurePath

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QFont, QFontMetricsF, QPainter, QPaintEvent, QPalette
from PySide6.QtWidgets import (
    QLabel,
    QLineEdit,
    QPushButton,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionButton,
    QStyleOptionFrame,
    QStyleOptionViewItem,
    QStylePainter,
    QWidget,
)

from ocmm_gui.kit._marks import ink
from ocmm_gui.kit._texts import LANGUAGES, language_in_use, literal
from ocmm_gui.kit._theme import LEFT

LEAST = 0.7
"""Minimum relative type size: 14 px become 10."""

_STEP = 0.05
_SLACK_PX = 1.0
_INSET_PX = 2
_ITEM_PX = 8
_PADDING_PX = 3
_FOLDER_PX = 60


def is_longer() -> bool:
    """Return whether sentences may be longer than the pages were designed for."""
    return language_in_use() != LANGUAGES[0]


@dataclass(frozen=True, slots=True)
class FittedText:
    """Layout of a fully visible text."""

    text: str
    """With a line break for the second line."""
    font: QFont
    """Requested size or smaller."""


def fit_words(
    text: str, font: QFont, width: float, height: float, *, wraps: bool
) -> FittedText | None:
    """Return the layout of a text, largest type first, or None; unless ``wraps``, in two lines."""
    pixels = font.pixelSize() if font.pixelSize() > 0 else QFontMetricsF(font).height()
    texts = (text,) if wraps or "\n" in text else (text, halved(text, font))
    for step in range(round((1.0 - LEAST) / _STEP) + 1):
        smaller = QFont(font)
        smaller.setPixelSize(max(1, round(pixels * (1.0 - step * _STEP))))
        metrics = QFontMetricsF(smaller)
        for one in texts:
            wide, high = _needed(one, metrics, width, wraps=wraps)
            if wide <= width + _SLACK_PX and high <= height + _SLACK_PX:
                return FittedText(one, smaller)
    return None


def _needed(text: str, metrics: QFontMetricsF, width: float, *, wraps: bool) -> tuple[float, float]:
    if not wraps:
        lines = text.split("\n")
        wide = max(metrics.horizontalAdvance(line) for line in lines)
        return wide, metrics.height() + metrics.lineSpacing() * (len(lines) - 1)
    flags = Qt.TextFlag.TextWordWrap | Qt.AlignmentFlag.AlignLeft
    box = metrics.boundingRect(QRectF(0.0, 0.0, width, 1e5), flags, text)
    return box.width(), box.height()


def halved(text: str, font: QFont) -> str:
    """Return a text with a line break at its most even division, if any."""
    metrics = QFontMetricsF(font)
    # A key in brackets, and a number with its unit, stay together.
    places = [at for at, (one, two) in enumerate(pairwise(text)) if one != " " and two == " "]
    if not places:
        return text
    at = min(
        places,
        key=lambda at: max(
            metrics.horizontalAdvance(text[: at + 1]),
            metrics.horizontalAdvance(text[at + 1 :].lstrip()),
        ),
    )
    return f"{text[: at + 1]}\n{text[at + 1 :].lstrip()}"


def least_width(text: str, font: QFont, *, rows: int) -> float:
    """Return the minimum width of a text in smallest type, in one line or in two."""
    least = QFont(font)
    least.setPixelSize(max(1, round(LEAST * font.pixelSize())))
    metrics = QFontMetricsF(least)
    broken = halved(text, least) if rows > 1 and "\n" not in text else text
    return max(metrics.horizontalAdvance(line) for line in broken.split("\n")) + 1.0


class PlainLabel(QLabel):
    """A label with literal text and tool tip, fully visible in every language."""

    def __init__(self, text: str = "", parent: QWidget | None = None) -> None:
        super().__init__(text, parent, textFormat=Qt.TextFormat.PlainText)

    def setToolTip(self, text: str) -> None:
        super().setToolTip(literal(text))

    def tell(self, text: str) -> None:
        """Show a text; an empty one hides the label."""
        self.setText(text)
        self.setVisible(bool(text))

    def minimumSizeHint(self) -> QSize:
        hint = super().minimumSizeHint()
        if not is_longer() or self.wordWrap() or not self.text():
            return hint
        full = max(self.fontMetrics().horizontalAdvance(line) for line in self.text().split("\n"))
        need = least_width(self.text(), self.font(), rows=1)
        return QSize(min(hint.width(), round(hint.width() - full + need) + 1), hint.height())

    def fitted(self) -> FittedText | None:
        """Return the layout of the text; None if it does not fit."""
        room = self.contentsRect()
        return fit_words(
            self.text(), self.font(), room.width(), room.height(), wraps=self.wordWrap()
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        found = self.fitted() if is_longer() and self.text() else None
        if found is None or (found.text == self.text() and found.font == self.font()):
            super().paintEvent(event)
            return
        painter = QPainter(self)
        painter.setFont(found.font)
        flags = self.alignment() | (Qt.TextFlag.TextWordWrap if self.wordWrap() else 0)
        self.style().drawItemText(
            painter, self.contentsRect(), int(flags), self.palette(), self.isEnabled(),
            found.text, self.foregroundRole(),
        )  # fmt: skip


class NarrowButton(QPushButton):
    """A button with fully visible text in every language."""

    def minimumSizeHint(self) -> QSize:
        hint = super().minimumSizeHint()
        if not is_longer() or not self.text():
            return hint
        full = max(self.fontMetrics().horizontalAdvance(line) for line in self.text().split("\n"))
        rows = 2 if self.minimumHeight() >= 2.3 * LEAST * self.fontMetrics().height() else 1
        need = least_width(self.text(), self.font(), rows=rows)
        return QSize(min(hint.width(), round(hint.width() - full + need) + 1), hint.height())

    def fitted(self) -> FittedText | None:
        """Return the layout of the text; None if it does not fit."""
        room, font = self._room(), QFont(self.font())
        # Bold by style sheet.
        font.setBold(font.bold() or self.property("role") == "primary")
        return fit_words(self.text(), font, room.width(), room.height(), wraps=False)

    def paintEvent(self, event: QPaintEvent) -> None:
        found = self.fitted() if self.text() else None
        if found is None or not (is_longer() or self._is_cut()):
            super().paintEvent(event)
            return
        option = QStyleOptionButton()
        self.initStyleOption(option)
        painter = QStylePainter(self)
        painter.drawControl(QStyle.ControlElement.CE_PushButtonBevel, option)
        # Not by the style: its sheet would override the font.
        ink(painter, self.palette().color(self._role()), font=found.font)
        flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextShowMnemonic
        painter.drawText(self._room(), flags, found.text)

    def _is_cut(self) -> bool:
        """Return whether the style would cut the text, which it keeps out of the padding."""
        wide = self.fontMetrics().horizontalAdvance(self.text())
        return wide > self._room().width() - 2 * _PADDING_PX

    def _role(self) -> QPalette.ColorRole:
        filled = self.isChecked() or self.property("role") == "primary"
        if filled and self.isEnabled():
            return QPalette.ColorRole.HighlightedText
        return QPalette.ColorRole.ButtonText

    def _room(self) -> QRect:
        option = QStyleOptionButton()
        self.initStyleOption(option)
        room = self.style().subElementRect(QStyle.SubElement.SE_PushButtonContents, option, self)
        # Use part of the padding before smaller type.
        return room.adjusted(-_PADDING_PX, 0, _PADDING_PX, 0)


class NarrowItems(QStyledItemDelegate):
    """List items with fully visible text in every language."""

    def initStyleOption(
        self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        """Select the type that fits."""
        super().initStyleOption(option, index)
        room = option.rect
        text = option.text
        if is_longer() and text:
            # With non-breaking spaces: an item has one line.
            found = fit_words(
                text.replace(" ", "\N{NO-BREAK SPACE}"),
                option.font,
                room.width() - _ITEM_PX,
                room.height(),
                wraps=False,
            )
            if found is not None:
                option.font = found.font


class HintField(QLineEdit):
    """A field with fully visible hint in every language."""

    def __init__(self, text: str = "") -> None:
        super().__init__(text)
        self._hint = ""

    def setPlaceholderText(self, text: str) -> None:
        """Set the hint; Qt would cut it at the end of the field."""
        self._hint = text
        self.update()

    def placeholderText(self) -> str:
        return self._hint

    def fitted(self) -> FittedText | None:
        """Return the layout of the hint; None if it does not fit."""
        room = self._room()
        return fit_words(self._hint, self.font(), room.width(), room.height(), wraps=True)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the field, with its hint if empty; of a path the file name first."""
        if self._shows_file():
            self._paint_file()
            return
        super().paintEvent(event)
        if self.text() or not self._hint:
            return
        room = self._room()
        short = self.fontMetrics().elidedText(self._hint, Qt.TextElideMode.ElideRight, room.width())
        found = self.fitted() or FittedText(short, self.font())
        painter = QPainter(self)
        ink(painter, self.palette().color(QPalette.ColorRole.PlaceholderText), font=found.font)
        painter.drawText(room, LEFT | Qt.TextFlag.TextWordWrap, found.text)

    def _shows_file(self) -> bool:
        """Return whether it shows a path and is not being edited."""
        text = self.text()
        absolute = text.startswith(("/", "\\\\")) or text[1:3] in (":\\", ":/")
        return absolute and not self.hasFocus() and bool(PurePath(text).name)

    def _paint_file(self) -> None:
        """Paint the file name, then its folder: the name is more informative."""
        option = QStyleOptionFrame()
        self.initStyleOption(option)
        painter = QStylePainter(self)
        painter.drawPrimitive(QStyle.PrimitiveElement.PE_PanelLineEdit, option)
        painter.setFont(self.font())
        room, metrics, path = self._room(), self.fontMetrics(), PurePath(self.text())
        elide = Qt.TextElideMode.ElideLeft
        painter.setPen(self.palette().color(QPalette.ColorRole.Text))
        painter.drawText(room, LEFT, metrics.elidedText(path.name, elide, room.width()))
        rest = room.adjusted(metrics.horizontalAdvance(f"{path.name}    "), 0, 0, 0)
        if rest.width() >= _FOLDER_PX:
            painter.setPen(self.palette().color(QPalette.ColorRole.PlaceholderText))
            painter.drawText(rest, LEFT, metrics.elidedText(str(path.parent), elide, rest.width()))

    def _room(self) -> QRect:
        option = QStyleOptionFrame()
        self.initStyleOption(option)
        room = self.style().subElementRect(QStyle.SubElement.SE_LineEditContents, option, self)
        return room.adjusted(_INSET_PX, 0, -_INSET_PX, 0)
