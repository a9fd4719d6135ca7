"""Statistics of a batch on paper: ``python -m ocmm_gui.reports._batch JOB... --out FILE``."""

from __future__ import annotations

import argparse
import math
import sys
from functools import partial
from pathlib import Path

import msgspec
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen

from ocmm_core.build import build_version
from ocmm_core.export import write_together
from ocmm_core.export.template import Paper, PaperLengths, load_paper, template_in_use
from ocmm_core.inspection.evaluation import SIMULATED, SIMULATED_LINE
from ocmm_core.inspection.finished import Comparison, Trend, compare_files
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.wording import ENGLISH, Speech
from ocmm_gui import kit
from ocmm_gui.kit import ink, later
from ocmm_gui.reports._canvas import (
    INK,
    SMALL,
    STRONG,
    TITLE,
    Column,
    PageCanvas,
    PageField,
    Style,
    draw,
    drawing,
    paint_text,
)
from ocmm_gui.reports._paper import letterhead, paint_with_foot, write_end, written_pdf
from ocmm_gui.work import Teller

COLUMNS = (
    Column("Characteristic", 450.0),
    Column("Parts", 240.0, right=True),
    Column("Mean", 210.0, right=True, length=True),
    Column("s", 180.0, right=True, length=True),
    Column("Cp", 120.0, right=True),
    Column("Cpk", 120.0, right=True),
    Column("95 %", 230.0, right=True),
    Column("Ppk", 120.0, right=True),
    Column("Signals", 130.0, right=True),
)
_RULES = (
    "Cp and Cpk from moving ranges, with the 95 % interval of Cpk; Ppk from the overall "
    "standard deviation s. Run rules: Western Electric 1 to 4 and Nelson 3."
)
_CHART = 520.0
_SCALE = 270.0
_EPOCH = "1970-01-01T00:00:00+00:00"
_MOST_SIGNALS = 12
_MOST_REASONS = 20


def lay_out(found: Comparison, paper: Paper) -> PageCanvas:
    """Return the pages: letterhead, table of all characteristics, a chart for each, signatures."""
    canvas = PageCanvas(Speech(paper.template.language), PaperLengths(paper.template.lengths))
    speech = canvas.speech
    letterhead(canvas, paper)
    canvas.write_sentence("Statistics of a batch", TITLE)
    if found.simulated:
        canvas.write_sentence(SIMULATED_LINE, Style(34.0, bold=True, colour=INK.warn))
    jobs = f"{len(found.jobs)} jobs of plan {found.plan}, {found.jobs[0]} to {found.jobs[-1]}."
    canvas.text(f"{speech.text(jobs)} {speech.text(canvas.lengths.sentence)}")
    canvas.table(COLUMNS, [_row(trend, canvas) for trend in found.trends])
    canvas.write_sentence(_RULES, SMALL)
    _reasons(canvas, found.left_out)
    for trend in found.trends:
        _characteristic(canvas, trend)
    write_end(canvas, (), paper.template.signatures, f"End of statistics of {found.plan}")
    return canvas


def batch_pdf(found: Comparison, paper: Paper) -> bytes:
    """Return the pages as PDF; StorageError as `written_pdf`."""
    canvas = lay_out(found, paper)
    speech = canvas.speech
    state = f"   {speech.word(SIMULATED)}" if found.simulated else ""
    foot = f"{found.plan}: {speech.text(f'{len(found.jobs)} jobs')}{state}   OCMM {build_version()}"
    return written_pdf(
        canvas,
        lambda painter, index: paint_with_foot(painter, canvas, index, foot),
        {"batch.json": _values(found)},
        title=speech.text(f"Statistics of a batch: {found.plan}"),
        software=build_version(),
        utc=max(
            (part.created_utc for trend in found.trends for part in trend.parts), default=_EPOCH
        ),
    )


def _values(found: Comparison) -> bytes:
    """Return the values on the pages as JSON."""
    values = {trend.name: trend.parts for trend in found.trends}
    content = {"schema": "ocmm.batch/1", "plan": found.plan, "simulated": found.simulated,
               "left_out": found.left_out, "values": values}  # fmt: skip
    return msgspec.json.format(msgspec.json.encode(content), indent=1)


def write_batch(found: Comparison, path: Path, tell: Teller) -> Path:
    """Return the written file; errors as `written_pdf`, and of the template of the station."""
    tell(later("Drawing the PDF"), 0.3)
    with drawing():
        content = batch_pdf(found, load_paper(template_in_use()))
    found.require_names()
    write_together({path: content})
    return path


def _row(trend: Trend, canvas: PageCanvas) -> list[PageField]:
    values, able, chart = trend.values, trend.capability, trend.chart
    speech, number = canvas.speech, canvas.speech.number
    between = " to " if speech.language == ENGLISH else " … "
    signals = "–" if chart is None else str(len(chart.signals) or speech.word("none"))
    odd = chart is not None and bool(chart.signals)
    return [
        PageField(trend.name, STRONG),
        PageField(speech.text(f"{len(values)} of {len(trend.parts)}")),
        PageField(_quantity(float(values.mean()), trend, canvas) if len(values) else "–"),
        PageField("–" if able is None else _quantity(able.sigma_overall, trend, canvas)),
        PageField("–" if able is None or able.cp is None else number(f"{able.cp:.2f}")),
        PageField("–" if able is None else number(f"{able.cpk:.2f}"), STRONG),
        PageField(
            "–" if able is None else number(f"{able.cpk_low:.2f}{between}{able.cpk_high:.2f}")
        ),
        PageField("–" if able is None else number(f"{able.ppk:.2f}")),
        PageField(signals, Style(26.0, bold=odd, colour=INK.warn if odd else INK.text)),
    ]


