"""Charts over time: lateness, round trip and clocks of the bus, and results of calibrations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from math import log10

import numpy as np
from pyqtgraph.functions import arrayToQPath
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPaintEvent, QPen, QPolygonF

from ocmm_core.calibration.records import Course, Sample
from ocmm_core.fieldbus.report import Histogram, within_us
from ocmm_core.geometry import Float
from ocmm_gui.charts._plot import SMALL_HEAD, SMALL_HEAD_PX, Plot, height_of
from ocmm_gui.kit import day_words, digit_font, ink, localised, text_font, tr

_FOOT_PX = 16.0
_SCALE_PX = 50.0
"""Left of a trend: the ends of its scale."""
_DENSE = 0.5
"""Points per pixel above which a curve is drawn thin."""
_THIN_FROM = 4.0
"""Points per pixel column above which a curve is thinned: each column keeps up to four."""
_WIDE_PX = 26.0
"""A class this wide has room for its edge label."""
_CENTRE = Qt.AlignmentFlag.AlignCenter


class Chart(Plot):
    """One of several small plots side by side."""

    def __init__(self, title: str, form: str = "") -> None:
        super().__init__(title, SMALL_HEAD, (210, 110), (120, 44))
        self._form = form
        """Format of values."""

    def _paint_ends(self, painter: QPainter, box: QRectF, middle: float, reach: float) -> None:
        """Paint the ends of the scale at the left of a box."""
        ink(painter, QColor(self._theme.muted), font=digit_font(11, bold=False))
        scale = QRectF(0.0, box.top(), box.left() - 4.0, box.height())
        for side, value in (
            (Qt.AlignmentFlag.AlignTop, middle + reach),
            (Qt.AlignmentFlag.AlignBottom, middle - reach),
        ):
            painter.drawText(scale, Qt.AlignmentFlag.AlignRight | side, format(value, self._form))

    def _colour(self, index: int) -> QColor:
        theme = self._theme
        colours = (theme.accent, theme.text, theme.good, theme.warn)
        return QColor(colours[index % len(colours)])


class HistogramChart(Chart):
    """Histogram of a time; heights are logarithmic so that rare values are visible."""

    def __init__(self, title: str) -> None:
        super().__init__(title)
        self._histogram: Histogram | None = None
        self._limit_us = 0.0

    def show_histogram(self, histogram: Histogram, limit_us: float) -> None:
        """Show a histogram; bars beyond ``limit_us`` are highlighted."""
        if (histogram, limit_us) == (self._histogram, self._limit_us):
            return
        self._histogram, self._limit_us = histogram, limit_us
        edge = within_us(histogram, 0.999)
        inside = localised(f"99.9 % ≤ {edge:g},") if edge is not None else ""
        worst = (
            tr("worst {worst_us:.0f}").format(worst_us=histogram.worst_us)
            if sum(histogram.counts)
            else tr("no values")
        )
        self._show_message(f"{inside} {worst}".strip())

    def paintEvent(self, event: QPaintEvent) -> None:
        histogram = self._histogram
        painter = QPainter(self)
        self._paint_head(painter, lines=2)
        if histogram is None:
            return
        theme, count = self._theme, len(histogram.counts)
        pitch = self.width() / count
        floor = self.height() - _FOOT_PX
        # Room for the count on the highest bar.
        high = max(floor - 3.0 * SMALL_HEAD_PX, 1.0)
        painter.setFont(digit_font(11, bold=False))
        decades = 1.0 + log10(max(*histogram.counts, 1))
        for index, value in enumerate(histogram.counts):
            edge = histogram.edges_us[index] if index < count - 1 else float("inf")
            late = edge > self._limit_us
            # Single values must be visible: the scale starts a decade below.
            tall = high * (1.0 + log10(value)) / decades if value else 0.0
            bar = QRectF((index + 0.12) * pitch, floor - tall, 0.76 * pitch, tall)
            painter.fillRect(bar, QColor(theme.warn if late else theme.accent))
            painter.setPen(QColor(theme.text))
            above = QRectF((index - 0.5) * pitch, bar.top() - 14.0, 2.0 * pitch, 14.0)
            _draw_if_fits(painter, above, _short(value), pitch)
            painter.setPen(QColor(theme.muted))
            below = QRectF((index - 0.5) * pitch, floor + 1.0, 2.0 * pitch, _FOOT_PX - 1.0)
            # Narrow classes: every other edge has a label.
            wide = pitch >= _WIDE_PX
            if wide or index % 2:
                _draw_if_fits(painter, below, _edge_word(edge), pitch if wide else 2.0 * pitch)
        painter.setPen(QPen(QColor(theme.border), 1.0))
        painter.drawLine(QPointF(0.0, floor), QPointF(self.width(), floor))


@dataclass(frozen=True, slots=True)
class Curve:
    name: str
    """Empty for a single curve."""
    values: tuple[float | None, ...]
    """One per time; None if unknown."""


class RecentChart(Chart):
    """Values over the last minutes. `reach`: Minimum half range of the scale."""

    def __init__(self, title: str, reach: float, span_s: float, form: str) -> None:
        super().__init__(title, form)
        self._reach = reach
        self._span_s = span_s
        self._times: tuple[float, ...] = ()
        self._curves: tuple[Curve, ...] = ()

    def show_curves(self, times: Sequence[float], curves: Sequence[Curve]) -> None:
        """Show curves over times, s, oldest first; the right edge is the last time.

        The word is the latest value; of several curves, the one farthest from zero.
        """
        self._times, self._curves = tuple(times), tuple(curves)
        latest = [
            (abs(curve.values[-1]), curve.name, format(curve.values[-1], self._form))
            for curve in curves
            if curve.values and curve.values[-1] is not None
        ]
        _, name, value = max(latest, default=(0.0, "", "–"))
        self._show_message(f"{name} {value}".strip())

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        self._paint_head(painter)
        known = [v for curve in self._curves for v in curve.values if v is not None]
        top = SMALL_HEAD_PX + 2.0
        box = QRectF(_SCALE_PX, top, self.width() - _SCALE_PX - 1.0, self.height() - top - 2.0)
        if not known or box.height() < 12.0:
            return
        low, high = min(known), max(known)
        middle, reach = 0.5 * (low + high), max(0.5 * (high - low), self._reach)
        theme = self._theme
        self._paint_ends(painter, box, middle, 1.15 * reach)
        painter.setPen(QPen(QColor(theme.border), 1.0))
        painter.drawRect(box)
        painter.setClipRect(box)
        styles = (Qt.PenStyle.SolidLine, Qt.PenStyle.DashLine, Qt.PenStyle.DotLine)
        # Antialiased strokes of dense curves cost a hundred times more and look the same
        # (benchmarks/charts.py).
        dense = len(self._times) > _DENSE * box.width()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, not dense)
        for index, curve in enumerate(self._curves):
            pen = QPen(self._colour(index), 1.0 if dense else 1.5)
            pen.setStyle(styles[index % len(styles)])
            painter.setPen(pen)
            painter.drawPath(self._path(curve, box, middle, 1.15 * reach))

    def _path(self, curve: Curve, box: QRectF, middle: float, reach: float) -> QPainterPath:
        """Return the curve in pixels, broken at unknown values."""
        times, values = np.array(self._times), np.array(curve.values, dtype=np.float64)
        x = box.right() - box.width() * (times[-1] - times) / self._span_s
        y = box.center().y() - 0.5 * box.height() * (values - middle) / reach
        x, y = thinned(x, y)
        path: QPainterPath = arrayToQPath(x, y, connect="finite")
        return path


def thinned(x: Float, y: Float) -> tuple[Float, Float]:
    """Return the points (m,) of a curve (n,) that a screen can show, px.

    Each pixel column keeps its first, lowest, highest and last point, in order, so single outliers
    stay visible. Unknown values are kept as breaks.
    """
    if len(x) < _THIN_FROM * (x[-1] - x[0] + 1.0):
        return x, y
    column = np.floor(x).astype(np.int64)
    first = np.flatnonzero(np.diff(column, prepend=column[0] - 1))
    last = np.append(first[1:], len(x)) - 1
    low = np.where(np.isfinite(y), y, np.inf)
    high = np.where(np.isfinite(y), y, -np.inf)
    keep = ~np.isfinite(y)
    keep[first] = keep[last] = True
    keep |= low == np.repeat(np.minimum.reduceat(low, first), last - first + 1)
    keep |= high == np.repeat(np.maximum.reduceat(high, first), last - first + 1)
    return x[keep], y[keep]


def _draw_if_fits(painter: QPainter, place: QRectF, text: str, room: float) -> None:
    if painter.fontMetrics().horizontalAdvance(text) <= room:
        painter.drawText(place, _CENTRE, text)


def _edge_word(edge_us: float) -> str:
    if edge_us == float("inf"):
        return ">"
    return localised(f"{edge_us / 1000.0:g}k") if edge_us >= 1000.0 else localised(f"{edge_us:g}")


def _short(count: int) -> str:
    """Return a count in at most five characters, empty for zero."""
    for limit, divisor, unit in ((10_000, 1, ""), (10_000_000, 1000, "k")):
        if count < limit:
            return f"{count / divisor:.0f}{unit}" if count else ""
    return f"{count / 1_000_000:.0f}M"


_HEAD_PX = 38.0
"""Title and names of the courses."""

_HISTORY_SCALE_PX = 54.0
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
        super().__init__(title, form)
        self._factor = factor
        self._reach = reach
        self._changes = changes
        self._limit = limit
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
        self._show_message(word or "–")

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        self._paint_head(painter)
        box = QRectF(
            _HISTORY_SCALE_PX,
            _HEAD_PX,
            self.width() - _HISTORY_SCALE_PX - 1.0,
            self.height() - _HEAD_PX - _FOOT_PX,
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
                points.append(
                    QPointF(x, height_of(box, self._value(course, sample) - middle, reach))
                )
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
        self._paint_ends(painter, box, middle, reach)
        days = QRectF(box.left(), box.bottom() + 1.0, box.width(), _FOOT_PX - 1.0)
        begin, end = (day_words(datetime.fromtimestamp(time, UTC).astimezone()) for time in times)
        single = begin == end
        centre = Qt.AlignmentFlag.AlignHCenter
        painter.drawText(days, centre if single else Qt.AlignmentFlag.AlignLeft, begin)
        if not single and painter.fontMetrics().horizontalAdvance(begin + end) < days.width():
            painter.drawText(days, Qt.AlignmentFlag.AlignRight, end)
        painter.setPen(QPen(QColor(theme.border), 1.0))
        painter.drawRect(box)
        zero = height_of(box, -middle, reach)
        if box.top() < zero < box.bottom():
            painter.drawLine(QPointF(box.left(), zero), QPointF(box.right(), zero))
        if self._limit > 0.0:
            painter.setPen(QPen(QColor(theme.bad), 1.5, Qt.PenStyle.DashLine))
            for value in (-self._limit, self._limit):
                y = height_of(box, value - middle, reach)
                painter.drawLine(QPointF(box.left(), y), QPointF(box.right(), y))

    def _paint_names(self, painter: QPainter) -> None:
        if len(self._courses) < 2:
            return
        painter.setFont(text_font(11))
        left, row = _HISTORY_SCALE_PX, QRectF(0.0, 18.0, self.width(), 18.0)
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
