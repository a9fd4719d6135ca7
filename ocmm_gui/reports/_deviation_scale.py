"""The scale of the whiskers in the picture of the part, and what has none."""

from __future__ import annotations

from PySide6.QtCore import QRectF
from PySide6.QtGui import QPainter

from ocmm_core.export.report import ReportData
from ocmm_gui.reports._canvas import INK, SMALL, Canvas
from ocmm_gui.views import SCALE_PX, deviations_of, paint_scale

_BOLDER = 2.2
"""What is as large as on a screen is too fine for paper."""


def deviation_scale(canvas: Canvas, data: ReportData) -> None:
    """Draw the scale of the whiskers below the picture; nothing where the job has none."""
    seen = deviations_of(data.view)
    if not seen.whiskers:
        return

    def paint(painter: QPainter, box: QRectF) -> None:
        wide = box.adjusted(0.0, 10.0, -0.35 * box.width(), 0.0)
        paint_scale(painter, wide, seen, INK, _BOLDER)

    canvas.draw(SCALE_PX[1] * _BOLDER + 20.0, paint)
    shown = {whisker.feature for whisker in seen.whiskers}
    without = [item.name for item in data.view.features if item.points and item.name not in shown]
    if without:
        canvas.text(
            f"Without a whisker, as no zone of their surface has a value: {', '.join(without)}.",
            SMALL,
        )
