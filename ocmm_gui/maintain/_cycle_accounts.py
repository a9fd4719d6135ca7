"""What became of the bus cycles: counts and shares that add up."""

from __future__ import annotations

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent

from ocmm_core.fieldbus.report import BusReport, shares, unaccounted
from ocmm_gui.kit import Painted, digit_font, later, localised, text_font, tr

_ROW_PX = 19.0
_BAR_PX = 12.0
_NAMES = (later("good"), later("late"), later("lost"), later("bad"))
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


class CycleAccounts(Painted):
    """A bar of the four verdicts, a line for each, and their sum."""

    def __init__(self) -> None:
        high, least = (round(_BAR_PX + rows * _ROW_PX) for rows in (7.5, 6.6))
        super().__init__(tr("Bus cycles"), (240, high), (220, least))
        self._counts = (0, 0, 0, 0)
        self._elapsed = 0
        self._gap = 0

    def show_report(self, report: BusReport) -> None:
        """Show the counters of a report."""
        self._counts = (report.good, report.late, report.lost, report.bad)
        self._elapsed, self._gap = report.elapsed, unaccounted(report)
        self.setAccessibleDescription("; ".join(" ".join(row) for row in self.rows()))
        self.update()

    def rows(self) -> tuple[tuple[str, str, str], ...]:
        """Return name, count and share of every line."""
        lines = [
            (tr(name), str(count), localised(f"{share:.3f} %"))
            for name, count, share in zip(_NAMES, self._counts, shares(self._counts), strict=True)
        ]
        if self._gap:
            lines.append((tr("NO VERDICT"), str(self._gap), tr("wrong")))
        return (*lines, (tr("elapsed"), str(self._elapsed), "100.000 %" if self._elapsed else "–"))

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the bar and the lines."""
        painter = QPainter(self)
        theme = self._theme
        painter.setFont(text_font(13))
        painter.setPen(QColor(theme.muted))
        painter.drawText(QRectF(0.0, 0.0, self.width(), _ROW_PX), _LEFT, tr("Bus cycles"))
        colours = (theme.good, theme.warn, theme.accent, theme.bad)
        self._paint_bar(painter, colours)
        top = _ROW_PX + _BAR_PX + 5.0
        rows = self.rows()
        pitch = min(max((self.height() - top) / len(rows), 0.8 * _ROW_PX), 1.6 * _ROW_PX)
        for index, (name, count, share) in enumerate(rows):
            line = QRectF(0.0, top + index * pitch, self.width(), pitch)
            known = index < len(colours)
            if known:
                square = QRectF(0.0, line.center().y() - 5.0, 10.0, 10.0)
                painter.fillRect(square, QColor(colours[index]))
            # What no verdict accounts for stands between the verdicts and the sum.
            wrong = not known and index < len(rows) - 1
            painter.setPen(QColor(theme.bad if wrong else theme.text))
            painter.setFont(text_font(13, bold=not known))
            painter.drawText(line.adjusted(16.0, 0.0, 0.0, 0.0), _LEFT, name)
            painter.setFont(digit_font(13, bold=not known))
            painter.drawText(line.adjusted(0.0, 0.0, -84.0, 0.0), _RIGHT, count)
            painter.drawText(line, _RIGHT, share)

    def _paint_bar(self, painter: QPainter, colours: tuple[str, ...]) -> None:
        bar = QRectF(0.0, _ROW_PX + 1.0, self.width(), _BAR_PX)
        painter.fillRect(bar, QColor(self._theme.border))
        total = sum(self._counts)
        if not total:
            return
        # Whatever happened at all is seen: two pixels at least.
        widths = [max(bar.width() * count / total, 2.0) if count else 0.0 for count in self._counts]
        widths[widths.index(max(widths))] -= sum(widths) - bar.width()
        left = 0.0
        for width, colour in zip(widths, colours, strict=True):
            painter.fillRect(QRectF(left, bar.top(), width, bar.height()), QColor(colour))
            left += width
