"""Details of a feature: point dots, further characteristics, and a picture with the next target."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from ocmm_core.geometry import Float, perpendicular_pair
from ocmm_core.inspection.evaluation import FeatureView
from ocmm_core.tolerances.decisions import CharacteristicResult
from ocmm_gui import kit
from ocmm_gui.kit import tr

_LINE_PX = 22.0


def points_words(feature: FeatureView) -> str:
    """Return how many points were taken, and of how many, in words."""
    if feature.open_ended:
        return feature.count_text
    words = tr("{taken} of %n points", "{taken} of 1 point", feature.needed)
    return words.format(taken=feature.taken)


class PointDots(kit.Themed, QWidget):
    """One dot per needed point, filled when recorded, and the count in digits."""

    def __init__(self) -> None:
        super().__init__()
        self._taken, self._needed, self._words = 0, 0, ""
        self.setAccessibleName(tr("Points"))
        self.setFixedHeight(30)

    def show_points(self, feature: FeatureView) -> None:
        self._taken = 0 if feature.open_ended else feature.taken
        self._needed = 0 if feature.open_ended else feature.needed
        self._words = feature.count_text
        self.setAccessibleDescription(points_words(feature))
        self.update()

    def sizeHint(self) -> QSize:
        return QSize(200, 30)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(kit.digit_font(20))
        wide = painter.fontMetrics().horizontalAdvance(self._words)
        painter.setPen(QColor(self._theme.text))
        painter.drawText(self.rect(), kit.LEFT, self._words)
        total = max(self._needed, self._taken)
        room = self.width() - wide - 16.0
        pitch = min(22.0, room / max(1, total))
        size = 0.68 * pitch
        for index in range(total):
            x = wide + 16.0 + index * pitch
            taken = index < self._taken
            extra = index >= self._needed
            painter.setPen(QColor(self._theme.muted if not taken else self._theme.accent))
            fill = self._theme.good if extra else self._theme.accent
            painter.setBrush(QColor(fill if taken else self._theme.panel))
            painter.drawEllipse(QRectF(x, 0.5 * (self.height() - size), size, size))


class CharacteristicList(kit.Themed, QWidget):
    """Further characteristics of the feature, one line each."""

    def __init__(self) -> None:
        super().__init__()
        self._results: tuple[CharacteristicResult, ...] = ()
        self.setAccessibleName(tr("Other characteristics of this feature"))
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Maximum)

    def show_results(self, results: tuple[CharacteristicResult, ...]) -> None:
        self._results = results
        self.setVisible(bool(results))
        self.updateGeometry()
        self.setAccessibleDescription(
            "; ".join(
                f"{r.name} {kit.quantity(r, r.deviation, signed=True)} "
                f"{kit.said_word(r.verdict.value)}"
                for r in results
            )
        )
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
            (r.name,
             f"{kit.quantity(r, r.deviation, signed=True)}  {kit.said_word(r.verdict.value)}",
             kit.verdict_colour(self._theme, r.verdict))
            for r in self._results
        ]  # fmt: skip
        for index, (name, value, colour) in enumerate(rows[: int(self.height() / line)]):
            box = QRectF(0, index * line, self.width(), line)
            painter.setFont(kit.text_font(13))
            painter.setPen(QColor(self._theme.text if index else self._theme.muted))
            painter.drawText(box, kit.LEFT, name)
            kit.ink(painter, QColor(colour), font=kit.digit_font(13, bold=False))
            painter.drawText(box, kit.RIGHT, value)


_MARGIN = 0.16
_FOOT_SHARE = 0.2
_FINGER_PX = 16.0
"""Maximum distance of a click from its point."""


class CoverageView(kit.PaintedWidget):
    """Round features along their axis with touched sectors, others along the normal.

    Outliers are crosses, the selected point has a ring; a click selects the nearest.
    """

    point_chosen = Signal(int)
    """Emits the number of the clicked point."""

    def __init__(self) -> None:
        super().__init__(tr("Coverage of the feature"), (110, 110), (60, 60))
        self._feature: FeatureView | None = None
        self._chosen = 0

    def show_feature(self, feature: FeatureView, chosen: int) -> None:
        self._feature, self._chosen = feature, chosen
        words = tr("no points")
        if feature.coverage is not None:
            words = kit.said(f"{feature.coverage.words}. {feature.coverage.warning}".strip())
        self.setAccessibleDescription(f"{feature.name}: {words}")
        self.setToolTip(kit.literal(words))
        self.update()

    def place_of(self, number: int) -> QPointF:
        """Return the place of a point; KeyError for unknown numbers; for tests."""
        return self._places()[number]

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Select the point nearest to the click, within a finger's width."""
        where = event.position()
        far = {
            number: float(np.hypot(place.x() - where.x(), place.y() - where.y()))
            for number, place in self._places().items()
        }
        nearest = min(far, key=lambda number: far[number], default=0)
        if nearest and far[nearest] <= _FINGER_PX:
            self.point_chosen.emit(nearest)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        feature = self._feature
        box = self._box()
        side = box.width()
        if feature is None or side < 20.0:
            return
        inner = _inner(box)
        if feature.shape.spec.is_round:
            self._paint_dial(painter, box, inner, feature)
        else:
            painter.setPen(QPen(QColor(self._theme.border), max(1.5, 0.012 * side)))
            painter.setBrush(QColor(self._ground(feature)))
            painter.drawRoundedRect(inner.adjusted(-6, -6, 6, 6), 4, 4)
            # Small, at the lower edge, clear of points.
            foot = QRectF(inner)
            foot.setTop(inner.bottom() - _FOOT_SHARE * side)
            self._paint_share(painter, foot, feature)
        self._paint_points(painter, inner, feature)

    def _ground(self, feature: FeatureView) -> str:
        """Return the colour of a flat feature: empty, badly or well distributed."""
        if feature.coverage is None:
            return self._theme.background
        return self._theme.zone_warn if feature.coverage.warning else self._theme.zone_good

    def _paint_dial(
        self, painter: QPainter, box: QRectF, inner: QRectF, feature: FeatureView
    ) -> None:
        side = box.width()
        good, empty = QColor(self._theme.zone_good), QColor(self._theme.background)
        cells = () if feature.coverage is None else feature.coverage.cells
        start = 0.0 if feature.coverage is None else np.degrees(feature.coverage.start)
        pole = False
        if feature.shape.spec.spread == "sphere" and cells:
            # The first patch is the pole, the others are sectors round it.
            pole, cells = cells[0], cells[1:]
        rim = box.adjusted(0.03 * side, 0.03 * side, -0.03 * side, -0.03 * side)
        painter.setPen(QPen(QColor(self._theme.panel), max(1.0, 0.012 * side)))
        step = round(16 * 360 / max(len(cells), 1))
        for sector, hit in enumerate(cells):
            painter.setBrush(good if hit else empty)
            painter.drawPie(rim, round(16 * start) + sector * step, step)
        kit.ink(
            painter, QPen(QColor(self._theme.border), max(1.0, 0.01 * side)), Qt.BrushStyle.NoBrush
        )
        painter.drawEllipse(rim)
        painter.setBrush(good if pole else QColor(self._theme.panel))
        hole = inner.adjusted(0.12 * side, 0.12 * side, -0.12 * side, -0.12 * side)
        painter.drawEllipse(hole)
        self._paint_share(painter, hole.adjusted(4.0, 0.0, -4.0, 0.0), feature)

    def _paint_share(self, painter: QPainter, box: QRectF, feature: FeatureView) -> None:
        if feature.coverage is None:
            return
        share = f"{100.0 * feature.coverage.fraction:.0f} %"
        painter.setPen(QColor(self._theme.text))
        painter.setFont(
            kit.fitted(kit.text_font(10, bold=True), share, box.width(), box.height(), 60.0)
        )
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, share)

    def _paint_points(self, painter: QPainter, inner: QRectF, feature: FeatureView) -> None:
        radius = max(3.5, 0.035 * inner.width())
        places = self._places()
        for point in feature.points:
            place = places[point.number]
            if point.number in feature.outliers:
                painter.setPen(QPen(QColor(self._theme.bad), max(2.0, 0.6 * radius)))
                for turn in (-1.0, 1.0):
                    arm = QPointF(radius, turn * radius)
                    painter.drawLine(place - arm, place + arm)
            else:
                kit.ink(painter, QPen(QColor(self._theme.panel), 1.0), QColor(self._theme.text))
                painter.drawEllipse(place, radius, radius)
            if point.number == self._chosen:
                painter.setPen(QPen(QColor(self._theme.accent), max(2.0, 0.5 * radius)))
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.drawEllipse(place, 2.2 * radius, 2.2 * radius)

    def _box(self) -> QRectF:
        side = float(min(self.width(), self.height()))
        box = QRectF(0.0, 0.0, side, side)
        box.moveCenter(QRectF(self.rect()).center())
        return box

    def _places(self) -> dict[int, QPointF]:
        """Return the place of each point on the widget, by number."""
        if self._feature is None:
            return {}
        inner = _inner(self._box())
        if self._feature.coverage is not None and not self._feature.shape.spec.is_round:
            # The text is below them.
            foot = _FOOT_SHARE * self._box().width()
            inner.adjust(0.5 * foot, 0.0, -0.5 * foot, -foot)
        half, middle = 0.5 * inner.width(), inner.center()
        return {
            point.number: QPointF(middle.x() + half * x, middle.y() - half * y)
            for point, (x, y) in zip(
                self._feature.points, picture_places(self._feature).tolist(), strict=True
            )
        }


def _inner(box: QRectF) -> QRectF:
    margin = _MARGIN * box.width()
    return box.adjusted(margin, margin, -margin, -margin)


def picture_places(feature: FeatureView) -> Float:
    """Return the places of a feature's points in its picture, (n, 2), each -1 to 1."""
    if not feature.points:
        return np.empty((0, 2))
    surface = np.stack([point.surface_world for point in feature.points])
    fit = feature.fit
    middle = surface.mean(axis=0) if fit is None else fit.point
    axis = np.zeros(3) if fit is None else fit.direction
    if not axis.any():
        # Without an axis, view along the probing direction.
        axis = np.mean([point.direction for point in feature.points], axis=0)
        axis = axis if np.linalg.norm(axis) > 1e-3 else np.array([0.0, 0.0, 1.0])
        axis = axis / np.linalg.norm(axis)
    first, second = perpendicular_pair(axis)
    flat = (surface - middle) @ np.stack([first, second], axis=1)
    reach = float(np.abs(flat).max())
    if feature.shape.spec.is_round:
        reach = float(np.linalg.norm(flat, axis=1).max())
    shown: Float = flat / max(reach, 1e-9)
    return shown
