"""The report as PDF: picture of the part, deviation plots, its numbers as attachments."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QImage, QPainter, QPen

from ocmm_core.export import EXPORTERS, PDF, report, require_complete, write_report
from ocmm_core.export.template import Section
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import NO_REAL_PART, SIMULATED
from ocmm_core.tolerances.decisions import U_LABEL, DeviationPicture
from ocmm_gui import kit, views
from ocmm_gui.kit import ink, text_font, verdict_colour
from ocmm_gui.rendering import RenderMode
from ocmm_gui.reports._canvas import (
    INK,
    LEFT,
    PAGE,
    SMALL,
    WIDTH,
    PageCanvas,
    Style,
    paint_text,
    printable,
)  # fmt: skip
from ocmm_gui.reports._messages import lengths_of, numbers_of, speech_of
from ocmm_gui.reports._paper import (
    closing,
    head_facts,
    letterhead,
    paint_with_foot,
    records,
    written_pdf,
)
from ocmm_gui.reports._sections import basis, features, title, verdicts, why_not
from ocmm_gui.scene import Orbit, StillScene, Tag, paint_scene, painted_still


def deviation_scale(
    canvas: PageCanvas, data: report.ReportData, seen: DeviationPicture, reach_mm: float | None
) -> None:
    """Draw the scale of the whiskers below the picture; ``reach_mm``: of the colours, or None."""
    if not seen.whiskers:
        return

    def paint(painter: QPainter, box: QRectF) -> None:
        wide = box.adjusted(0.0, 10.0, -0.35 * box.width(), 0.0)
        views.paint_scale(painter, wide, seen, INK, _BOLDER, reach_mm, canvas.speech.word)

    canvas.draw(views.SCALE_PX[1] * _BOLDER + 20.0, paint, canvas.speech.word("Deviation"))
    shown = {whisker.feature for whisker in seen.whiskers}
    without = [item.name for item in data.view.features if item.points and item.name not in shown]
    if without:
        names = ", ".join(without)
        canvas.write_sentence(
            f"Without a whisker, as no zone of their surface has a value: {names}.", SMALL
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


def picture(canvas: PageCanvas, data: report.ReportData) -> None:
    """Draw the points and features of the job in the world frame."""
    items, reach = views.job_items(data.view, INK)
    if not len(reach):
        return
    seen = views.deviations_of(data.view)
    part, colour_mm = views.deviation_part(seen, data.view.placed_part, INK, RenderMode.SHADED)
    if part is not None:
        reach = np.concatenate([reach, part.T_world_from_model.apply(part.mesh.vertices)])
    orbit, height = _best_view(reach, data.frame.rotation[2])
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
            size = inside.size().toSize()
            still = StillScene(tuple(shapes), orbit, size, _SHARPER, INK.panel, part)
            painter.drawImage(QPointF(), painted_still(still, text_font(13.0)).image)
        painter.restore()
        ink(painter, QPen(QColor(INK.border), 2.0), Qt.BrushStyle.NoBrush)
        painter.drawRect(box)
        for word in words:
            _paint_word(painter, box.topLeft(), *word)

    tags = [item for item in items if isinstance(item, Tag)]
    places = orbit.project(np.array([tag.point for tag in tags]).reshape(-1, 3), WIDTH, height)
    words = list(placed_words(QRectF(0.0, 0.0, WIDTH, height), tags, places))
    canvas.draw(height, paint, canvas.speech.word("The part as measured"))
    if len(words) < len(tags):
        # A missing label must not suggest a missing feature.
        canvas.write_sentence(
            f"{len(tags) - len(words)} of {len(tags)} names have no room here.", SMALL
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
    wide, high = np.maximum(np.ptp(view.axes()[:2] @ reach.T, axis=1), 1.0)
    # Height for the full page width, within the limits of a page.
    height = float(np.clip(WIDTH * high / wide, _LEAST_HIGH, _MOST_HIGH))
    return float(min(WIDTH / wide, height / high)), view, height


def _paint_word(painter: QPainter, corner: QPointF, tag: Tag, at: QPointF, word: QRectF) -> None:
    """Paint a label of a place ``at``; positions are from ``corner`` on."""
    word, anchor = word.translated(corner), at + corner
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
        spots = _spots(anchor, metrics.horizontalAdvance(printable(tag.text)) + 2.0 * _PAD, height)
        inside = (spots[:, 0] >= box.left()) & (spots[:, 2] <= box.right())
        inside &= (spots[:, 1] >= box.top()) & (spots[:, 3] <= box.bottom())
        spots, others = spots[inside], taken[:count]
        if not len(spots):
            continue
        # Only labels within their reach are compared with each position.
        low, high = spots[:, :2].min(axis=0), spots[:, 2:].max(axis=0)
        others = others[np.all((others[:, :2] < high) & (others[:, 2:] > low), axis=1), None]
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


_ROW, _NAME, _SECTION_HIGH = 52.0, 520.0, 800.0
_BEYOND = 1.5
"""Deviations beyond this many half tolerances are drawn as an arrow."""


def deviations(canvas: PageCanvas, data: report.ReportData) -> None:
    """Draw every deviation in its tolerance, with its uncertainty as a whisker."""
    shown = [item for item in data.reported if _place(item) is not None]
    if not shown:
        return
    canvas.heading("Deviations within their tolerances", 4.0 * _ROW)
    canvas.write_sentence(f"Band: tolerance about its middle. Whisker: {U_LABEL}.", SMALL)
    for item in shown:
        canvas.draw(_ROW, partial(_paint_deviation, item=item, canvas=canvas), item.result.name)
        if views.is_section(item.result):
            paint = partial(
                views.paint_section, result=item.result, theme=INK, scale=_BOLDER,
                translate=canvas.speech.word,
            )  # fmt: skip
            canvas.draw(
                _SECTION_HIGH, paint, f"{canvas.speech.word('Section')}: {item.result.name}"
            )


def _place(item: report.ReportedResult) -> tuple[float, float] | None:
    """Return deviation and U in half tolerances from the middle; None if undefined."""
    result = item.result
    half = 0.5 * (result.upper - result.lower)
    if result.stated is None or half <= 0.0:
        return None
    _, deviation, uncertainty = result.stated
    middle = 0.5 * (result.upper + result.lower)
    return (deviation - middle) / half, uncertainty / half


def _paint_deviation(
    painter: QPainter, box: QRectF, *, item: report.ReportedResult, canvas: PageCanvas
) -> None:
    found, result = _place(item), item.result
    if found is None or result.deviation is None:
        return
    where, u = found
    named = QRectF(box.left(), box.top(), _NAME, box.height())
    paint_text(painter, named, result.name, Style(28.0), kit.LEFT)
    plot = box.adjusted(_NAME, 8.0, -360.0, -8.0)
    scale = 0.5 * plot.width() / _BEYOND
    centre = plot.center()
    ink(painter, Qt.PenStyle.NoPen, QColor(INK.zone_bad))
    painter.drawRect(plot)
    painter.setBrush(QColor(INK.zone_good))
    painter.drawRect(QRectF(centre.x() - scale, plot.top(), 2.0 * scale, plot.height()))
    painter.setPen(QPen(QColor(INK.border), 2.0))
    painter.drawLine(QPointF(centre.x(), plot.top()), QPointF(centre.x(), plot.bottom()))
    painter.setPen(QPen(QColor(INK.text), 3.0))
    ends = [centre.x() + scale * max(-_BEYOND, min(_BEYOND, where + s * u)) for s in (-1.0, 1.0)]
    painter.drawLine(QPointF(ends[0], centre.y()), QPointF(ends[1], centre.y()))
    x = centre.x() + scale * max(-_BEYOND, min(_BEYOND, where))
    painter.setBrush(QColor(INK.text))
    if abs(where) <= _BEYOND:
        painter.drawEllipse(QPointF(x, centre.y()), 9.0, 9.0)
    else:
        sense = math.copysign(1.0, where)
        painter.drawPolygon(
            [
                QPointF(x, centre.y()),
                QPointF(x - 22.0 * sense, centre.y() - 14.0),
                QPointF(x - 22.0 * sense, centre.y() + 14.0),
            ]
        )
    unit = "" if item.unit == "deg" else f" {canvas.lengths.word}"
    told = canvas.lengths.quantity(result.deviation, item.unit, signed=True)
    paint_text(
        painter, QRectF(plot.right() + 20.0, box.top(), 340.0, box.height()),
        canvas.speech.number(f"{told}{unit}"),
        Style(28.0, bold=True, colour=verdict_colour(INK, result.verdict)), kit.LEFT,
    )  # fmt: skip


_LONGEST_TITLE, _LONGEST_NUMBER = 200, 60

_BAND_TOP, _BAND_HIGH = 40.0, 72.0
"""Above the layout, so that it covers no number; tenths of a millimetre."""


SECTION_PAINTERS: dict[Section, Callable[[PageCanvas, report.ReportData], None]] = {
    "results": verdicts,
    "why": why_not,
    "deviations": deviations,
    "picture": picture,
    "features": features,
    "basis": basis,
}
"""Sections of a template; a test compares them with `export.report.SECTIONS`."""


def lay_out(data: report.ReportData) -> PageCanvas:
    canvas = PageCanvas(speech_of(data), lengths_of(data))
    with numbers_of(data):
        letterhead(canvas, data.paper)
        title(canvas, data)
        head_facts(canvas, data)
        for name in data.paper.template.sections:
            SECTION_PAINTERS[name](canvas, data)
        records(canvas, data)
        closing(canvas, data)
    return canvas


def page_picture(
    canvas: PageCanvas, index: int, data: report.ReportData, width: int = 1240
) -> QImage:
    scale = width / PAGE[0]
    image = QImage(width, round(scale * PAGE[1]), QImage.Format.Format_RGB32)
    image.fill(QColor("white"))
    painter = QPainter(image)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.scale(scale, scale)
    paint_page(painter, canvas, index, data)
    painter.end()
    return image


def pdf_bytes(
    data: report.ReportData,
    attachments: Mapping[str, bytes],
    progress: Callable[[int, int], None] = lambda _page, _pages: None,
) -> bytes:
    """Return the report as a PDF file with other files inside.

    `progress`: receives index and number of pages before each is painted. Raises StorageError if
    the file read back differs from the input.
    """
    canvas = lay_out(data)

    def paint(painter: QPainter, index: int) -> None:
        progress(index + 1, len(canvas.pages))
        paint_page(painter, canvas, index, data)

    return written_pdf(
        canvas,
        paint,
        attachments,
        title=report.one_line(f"{data.head.part} {data.head.serial}: {data.job}")[:_LONGEST_TITLE],
        software=data.written_by,
        utc=data.last_taken_utc or data.head.created_utc,
    )


def pdf_file(
    data: report.ReportData, progress: Callable[[int, int], None] = lambda _page, _pages: None
) -> tuple[str, bytes]:
    """Return name and content of ``<job>_report.pdf``; arguments and errors as `pdf_bytes`."""
    attachments = EXPORTERS["json"].contents((data,), report.polyworks_profile())
    return f"{data.stem}{PDF.suffixes[0]}", pdf_bytes(data, attachments, progress)


def write_pdf(data: report.ReportData, folder: Path, *, incomplete: bool = False) -> Path:
    """Write ``<job>_report.pdf`` with the JSON report inside, and its seal; return its path.

    Raises MeasuringError for an incomplete job without ``incomplete``, StorageError as `pdf_bytes`
    or if the folder cannot be written.
    """
    if not incomplete:
        # Before the pages are made, which takes a second.
        require_complete((data,))
    name, content = pdf_file(data)
    path, *_ = write_report(data, (), folder, incomplete=incomplete, beside={name: content})
    return path


def paint_page(painter: QPainter, canvas: PageCanvas, index: int, data: report.ReportData) -> None:
    if data.states:
        _paint_band(painter, data)
    # Every page identifies its report (ISO/IEC 17025, 7.8.2.1 d).
    number = report.report_number(data)
    # Shortened, so that the states after it fit on every page; complete among the facts.
    short = number if len(number) <= _LONGEST_NUMBER else f"{number[: _LONGEST_NUMBER - 1]}…"
    named = "   ".join((short, *map(speech_of(data).word, data.states), f"OCMM {data.written_by}"))
    with numbers_of(data):
        paint_with_foot(painter, canvas, index, named)


def _paint_band(painter: QPainter, data: report.ReportData) -> None:
    """Paint the states of the report across the top of a page, above all else."""
    band = QRectF(LEFT, _BAND_TOP, WIDTH, _BAND_HIGH)
    ink(painter, Qt.PenStyle.NoPen, QColor(INK.warn))
    painter.drawRect(band)
    speech = speech_of(data)
    words = "   ·   ".join(map(speech.word, data.states))
    if SIMULATED in data.states:
        words += f"   ({speech.text(NO_REAL_PART)})"
    style = Style(44.0, bold=True, colour="#ffffff")
    paint_text(painter, band, words, style, Qt.AlignmentFlag.AlignCenter)
