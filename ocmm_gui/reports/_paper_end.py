"""End of a report: records, statements, signatures, end mark."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import segno
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPen

from ocmm_core.export.report import ReportData, report_number, statements
from ocmm_core.seals import shown_key
from ocmm_core.wording import Speech
from ocmm_gui.reports._canvas import (
    BODY,
    INK,
    LEFT,
    SMALL,
    WIDTH,
    Canvas,
    Style,
    paint_text,
    text_height,
)

_ABOVE = 140.0
"""Room to sign in, above the line."""
_SAID = Style(26.0)


def closing(canvas: Canvas, data: ReportData) -> None:
    told = [canvas.speech.say(one) for one in statements(data)]
    end = f"End of report {report_number(data)}"
    write_end(canvas, told, data.paper.template.signatures, end)


def write_end(canvas: Canvas, told: Sequence[str], signers: Sequence[str], end: str) -> None:
    """Write statements, signatures and the end on one page, never without other content."""
    words = [canvas.speech.say(one) for one in signers]
    each = WIDTH / len(words)
    below = 16.0 + max(text_height(one, SMALL, each - 60.0) for one in words)
    canvas.skip(30.0)
    height = sum(text_height(one, _SAID, WIDTH) + 6.0 for one in told) + _ABOVE + below + 50.0
    canvas.room_with_last(height)
    for sentence in told:
        canvas.text(sentence, _SAID)
    canvas.draw(_ABOVE + below, partial(_paint_signatures, words=words))
    last = canvas.speech.say(end)
    canvas.draw(50.0, lambda painter, box: paint_text(painter, box, last, SMALL))


def _paint_signatures(painter: QPainter, box: QRectF, *, words: list[str]) -> None:
    each = WIDTH / len(words)
    y = box.top() + _ABOVE
    for index, signer in enumerate(words):
        left, right = box.left() + index * each, box.left() + (index + 1) * each - 60.0
        painter.setPen(QPen(QColor(INK.text), 2.0))
        painter.drawLine(int(left), int(y), int(right), int(y))
        below = QRectF(left, y + 8.0, right - left, box.bottom() - y - 8.0)
        paint_text(painter, below, signer, SMALL)


_CODE_SIDE = 300.0
"""30 mm: half a millimetre a module, legible for any telephone."""


_CODE_WORDS = (
    "This code holds the head of the job file and its signature.\n"
    "ocmm audit verify JOB --line TEXT says whether a file is the one that was reported."
)


def records(canvas: Canvas, data: ReportData) -> None:
    """Write the complete hashes, and the code that proves the job file."""
    canvas.heading("Records", 240.0)
    head, say = data.head, canvas.speech.say
    hashes = (
        ("Job", f"{data.job} ({head.job_uuid})"),
        ("Cameras", say(data.calibration.note or data.calibration.label)),
        ("Probe and tip", say(data.probe.note or data.probe.label)),
        ("Reference body", data.reference.note),
        ("Plan, SHA-256", head.plan_identity),
        ("Cameras, SHA-256", head.rig_identity),
        ("Probe, SHA-256", head.probe_identity),
        ("Measured with", f"OCMM {head.software_version}"),
        ("Reported with", f"OCMM {data.written_by}"),
    )
    for name, value in hashes:
        if value:
            _fact(canvas, name, value, SMALL)
    _seal(canvas, data)


def _seal(canvas: Canvas, data: ReportData) -> None:
    """Write the step of the job that the report covers, with the code that proves the file."""
    seal = data.seal
    if seal is None:
        return
    _fact(canvas, "Job at step", f"{seal.steps}: {seal.head}", SMALL)
    _fact(
        canvas,
        "Signed with key",
        shown_key(seal.state.fingerprint) or canvas.speech.say("not signed"),
        SMALL,
    )
    if seal.line:
        canvas.skip(16.0)
        paint = partial(_paint_code, line=seal.line, speech=canvas.speech)
        canvas.draw(_CODE_SIDE, paint, canvas.speech.say(_CODE_WORDS))


def _paint_code(painter: QPainter, box: QRectF, *, line: str, speech: Speech) -> None:
    rows = [bytes(row) for row in segno.make(line, micro=False, error="m").matrix]
    side = _CODE_SIDE / len(rows)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(INK.text))
    # One path: squares painted one by one leave hairlines between them.
    path = QPainterPath()
    path.setFillRule(Qt.FillRule.WindingFill)
    for y, row in enumerate(rows):
        for x, dark in enumerate(row):
            if dark:
                path.addRect(box.left() + x * side, box.top() + y * side, side, side)
    painter.drawPath(path)
    words = QRectF(box.left() + _CODE_SIDE + 40.0, box.top(), 1200.0, 110.0)
    paint_text(
        painter, words,
        speech.say(_CODE_WORDS),
        SMALL,
    )  # fmt: skip


def _fact(canvas: Canvas, name: str, value: str, style: Style = BODY) -> None:
    y, pages = canvas.y, len(canvas.pages)
    canvas.text(value, style, left=LEFT + 360.0)
    if len(canvas.pages) > pages:
        y = canvas.y - 46.0
    box = QRectF(LEFT, y, 350.0, 60.0)
    muted, words = Style(style.size, colour=INK.muted), canvas.speech.word(name)
    draw = canvas.tagged(lambda painter: paint_text(painter, box, words, muted), "P")
    canvas.pages[-1].append(draw)
