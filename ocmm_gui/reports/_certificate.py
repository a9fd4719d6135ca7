"""The pages of a paper about the machine: ``python -m ocmm_gui.reports._certificate FOLDER``."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise
from pathlib import Path

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen

from ocmm_core.build import build_version
from ocmm_core.documents import decode_json
from ocmm_core.export.certificate import (
    Certificate,
    CertificateLine,
    CertificateRun,
    Conformity,
    air_said,
    certificate_facts,
    certificate_of_folder,
    certificate_title,
    rule_said,
    write_certificates,
)
from ocmm_core.export.report import NOT_STATED
from ocmm_core.export.template import PaperLengths, Particulars, load_paper, template_in_use
from ocmm_core.wording import Speech
from ocmm_gui import kit
from ocmm_gui.kit import ink
from ocmm_gui.reports._canvas import (
    INK,
    LEFT,
    SMALL,
    STRONG,
    TITLE,
    Column,
    PageCanvas,
    PageField,
    Style,
    draw,
    paint_text,
    text_height,
)
from ocmm_gui.reports._messages import table_of_values
from ocmm_gui.reports._paper import letterhead, paint_with_foot, write_end, written_pdf

_COLUMNS = (
    Column("Test", 485.0),
    Column("Measured", 225.0, right=True, length=True),
    Column("Certified", 225.0, right=True, length=True),
    Column("Error", 180.0, right=True, length=True),
    Column("U (k = 2)", 205.0, right=True, length=True),
    Column("MPE", 150.0, right=True, length=True),
    Column("Verdict", 330.0),
)
_COLOURS = {Conformity.CONFORM: INK.good, Conformity.NOT_CONFORM: INK.bad}
_NAME = 330.0
_PLOT = 1100.0
_HEADS = {"beforeAdjustment": "As found", "afterAdjustment": "After adjustment"}


def lay_out(paper: Certificate) -> PageCanvas:
    """Return the pages: head, verdicts, every error with U and limit, the graph, signatures."""
    template = paper.paper.template
    canvas = PageCanvas(Speech(template.language), PaperLengths(template.lengths))
    speech = canvas.speech
    letterhead(canvas, paper.paper)
    canvas.text(certificate_title(paper, speech), TITLE)
    last = paper.final
    if last is None and paper.not_after:
        canvas.write_sentence("NO STATEMENT OF CONFORMITY", Style(40.0, bold=True, colour=INK.warn))
    if last is not None:
        colour = {"pass": INK.good, "fail": INK.bad}.get(last.word, INK.warn)
        canvas.text(speech.text(last.summary).upper(), Style(40.0, bold=True, colour=colour))
    for state in paper.states:
        canvas.write_sentence(state, Style(34.0, bold=True, colour=INK.warn))
    canvas.skip(10.0)
    for fact in certificate_facts(paper, speech, canvas.lengths):
        if fact.name not in ("Title", "Statement"):
            value = fact.value if fact.stated else speech.text(NOT_STATED)
            _fact(canvas, speech.word(fact.name), value, stated=fact.stated)
    _state(canvas, "As found", paper.not_found)
    for run in paper.runs:
        _run(canvas, run)
    _state(canvas, "After adjustment", paper.not_after)
    table_of_values(canvas, paper)
    if len({abs(line.reference) for run in paper.runs for line in run.lines}) > 1:
        # Over a single length a graph adds nothing to the table.
        graph = "Errors between the permissible errors (MPE)"
        canvas.heading(graph, _PLOT)
        paint = partial(_paint_errors, paper=paper, speech=speech, lengths=canvas.lengths)
        canvas.draw(_PLOT, paint, speech.word(graph))
    _closing(canvas, paper)
    return canvas


def _state(canvas: PageCanvas, name: str, why: str) -> None:
    """Report a state that could not be determined, with the reason."""
    if why:
        speech = canvas.speech
        canvas.heading(f"{speech.word(name)}: {speech.word('not determined')}", 120.0)
        said = speech.text(why)
        canvas.text(f"{said[:1].upper()}{said[1:]}.", SMALL)


def certificate_pdf(paper: Certificate, files: Mapping[str, bytes]) -> bytes:
    """Return the pages as PDF with these files inside; StorageError as `written_pdf`."""
    canvas = lay_out(paper)
    # A single copied page must not be mistaken either.
    states = (canvas.speech.text(state.partition(":")[0]) for state in paper.states)
    foot = "   ".join((paper.number, *states, f"OCMM {build_version()}"))
    return written_pdf(
        canvas,
        lambda painter, index: paint_with_foot(painter, canvas, index, foot),
        files,
        title=f"{paper.title}: {paper.item}",
        software=build_version(),
        utc=paper.end_utc,
    )


def _run(canvas: PageCanvas, run: CertificateRun) -> None:
    speech = canvas.speech
    canvas.heading(f"{speech.word(_HEADS[run.status])}: {speech.text(run.summary)}", 200.0)
    warm = air_said(run, speech)
    if run.temperature_c is None:
        warm = ", ".join(part for part in (speech.text(NOT_STATED), warm) if part)
    when = run.made_utc[:16].replace("T", " ")
    rule = rule_said(run.rule, speech).removesuffix(".")
    canvas.text(f"{when} UTC, {run.made_by}, {warm}. {rule[:1].upper()}{rule[1:]}.", SMALL)
    for note in run.notes:
        canvas.write_sentence(note, SMALL)
    canvas.table(_COLUMNS, [_row(line, speech, canvas.lengths) for line in run.lines])
    canvas.skip(12.0)
    canvas.write_sentence(f"Record {run.record}; observations {run.data_sha256} (SHA-256)", SMALL)


def _line_said(name: str, speech: Speech) -> str:
    """Translate quantity and place of a line; the sign of a quantity stays."""
    whole = speech.text(name)
    if whole != name:
        return whole
    quantity, blank, place = name.partition(" ")
    parts = place.split(", ")
    return f"{quantity}{blank}{', '.join(map(speech.text, parts))}" if place else name


def _row(line: CertificateLine, speech: Speech, lengths: PaperLengths) -> list[PageField]:
    told, number = line.conformity, lengths.number
    return [
        PageField(_line_said(line.name, speech), STRONG),
        PageField(speech.number(number(line.measured))),
        PageField(speech.number(number(line.reference))),
        PageField(speech.number(number(line.error, signed=True)), STRONG),
        PageField(speech.number(number(line.expanded))),
        PageField(speech.number(number(line.limit))),
        PageField(
            speech.word(told.summary), Style(24.0, bold=True, colour=_COLOURS.get(told, INK.warn))
        ),
    ]


def _fact(canvas: PageCanvas, name: str, value: str, *, stated: bool) -> None:
    style = Style(25.0) if stated else SMALL
    height = max(text_height(value, style, 1800.0 - _NAME), 34.0)

    def paint(painter: QPainter, box: QRectF) -> None:
        paint_text(painter, QRectF(LEFT, box.top(), _NAME - 10.0, 60.0), name, SMALL)
        paint_text(painter, box.adjusted(_NAME, 0.0, 0.0, 0.0), value, style)

    canvas.draw(height + 4.0, paint)


def _closing(canvas: PageCanvas, paper: Certificate) -> None:
    facts = certificate_facts(paper, canvas.speech, canvas.lengths)
    said = [fact.value for fact in facts if fact.name == "Statement"]
    write_end(canvas, said, paper.paper.template.signatures, f"End of {paper.number}")


def _paint_errors(
    painter: QPainter, box: QRectF, *, paper: Certificate, speech: Speech, lengths: PaperLengths
) -> None:
    lines = [line for run in paper.runs for line in run.lines]
    plot = box.adjusted(190.0, 60.0, -20.0, -150.0)
    longest = max(abs(line.reference) for line in lines) or 1.0
    one = lengths.per_mm
    reach = max(max(line.limit, abs(line.error) + line.expanded) for line in lines)
    highest = _round_end(reach * one) / one

    def place(length: float, error: float) -> QPointF:
        return QPointF(
            plot.left() + plot.width() * abs(length) / (1.05 * longest),
            plot.center().y() - 0.5 * plot.height() * error / highest,
        )

    ink(painter, QPen(QColor(INK.border), 2.0), Qt.BrushStyle.NoBrush)
    painter.drawRect(plot)
    painter.drawLine(place(0.0, 0.0), place(1.05 * longest, 0.0))
    painter.setPen(QPen(QColor(INK.bad), 4.0))
    ordered = sorted({(abs(line.reference), line.limit) for line in lines})
    for sense in (1.0, -1.0):
        for length, limit in ordered:
            at = place(length, sense * limit)
            painter.drawLine(at - QPointF(16.0, 0.0), at + QPointF(16.0, 0.0))
        for first, second in pairwise(ordered):
            painter.drawLine(place(first[0], sense * first[1]), place(second[0], sense * second[1]))
    for run in paper.runs:
        filled = run is paper.final
        for line in run.lines:
            _paint_error(painter, place, line, filled=filled)
    _paint_scales(painter, box, plot, (longest, highest), speech, lengths)


def _round_end(reach: float) -> float:
    """Return the end of a scale, mm, whose half and whole need no rounding.

    A tick at 34.5 µm labelled 34 makes all nearby points look wrong.
    """
    wanted = max(1.1 * reach, 1e-6)
    power = 10.0 ** math.floor(math.log10(wanted))
    return float(power * next(step for step in (1.0, 2.0, 4.0, 6.0, 8.0, 10.0)
                              if step * power >= wanted))  # fmt: skip


def _paint_error(
    painter: QPainter,
    place: Callable[[float, float], QPointF],
    line: CertificateLine,
    *,
    filled: bool,
) -> None:
    painter.setPen(QPen(QColor(INK.text), 3.0))
    low = place(line.reference, line.error - line.expanded)
    painter.drawLine(low, place(line.reference, line.error + line.expanded))
    painter.setBrush(QColor(INK.text if filled else "#ffffff"))
    painter.drawEllipse(place(line.reference, line.error), 10.0, 10.0)


def _paint_scales(
    painter: QPainter,
    box: QRectF,
    plot: QRectF,
    ends: tuple[float, float],
    speech: Speech,
    lengths: PaperLengths,
) -> None:
    longest, highest = (end * lengths.per_mm for end in ends)
    small, unit = (1.0, "in") if lengths.unit == "inch" else (1e3, "µm")
    for share in (-1.0, -0.5, 0.0, 0.5, 1.0):
        y = plot.center().y() - 0.5 * plot.height() * share
        told = QRectF(box.left(), y - 18.0, 180.0, 36.0)
        value = speech.number(f"{small * share * highest:+g}") if share else "0"
        paint_text(painter, told, f"{value} {unit}", SMALL, kit.RIGHT)
    for share in (0.0, 0.5, 1.0):
        x = plot.left() + plot.width() * share / 1.05
        told = QRectF(x - 100.0, plot.bottom() + 8.0, 200.0, 36.0)
        align = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop
        at = f"{share * longest:.{0 if lengths.unit == 'mm' else 2}f} {lengths.word}"
        paint_text(painter, told, speech.number(at), SMALL, align)
    words = (
        "Error over certified length. Red: ± MPE. Whisker: U (k = 2). Filled: as the item is now; "
        "open: as found before an adjustment."
    )
    below = QRectF(plot.left(), box.bottom() - 100.0, plot.width(), 90.0)
    paint_text(painter, below, speech.text(words), SMALL)


def main(arguments: list[str] | None = None) -> int:
    """Write pages, DCC and signature; return 0, 2 on failure, 3 after an unexpected error."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--tip", default="")
    parser.add_argument("--calibration", action="store_true")
    parser.add_argument("--as-found", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--template", type=Path)
    parser.add_argument("--given", default="{}", help="Particulars, as JSON.")
    options = parser.parse_args(arguments)

    def write() -> None:
        given = decode_json(options.given, Particulars)
        paper = certificate_of_folder(
            options.folder, load_paper(options.template or template_in_use(), given), options.tip,
            calibration=options.calibration, as_found=options.as_found,
        )  # fmt: skip
        for path in write_certificates([(paper, partial(certificate_pdf, paper))], options.out):
            sys.stdout.write(f"{path}\n")

    return draw(write, "The certificate", "The records are unchanged.")


if __name__ == "__main__":
    sys.exit(main())
