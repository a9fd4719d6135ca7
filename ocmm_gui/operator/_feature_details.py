"""Details of a feature: point dots, and further characteristics."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from ocmm_core.tolerances.decisions import CharacteristicResult
from ocmm_gui.kit import (
    DEFAULT_THEME,
    THEMES,
    Theme,
    digit_font,
    quantity,
    said_word,
    text_font,
    tr,
    verdict_colour,
)

_LINE_PX = 22.0


class PointDots(QWidget):
    """One dot per needed point, filled when recorded, and the count in digits."""

    def __init__(self) -> None:
        super().__init__()
        self._taken, self._needed = 0, 0
        self._theme = THEMES[DEFAULT_THEME]
        self.setAccessibleName(tr("Points"))
        self.setFixedHeight(30)

    def show_points(self, taken: int, needed: int) -> None:
        self._taken, self._needed = taken, needed
        self.setAccessibleDescription(
            tr("{taken} of %n points", "{taken} of 1 point", needed).format(taken=taken)
        )
        self.update()

    def set_theme(self, theme: Theme) -> None:
        self._theme = theme
        self.update()

    def sizeHint(self) -> QSize:
        return QSize(200, 30)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(digit_font(20))
        text = f"{self._taken} / {self._needed}"
        wide = painter.fontMetrics().horizontalAdvance(text)
        painter.setPen(QColor(self._theme.text))
        painter.drawText(
            self.rect(), Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter, text
        )
        total = max(self._needed, self._taken, 1)
        room = self.width() - wide - 16.0
        pitch = min(22.0, room / total)
        size = 0.68 * pitch
        for index in range(total):
            x = wide + 16.0 + index * pitch
            taken = index < self._taken
            extra = index >= self._needed
            painter.setPen(QColor(self._theme.muted if not taken else self._theme.accent))
            fill = self._theme.good if extra else self._theme.accent
            painter.setBrush(QColor(fill if taken else self._theme.panel))
            painter.drawEllipse(QRectF(x, 0.5 * (self.height() - size), size, size))


class CharacteristicList(QWidget):
    """Further characteristics of the feature, one line each."""

    def __init__(self) -> None:
        super().__init__()
        self._results: tuple[CharacteristicResult, ...] = ()
        self._theme = THEMES[DEFAULT_THEME]
        self.setAccessibleName(tr("Other characteristics of this feature"))
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Maximum)

    def show_results(self, results: tuple[CharacteristicResult, ...]) -> None:
        self._results = results
        self.setVisible(bool(results))
        self.updateGeometry()
        self.setAccessibleDescription(
            "; ".join(
                f"{r.name} {quantity(r, r.deviation, signed=True)} {said_word(r.verdict.value)}"
                for r in results
            )
        )
        self.update()

    def set_theme(self, theme: Theme) -> None:
        self._theme = theme
        self.update()

    def sizeHint(self) -> QSize:
        return QSize(200, round(_LINE_PX * (len(self._results) + 1)))

    def minimumSizeHint(self) -> QSize:
        return QSize(160, 0)

    def paintEvent(self, event: QPaintEvent) -> None:
        line = _LINE_PX
        if not self._results or self.height() < 2 * line:
            return
        painter = QPainter(self)
        rows = [(tr("Also"), tr("deviation"), self._theme.muted)]
        rows += [
            (r.name, f"{quantity(r, r.deviation, signed=True)}  {said_word(r.verdict.value)}",
             verdict_colour(self._theme, r.verdict))
            for r in self._results
        ]  # fmt: skip
        for index, (name, value, colour) in enumerate(rows[: int(self.height() / line)]):
            box = QRectF(0, index * line, self.width(), line)
            painter.setFont(text_font(13))
            painter.setPen(QColor(self._theme.text if index else self._theme.muted))
            painter.drawText(box, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter, name)
            painter.setFont(digit_font(13, bold=False))
            painter.setPen(QColor(colour))
            painter.drawText(
                box, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter, value
            )
