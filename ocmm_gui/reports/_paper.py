"""Head and end of a report, and its PDF file.

Head: laboratory, customer, part, place, time, equipment. End: records, statements, signatures, end
mark. The file has the data of its pages inside, and is verified by reading back (decision 18).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial

import segno
from PySide6.QtCore import QBuffer, QByteArray, QIODevice, QMarginsF, QRectF, Qt
from PySide6.QtGui import (
    QColor,
    QImage,
    QPageLayout,
    QPageSize,
    QPainter,
    QPainterPath,
    QPdfWriter,
    QPen,
)

from ocmm_core.errors import InputError, StorageError
from ocmm_core.export import report
from ocmm_core.export.template import Paper
from ocmm_core.seals import shown_key
from ocmm_core.wording import Speech
from ocmm_gui.kit import ink
from ocmm_gui.reports._archival import PdfFacts, archival_pdf, attached
from ocmm_gui.reports._canvas import (
    BODY,
    BOTTOM,
    HEADING,
    INK,
    LEFT,
    SMALL,
    WIDTH,
    PageCanvas,
    Style,
    paint_line,
    paint_text,
    text_height,
    whole_words,
)

_RESOLUTION = 1200
_UNITS_PER_INCH = 254.0
_NUMBER = 320.0
"""Width reserved for the page number."""


def written_pdf(
    canvas: PageCanvas,
    paint: Callable[[QPainter, int], None],
    attachments: Mapping[str, bytes],
    *,
    title: str,
    software: str,
    utc: str,
) -> bytes:
    """Return pages as PDF/A-3a with their data as associated files.

    ``paint``: paints the page of an index, see `paint_with_foot`; in tenths of a millimetre;
    ``attachments``: by name; others as in `PdfFacts`. StorageError if the file read back differs.
    """
    content = QByteArray()
    buffer = QBuffer(content)
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    writer = QPdfWriter(buffer)
    writer.setPdfVersion(QPdfWriter.PdfVersion.PdfVersion_1_6)
    writer.setPageSize(QPageSize(QPageSize.PageSizeId.A4))
    writer.setPageMargins(QMarginsF(0.0, 0.0, 0.0, 0.0), QPageLayout.Unit.Millimeter)
    writer.setResolution(_RESOLUTION)
    painter = QPainter(writer)
    painter.scale(_RESOLUTION / _UNITS_PER_INCH, _RESOLUTION / _UNITS_PER_INCH)
    for index in range(len(canvas.pages)):
        if index:
            writer.newPage()
        paint(painter, index)
    painter.end()
    buffer.close()
    facts = PdfFacts(title, canvas.speech.language, software, utc)
    made = archival_pdf(bytes(content.data()), canvas.tags, facts, attachments)
    _require_whole(made, len(canvas.pages), attachments)
    return made


def paint_with_foot(painter: QPainter, canvas: PageCanvas, index: int, foot: str) -> None:
    """Paint a page with its foot: identification, page number and count."""
    for draw in canvas.pages[index]:
        draw(painter)
    box = QRectF(LEFT, BOTTOM + 30.0, WIDTH, 60.0)
    paint_line(painter, box.adjusted(0.0, 0.0, -_NUMBER, 0.0), foot, SMALL)
    paint_line(
        painter, box, canvas.speech.text(f"page {index + 1} of {len(canvas.pages)}"), SMALL,
        Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop,
    )  # fmt: skip


def _require_whole(pdf: bytes, pages: int, attachments: Mapping[str, bytes]) -> None:
    try:
        counted, inside = attached(pdf)
    except ValueError as error:
        raise _incomplete(str(error)) from error
    missing = [name for name, content in attachments.items() if inside.get(name) != content]
    if missing or counted != pages:
        without = f", without {', '.join(missing)}" if missing else ""
        raise _incomplete(f"{counted} of {pages} pages{without}")


def _incomplete(why: str) -> StorageError:
    return StorageError(
        "export.pdf", f"The PDF is incomplete: {why}.",
        "Write it again; other files are not affected.",
    )  # fmt: skip


_LOGO = (420.0, 150.0)
_MOST_PX = 4096
"""Limit of a template's picture, which may declare any size."""