def _quantity(value: float, trend: Trend, canvas: PageCanvas) -> str:
    return canvas.speech.number(canvas.lengths.quantity(value, spec_of(trend.kind).unit))


def _characteristic(canvas: PageCanvas, trend: Trend) -> None:
    canvas.heading(trend.name, _CHART + 60.0)
    if len(trend.values):
        canvas.draw(_CHART, partial(_paint_chart, trend=trend, canvas=canvas), trend.name)
    able = trend.capability
    told = [able.summary if able is not None else trend.why_not, trend.caution]
    canvas.text(" ".join(canvas.speech.text(one) for one in told if one))
    if trend.chart is not None and trend.chart.signals:
        counted = [part for part in trend.parts if part.value is not None]
        lines = [
            f"{counted[i].job}: {canvas.speech.text(f'{why.rule}, {why.value}.')}"
            for i, why in trend.chart.signals[-_MOST_SIGNALS:]
        ]
        more = len(trend.chart.signals) - len(lines)
        first = [f"{more} earlier signals are in the table of the batch."] if more else []
        canvas.text(" ".join([*map(canvas.speech.text, first), *lines]), SMALL)
    _reasons(canvas, trend.left_out)


def _reasons(canvas: PageCanvas, reasons: tuple[str, ...]) -> None:
    if reasons:
        more = len(reasons) - _MOST_REASONS
        shown = [*reasons[:_MOST_REASONS], *([f"And {more} more."] if more > 0 else [])]
        said = " ".join(canvas.speech.text(one) for one in shown)
        canvas.text(f"{canvas.speech.word('Not counted')}: {said}", SMALL)


def _paint_chart(painter: QPainter, box: QRectF, *, trend: Trend, canvas: PageCanvas) -> None:
    plot = box.adjusted(_SCALE, 10.0, -10.0, -50.0)
    low, high = trend.span()

    def y(value: float) -> float:
        return plot.bottom() - (value - low) / (high - low) * plot.height()

    ink(painter, Qt.PenStyle.NoPen, QColor(INK.zone_good))
    top, bottom = y(min(trend.high, high)), y(max(trend.low, low))
    painter.drawRect(QRectF(plot.left(), top, plot.width(), bottom - top))
    levels = [("limit", one, Qt.PenStyle.SolidLine)
              for one in (trend.low, trend.high) if math.isfinite(one)]  # fmt: skip
    if trend.chart is not None:
        levels += [
            ("mean", trend.chart.centre, Qt.PenStyle.DotLine),
            ("UCL", trend.chart.high, Qt.PenStyle.DashLine),
            ("LCL", trend.chart.low, Qt.PenStyle.DashLine),
        ]
    taken: list[float] = []
    for name, value, style in levels:
        painter.setPen(QPen(QColor(INK.text), 2.5, style))
        painter.drawLine(QPointF(plot.left(), y(value)), QPointF(plot.right(), y(value)))
        # Overlapping words are illegible.
        if all(abs(y(value) - other) > 34.0 for other in taken):
            taken.append(y(value))
            told = QRectF(box.left(), y(value) - 18.0, _SCALE - 12.0, 36.0)
            words = f"{canvas.speech.word(name)} {_quantity(value, trend, canvas)}"
            paint_text(painter, told, words, SMALL, kit.RIGHT)
    _paint_parts(painter, plot, trend, low, high)
    foot = QRectF(plot.left(), plot.bottom() + 8.0, plot.width(), 36.0)
    paint_text(painter, foot, trend.parts[0].serial, SMALL)
    right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop
    paint_text(painter, foot, trend.parts[-1].serial, SMALL, right)


def _paint_parts(painter: QPainter, plot: QRectF, trend: Trend, low: float, high: float) -> None:
    scale, step = plot.height() / (high - low), plot.width() / len(trend.parts)
    size = min(max(0.4 * step, 3.0), 9.0)
    warned = set() if trend.chart is None else {index for index, _ in trend.chart.signals}
    before: QPointF | None = None
    marks: list[tuple[QPointF, bool]] = []
    counted = -1
    painter.setPen(QPen(QColor(INK.muted), 2.0))
    for index, part in enumerate(trend.parts):
        if part.value is None or part.uncertainty is None:
            continue
        counted += 1
        place = QPointF(
            plot.left() + (index + 0.5) * step, plot.bottom() - (part.value - low) * scale
        )
        if before is not None:
            painter.drawLine(before, place)
        reach = QPointF(0.0, part.uncertainty * scale)
        painter.drawLine(place - reach, place + reach)
        marks.append((place, counted in warned))
        before = place
    painter.setPen(QPen(QColor(INK.text), 1.5))
    # Points that need attention last, so that nothing hides them.
    for place, odd in sorted(marks, key=lambda one: one[1]):
        painter.setBrush(QColor(INK.bad if odd else INK.text))
        if odd:
            large = size + 3.0
            painter.drawRect(QRectF(place.x() - large, place.y() - large, 2.0 * large, 2.0 * large))
        else:
            painter.drawEllipse(place, size, size)


def main(arguments: list[str] | None = None) -> int:
    """Write the pages; return 0, 2 on failure, 3 after an unexpected error."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("jobs", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--feature", default="")
    parser.add_argument("--probes", type=Path)
    parser.add_argument("--calibrations", type=Path)
    options = parser.parse_args(arguments)

    def write() -> None:
        found = compare_files(
            options.jobs, probes=options.probes, calibrations=options.calibrations
        ).about(options.feature)
        content = batch_pdf(found, load_paper(template_in_use()))
        found.require_names()
        write_together({options.out: content})
        sys.stdout.write(f"{options.out}\n")

    return draw(write, "The statistics", "The jobs are unchanged.")


if __name__ == "__main__":
    sys.exit(main())
