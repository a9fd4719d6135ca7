from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy

from ocmm_core.calibration.guided import Step
from ocmm_gui.kit import Mark, Painted, fitted, paint_mark, said_word, text_font, tr

_ROW_PX, _MARK_PX = 66.0, 30.0
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter


class Rail(Painted):
    """One row per step: mark, title and count."""

    def __init__(self) -> None:
        super().__init__(tr("Steps"), (180, round(5 * _ROW_PX)), (140, 160))
        self._steps: tuple[Step, ...] = ()
        self._current = 0
        self._ended = False
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Expanding)

    def show_steps(self, steps: Sequence[Step], current: int, *, ended: bool) -> None:
        """Show the steps; ``ended`` marks all of them as done."""
        shown = (tuple(steps), current, ended)
        if shown != (self._steps, self._current, self._ended):
            self._steps, self._current, self._ended = shown
            step = steps[current]
            self.setAccessibleDescription(
                tr("Step {current} of {count}: {title}").format(
                    current=current + 1, count=len(steps), title=said_word(step.title)
                )
            )
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        theme = self._theme
        row = min(_ROW_PX, self.height() / max(len(self._steps), 1))
        for index, step in enumerate(self._steps):
            done = self._ended or index < self._current
            current = index == self._current and not self._ended
            top = index * row
            box = QRectF(3.0, top + 0.5 * (row - _MARK_PX), _MARK_PX, _MARK_PX)
            if index:
                painter.setPen(QPen(QColor(theme.border), 2.0))
                x = box.center().x()
                above = box.top() - (row - _MARK_PX) + 3.0
                painter.drawLine(QPointF(x, above), QPointF(x, box.top() - 3.0))
            colour = theme.good if done else theme.accent if current else theme.muted
            mark = Mark.GOOD if done else Mark.ACTIVE if current else Mark.OPEN
            paint_mark(painter, mark, box, colour, theme.background)
            text = QRectF(box.right() + 10.0, top, self.width() - box.right() - 12.0, row)
            title = f"{index + 1}  {said_word(step.title)}"
            painter.setFont(fitted(text_font(17, bold=current), title, text.width(), 26.0, 17))
            painter.setPen(QColor(theme.text if current or done else theme.muted))
            if step.wanted:
                head = QRectF(text.left(), text.center().y() - 25.0, text.width(), 26.0)
                painter.drawText(head, _LEFT, title)
                painter.setFont(text_font(14))
                painter.setPen(QColor(theme.muted))
                count = QRectF(text.left() + 18.0, text.center().y() + 1.0, text.width(), 20.0)
                painter.drawText(
                    count,
                    _LEFT,
                    tr("{done} of {wanted}").format(done=step.done, wanted=step.wanted),
                )
            else:
                painter.drawText(text, _LEFT, title)