_NAMED, _SAID, _UNSAID = (
    Style(25.0, colour=INK.muted), Style(25.0), Style(25.0, colour=INK.muted)
)  # fmt: skip
_GROUP = Style(27.0, bold=True)
_NAME_WIDTH, _GAP = 225.0, 40.0
_HALF = 0.5 * (WIDTH - _GAP)
_LONG = 240
"""Characters beyond which a fact gets the whole width, below the two columns."""

_COLUMNS = ((("laboratory", "Laboratory"), ("customer", "Customer"), ("item", "Item measured"),
             ("instrument", "Instrument")), (("measurement", "Measurement"),))  # fmt: skip


def letterhead(canvas: PageCanvas, paper: Paper) -> None:
    """Write the laboratory with its logo across the top of the first page, if known."""
    house = paper.template.laboratory
    logo = _picture(paper.logo)
    if not house.name and logo is None:
        return
    address = " · ".join([*house.address, *([house.contact] if house.contact else [])])
    width = WIDTH - (_LOGO[0] + _GAP if logo is not None else 0.0)
    small = Style(24.0, colour=INK.muted)
    named = text_height(house.name, HEADING, width)
    height = named + 6.0 + (text_height(address, small, width) if address else 0.0)

    def paint(painter: QPainter, box: QRectF) -> None:
        paint_text(painter, QRectF(box.left(), box.top(), width, named), house.name, HEADING)
        if address:
            below = QRectF(box.left(), box.top() + named + 6.0, width, box.height() - named)
            paint_text(painter, below, address, small)
        if logo is not None:
            _paint_logo(painter, box, logo)

    canvas.draw(max(height, _LOGO[1] if logo is not None else 0.0), paint)
    canvas.skip(26.0)


def head_facts(canvas: PageCanvas, data: report.ReportData) -> None:
    """Write the facts of the head in two columns; long ones below them, at full width."""
    facts = [
        replace(fact, name=canvas.speech.word(fact.name), value=canvas.speech.text(fact.value))
        for fact in report.paper_facts(data, canvas.lengths)
        if fact.name not in ("Title", "Statement")
    ]
    short = [fact for fact in facts if len(fact.value) <= _LONG]
    columns = [
        [
            (canvas.speech.word(words), [one for one in short if one.group == group])
            for group, words in groups
        ]
        for groups in _COLUMNS
    ]
    canvas.draw(
        max(sum(_block_height(block) for _, block in column) for column in columns),
        partial(
            _paint_columns,
            columns=columns,
            unsaid={report.NOT_STATED, canvas.speech.text(report.NOT_STATED)},
        ),
    )
    for fact in facts:
        if len(fact.value) > _LONG:
            canvas.skip(6.0)
            canvas.text(f"{fact.name}: {fact.value}", _SAID)


def _block_height(block: Sequence[report.PaperFact]) -> float:
    return 58.0 + sum(_fact_height(fact) for fact in block)


def _fact_height(fact: report.PaperFact) -> float:
    name = text_height(fact.name, _named(fact), _NAME_WIDTH - 10.0)
    return max(name, text_height(fact.value, _SAID, _HALF - _NAME_WIDTH)) + 5.0


def _named(fact: report.PaperFact) -> Style:
    return whole_words(fact.name, _NAMED, _NAME_WIDTH - 10.0)


def _paint_columns(
    painter: QPainter,
    box: QRectF,
    *,
    columns: Sequence[Sequence[tuple[str, list[report.PaperFact]]]],
    unsaid: Collection[str],
) -> None:
    for number, column in enumerate(columns):
        left, y = LEFT + number * (_HALF + _GAP), box.top()
        for words, block in column:
            paint_text(painter, QRectF(left, y + 12.0, _HALF, 40.0), words, _GROUP)
            y += 52.0
            for fact in block:
                height = _fact_height(fact)
                paint_text(
                    painter, QRectF(left, y, _NAME_WIDTH - 10.0, height), fact.name, _named(fact)
                )
                said = QRectF(left + _NAME_WIDTH, y, _HALF - _NAME_WIDTH, height)
                paint_text(painter, said, fact.value, _UNSAID if fact.value in unsaid else _SAID)
                y += height
            y += 6.0


def _picture(content: bytes) -> QImage | None:
    if not content:
        return None
    image = QImage.fromData(content)
    if image.isNull():
        fault = "cannot be drawn: it begins as a picture, and is damaged or far too large"
    elif max(image.width(), image.height()) > _MOST_PX:
        fault = f"is {image.width()} × {image.height()} pixels; at most {_MOST_PX} are drawn"
    else:
        return image
    raise InputError(
        "report.logo",
        f"The logo of the template (field 'laboratory.logo') {fault}.",
        "Give another picture, or leave the field empty.",
    )


