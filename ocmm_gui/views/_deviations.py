"""Deviations of touched places: whiskers in the 3-D view, and their scale.

Whisker classes come from the core (`deviation_picture`); here they get a colour and a mark. Too
much material is red with a diamond, too little blue with a diamond, within the limits and accepted
green with a filled end, within and not accepted amber with a hollow one, held back grey: nothing
depends on distinguishing red from green.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QLinearGradient, QPainter, QPen

from ocmm_core.inspection.evaluation import JobView
from ocmm_core.tolerances.decisions import DeviationClass, DeviationPicture, deviation_picture
from ocmm_gui.kit import Theme, fitted, is_longer, later, length_number, length_words, text_font, tr
from ocmm_gui.scene import Diamonds, Dots, Item, Lines, Tag, blended

_LEAST_PX = 9
_BLUES = ("#0a4fb4", "#7db4ff")
"""Too little material, on light and on dark ground; the themes have no colour for it."""

_WORDS = {
    DeviationClass.MORE: later("{count} too much"),
    DeviationClass.LESS: later("{count} too little"),
    DeviationClass.WITHIN: later("{count} accepted"),
    DeviationClass.WITHIN_ONLY: later("{count} within, not accepted"),
    DeviationClass.HELD: later("{count} held back"),
}
_SCALE = later("Deviation from the middle of the zone, × {factor:g}")
_LOWER, _UPPER = later("lower limit"), later("upper limit")
_REACH = later("Colour: between points, to {reach:.1f} mm. Grey: not measured.")
Say = Callable[[str], str]
"""Translates a `later` sentence."""
_OUTSIDE = (DeviationClass.MORE, DeviationClass.LESS)
SHADES = {DeviationClass.MORE: 0.35, DeviationClass.LESS: 0.55}
"""Share of red or white at the limit: mixed with blue it would be grey: not measured."""
SCALE_PX = (340.0, 80.0)
"""Width and height of the scale at screen type size."""


def deviations_of(job: JobView) -> DeviationPicture:
    return deviation_picture(job.characteristics, job.held)


def deviation_colour(theme: Theme, kind: DeviationClass) -> str:
    if kind is DeviationClass.LESS:
        return _BLUES[0 if QColor(theme.panel).lightnessF() > 0.5 else 1]
    return {
        DeviationClass.MORE: theme.bad,
        DeviationClass.WITHIN: theme.good,
        DeviationClass.WITHIN_ONLY: theme.warn,
    }.get(kind, theme.muted)


def surface_colour(theme: Theme, kind: DeviationClass) -> str:
    """Return the colour of a class on the part: dark line colours are lightened."""
    light = QColor(theme.panel).lightnessF() > 0.5
    return blended(deviation_colour(theme, kind), "#ffffff", 0.4 if light else 0.0)


def limit_colour(theme: Theme, kind: DeviationClass, end: DeviationClass) -> str:
    """Return the colour at a limit for a class ``kind`` within it, at the end ``end``."""
    beyond = surface_colour(theme, end) if end is DeviationClass.MORE else "#ffffff"
    return blended(surface_colour(theme, kind), beyond, SHADES[end])


def deviation_items(picture: DeviationPicture, theme: Theme) -> tuple[Item, ...]:
    """Return the whiskers; the worst one is labelled with its deviation."""
    items: list[Item] = []
    for kind in DeviationClass:
        own = [whisker for whisker in picture.whiskers if whisker.kind is kind]
        if not own:
            continue
        colour = deviation_colour(theme, kind)
        segments = np.array([(whisker.base_world, whisker.end_world) for whisker in own])
        outside = kind in _OUTSIDE
        items.append(Lines(segments, colour, 3.4 if outside else 2.4))
        ends = segments[:, 1]
        if outside:
            items.append(Diamonds(ends, colour, 11.0))
        else:
            # A filled end is accepted, a hollow one is not.
            filled = kind is DeviationClass.WITHIN
            items.append(Dots(ends, colour if filled else theme.panel, 6.0, colour))
    worst = picture.worst
    if worst is not None:
        words = f"{worst.feature} {length_words(worst.deviation, signed=True)}"
        items.append(Tag(worst.end_world, words, deviation_colour(theme, worst.kind)))
    return tuple(items)


def scale_words(picture: DeviationPicture, say: Say = tr) -> tuple[str, str]:
    """Return the magnification of whiskers, and the counts per class."""
    counts = [(kind, picture.count(kind)) for kind in DeviationClass]
    return (
        say(_SCALE).format(factor=picture.factor),
        ", ".join(say(_WORDS[kind]).format(count=count) for kind, count in counts if count),
    )


def limit_words(picture: DeviationPicture, say: Say = tr) -> tuple[str, str, str]:
    """Return the labels at the ends and the middle of the inner scale."""
    if picture.limit is None:
        return say(_LOWER), "0", say(_UPPER)
    limit = picture.limit
    return length_number(-limit, signed=True), "0", length_words(limit, signed=True)


def scale_place(box: QRectF) -> QRectF:
    """Return the place of the scale in a view: the lower right corner."""
    wide, high = min(SCALE_PX[0], box.width() - 220.0), SCALE_PX[1]
    return QRectF(box.right() - wide - 10.0, box.bottom() - high - 4.0, wide, high)


def paint_scale(
    painter: QPainter, box: QRectF, picture: DeviationPicture, theme: Theme, scale: float = 1.0,
    reach_mm: float | None = None, say: Say = tr,
) -> None:  # fmt: skip
    """Paint the scale: too little, within, too much, with limits at the middle's ends.

    ``scale``: type size relative to the screen's; ``reach_mm``: colour reach; None: no colours.
    """
    if not picture.whiskers:
        return
    line = 15.0 * scale
    font, bold = text_font(11.0 * scale), text_font(11.0 * scale, bold=True)
    told, counted = scale_words(picture, say)
    painter.setPen(QColor(theme.text))
    _line(painter, QRectF(box.left(), box.top(), box.width(), line), told, font)
    bar = QRectF(box.left(), box.top() + 1.1 * line, box.width(), 0.8 * line)
    third = bar.width() / 4.0
    middle = QRectF(bar.left() + third, bar.top(), 2.0 * third, bar.height())
    painter.setPen(Qt.PenStyle.NoPen)
    look = deviation_colour if reach_mm is None else surface_colour
    for part, kind in (
        (QRectF(bar.left(), bar.top(), third, bar.height()), DeviationClass.LESS),
        (QRectF(middle.right(), bar.top(), third, bar.height()), DeviationClass.MORE),
    ):
        painter.setBrush(QColor(look(theme, kind)))
        painter.drawRect(part)
    within = [
        kind for kind in (DeviationClass.WITHIN, DeviationClass.WITHIN_ONLY) if picture.count(kind)
    ] or [DeviationClass.WITHIN_ONLY]
    for row, kind in enumerate(within):
        high = middle.height() / len(within)
        band = QRectF(middle.left(), middle.top() + row * high, middle.width(), high)
        if reach_mm is None:
            painter.setBrush(QColor(deviation_colour(theme, kind)))
        else:
            painter.setBrush(_shades(band, kind, theme))
        painter.drawRect(band)
    painter.setPen(QPen(QColor(theme.text), 1.4 * scale))
    places = (middle.left(), middle.center().x(), middle.right())
    for x in places:
        painter.drawLine(QPointF(x, bar.top() - 2.0 * scale), QPointF(x, bar.bottom() + 3 * scale))
    under = bar.bottom() + 3.0 * scale
    wide = 2.0 * third
    for x, words in zip(places, limit_words(picture, say), strict=True):
        _line(
            painter, QRectF(x - 0.5 * wide, under, wide, line), words, bold,
            Qt.AlignmentFlag.AlignHCenter,
        )  # fmt: skip
    _line(painter, QRectF(box.left(), under + line, box.width(), line), counted, font)
    if reach_mm is not None:
        below = QRectF(box.left(), under + 2.0 * line, box.width(), line)
        _line(painter, below, reach_words(reach_mm, say), font)


def reach_words(reach_mm: float, say: Say = tr) -> str:
    """Return the meaning of coloured and uncoloured regions."""
    return say(_REACH).format(reach=reach_mm)


def _shades(box: QRectF, kind: DeviationClass, theme: Theme) -> QLinearGradient:
    """Return the colours between the limits, from too little to too much."""
    shades = QLinearGradient(box.topLeft(), box.topRight())
    shades.setColorAt(0.5, QColor(surface_colour(theme, kind)))
    for place, end in ((0.0, DeviationClass.LESS), (1.0, DeviationClass.MORE)):
        shades.setColorAt(place, QColor(limit_colour(theme, kind, end)))
    return shades


def _line(
    painter: QPainter,
    box: QRectF,
    words: str,
    font: QFont,
    where: Qt.AlignmentFlag = Qt.AlignmentFlag.AlignLeft,
) -> None:
    if is_longer():
        least = fitted(font, words, box.width(), box.height(), font.pixelSize()).pixelSize()
        font = QFont(font)
        font.setPixelSize(max(_LEAST_PX, least))
    painter.setFont(font)
    shown = painter.fontMetrics().elidedText(
        words, Qt.TextElideMode.ElideRight, int(box.width()) + 1
    )
    painter.drawText(box, where | Qt.AlignmentFlag.AlignVCenter, shown)
