"""How our shapes and characteristics are called in QIF 3.0, and what their elements hold."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.export.report import Element
from ocmm_core.features.shapes import QifWords, Shape
from ocmm_core.geometry import Float

Value = float | Float | str
Pair = tuple[str, "Value | list[Pair]"]
"""Name of an XML element and what it holds: a number, a vector, text, or elements."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of characteristic.

    Attributes
    ----------
    word
        Begins the names of its elements.
    is_zone
        It is toleranced by the width of a zone, not by limits of a size.
    has_shape
        The shape of its zone must be told.
    has_modifier
        Its material condition must be told.
    """

    word: str
    is_zone: bool = False
    has_shape: bool = False
    has_modifier: bool = False


_KINDS = {
    "diameter": Kind("Diameter"),
    "radius": Kind("Radius"),
    "length": Kind("Length"),
    "width": Kind("Width"),
    "distance": Kind("DistanceBetween"),
    "coordinate": Kind("LinearCoordinate"),
    "angle": Kind("AngleBetween"),
    "straightness": Kind("Straightness", is_zone=True, has_shape=True),
    "flatness": Kind("Flatness", is_zone=True),
    "roundness": Kind("Circularity", is_zone=True),
    "cylindricity": Kind("Cylindricity", is_zone=True),
    "parallelism": Kind("Parallelism", is_zone=True, has_shape=True, has_modifier=True),
    "perpendicularity": Kind("Perpendicularity", is_zone=True, has_shape=True, has_modifier=True),
    "angularity": Kind("Angularity", is_zone=True, has_shape=True, has_modifier=True),
    "position": Kind("Position", is_zone=True, has_shape=True, has_modifier=True),
    "concentricity": Kind("Concentricity", is_zone=True, has_shape=True),
    "coaxiality": Kind("Coaxiality", is_zone=True, has_shape=True),
    "symmetry": Kind("Symmetry", is_zone=True),
    "line profile": Kind("LineProfile", is_zone=True),
    "surface profile": Kind("SurfaceProfile", is_zone=True),
    "circular runout": Kind("CircularRunout", is_zone=True),
    "total runout": Kind("TotalRunout", is_zone=True),
}

_BY_WORD = {kind.word: kind for kind in _KINDS.values()}
_OTHER_FORM = Kind("OtherForm", is_zone=True)
_OF_BALLS = {"diameter": Kind("SphericalDiameter"), "radius": Kind("SphericalRadius")}


def feature_word(shape: Shape) -> str:
    """Return how the names of the elements of a feature begin."""
    return shape.spec.qif.feature


def is_told_from_start(shape: Shape) -> bool:
    """Return whether QIF tells a shape from the point where it begins, along its direction."""
    return shape.spec.qif.extent in ("nominal", "definition")


def kind_of(kind: str, shape: Shape | None, count: int) -> Kind:
    """Return a kind of characteristic.

    Parameters
    ----------
    kind
        In the words of a plan; ``"form"`` is that of its shape.
    shape
        Of its first feature.
    count
        Of its features.
    """
    if kind == "form":
        word = _OTHER_FORM.word if shape is None else shape.spec.qif.form
        return _BY_WORD.get(word, Kind(word, is_zone=True))
    if kind == "angle" and count == 1:
        return Kind("Angle")
    if shape is Shape.SPHERE and kind in _OF_BALLS:
        return _OF_BALLS[kind]
    return _KINDS.get(kind, _OTHER_FORM)


def definition_of(shape: Shape, element: Element, side: str) -> list[Pair]:
    """Return what the definition of a feature holds."""
    words = shape.spec.qif
    if not words.sizes:
        return []
    held: list[Pair] = [("InternalExternal", "INTERNAL" if side == "inner" else "EXTERNAL")]
    held += [(name, value or 0.0) for name, value in _sizes(words, element)]
    match words.extent:
        case "definition":
            held += _told(("Length", element.length))
        case "cone":
            held += _ends(element, element.angle_deg or 0.0)
        case "flat":
            ends: list[Pair] = [("SlotEndEnum", "FLAT")]
            held.append(("EndType", ends))
        case "" | "nominal":
            pass
    return held


def place_of(shape: Shape, element: Element) -> list[Pair]:
    """Return where an element lies, as nominals tell it."""
    point, direction, across = element.point, element.direction, element.across
    place = shape.spec.qif.place
    if place == "location" or direction is None:
        return [("Location", point)]
    match place:
        case "axis":
            return [("Axis", [("AxisPoint", point), ("Direction", direction)])]
        case "location, axis":
            return [("Location", point), ("AxisVector", direction)]
        case "location, direction":
            return [("Location", point), ("Direction", direction)]
        case "long axis" if across is not None:
            axis: list[Pair] = [("AxisPoint", point), ("Direction", across)]
            return [("Axis", axis), ("Normal", direction)]
        case "centre line" if across is not None:
            line: list[Pair] = [("StartPoint", point), ("Vector", across)]
            return [("CenterLine", line), ("Normal", direction)]
        case "location, normal" | "long axis" | "centre line":
            return [("Location", point), ("Normal", direction)]


def nominal_of(shape: Shape, element: Element) -> list[Pair]:
    """Return where a nominal element lies; a line and a cylinder are told from their start."""
    if not is_told_from_start(shape) or element.length is None or element.direction is None:
        return place_of(shape, element)
    start = element.point - 0.5 * element.length * element.direction
    place = place_of(shape, replace(element, point=start))
    return [*place, ("Length", element.length)] if shape.spec.qif.extent == "nominal" else place


def measured_of(shape: Shape, element: Element) -> list[Pair]:
    """Return where a measured element lies and how large it is."""
    words = shape.spec.qif
    sizes = _sizes(words, element)
    before, after = sizes[: words.before], sizes[words.before :]
    return [*_told(*before), *place_of(shape, element), *_told(*after)]


def _sizes(words: QifWords, element: Element) -> list[tuple[str, float | None]]:
    """Return the sizes of an element by their names; None where one is not known."""
    known = {
        "diameter": element.diameter,
        "length": element.length,
        "width": element.width,
        "angle_deg": element.angle_deg,
    }
    return [(name, known[field]) for name, field in words.sizes]


def _ends(element: Element, angle_deg: float) -> list[Pair]:
    """Return where a cone ends along its axis; nothing where the plan does not know its length."""
    if element.length is None:
        return []
    half = 0.5 * element.length
    ends: list[Pair] = [("LargeEndDistance", half)]
    narrowest = 0.5 * (element.diameter or 0.0) - half * np.tan(np.radians(0.5 * angle_deg))
    # Without a small end QIF takes the cone to its apex.
    return [*ends, ("SmallEndDistance", -half)] if narrowest > 0.0 else ends


def _told(*pairs: tuple[str, float | None]) -> list[Pair]:
    return [(name, value) for name, value in pairs if value is not None]