def _paint_logo(painter: QPainter, box: QRectF, logo: QImage) -> None:
    scale = min(_LOGO[0] / logo.width(), _LOGO[1] / logo.height())
    width, height = scale * logo.width(), scale * logo.height()
    painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
    place = QRectF(box.right() - width, box.top(), width, height)
    painter.drawImage(place, logo, QRectF(logo.rect()), Qt.ImageConversionFlag.AutoColor)


_ABOVE = 140.0
"""Room to sign in, above the line."""
_STATEMENTS = Style(26.0)


def closing(canvas: PageCanvas, data: report.ReportData) -> None:
    told = [canvas.speech.text(one) for one in report.statements(data)]
    end = f"End of report {report.report_number(data)}"
    write_end(canvas, told, data.paper.template.signatures, end)


def write_end(canvas: PageCanvas, told: Sequence[str], signers: Sequence[str], end: str) -> None:
    """Write statements, signatures and the end on one page, never without other content."""
    words = [canvas.speech.text(one) for one in signers]
    each = WIDTH / len(words)
    below = 16.0 + max(text_height(one, SMALL, each - 60.0) for one in words)
    canvas.skip(30.0)
    height = sum(text_height(one, _STATEMENTS, WIDTH) + 6.0 for one in told) + _ABOVE + below + 50.0
    canvas.room_with_last(height)
    for sentence in told:
        canvas.text(sentence, _STATEMENTS)
    canvas.draw(_ABOVE + below, partial(_paint_signatures, words=words))
    last = canvas.speech.text(end)
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


def records(canvas: PageCanvas, data: report.ReportData) -> None:
    """Write the complete hashes, and the code that proves the job file."""
    canvas.heading("Records", 240.0)
    head, text = data.head, canvas.speech.text
    hashes = (
        ("Job", f"{data.job} ({head.job_uuid})"),
        ("Cameras", text(data.calibration.note or data.calibration.label)),
        ("Probe and tip", text(data.probe.note or data.probe.label)),
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


def _seal(canvas: PageCanvas, data: report.ReportData) -> None:
    """Write the step of the job that the report covers, with the code that proves the file."""
    seal = data.seal
    if seal is None:
        return
    _fact(canvas, "Job at step", f"{seal.steps}: {seal.head}", SMALL)
    _fact(
        canvas,
        "Signed with key",
        shown_key(seal.state.fingerprint) or canvas.speech.text("not signed"),
        SMALL,
    )
    if seal.line:
        canvas.skip(16.0)
        paint = partial(_paint_code, line=seal.line, speech=canvas.speech)
        canvas.draw(_CODE_SIDE, paint, canvas.speech.text(_CODE_WORDS))


def _paint_code(painter: QPainter, box: QRectF, *, line: str, speech: Speech) -> None:
    rows = [bytes(row) for row in segno.make(line, micro=False, error="m").matrix]
    side = _CODE_SIDE / len(rows)
    ink(painter, Qt.PenStyle.NoPen, QColor(INK.text))
    # One path: squares painted one by one leave hairlines between them.
    path = QPainterPath()
    path.setFillRule(Qt.FillRule.WindingFill)
    for y, row in enumerate(rows):
        for x, dark in enumerate(row):
            if dark:
                path.addRect(box.left() + x * side, box.top() + y * side, side, side)
    painter.drawPath(path)
    words = QRectF(box.left() + _CODE_SIDE + 40.0, box.top(), 1200.0, 110.0)
    paint_text(painter, words, speech.text(_CODE_WORDS), SMALL)


def _fact(canvas: PageCanvas, name: str, value: str, style: Style = BODY) -> None:
    y, pages = canvas.y, len(canvas.pages)
    canvas.text(value, style, left=LEFT + 360.0)
    if len(canvas.pages) > pages:
        y = canvas.y - 46.0
    box = QRectF(LEFT, y, 350.0, 60.0)
    muted, words = Style(style.size, colour=INK.muted), canvas.speech.word(name)
    draw = canvas.tagged(lambda painter: paint_text(painter, box, words, muted), "P")
    canvas.pages[-1].append(draw)
