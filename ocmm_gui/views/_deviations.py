"""Deviations of touched places: whiskers in the 3-D view, their scale, and colours on the part.

Whisker classes come from the core (`deviation_picture`); here they get a colour and a mark. Too
much material is red with a diamond, too little blue with a diamond, within the limits and accepted
green with a filled end, within and not accepted amber with a hollow one, held back grey: nothing
depends on distinguishing red from green. The part is coloured near touched points (`value_field`),
and grey elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QLinearGradient, QPainter, QPen

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.part_model import PartModel, PlacedPart
from ocmm_core.tolerances.decisions import DeviationClass, DeviationPicture, deviation_picture
from ocmm_gui.kit import Theme, fitted, is_longer, later, length_number, length_words, text_font, tr
from ocmm_gui.rendering import (
    Colours,
    RenderMesh,
    RenderMode,
    RenderStyle,
    ValueField,
    face_colours,
    mesh_of,
    value_field,
)
from ocmm_gui.scene import (
    Diamonds,
    Dots,
    Item,
    Lines,
    PartScene,
    Tag,
    blended,
    edge_colour,
    part_colour,
)

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
Translate = Callable[[str], str]
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


def scale_words(picture: DeviationPicture, translate: Translate = tr) -> tuple[str, str]:
    """Return the magnification of whiskers, and the counts per class."""
    counts = [(kind, picture.count(kind)) for kind in DeviationClass]
    return (
        translate(_SCALE).format(factor=picture.factor),
        ", ".join(translate(_WORDS[kind]).format(count=count) for kind, count in counts if count),
    )


def limit_words(picture: DeviationPicture, translate: Translate = tr) -> tuple[str, str, str]:
    """Return the labels at the ends and the middle of the inner scale."""
    if picture.limit is None:
        return translate(_LOWER), "0", translate(_UPPER)
    limit = picture.limit
    return length_number(-limit, signed=True), "0", length_words(limit, signed=True)


def scale_place(box: QRectF) -> QRectF:
    """Return the place of the scale in a view: the lower right corner."""
    wide, high = min(SCALE_PX[0], box.width() - 220.0), SCALE_PX[1]
    return QRectF(box.right() - wide - 10.0, box.bottom() - high - 4.0, wide, high)


def paint_scale(
    painter: QPainter, box: QRectF, picture: DeviationPicture, theme: Theme, scale: float = 1.0,
    reach_mm: float | None = None, translate: Translate = tr,
) -> None:  # fmt: skip
    """Paint the scale: too little, within, too much, with limits at the middle's ends.

    ``scale``: type size relative to the screen's; ``reach_mm``: colour reach; None: no colours.
    """
    if not picture.whiskers:
        return
    line = 15.0 * scale
    font, bold = text_font(11.0 * scale), text_font(11.0 * scale, bold=True)
    told, counted = scale_words(picture, translate)
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
    for x, words in zip(places, limit_words(picture, translate), strict=True):
        _line(
            painter, QRectF(x - 0.5 * wide, under, wide, line), words, bold,
            Qt.AlignmentFlag.AlignHCenter,
        )  # fmt: skip
    _line(painter, QRectF(box.left(), under + line, box.width(), line), counted, font)
    if reach_mm is not None:
        below = QRectF(box.left(), under + 2.0 * line, box.width(), line)
        _line(painter, below, reach_words(reach_mm, translate), font)


def reach_words(reach_mm: float, translate: Translate = tr) -> str:
    """Return the meaning of coloured and uncoloured regions."""
    return translate(_REACH).format(reach=reach_mm)


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


@dataclass(frozen=True, slots=True, eq=False)
class FieldRequest:
    """Input of a field: places on the model (k, 3), mm, shares of limits, accepted."""

    points: Float
    shares: Float
    good: NDArray[np.bool_]

    def is_like(self, other: FieldRequest | None) -> bool:
        return (
            other is not None
            and np.array_equal(self.points, other.points)
            and np.array_equal(self.shares, other.shares)
            and np.array_equal(self.good, other.good)
        )


def field_request(picture: DeviationPicture, placed: PlacedPart | None) -> FieldRequest | None:
    """Return the request of a picture; None without a part or its pose."""
    whiskers = [item for item in picture.whiskers if item.kind is not DeviationClass.HELD]
    if placed is None or placed.is_rough or not whiskers:
        return None
    place = placed.T_world_from_model
    return FieldRequest(
        (np.stack([item.base_world for item in whiskers]) - place.translation) @ place.rotation,
        np.array([item.share for item in whiskers]),
        np.array([item.kind is DeviationClass.WITHIN for item in whiskers]),
    )


def make_field(mesh: RenderMesh, model: PartModel, wanted: FieldRequest) -> ValueField | None:
    """Return the field on a whole mesh of a model; None if no place lies on it."""
    return value_field(mesh, wanted.points, wanted.shares, wanted.good.tolist(), owners_of(model))


def owners_of(model: PartModel) -> Sequence[str]:
    """Return the feature of each face; empty for none."""
    return [face.feature for face in model.faces]


def field_colours(field: ValueField, colours: Colours, theme: Theme) -> Colours:
    """Return the vertex colours (n, 3) of a field; ``colours`` are those of the mesh."""
    found = colours[field.parents].copy()
    rows = np.flatnonzero(np.isfinite(field.values))
    shares, good = field.values[rows, None], field.good[rows, None]
    more, less = DeviationClass.MORE, DeviationClass.LESS
    size = np.abs(shares)
    mixed = np.zeros((len(rows), 3))
    for accepted, kind in ((True, DeviationClass.WITHIN), (False, DeviationClass.WITHIN_ONLY)):
        middle = _channels(surface_colour(theme, kind))
        ends = np.where(
            shares > 0.0,
            _channels(limit_colour(theme, kind, more)),
            _channels(limit_colour(theme, kind, less)),
        )
        mixed = np.where(good == accepted, middle + np.minimum(size, 1.0) * (ends - middle), mixed)
    # Beyond the limit the colour jumps: a place outside never looks nearly good.
    outside = np.where(
        shares > 0.0, _channels(surface_colour(theme, more)), _channels(surface_colour(theme, less))
    )
    found[rows] = np.round(np.where(size > 1.0, outside, mixed))
    return found


def deviation_part(
    picture: DeviationPicture, placed: PlacedPart | None, theme: Theme, mode: RenderMode
) -> tuple[PartScene | None, float | None]:
    """Return a placed part with its deviations, and the colour reach of a point, mm.

    For reports: at once. None without a located part, and for the reach if uncoloured.
    """
    if placed is None or placed.is_rough or not len(placed.model.triangles):
        return None, None
    mesh, field = _made(_Made(placed.model, field_request(picture, placed)))
    colours = face_colours(placed.model, part_colour(theme))
    if field is not None:
        mesh, colours = field.mesh, field_colours(field, colours, theme)
    style = RenderStyle(mode, edge_colour(theme), theme.panel, ground=theme.panel)
    scene = PartScene(mesh, colours, style, placed.T_world_from_model, moving=False, slack_mm=1.0)
    return scene, None if field is None else field.reach_mm


@dataclass(frozen=True, slots=True)
class _Made:
    """A model and a request; equal for equal requests on the same model."""

    model: PartModel
    wanted: FieldRequest | None

    def __eq__(self, other: object) -> bool:
        """Return whether the field would be the same."""
        if not isinstance(other, _Made) or self.model is not other.model:
            return False
        return self.wanted is other.wanted or (
            self.wanted is not None and self.wanted.is_like(other.wanted)
        )

    def __hash__(self) -> int:
        """Return a hash common to all requests of one model."""
        return id(self.model)


@lru_cache(maxsize=1)
def _made(made: _Made) -> tuple[RenderMesh, ValueField | None]:
    """Make a field; cached, because pages are laid out repeatedly for one job."""
    mesh = mesh_of(made.model)
    return mesh, None if made.wanted is None else make_field(mesh, made.model, made.wanted)


def _channels(colour: str) -> Float:
    read = QColor(colour)
    return np.array([read.red(), read.green(), read.blue()], dtype=np.float64)
