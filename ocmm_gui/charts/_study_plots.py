"""Gauge studies as plots: components, values by operator, and a run of one part."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen

from ocmm_core.geometry import Float
from ocmm_gui.charts._plot import Plot, height_of
from ocmm_gui.kit import LEFT, RIGHT, digit_font, ink, localised, text_font, tr
from ocmm_shop.studies import GaugeStudy, Type1Study

_SCALE_PX, _FOOT_PX = 84.0, 24.0
_GOOD, _CONDITIONAL = 10.0, 30.0
"""Per cent of study or tolerance (AIAG): good below the first, bad above the second."""


class ComponentsPlot(Plot):
    """Repeatability, reproducibility, their sum and the parts, per cent of the study."""

    def __init__(self) -> None:
        super().__init__(tr("Components, % of study"))
        self._rows: tuple[tuple[str, float, float], ...] = ()

    def show_study(self, study: GaugeStudy | None) -> None:
        self._rows = ()
        if study is None:
            self._show_message(tr("no study"))
            return
        um = 1e3
        self._rows = tuple(
            (name, 100.0 * value / study.tv if study.tv > 0.0 else 0.0, um * value)
            for name, value in (
                (tr("GRR"), study.grr), (tr("Repeatability (EV)"), study.ev),
                (tr("Operators (AV)"), study.av), (tr("Parts (PV)"), study.pv),
            )
        )  # fmt: skip
        tolerance = ""
        if study.tolerance_percent is not None:
            tolerance = tr(", {p:.1f} % of tolerance").format(p=study.tolerance_percent)
        self._show_message(
            tr("GRR {p:.1f} % of study{tolerance}, ndc {ndc}: {word}").format(
                p=study.study_percent, tolerance=tolerance, ndc=study.ndc, word=study.word
            )
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        box = self._paint_head(painter).adjusted(150.0, 8.0, -150.0, -_FOOT_PX)
        theme = self._theme
        if not self._rows:
            return
        high = box.height() / len(self._rows)
        for index, (name, share, um) in enumerate(self._rows):
            top = box.top() + index * high
            bar = QRectF(box.left(), top + 0.2 * high, box.width() * share / 100.0, 0.6 * high)
            painter.fillRect(bar, QColor(theme.accent if index else theme.text))
            ink(painter, QColor(theme.text), font=text_font(14, bold=not index))
            painter.drawText(QRectF(0.0, top, 144.0, high), RIGHT, name)
            painter.setFont(digit_font(14, bold=False))
            place = QRectF(box.right() + 8.0, top, 142.0, high)
            painter.drawText(place, LEFT, localised(f"{share:.1f} %  {um:.1f} µm"))
        for level in (_GOOD, _CONDITIONAL):
            x = box.left() + 0.01 * level * box.width()
            painter.setPen(QPen(QColor(theme.warn), 1.6, Qt.PenStyle.DashLine))
            painter.drawLine(QPointF(x, box.top()), QPointF(x, box.bottom()))
            ink(painter, QColor(theme.muted), font=text_font(12))
            painter.drawText(
                QRectF(x - 30.0, box.bottom() + 2.0, 60.0, 20.0), Qt.AlignmentFlag.AlignCenter,
                f"{level:.0f} %",
            )  # fmt: skip


class OperatorsPlot(Plot):
    """Values minus the mean of their part, by operator, with means."""

    def __init__(self) -> None:
        super().__init__(tr("Value less part mean, µm"))
        self._names: tuple[str, ...] = ()
        self._values: Float = np.empty((0, 0, 0))

    def show_values(self, names: Sequence[str], values: Float | None) -> None:
        """Show values (parts, operators, trials), mm; None shows nothing."""
        self._names = tuple(names)
        self._values = np.empty((0, 0, 0))
        if values is None or not values.size:
            self._show_message(tr("no study"))
            return
        self._values = 1e3 * (values - values.mean(axis=(1, 2), keepdims=True))
        means = self._values.mean(axis=(0, 2))
        self._show_message(
            tr("largest difference of operators {um:.1f} µm").format(um=float(np.ptp(means)))
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        box = self._paint_head(painter).adjusted(_SCALE_PX, 4.0, -8.0, -_FOOT_PX)
        theme, values = self._theme, self._values
        if not values.size:
            return
        reach = 1.1 * max(float(np.max(np.abs(values))), 1e-6)
        _frame(painter, box, theme.border, theme.background)
        _scale(painter, box, reach, theme.muted)
        wide = box.width() / values.shape[1]
        for index, name in enumerate(self._names):
            own = values[:, index]
            left = box.left() + index * wide
            for number, value in enumerate(own.ravel()):
                x = left + wide * (0.15 + 0.7 * (number + 0.5) / own.size)
                ink(painter, Qt.PenStyle.NoPen, QColor(theme.accent))
                painter.drawEllipse(QPointF(x, height_of(box, float(value), reach)), 3.5, 3.5)
            mean = height_of(box, float(own.mean()), reach)
            painter.setPen(QPen(QColor(theme.text), 2.4))
            painter.drawLine(QPointF(left + 0.1 * wide, mean), QPointF(left + 0.9 * wide, mean))
            ink(painter, QColor(theme.text), font=text_font(13, bold=True))
            place = QRectF(left, box.bottom() + 2.0, wide, _FOOT_PX - 2.0)
            painter.drawText(place, Qt.AlignmentFlag.AlignCenter, name)


class RunPlot(Plot):
    """Repeated measurements of a part: deviation from its reference, 10 % tolerance."""

    def __init__(self) -> None:
        super().__init__(tr("Deviation, µm"))
        self._values: Float = np.empty(0)
        self._tenth = 0.0

    def show_run(self, study: Type1Study, values: Float, reference: float, width: float) -> None:
        """Show a study with its values, mm; ``width`` is the tolerance."""
        self._values, self._tenth = 1e3 * (np.asarray(values) - reference), 100.0 * width
        word = tr("CAPABLE") if study.capable else tr("NOT CAPABLE")
        self._show_message(
            tr("N {n}, Cg {cg:.2f} ({low:.2f} to {high:.2f}), Cgk {cgk:.2f}: {word}").format(
                n=study.results, cg=study.cg, low=study.cg_low, high=study.cg_high,
                cgk=study.cgk, word=word,
            )
        )  # fmt: skip

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        box = self._paint_head(painter).adjusted(_SCALE_PX, 4.0, -8.0, -_FOOT_PX)
        theme, values = self._theme, self._values
        if not len(values):
            return
        reach = 1.15 * max(self._tenth, float(np.max(np.abs(values))))
        _frame(painter, box, theme.border, theme.background)
        band = QRectF(
            box.left(), height_of(box, self._tenth, reach), box.width(),
            height_of(box, -self._tenth, reach) - height_of(box, self._tenth, reach),
        )  # fmt: skip
        painter.fillRect(band, QColor(theme.zone_good))
        _scale(painter, box, reach, theme.muted)
        mean = height_of(box, float(values.mean()), reach)
        painter.setPen(QPen(QColor(theme.text), 1.6, Qt.PenStyle.DashLine))
        painter.drawLine(QPointF(box.left(), mean), QPointF(box.right(), mean))
        pitch = box.width() / len(values)
        before: QPointF | None = None
        for index, value in enumerate(values):
            place = QPointF(box.left() + (index + 0.5) * pitch, height_of(box, float(value), reach))
            painter.setPen(QPen(QColor(theme.muted), 1.2))
            if before is not None:
                painter.drawLine(before, place)
            before = place
            painter.setBrush(QColor(theme.accent if abs(value) <= self._tenth else theme.bad))
            painter.drawEllipse(place, 4.0, 4.0)


def _frame(painter: QPainter, box: QRectF, border: str, background: str) -> None:
    ink(painter, QPen(QColor(border), 1.0), QColor(background))
    painter.drawRect(box)


def _scale(painter: QPainter, box: QRectF, reach: float, colour: str) -> None:
    ink(painter, QColor(colour), font=digit_font(12, bold=False))
    for share in (0.9, 0.0, -0.9):
        y = height_of(box, share * reach, reach)
        painter.drawLine(QPointF(box.left(), y), QPointF(box.left() + 6.0, y))
        place = QRectF(0.0, y - 9.0, _SCALE_PX - 8.0, 18.0)
        painter.drawText(place, RIGHT, localised(f"{share * reach:+.1f}") if share else "0")
