"""Long-term charts: results of each calibration with uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF

from ocmm_core.calibration.records import Course, Sample
from ocmm_gui.charts._bus_charts import Chart
from ocmm_gui.kit import day_words, digit_font, text_font

_HEAD_PX = 38.0
"""Title and names of the courses."""
_FOOT_PX = 16.0
_SCALE_PX = 54.0
_MARK_PX = 3.5
_COVERAGE = 2.0
"""Bars show twice the standard uncertainty."""


class HistoryChart(Chart):
    """Samples with their uncertainty over days, joined by lines.

    ``factor``: from the unit of the course to that of the title; ``reach``: minimum half range in
    it; ``changes``: differences to the first sample of each course; ``limit``: lines at plus and
    minus this value, centred on zero; zero draws none.
    """

    def __init__(
        self,
        title: str,
        *,
        factor: float = 1.0,
        reach: float,
        changes: bool = True,
        limit: float = 0.0,
        form: str = "+.1f",
    ) -> None:
        super().__init__(title)
        self._factor = factor
        self._reach = reach
        self._changes = changes
        self._limit = limit
        self._form = form
        self._courses: tuple[Course, ...] = ()

    def show_courses(self, courses: Sequence[Course]) -> None:
        """Show courses; the word is the latest value farthest from zero."""
        self._courses = tuple(course for course in courses if course.samples)
        latest = [(self._value(course, course.samples[-1]), course) for course in self._courses]
        word = ""
        if latest:
            value, course = max(latest, key=lambda pair: abs(pair[0]))
            name = course.name if len(latest) > 1 else ""
            word = f"{name} {format(value, self._form)}".strip()
        self._say(word or "–")

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        self._paint_head(painter)
        box = QRectF(
            _SCALE_PX, _HEAD_PX, self.width() - _SCALE_PX - 1.0, self.height() - _HEAD_PX - _FOOT_PX
        )
        if not self._courses or box.height() < 12.0:
            return
        times = [s.when.timestamp() for course in self._courses for s in course.samples]
        middle, reach = self._scale()
        self._paint_scale(painter, box, middle, reach, (min(times), max(times)))
        self._paint_names(painter)
        span = max(max(times) - min(times), 1.0)
        # A sample at an edge keeps its whole mark.
        inner = box.adjusted(2.0 * _MARK_PX, 0.0, -2.0 * _MARK_PX, 0.0)
        painter.setClipRect(box)
        for index, course in enumerate(self._courses):
            points = []
            for sample in course.samples:
                share = (sample.when.timestamp() - min(times)) / span if len(times) > 1 else 0.5
                x = inner.left() + inner.width() * share
                points.append(QPointF(x, _y(box, middle, reach, self._value(course, sample))))
            self._paint_course(painter, index, course, points, box.height() / (2.0 * reach))

    def _value(self, course: Course, sample: Sample) -> float:
        first = course.samples[0].value if self._changes else 0.0
        return (sample.value - first) * self._factor

    def _scale(self) -> tuple[float, float]:
        """Return middle and half height of the scale."""
        ends = [
            self._value(course, sample) + side * _COVERAGE * sample.sigma * self._factor
            for course in self._courses
            for sample in course.samples
            for side in (-1.0, 1.0)
        ]
        if self._limit > 0.0:
            return 0.0, 1.15 * max(self._limit, *(abs(end) for end in ends))
        low, high = min(ends), max(ends)
        return 0.5 * (low + high), 1.15 * max(0.5 * (high - low), self._reach)

    def _paint_scale(
        self,
        painter: QPainter,
        box: QRectF,
        middle: float,
        reach: float,
        times: tuple[float, float],
    ) -> None:
        theme = self._theme
        painter.setFont(digit_font(11, bold=False))
        painter.setPen(QColor(theme.muted))
        scale = QRectF(0.0, box.top(), _SCALE_PX - 4.0, box.height())
        for side, value in (
            (Qt.AlignmentFlag.AlignTop, middle + reach),
            (Qt.AlignmentFlag.AlignBottom, middle - reach),
        ):
            painter.drawText(scale, Qt.AlignmentFlag.AlignRight | side, format(value, self._form))
        days = QRectF(box.left(), box.bottom() + 1.0, box.width(), _FOOT_PX - 1.0)
        begin, end = (_day(time) for time in times)
        single = begin == end
        centre = Qt.AlignmentFlag.AlignHCenter
        painter.drawText(days, centre if single else Qt.AlignmentFlag.AlignLeft, begin)
        if not single and painter.fontMetrics().horizontalAdvance(begin + end) < days.width():
            painter.drawText(days, Qt.AlignmentFlag.AlignRight, end)
        painter.setPen(QPen(QColor(theme.border), 1.0))
        painter.drawRect(box)
        zero = _y(box, middle, reach, 0.0)
        if box.top() < zero < box.bottom():
            painter.drawLine(QPointF(box.left(), zero), QPointF(box.right(), zero))
        if self._limit > 0.0:
            painter.setPen(QPen(QColor(theme.bad), 1.5, Qt.PenStyle.DashLine))
            for value in (-self._limit, self._limit):
                y = _y(box, middle, reach, value)
                painter.drawLine(QPointF(box.left(), y), QPointF(box.right(), y))

    def _paint_names(self, painter: QPainter) -> None:
        if len(self._courses) < 2:
            return
        painter.setFont(text_font(11))
        left, row = _SCALE_PX, QRectF(0.0, 18.0, self.width(), 18.0)
        for index, course in enumerate(self._courses):
            self._paint_mark(painter, index, QPointF(left + 4.0, row.center().y()))
            painter.setPen(QColor(self._theme.muted))
            place = QRectF(left + 12.0, row.top(), self.width() - left, row.height())
            painter.drawText(place, Qt.AlignmentFlag.AlignVCenter, course.name)
            left += 26.0 + painter.fontMetrics().horizontalAdvance(course.name)

    def _paint_course(
        self,
        painter: QPainter,
        index: int,
        course: Course,
        points: Sequence[QPointF],
        px_per_unit: float,
    ) -> None:
        painter.setPen(QPen(self._colour(index), 1.2))
        painter.drawPolyline(QPolygonF(points))
        for point, sample in zip(points, course.samples, strict=True):
            half = QPointF(0.0, _COVERAGE * sample.sigma * self._factor * px_per_unit)
            painter.setPen(QPen(self._colour(index), 1.2))
            painter.drawLine(point - half, point + half)
            self._paint_mark(painter, index, point)

    def _paint_mark(self, painter: QPainter, index: int, centre: QPointF) -> None:
        painter.setPen(QPen(self._colour(index), 1.5))
        painter.setBrush(self._colour(index) if index < 2 else QColor(self._theme.panel))
        box = QRectF(0.0, 0.0, 2.0 * _MARK_PX, 2.0 * _MARK_PX)
        box.moveCenter(centre)
        if index % 2:
            painter.drawRect(box)
        else:
            painter.drawEllipse(box)
        painter.setBrush(Qt.BrushStyle.NoBrush)

    def _colour(self, index: int) -> QColor:
        theme = self._theme
        colours = (theme.accent, theme.text, theme.good, theme.warn)
        return QColor(colours[index % len(colours)])


def _y(box: QRectF, middle: float, reach: float, value: float) -> float:
    return box.center().y() - 0.5 * box.height() * (value - middle) / reach


def _day(time: float) -> str:
    return day_words(datetime.fromtimestamp(time, UTC).astimezone())
