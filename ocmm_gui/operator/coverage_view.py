"""The picture of a feature: where its points lie on it, and where the next one is wanted."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen

from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float, perpendicular_pair
from ocmm_core.inspection.view import FeatureView
from ocmm_gui.painted import Painted
from ocmm_gui.theme import text_font

_ROUND = (
    Shape.CIRCLE, Shape.CYLINDER, Shape.CONE, Shape.SPHERE, Shape.TORUS, Shape.ELLIPSE,
)  # fmt: skip
_MARGIN = 0.16


class CoverageView(Painted):
    """Round features from along their axis with the touched sectors, others from their normal.

    A point that is flagged is a cross, the chosen one has a ring.
    """

    def __init__(self) -> None:
        super().__init__("Coverage of the feature", (110, 110), (60, 60))
        self._feature: FeatureView | None = None
        self._chosen = 0

    def show_feature(self, feature: FeatureView, chosen: int) -> None:
        """Show how the points of a feature are spread."""
        self._feature, self._chosen = feature, chosen
        said = "no points"
        if feature.coverage is not None:
            said = f"{feature.coverage.words}. {feature.coverage.warning}".strip()
        self.setAccessibleDescription(f"{feature.name}: {said}")
        self.setToolTip(said)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint outline, sectors and points."""
        painter = self._painter()
        feature = self._feature
        side = float(min(self.width(), self.height()))
        box = QRectF(0.0, 0.0, side, side)
        box.moveCenter(QRectF(self.rect()).center())
        if feature is None or side < 20.0:
            return
        places = picture_places(feature)
        inner = box.adjusted(_MARGIN * side, _MARGIN * side, -_MARGIN * side, -_MARGIN * side)
        if feature.shape in _ROUND:
            self._paint_dial(painter, box, inner, feature)
        else:
            painter.setPen(QPen(QColor(self._theme.border), max(1.5, 0.012 * side)))
            painter.setBrush(QColor(self._ground(feature)))
            painter.drawRoundedRect(inner.adjusted(-6, -6, 6, 6), 4, 4)
        self._paint_points(painter, inner, places, feature)

    def _ground(self, feature: FeatureView) -> str:
        """Return the colour of a flat feature: empty, badly spread or well spread."""
        if feature.coverage is None:
            return self._theme.background
        return self._theme.zone_warn if feature.coverage.warning else self._theme.zone_good

    def _paint_dial(
        self, painter: QPainter, box: QRectF, inner: QRectF, feature: FeatureView
    ) -> None:
        side = box.width()
        good, empty = QColor(self._theme.zone_good), QColor(self._theme.background)
        cells = () if feature.coverage is None else feature.coverage.cells
        pole = False
        if feature.shape is Shape.SPHERE and cells:
            # The first patch is the pole, the others are sectors round it.
            pole, cells = cells[0], cells[1:]
        rim = box.adjusted(0.03 * side, 0.03 * side, -0.03 * side, -0.03 * side)
        painter.setPen(QPen(QColor(self._theme.panel), max(1.0, 0.012 * side)))
        step = round(16 * 360 / max(len(cells), 1))
        for sector, hit in enumerate(cells):
            painter.setBrush(good if hit else empty)
            painter.drawPie(rim, sector * step, step)
        painter.setPen(QPen(QColor(self._theme.border), max(1.0, 0.01 * side)))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawEllipse(rim)
        painter.setBrush(good if pole else QColor(self._theme.panel))
        hole = inner.adjusted(0.12 * side, 0.12 * side, -0.12 * side, -0.12 * side)
        painter.drawEllipse(hole)
        if feature.coverage is not None:
            painter.setPen(QColor(self._theme.text))
            painter.setFont(text_font(max(11.0, 0.1 * side), bold=True))
            share = f"{100.0 * feature.coverage.fraction:.0f} %"
            painter.drawText(hole, Qt.AlignmentFlag.AlignCenter, share)

    def _paint_points(
        self, painter: QPainter, inner: QRectF, places: Float, feature: FeatureView
    ) -> None:
        radius = max(3.5, 0.035 * inner.width())
        half = 0.5 * inner.width()
        for point, (x, y) in zip(feature.points, places.tolist(), strict=True):
            place = QPointF(inner.center().x() + half * x, inner.center().y() - half * y)
            if point.number in feature.outliers:
                painter.setPen(QPen(QColor(self._theme.bad), max(2.0, 0.6 * radius)))
                for turn in (-1.0, 1.0):
                    arm = QPointF(radius, turn * radius)
                    painter.drawLine(place - arm, place + arm)
            else:
                painter.setPen(QPen(QColor(self._theme.panel), 1.0))
                painter.setBrush(QColor(self._theme.text))
                painter.drawEllipse(place, radius, radius)
            if point.number == self._chosen:
                painter.setPen(QPen(QColor(self._theme.accent), max(2.0, 0.5 * radius)))
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.drawEllipse(place, 2.2 * radius, 2.2 * radius)


def picture_places(feature: FeatureView) -> Float:
    """Return where the points of a feature stand in its picture, (n, 2), each from -1 to 1."""
    if not feature.points:
        return np.empty((0, 2))
    surface = np.stack([point.surface_world for point in feature.points])
    fit = feature.fit
    middle = surface.mean(axis=0) if fit is None else fit.point
    axis = np.zeros(3) if fit is None else fit.direction
    if not axis.any():
        # Without an axis the picture looks at what was touched from where the probe stood.
        axis = np.mean([point.direction for point in feature.points], axis=0)
        axis = axis if np.linalg.norm(axis) > 1e-3 else np.array([0.0, 0.0, 1.0])
        axis = axis / np.linalg.norm(axis)
    first, second = perpendicular_pair(axis)
    flat = (surface - middle) @ np.stack([first, second], axis=1)
    reach = float(np.abs(flat).max())
    if feature.shape in _ROUND:
        reach = float(np.linalg.norm(flat, axis=1).max())
    shown: Float = flat / max(reach, 1e-9)
    return shown
