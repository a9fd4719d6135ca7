"""Picture of the measured part, as large as possible; labels next to items, or on thin lines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPen

from ocmm_core.export.report import ReportData
from ocmm_core.geometry import Float
from ocmm_core.tolerances.decisions import DeviationPicture
from ocmm_gui.kit import ink, text_font
from ocmm_gui.rendering import RenderMode
from ocmm_gui.reports._canvas import INK, SMALL, WIDTH, PageCanvas, Style, paint_text, printable
from ocmm_gui.scene import Orbit, StillScene, Tag, paint_scene, painted_still
from ocmm_gui.views import SCALE_PX, deviation_part, deviations_of, job_items, paint_scale


def deviation_scale(
    canvas: PageCanvas, data: ReportData, seen: DeviationPicture, reach_mm: float | None
) -> None:
    """Draw the scale of the whiskers below the picture; ``reach_mm``: of the colours, or None."""
    if not seen.whiskers:
        return

    def paint(painter: QPainter, box: QRectF) -> None:
        wide = box.adjusted(0.0, 10.0, -0.35 * box.width(), 0.0)
        paint_scale(painter, wide, seen, INK, _BOLDER, reach_mm, canvas.speech.word)

    canvas.draw(SCALE_PX[1] * _BOLDER + 20.0, paint, canvas.speech.word("Deviation"))
    shown = {whisker.feature for whisker in seen.whiskers}
    without = [item.name for item in data.view.features if item.points and item.name not in shown]
    if without:
        names = ", ".join(without)
        canvas.text(
            canvas.speech.say(
                f"Without a whisker, as no zone of their surface has a value: {names}."
            ),
            SMALL,
        )


_BOLDER = 2.2
"""Screen line widths are too fine on paper."""
_SHARPER = 3.0
"""Pixels of the part per screen pixel: some 350 an inch."""
_MOST_HIGH, _LEAST_HIGH = 1150.0, 500.0
_ELEVATIONS = (38.0, 50.0, 62.0)
_MARGIN = 1.12
_WORD = Style(27.0, bold=True)
_PAD = 6.0
_RINGS, _STEP, _TURNS = 14, 34.0, 16


def picture(canvas: PageCanvas, data: ReportData) -> None:
    """Draw the points and features of the job in the world frame."""
    items, reach = job_items(data.view, INK)
    if not len(reach):
        return
    seen = deviations_of(data.view)
    part, colour_mm = deviation_part(seen, data.view.placed_part, INK, RenderMode.SHADED)
    if part is not None:
        reach = np.concatenate([reach, part.T_world_from_model.apply(part.mesh.vertices)])
    up = data.frame.rotation[2]
    orbit, height = _best_view(reach, up)
    canvas.heading("The part as measured", height)

    def paint(painter: QPainter, box: QRectF) -> None:
        # Line and dot sizes of a screen are too fine for paper.
        painter.save()
        painter.setClipRect(box)
        painter.translate(box.topLeft())
        painter.scale(_BOLDER, _BOLDER)
        inside = QRectF(0.0, 0.0, box.width() / _BOLDER, box.height() / _BOLDER)
        shapes = [item for item in items if not isinstance(item, Tag)]
        if part is None:
            paint_scene(painter, shapes, orbit, inside, text_font(13.0), INK.panel)
        else:
            still = StillScene(
                tuple(shapes), orbit, inside.size().toSize(), _SHARPER, INK.panel, part
            )
            painter.drawImage(QPointF(), painted_still(still, text_font(13.0)).image)
        painter.restore()
        ink(painter, QPen(QColor(INK.border), 2.0), Qt.BrushStyle.NoBrush)
        painter.drawRect(box)
        tags = [item for item in items if isinstance(item, Tag)]
        places = orbit.project(
            np.array([tag.point for tag in tags]).reshape(-1, 3), box.width(), box.height()
        )
        _paint_words(painter, box, tags, places)

    canvas.draw(height, paint, canvas.speech.word("The part as measured"))
    tags = [item for item in items if isinstance(item, Tag)]
    places = orbit.project(np.array([tag.point for tag in tags]).reshape(-1, 3), WIDTH, height)
    written = sum(1 for _ in placed_words(QRectF(0.0, 0.0, WIDTH, height), tags, places))
    if written < len(tags):
        # A missing label must not suggest a missing feature.
        canvas.text(
            canvas.speech.say(f"{len(tags) - written} of {len(tags)} names have no room here."),
            SMALL,
        )
    deviation_scale(canvas, data, seen, colour_mm)


def _best_view(reach: Float, up: Float) -> tuple[Orbit, float]:
    """Return the view from above that shows the part largest, and the height of its picture."""
    views = [
        _sized(reach, Orbit(np.zeros(3), azimuth, elevation, 200.0, up))
        for elevation in np.radians(_ELEVATIONS).tolist()
        for azimuth in np.radians(np.arange(0.0, 360.0, 15.0)).tolist()
    ]
    _, view, height = max(views, key=lambda found: found[0])
    return view.fitted(reach, WIDTH, height, _MARGIN), height


def _sized(reach: Float, view: Orbit) -> tuple[float, Orbit, float]:
    """Return the scale of the part in a view, the view, and the height of its picture."""
    wide, high = np.maximum(np.ptp(reach @ view.axes()[:2].T, axis=0), 1.0)
    # Height for the full page width, within the limits of a page.
    height = float(np.clip(WIDTH * high / wide, _LEAST_HIGH, _MOST_HIGH))
    return float(min(WIDTH / wide, height / high)), view, height


def _paint_words(painter: QPainter, box: QRectF, tags: Sequence[Tag], places: Float) -> None:
    for tag, anchor, word in placed_words(box, tags, places):
        painter.setPen(QPen(QColor(INK.muted), 1.5))
        if not word.contains(anchor):
            painter.drawLine(anchor, _nearest(word, anchor))
        ink(painter, Qt.PenStyle.NoPen, QColor(255, 255, 255, 215))
        painter.drawRect(word)
        style = Style(_WORD.size, bold=True, colour=tag.colour)
        paint_text(painter, word.adjusted(_PAD, 0.0, 0.0, 0.0), tag.text, style)


def placed_words(
    box: QRectF, tags: Sequence[Tag], places: Float
) -> Iterator[tuple[Tag, QPointF, QRectF]]:
    """Yield every label with its item and position; no two overlap.

    Labels take the nearest free position round their point, in rings. Those without one are left
    out. `places`: (n, 2 or 3), points of ``tags``, from the upper left corner.
    """
    metrics = QFontMetricsF(text_font(_WORD.size, bold=True))
    height = metrics.height()
    # Left, top, right and bottom of placed labels, for one vectorised comparison.
    taken, count = np.empty((len(tags), 4)), 0
    for tag, place in zip(tags, places, strict=True):
        anchor = QPointF(box.left() + place[0], box.top() + place[1])
        width = metrics.horizontalAdvance(printable(tag.text)) + 2.0 * _PAD
        spots = _spots(anchor, width, height)
        inside = (spots[:, 0] >= box.left()) & (spots[:, 2] <= box.right())
        inside &= (spots[:, 1] >= box.top()) & (spots[:, 3] <= box.bottom())
        spots = spots[inside]
        others = taken[:count, None]
        covers = (spots[:, 0] < others[..., 2]) & (spots[:, 2] > others[..., 0])
        covers &= (spots[:, 1] < others[..., 3]) & (spots[:, 3] > others[..., 1])
        free = np.flatnonzero(~covers.any(axis=0))
        if len(free):
            left, top, right, bottom = taken[count] = spots[free[0]]
            count += 1
            yield tag, anchor, QRectF(left, top, right - left, bottom - top)


_AROUND = 2.0 * np.pi * np.arange(_TURNS) / _TURNS
_OUTWARD = _STEP * np.arange(1, _RINGS + 1)[:, None]


def _spots(anchor: QPointF, width: float, height: float) -> Float:
    """Return (n, 4) left, top, right, bottom of the positions round a point, nearest first."""
    along = np.cos(_AROUND)
    x = anchor.x() + _OUTWARD * along
    y = anchor.y() - _OUTWARD * np.sin(_AROUND)
    # A label to the left of its point ends there, one to the right starts there.
    left = (x - width * (0.5 - 0.5 * along)).ravel()
    top = (y - 0.5 * height).ravel()
    return np.stack([left, top, left + width, top + height], axis=1)


def _nearest(word: QRectF, anchor: QPointF) -> QPointF:
    return QPointF(
        min(max(anchor.x(), word.left()), word.right()),
        min(max(anchor.y(), word.top()), word.bottom()),
    )
