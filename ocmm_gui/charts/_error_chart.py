"""Errors of checks between their limits, as a plot."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen

from ocmm_core.calibration.records import Check
from ocmm_gui.charts._plot import Plot
from ocmm_gui.kit import digit_font, localised, said_word, text_font, tr

_SCALE_PX = 58.0


class ErrorChart(Plot):
    """Errors with their uncertainty between the limits, per check."""

    def __init__(self, *, whole_names: bool = False) -> None:
        super().__init__(tr("Errors, µm"))
        self._whole_names = whole_names
        self._foot = 62.0 if whole_names else 24.0
        self._checks: tuple[Check, ...] = ()
        self._largest = 0

    def show_checks(self, checks: Sequence[Check], largest: int) -> None:
        """Show all checks; name the one nearest to its limit."""
        self._checks, self._largest = tuple(checks), largest
        worst = checks[largest]
        self._say(
            tr("largest: {error} ({name})").format(
                error=check_words(worst), name=said_word(worst.name)
            )
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        box = self._paint_head(painter).adjusted(_SCALE_PX, 4.0, -4.0, -self._foot)
        theme, checks = self._theme, self._checks
        if not checks:
            return
        reach = 1.1 * max(max(abs(one.error_mm) + one.expanded_mm, one.limit_mm) for one in checks)
        pitch = box.width() / len(checks)

        def y(value: float) -> float:
            return box.center().y() - 0.5 * box.height() * value / reach

        painter.setPen(QPen(QColor(theme.border), max(theme.border_px, 1)))
        painter.setBrush(QColor(theme.background))
        painter.drawRect(box)
        for index, one in enumerate(checks):
            low = 0.0 if is_amount(one) else -one.limit_mm
            top = y(one.limit_mm)
            band = QRectF(box.left() + index * pitch, top, pitch, y(low) - top)
            painter.fillRect(band, QColor(theme.zone_good))
            painter.setPen(QPen(QColor(theme.text), 1.5))
            painter.drawLine(band.topLeft(), band.topRight())
            painter.drawLine(band.bottomLeft(), band.bottomRight())
        painter.setPen(QPen(QColor(theme.text), 1.0, Qt.PenStyle.DotLine))
        painter.drawLine(QPointF(box.left(), y(0.0)), QPointF(box.right(), y(0.0)))
        for index, one in enumerate(checks):
            x = box.left() + (index + 0.5) * pitch
            colour = QColor(theme.text)
            if abs(one.error_mm) + one.expanded_mm > one.limit_mm:
                colour = QColor(theme.bad if abs(one.error_mm) > one.limit_mm else theme.warn)
            if index == self._largest:
                painter.setPen(QPen(QColor(theme.accent), 3.0))
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.drawEllipse(QPointF(x, y(one.error_mm)), 9.0, 9.0)
            painter.setPen(QPen(colour, 2.0))
            painter.drawLine(
                QPointF(x, y(one.error_mm - one.expanded_mm)),
                QPointF(x, y(one.error_mm + one.expanded_mm)),
            )
            painter.setBrush(colour)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.drawEllipse(QPointF(x, y(one.error_mm)), 4.0, 4.0)
        painter.setFont(digit_font(13, bold=False))
        painter.setPen(QColor(theme.muted))
        limit = max(one.limit_mm for one in checks)
        for value in (limit, 0.0, -limit):
            place = QRectF(0.0, y(value) - 10.0, _SCALE_PX - 6.0, 20.0)
            right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
            painter.drawText(place, right, f"{1e3 * value:+.0f}" if value else "0")
        self._paint_groups(painter, box, pitch)

    def _paint_groups(self, painter: QPainter, box: QRectF, pitch: float) -> None:
        painter.setFont(text_font(13))
        begin = 0
        names = [group_of(one.name) for one in self._checks]
        for index in range(1, len(names) + 1):
            if index < len(names) and names[index] == names[begin]:
                continue
            painter.setPen(QPen(QColor(self._theme.border), 1.0))
            x = box.left() + index * pitch
            painter.drawLine(QPointF(x, box.top()), QPointF(x, box.bottom() + 6.0))
            place = QRectF(
                box.left() + begin * pitch, box.bottom() + 2.0, (index - begin) * pitch,
                self._foot - 4.0,
            )  # fmt: skip
            painter.setPen(QColor(self._theme.muted))
            if self._whole_names:
                wrapped = Qt.AlignmentFlag.AlignHCenter | Qt.TextFlag.TextWordWrap
                painter.drawText(place.adjusted(3.0, 0.0, -3.0, 0.0), wrapped, names[begin])
                begin = index
                continue
            # Ends of names are more specific than their starts: "space diagonal 2".
            text = names[begin]
            while painter.fontMetrics().horizontalAdvance(text) > place.width() and text:
                text = text.partition(" ")[2]
            painter.drawText(place, Qt.AlignmentFlag.AlignCenter, text)
            begin = index


def is_amount(check: Check) -> bool:
    """Return whether a check has one limit: form and scatter are never negative."""
    return check.certified_mm == 0.0


def check_words(check: Check) -> str:
    """Return error, U if known, and limit of a check."""
    error, limit = f"{1e3 * check.error_mm:+.1f} µm", f"{1e3 * check.limit_mm:.1f} µm"
    if is_amount(check):
        error = error.removeprefix("+")
    else:
        limit = f"± {limit}"
    u = tr("U {u:.1f} µm (k = 2), ").format(u=1e3 * check.expanded_mm)
    return tr("{error}, {u}limit {limit}").format(
        error=localised(error), u=u if check.expanded_mm else "", limit=localised(limit)
    )


def group_of(name: str) -> str:
    """Return the line or sphere of a check: the text before the comma."""
    return name.partition(",")[0]
