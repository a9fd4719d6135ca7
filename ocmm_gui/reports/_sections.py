"""Sections of the report: verdict, results, features, uncertainty, records and hashes.

Symbols of geometrical tolerances are paths (ISO 1101, ISO 7083): fonts lack most of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPen, QPolygonF

from ocmm_core.export.report import ReportData, ReportedResult, one_line
from ocmm_core.features.shapes import MINIMUM_POINTS, Shape
from ocmm_core.inspection.evaluation import INCOMPLETE, SIMULATED_LINE
from ocmm_core.tolerances.decisions import U_LABEL, PartWord, Verdict, VerdictSummary
from ocmm_core.tolerances.kinds import Symbol, symbol_of
from ocmm_core.wording import Speech
from ocmm_gui.kit import ink, verdict_colour
from ocmm_gui.reports._canvas import (
    INK,
    SMALL,
    STRONG,
    TITLE,
    Column,
    PageCanvas,
    PageField,
    Style,
    on_one_line,
    paint_line,
    paint_text,
    printable,
)
from ocmm_gui.reports._messages import count_words, element_words, measurand, speech_of

_STROKE = 0.07
"""Line width relative to the height of the symbol (ISO 7083: a tenth of the letters)."""

_BOW = QRectF(0.1, 0.3, 0.8, 0.8)


def paint_symbol(painter: QPainter, symbol: Symbol, box: QRectF, colour: Qt.GlobalColor) -> None:
    side = min(box.width(), box.height())
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.translate(box.center().x() - 0.5 * side, box.center().y() - 0.5 * side)
    painter.scale(side, side)
    painter.setPen(QPen(colour, _STROKE, c=Qt.PenCapStyle.RoundCap, j=Qt.PenJoinStyle.RoundJoin))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawPath(_path(symbol))
    painter.restore()


def _path(symbol: Symbol) -> QPainterPath:
    path = QPainterPath()
    for points in symbol.lines:
        path.addPolygon(QPolygonF([QPointF(x, y) for x, y in points]))
    for x, y, radius in symbol.circles:
        path.addEllipse(QPointF(x, y), radius, radius)
    if symbol.bow:
        path.arcMoveTo(_BOW, 0.0)
        path.arcTo(_BOW, 0.0, 180.0)
    if symbol.bow == "closed":
        path.closeSubpath()
    return path


_VERDICT = 960.0

_MARKS = {
    Verdict.CONFORM: "✓",
    Verdict.NOT_CONFORM: "✗",
    Verdict.NOT_PROVEN: "?",
    Verdict.NOT_MEASURED: "–",
    Verdict.PROVISIONAL: "–",
    None: "–",
}

_MOST_NAMES = 24
"""Of characteristics in one reason at the head of a report: some six lines."""

RESULT_COLUMNS = (
    Column("", 70.0),
    Column("Characteristic", 380.0),
    Column("Datums", 200.0),
    Column("Nominal", 160.0, right=True, length=True),
    Column("Limits", 170.0, right=True, length=True),
    Column("Measured", 180.0, right=True, length=True),
    Column("Deviation", 165.0, right=True, length=True),
    Column(U_LABEL, 155.0, right=True, length=True),
    Column("Verdict", 320.0),
)

WHY_COLUMNS = (
    Column("Characteristic", 350.0),
    Column("Why", 640.0),
    Column("What to do", 620.0),
    Column("Points", 190.0, right=True),
)

FEATURE_COLUMNS = (
    Column("Feature", 250.0),
    Column("Verdict", 340.0),
    Column("Shape", 205.0),
    Column("Association", 180.0),
    Column("Points", 120.0, right=True),
    Column("Form", 160.0, right=True, length=True),
    Column("Actual element", 545.0, length=True),
)

BASIS_COLUMNS = (
    Column("Characteristic", 340.0),
    Column("Frame", 360.0),
    Column("Association", 300.0),
    Column("95 % interval", 340.0, right=True, length=True),
    Column("T / 2U", 120.0, right=True),
    Column("Form by noise", 170.0, right=True, length=True),
    Column("Bonus", 170.0, right=True, length=True),
)


def title(canvas: PageCanvas, data: ReportData) -> None:
    """Write the name of the part and its verdict with reasons."""
    canvas.draw(150.0, partial(_paint_title, data=data), role="H1")
    canvas.skip(20.0)
    part = data.part
    origin = (SIMULATED_LINE,) if data.view.simulated else ()
    speech = canvas.speech
    if part.requirement_words:
        colour = INK.warn if part.is_partial else INK.text
        told = f"{speech.text(part.requirement_words)}."
        canvas.text(told, Style(34.0, bold=True, colour=colour))
    names = (one.result.name for one in data.reported)
    if any(printable(one) != one for one in (data.head.part, data.head.operator, *names)):
        canvas.write_sentence(
            "Signs such as [U+4E2D] are in no font of this computer; data files have them.", SMALL
        )
    for line in (*origin, *(part.reasons or (part.summary.counted,))):
        fails = line.startswith(Verdict.NOT_CONFORM.value)
        plain = INK.text if line == part.summary.counted else INK.warn
        told = _shortened(line, speech)
        canvas.text(told, Style(34.0, bold=True, colour=INK.bad if fails else plain))
    if part.reasons:
        canvas.write_sentence(part.summary.counted, SMALL)
    for note in (data.view.unproven, *data.view.camera_doubts, *data.view.noise, *data.notes):
        if note:
            canvas.skip(6.0)
            canvas.text(f"! {canvas.speech.text(note)}", Style(32.0, bold=True, colour=INK.bad))


def _shortened(line: str, speech: Speech) -> str:
    """Return a reason with a limited number of names; the results list all."""
    names = line.split(", ")
    if len(names) <= _MOST_NAMES:
        return speech.text(line)
    count = len(names) - _MOST_NAMES
    more = speech.text(f"and {count:d} more, see the results")
    return f"{speech.text(', '.join(names[:_MOST_NAMES]))} {more}"


def verdicts(canvas: PageCanvas, data: ReportData) -> None:
    canvas.heading("Results", 200.0)
    rows = []
    remarks: list[str] = []
    shapes = {feature.name: feature.shape for feature in data.features}
    for item in data.reported:
        mark = ""
        if item.result.note:
            remarks.append(
                f"{len(remarks) + 1}) {item.result.name}: {canvas.speech.text(item.result.note)}"
            )
            mark = f" {len(remarks)})"
        rows.append(_result_row(item, mark, _symbol(item, shapes), canvas))
    _table_without(canvas, RESULT_COLUMNS, rows, "Datums")
    canvas.skip(12.0)
    for remark in remarks:
        canvas.text(remark, SMALL)


def _table_without(
    canvas: PageCanvas, columns: Sequence[Column], rows: list[list[PageField]], title: str
) -> None:
    """Lay out a table; a column empty in every row gives its width to the names."""
    place = [column.title for column in columns].index(title)
    if any(row[place].text not in ("", "–") for row in rows):
        canvas.table(columns, rows)
        return
    named = next(index for index, column in enumerate(columns) if column.title)
    wide = replace(columns[named], width=columns[named].width + columns[place].width)
    kept = [*columns[:named], wide, *columns[named + 1 : place], *columns[place + 1 :]]
    canvas.table(kept, [[*row[:place], *row[place + 1 :]] for row in rows])


def why_not(canvas: PageCanvas, data: ReportData) -> None:
    """Write why results are not CONFORM, and the remedies."""
    if not data.explanations:
        return
    canvas.heading("Why, and what to do", 260.0)
    rows = []
    for item in data.explanations:
        colour = verdict_colour(INK, item.verdict)
        said = item.why if not item.finding.evidence else f"{item.why}\n{item.finding.evidence}"
        rows.append(
            [
                PageField(
                    f"{_MARKS[item.verdict]} {item.characteristic}", Style(bold=True, colour=colour)
                ),
                PageField(canvas.speech.text(said)),
                PageField(canvas.speech.text(item.suggestion), STRONG),
                PageField(", ".join(str(number) for number in item.points) or "–"),
            ]
        )
    canvas.table(WHY_COLUMNS, rows)


def features(canvas: PageCanvas, data: ReportData) -> None:
    """Write the results of every feature."""
    canvas.heading("Features", 200.0)
    rows = []
    for feature in data.features:
        seen = feature.seen
        fit = seen.fit
        shows_form = fit is not None and len(seen.points) > MINIMUM_POINTS[feature.shape]
        element = feature.actual_element
        rows.append(
            [
                PageField(feature.name, STRONG),
                _verdict_field(
                    data.view.verdict_of(feature.name), canvas.speech, undone=seen.provisional
                ),
                PageField(canvas.speech.word(feature.shape.value)),
                PageField(
                    ""
                    if fit is None
                    else canvas.speech.word(fit.criterion.name.lower().replace("_", " "))
                ),
                PageField(canvas.speech.text(count_words(seen))),
                PageField(
                    canvas.speech.number(canvas.lengths.number(fit.form))
                    if fit is not None and shows_form
                    else "–"
                ),
                PageField(
                    canvas.speech.text(seen.note)
                    if element is None
                    else element_words(element, canvas.speech, canvas.lengths)
                ),
            ]
        )
    canvas.table(FEATURE_COLUMNS, rows)
    if data.annulled:
        canvas.skip(10.0)
        numbers = ", ".join(str(number) for number in data.annulled)
        canvas.write_sentence(f"Points undone, kept in the job file: {numbers}.", SMALL)


def _verdict_field(summary: VerdictSummary, speech: Speech, *, undone: bool) -> PageField:
    """Return verdict, count, deciding characteristic and missing items of a feature."""
    lines = [speech.word(INCOMPLETE)] if undone else []
    if summary.verdict is None:
        colour = INK.warn if undone else INK.muted
        return PageField(
            "\n".join([speech.text("no tolerance"), *lines]),
            Style(28.0, bold=undone, colour=colour),
        )
    if summary.verdict is not Verdict.CONFORM:
        lines.insert(0, summary.deciding)
    told = speech.text(summary.share) or speech.word(summary.verdict.value)
    words = f"{_MARKS[summary.verdict]} {told}"
    style = Style(28.0, bold=True, colour=verdict_colour(INK, summary.verdict))
    return PageField("\n".join([words, *lines]), style)


def basis(canvas: PageCanvas, data: ReportData) -> None:
    """Write the basis of the results: frame, association, interval, and noise of form."""
    rows, number, quantity = [], canvas.speech.number, canvas.lengths.quantity
    for item in data.reported:
        result = item.result
        if result.stated is None:
            continue
        rows.append(
            [
                PageField(result.name, STRONG),
                PageField(canvas.speech.text(result.frame).replace("|", " | ") or "–"),
                PageField(
                    canvas.speech.word(result.association or item.association or "least squares")
                ),
                PageField(
                    "–" if result.interval is None
                    else number(
                        f"{quantity(result.interval[0], item.unit)} … "
                        f"{quantity(result.interval[1], item.unit)}"
                    )
                ),
                PageField("–" if result.tur is None else number(f"{result.tur:.1f}")),
                PageField(
                    "–" if result.floor is None else number(quantity(result.floor, item.unit))
                ),
                PageField(number(quantity(result.bonus, item.unit)) if result.bonus else "–"),
            ]
        )  # fmt: skip
    if rows:
        canvas.heading("Basis of the results", 200.0)
        _table_without(canvas, BASIS_COLUMNS, rows, "Frame")


def _symbol(item: ReportedResult, shapes: Mapping[str, Shape]) -> Symbol | None:
    """Return the symbol of a result; None if it is written in words."""
    return symbol_of(item.result.kind, shapes.get(item.result.features[0]))


def _result_row(
    item: ReportedResult, mark: str, symbol: Symbol | None, canvas: PageCanvas
) -> list[PageField]:
    result, speech = item.result, canvas.speech

    def told_as(value: float, *, signed: bool = False) -> str:
        return canvas.lengths.quantity(value, item.unit, signed=signed)

    limits = f"{told_as(result.upper, signed=True)}\n{told_as(result.lower, signed=True)}"
    if item.one_sided:
        limits = f"≤\N{NO-BREAK SPACE}{told_as(result.upper)}"
    if result.bonus:
        letter = "L" if item.asked is not None and "least" in item.asked.modifier else "M"
        limits += f"\n({letter}) +{told_as(result.bonus)}"
    colour = verdict_colour(INK, result.verdict)
    draw = None if symbol is None else partial(_paint_symbol, symbol=symbol)
    numbers = ("–", "–", "–")
    if result.stated is not None:
        measured, deviation, uncertainty = result.stated
        numbers = (told_as(measured), told_as(deviation, signed=True), told_as(uncertainty))
    told = result.verdict.value
    if result.leaning:
        told += f", leaning {result.leaning}"
    word = f"{_MARKS[result.verdict]} {speech.word(told)}"
    return [
        PageField(draw=draw),
        PageField(f"{result.name}{mark}\n{measurand(item, speech)}"),
        PageField(" | ".join(item.datums)),
        PageField("–" if item.one_sided else speech.number(told_as(result.nominal))),
        PageField(speech.number(limits)),
        PageField(speech.number(numbers[0]), STRONG),
        PageField(speech.number(numbers[1])),
        PageField(speech.number(numbers[2])),
        PageField(word, Style(28.0, bold=True, colour=colour)),
    ]


def _paint_symbol(painter: QPainter, box: QRectF, *, symbol: Symbol) -> None:
    side = 36.0
    paint_symbol(
        painter, symbol, QRectF(box.left(), box.center().y() - 0.5 * side, side, side),
        Qt.GlobalColor.black,
    )  # fmt: skip


def _paint_title(painter: QPainter, box: QRectF, *, data: ReportData) -> None:
    part = data.part
    # Nothing extends below the verdict: long names are given in full among the facts.
    beside = box.adjusted(0.0, 0.0, -_VERDICT - 30.0, 0.0)
    speech = speech_of(data)
    paint_line(painter, beside, speech.text(data.paper.template.title), TITLE)
    named = f"{one_line(data.head.part)}   {speech.word('no.')} {one_line(data.head.serial)}"
    paint_line(painter, beside.adjusted(0.0, 84.0, 0.0, 0.0), named, Style(38.0))
    # On paper missing features are a warning, because measuring cannot be resumed.
    undone = part.word is PartWord.NOT_COMPLETE
    colour = INK.warn if undone else verdict_colour(INK, part.shown_as)
    frame = QRectF(box.right() - _VERDICT, box.top(), _VERDICT, 136.0)
    ink(painter, QPen(QColor(colour), 6.0), Qt.BrushStyle.NoBrush)
    painter.drawRoundedRect(frame, 14.0, 14.0)
    # NOT COMPLETE already implies it; the band above has all states.
    told = [state for state in data.states if not (undone and state == INCOMPLETE)]
    if told:
        states = QRectF(frame.left(), frame.top() + 8.0, frame.width(), 36.0)
        style = Style(28.0, bold=True, colour=INK.warn)
        paint_text(
            painter, states, " · ".join(map(speech.word, told)), style, Qt.AlignmentFlag.AlignCenter
        )
        frame.setTop(frame.top() + 36.0)
    count = "".join(f": {speech.text(one)}" for one in part.short_headline[1:])
    words = f"{_MARKS[part.shown_as]} {speech.word(part.word.value)}{count}"
    # In some languages it is longer, and a second line would cover the states.
    style = on_one_line(words, Style(56.0, bold=True, colour=colour), frame.width() - 30.0)
    paint_text(painter, frame, words, style, Qt.AlignmentFlag.AlignCenter)
