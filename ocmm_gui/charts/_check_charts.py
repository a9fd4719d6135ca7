"""Checks against their limits: errors, interim checks over time, and facts of a session."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen

from ocmm_core.acceptance import InterimChart, InterimWord
from ocmm_core.calibration.records import Check, VerificationRecord
from ocmm_gui.charts._plot import LevelLine, Plot, height_of, paint_levels
from ocmm_gui.kit import RIGHT, digit_font, fitted, ink, localised, said, said_word, text_font, tr

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
        self._show_message(
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
            return height_of(box, value, reach)

        ink(painter, QPen(QColor(theme.border), max(theme.border_px, 1)), QColor(theme.background))
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
                ink(painter, QPen(QColor(theme.accent), 3.0), Qt.BrushStyle.NoBrush)
                painter.drawEllipse(QPointF(x, y(one.error_mm)), 9.0, 9.0)
            painter.setPen(QPen(colour, 2.0))
            painter.drawLine(
                QPointF(x, y(one.error_mm - one.expanded_mm)),
                QPointF(x, y(one.error_mm + one.expanded_mm)),
            )
            ink(painter, Qt.PenStyle.NoPen, colour)
            painter.drawEllipse(QPointF(x, y(one.error_mm)), 4.0, 4.0)
        ink(painter, QColor(theme.muted), font=digit_font(13, bold=False))
        limit = max(one.limit_mm for one in checks)
        for value in (limit, 0.0, -limit):
            place = QRectF(0.0, y(value) - 10.0, _SCALE_PX - 6.0, 20.0)
            painter.drawText(place, RIGHT, f"{1e3 * value:+.0f}" if value else "0")
        self._paint_groups(painter, box, pitch)

    def _paint_groups(self, painter: QPainter, box: QRectF, pitch: float) -> None:
        painter.setFont(text_font(13))
        begin = 0
        names = [group_of(said_word(one.name)) for one in self._checks]
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
                place.adjust(3.0, 0.0, -3.0, 0.0)
                longest = max(names[begin].split(), key=len)
                painter.setFont(fitted(text_font(10), longest, place.width(), 18.0, 13))
                painter.drawText(place, wrapped, names[begin])
                begin = index
                continue
            # Ends of names are more specific than their starts: "space diagonal 2".
            text = names[begin]
            while (font := fitted(text_font(10), text, place.width(), 18.0, 13)).pixelSize() < 9:
                text = text.partition(" ")[2]
            painter.setFont(font)
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


_INTERIM_SCALE_PX, _FOOT_PX = 100.0, 24.0
_SIGMAS = 3.0


class InterimPlot(Plot):
    """One dot per check: round if good, otherwise square."""

    def __init__(self) -> None:
        super().__init__(tr("Interim checks, error in µm"))
        self._chart: InterimChart | None = None
        self._show_message(tr("no checks yet"))

    def show_chart(self, chart: InterimChart) -> None:
        self._chart = chart
        if not chart.points:
            self._show_message(tr("no checks yet"))
            return
        last = chart.points[-1]
        said = tr(
            "%n checks, last {error:+.1f} µm: {word}",
            "1 check, last {error:+.1f} µm: {word}",
            len(chart.points),
        ).format(error=1e3 * last.check.error_mm, word=said_word(last.word.value))
        self._show_message(f"{said_word(chart.doubt)}   {said}" if chart.doubt else said)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        box = self._paint_head(painter).adjusted(_INTERIM_SCALE_PX, 4.0, -8.0, -_FOOT_PX)
        chart, theme = self._chart, self._theme
        ink(painter, QPen(QColor(theme.border), max(theme.border_px, 1)), QColor(theme.background))
        painter.drawRect(box)
        if chart is None or not chart.points:
            return
        errors = [one.check.error_mm for one in chart.points]
        shown = [one for one in errors if math.isfinite(one)]
        limit = max(one.check.limit_mm for one in chart.points)
        reach = 1.1 * max([limit, *(abs(one) for one in shown)])

        def y(value: float) -> float:
            return height_of(box, value, reach)

        painter.fillRect(
            QRectF(box.left(), y(limit), box.width(), y(-limit) - y(limit)), QColor(theme.zone_good)
        )
        self._paint_levels(painter, box, chart, limit, y)
        self._paint_checks(painter, box, chart, y)
        ink(painter, QColor(theme.muted), font=text_font(12))
        foot = QRectF(box.left(), box.bottom() + 2.0, box.width(), _FOOT_PX - 2.0)
        centre = Qt.AlignmentFlag.AlignVCenter
        painter.drawText(foot, centre | Qt.AlignmentFlag.AlignLeft, chart.points[0].check.utc[:16])
        painter.drawText(
            foot, centre | Qt.AlignmentFlag.AlignRight, chart.points[-1].check.utc[:16]
        )

    def _paint_levels(
        self,
        painter: QPainter,
        box: QRectF,
        chart: InterimChart,
        limit: float,
        y: Callable[[float], float],
    ) -> None:  # fmt: skip
        levels = [(tr("limit"), limit, Qt.PenStyle.SolidLine)]
        levels += [(tr("limit"), -limit, Qt.PenStyle.SolidLine)]
        if math.isfinite(chart.centre):
            spread = _SIGMAS * chart.sigma
            levels += [
                (tr("centre"), chart.centre, Qt.PenStyle.DotLine),
                (tr("+3 s"), chart.centre + spread, Qt.PenStyle.DashLine),
                (tr("-3 s"), chart.centre - spread, Qt.PenStyle.DashLine),
            ]
        lines = [
            LevelLine(y(value), localised(f"{name} {1e3 * value:+.1f}"), style)
            for name, value, style in levels
        ]
        paint_levels(painter, box, lines, box.left() - 6.0, self._theme)

    def _paint_checks(
        self, painter: QPainter, box: QRectF, chart: InterimChart, y: Callable[[float], float]
    ) -> None:
        theme = self._theme
        pitch = box.width() / len(chart.points)
        colours = {
            InterimWord.GOOD: theme.good, InterimWord.LEARNING: theme.accent,
            InterimWord.REPEAT: theme.warn, InterimWord.STOP: theme.bad,
        }  # fmt: skip
        for index, one in enumerate(chart.points):
            x = box.left() + (index + 0.5) * pitch
            ink(painter, QPen(QColor(theme.text), 1.2), QColor(colours[one.word]))
            if not math.isfinite(one.check.error_mm):
                painter.drawText(QPointF(x - 4.0, box.bottom() - 4.0), "?")
            elif one.word in (InterimWord.GOOD, InterimWord.LEARNING):
                painter.drawEllipse(QPointF(x, y(one.check.error_mm)), 5.0, 5.0)
            else:
                painter.drawRect(QRectF(x - 6.0, y(one.check.error_mm) - 6.0, 12.0, 12.0))


def session_of(record: VerificationRecord) -> tuple[tuple[str, str], ...]:
    """Return facts about corners and repeated seats; none for earlier versions."""
    facts: list[tuple[str, str]] = []
    if record.corners:
        missing = [one for one in record.corners if not one.reached]
        corners = tr("{reached} of {count} reached").format(
            reached=len(record.corners) - len(missing), count=len(record.corners)
        )
        for one in missing:
            corners += f"; {one.name}: " + (said(one.reason) or tr("no reason"))
        facts.append((tr("Corners"), corners))
    if record.repeats:
        shifts = (
            f"{_seat(one.place)} {1e3 * float(np.linalg.norm(one.shift_mm)):.0f} µm"
            f"{'' if one.square <= one.limit else ' ▲'}"
            for one in record.repeats
        )
        facts.append((tr("Repeats"), ", ".join(shifts)))
    forms = [one for one in record.checks if one.name.endswith(", form")]
    if forms:
        worst = max(forms, key=lambda one: one.error_mm)
        facts.append(
            (
                tr("Form"),
                tr("{error_mm:.1f} µm, limit {limit_mm:.1f} µm").format(
                    error_mm=1e3 * worst.error_mm, limit_mm=1e3 * worst.limit_mm
                ),
            )
        )
    return tuple(facts)


def _seat(place: str) -> str:
    return tr("seat {number}").format(number=place.removeprefix("seat "))
