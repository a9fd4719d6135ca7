"""Head of a report: laboratory, customer, part, place, time, equipment."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QImage, QPainter

from ocmm_core.errors import InputError
from ocmm_core.export.report import NOT_STATED, PaperFact, ReportData, paper_facts
from ocmm_core.export.template import Paper
from ocmm_gui.reports._canvas import (
    HEADING,
    INK,
    LEFT,
    WIDTH,
    Canvas,
    Style,
    paint_text,
    text_height,
    whole_words,
)

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


def letterhead(canvas: Canvas, data: ReportData) -> None:
    """Write the laboratory with its logo across the top of the first page, if known."""
    paper_letterhead(canvas, data.paper)


def paper_letterhead(canvas: Canvas, paper: Paper) -> None:
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


def head_facts(canvas: Canvas, data: ReportData) -> None:
    """Write the facts of the head in two columns; long ones below them, at full width."""
    facts = [
        replace(fact, name=canvas.speech.word(fact.name), value=canvas.speech.say(fact.value))
        for fact in paper_facts(data, canvas.lengths)
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
    height = max(sum(_block_height(block) for _, block in column) for column in columns)
    canvas.draw(
        height,
        partial(
            _paint_columns, columns=columns, unsaid={NOT_STATED, canvas.speech.say(NOT_STATED)}
        ),
    )
    for fact in facts:
        if len(fact.value) > _LONG:
            canvas.skip(6.0)
            canvas.text(f"{fact.name}: {fact.value}", _SAID)


def _block_height(block: Sequence[PaperFact]) -> float:
    return 58.0 + sum(_fact_height(fact) for fact in block)


def _fact_height(fact: PaperFact) -> float:
    name = text_height(fact.name, _named(fact), _NAME_WIDTH - 10.0)
    return max(name, text_height(fact.value, _SAID, _HALF - _NAME_WIDTH)) + 5.0


def _named(fact: PaperFact) -> Style:
    return whole_words(fact.name, _NAMED, _NAME_WIDTH - 10.0)


def _paint_columns(
    painter: QPainter,
    box: QRectF,
    *,
    columns: Sequence[Sequence[tuple[str, list[PaperFact]]]],
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
                style = _UNSAID if fact.value in unsaid else _SAID
                paint_text(painter, said, fact.value, style)
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
