"""An uncertainty budget as a table and as bars."""

from __future__ import annotations

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPaintEvent, QPen

from ocmm_core.tolerances.uncertainty import Budget, BudgetRow
from ocmm_gui.kit import (
    NumberTable,
    PaintedWidget,
    digit_font,
    ink,
    later,
    literal,
    localised,
    text_font,
    tr,
    tr_all,
)

_COLUMNS = (
    (later("Source"), later("of the uncertainty")),
    (
        later("Kind"),
        later("A: from the observations of this job; B: from other sources; distribution"),
    ),
    ("u, µm", later("standard uncertainty contributed to the result; m° for angles")),
    (later("Share"), later("of the variance")),
)
_ROW_PX, _LINE_PX = 26.0, 23
_LEAST_SHARE, _MOST_ROWS = 1e-4, 9
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


class BudgetTable(NumberTable):
    """The sources, greatest first."""

    def __init__(self) -> None:
        super().__init__(
            tr("Uncertainty budget"), tr_all(_COLUMNS), whole=False, font=text_font(13)
        )
        self.verticalHeader().setDefaultSectionSize(_LINE_PX)
        self.setMinimumHeight(round(4.5 * _LINE_PX))
        self.right_heads((2, 3))

    def show_budget(self, budget: Budget | None) -> None:
        """Show the sources of one result; None hides the table."""
        rows = shown_rows(budget)
        self.setVisible(bool(rows))
        # Rest of the height for the bars.
        self.setMaximumHeight(round((len(rows) + 1.6) * _LINE_PX))
        self.show_rows(
            [
                (row.name, f"{row.kind}, {row.distribution}",
                 localised(f"{1e3 * row.standard:.2f}"),
                 f"{100.0 * row.share:.0f} %")
                for row in rows
            ]
        )  # fmt: skip
        for line, row in enumerate(rows):
            self._cell(line, 0).setToolTip(literal(row.origin))
            # Words in the font of digits would not fit into the narrowest window.
            for column in (0, 1):
                self._cell(line, column).setFont(text_font(13))
            for column in (2, 3):
                cell = self._cell(line, column)
                cell.setFont(digit_font(13, bold=False))
                cell.setTextAlignment(_RIGHT)


def shown_rows(budget: Budget | None) -> tuple[BudgetRow, ...]:
    """Return the sources that fit on a screen, greatest first."""
    if budget is None:
        return ()
    return tuple(row for row in budget.rows if row.share >= _LEAST_SHARE)[:_MOST_ROWS]


class BudgetBars(PaintedWidget):
    """One bar per source, as long as its standard uncertainty; below them the total."""

    def __init__(self) -> None:
        super().__init__(tr("Uncertainty budget as bars"), (240, 150), (160, 60))
        self._budget: Budget | None = None

    def show_budget(self, budget: Budget | None) -> None:
        self._budget = budget
        self.setAccessibleDescription(
            "; ".join(f"{row.name} {100.0 * row.share:.0f} %" for row in shown_rows(budget))
        )
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        budget = self._budget
        if budget is None or budget.standard <= 0.0:
            return
        painter = self._painter()
        count = max(int(self.height() / _ROW_PX) - 1, 1)
        rows = [(row.name, row.standard, self._theme.accent) for row in shown_rows(budget)[:count]]
        rows.append((tr("Together, u"), budget.standard, self._theme.text))
        pitch = min(_ROW_PX * 1.3, self.height() / len(rows))
        painter.setFont(text_font(13))
        metrics = painter.fontMetrics()
        words = max(metrics.horizontalAdvance(name) for name, _, _ in rows) + 10.0
        painter.setFont(digit_font(12, bold=False))
        digits = painter.fontMetrics().horizontalAdvance("0000.00") + 8.0
        reach = max(u for _, u, _ in rows)
        room = max(self.width() - words - digits, 20.0)
        for index, (name, u, colour) in enumerate(rows):
            y = index * pitch
            ink(painter, QColor(self._theme.text), font=text_font(13))
            painter.drawText(QRectF(0.0, y, words, pitch), _LEFT, name)
            bar = QRectF(words, y + 0.2 * pitch, room * u / reach, 0.6 * pitch)
            painter.fillRect(bar, QColor(colour))
            painter.setFont(digit_font(12, bold=False))
            box = QRectF(self.width() - digits, y, digits, pitch)
            painter.drawText(box, _RIGHT, localised(f"{1e3 * u:.2f}"))
        painter.setPen(QPen(QColor(self._theme.border), 1.0))
        line = (len(rows) - 1) * pitch
        painter.drawLine(0, round(line), self.width(), round(line))
