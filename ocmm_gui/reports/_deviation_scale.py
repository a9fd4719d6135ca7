"""The scale of the whiskers in the picture of the part, and what has none."""

from __future__ import annotations

from PySide6.QtCore import QRectF
from PySide6.QtGui import QPainter

from ocmm_core.export.report import ReportData
from ocmm_core.tolerances.decisions import DeviationPicture
from ocmm_gui.reports._canvas import INK, SMALL, Canvas
from ocmm_gui.views import SCALE_PX, paint_scale

_BOLDER = 2.2
"""What is as large as on a screen is too fine for paper."""


def deviation_scale(
    canvas: Canvas, data: ReportData, seen: DeviationPicture, reach_mm: float | None
) -> None:
    """Draw the scale of the whiskers below the picture; nothing where the job has none.

    The part is coloured up to ``reach_mm`` from a point; None where it is not.
    """
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
