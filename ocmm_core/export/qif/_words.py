"""How our shapes and characteristics are called in QIF 3.0, and what their elements hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_core.export.report import Element
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float
from ocmm_core.tolerances.kinds import spec_for

Value = float | Float | str
Pair = tuple[str, "Value | list[Pair]"]
"""Name of an XML element and what it holds: a number, a vector, text, or elements."""

_WORDS = {
    Shape.POINT: "Point",
    Shape.LINE: "Line",
    Shape.PLANE: "Plane",
    Shape.CIRCLE: "Circle",
    Shape.SPHERE: "Sphere",
    Shape.CYLINDER: "Cylinder",
    Shape.ELLIPSE: "Ellipse",
    Shape.ROUND_SLOT: "ElongatedCircle",
    Shape.SQUARE_SLOT: "OppositeParallelLines",
    Shape.RECTANGLE: "OppositeParallelLines",
    Shape.CONE: "Cone",
    Shape.TORUS: "Torus",
}


STARTING = (Shape.LINE, Shape.CYLINDER)
"""Shapes that QIF tells from the point where they begin, along their direction."""

_FLAT_SLOTS = (Shape.SQUARE_SLOT, Shape.RECTANGLE)


def feature_word(shape: Shape) -> str:
    """Return how the names of the elements of a feature begin."""
    return _WORDS[shape]


def characteristic_word(kind: str, shape: Shape | None, count: int) -> str:
    """Return how the names of the elements of a characteristic begin.

    Parameters
    ----------
    kind
        In the words of a plan.
    shape
        Of its first feature; None where it is not known.
    count
        Of its features.
    """
    words = spec_for(kind, shape).qif
    if count == 1 and words.of_one:
        return words.of_one
    return words.word if shape is None else words.of_shape.get(shape, words.word)


def definition_of(shape: Shape, element: Element, side: str) -> list[Pair]:
    """Return what the definition of a feature holds."""
    sided: list[Pair] = [("InternalExternal", "INTERNAL" if side == "inner" else "EXTERNAL")]
    diameter, length, width = element.diameter or 0.0, element.length or 0.0, element.width or 0.0
    if shape in (Shape.CIRCLE, Shape.SPHERE):
        return [*sided, ("Diameter", diameter)]
    if shape is Shape.CYLINDER:
        return [*sided, ("Diameter", diameter), *_told(("Length", element.length))]
    if shape is Shape.CONE:
        angle = element.angle_deg or 0.0
        return [*sided, ("Diameter", diameter), ("FullAngle", angle), *_ends(element, angle)]
    if shape is Shape.ELLIPSE:
        return [*sided, ("MajorDiameter", length), ("MinorDiameter", width)]
    if shape is Shape.ROUND_SLOT:
        return [*sided, ("Diameter", width), ("Length", length)]
    if shape in _FLAT_SLOTS:
        ends: list[Pair] = [("SlotEndEnum", "FLAT")]
        return [*sided, ("Width", width), ("Length", length), ("EndType", ends)]
    if shape is Shape.TORUS:
        return [*sided, ("MinorDiameter", width), ("MajorDiameter", diameter)]
    return []


def place_of(shape: Shape, element: Element) -> list[Pair]:
    """Return where an element lies, as nominals tell it."""
    point, direction, across = element.point, element.direction, element.across
    if shape is Shape.SPHERE or direction is None:
        return [("Location", point)]
    if shape in (Shape.CYLINDER, Shape.CONE):
        return [("Axis", [("AxisPoint", point), ("Direction", direction)])]
    if shape is Shape.TORUS:
        return [("Location", point), ("AxisVector", direction)]
    if shape is Shape.LINE:
        return [("Location", point), ("Direction", direction)]
    if across is not None and shape is Shape.ELLIPSE:
        return [("Axis", [("AxisPoint", point), ("Direction", across)]), ("Normal", direction)]
    if across is not None and shape in (Shape.ROUND_SLOT, *_FLAT_SLOTS):
        return [("CenterLine", [("StartPoint", point), ("Vector", across)]), ("Normal", direction)]
    return [("Location", point), ("Normal", direction)]


def nominal_of(shape: Shape, element: Element) -> list[Pair]:
    """Return where a nominal element lies; a line and a cylinder are told from their start."""
    if shape not in STARTING or element.length is None or element.direction is None:
        return place_of(shape, element)
    start = element.point - 0.5 * element.length * element.direction
    place = place_of(shape, replace(element, point=start))
    return [*place, ("Length", element.length)] if shape is Shape.LINE else place


def measured_of(shape: Shape, element: Element) -> list[Pair]:
    """Return where a measured element lies and how large it is."""
    place = place_of(shape, element)
    sizes: list[Pair] = []
    if shape in (Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER):
        sizes = _told(("Diameter", element.diameter))
    elif shape is Shape.CONE:
        sizes = _told(("Diameter", element.diameter), ("FullAngle", element.angle_deg))
    elif shape is Shape.ELLIPSE:
        sizes = _told(("MajorDiameter", element.length), ("MinorDiameter", element.width))
    elif shape is Shape.TORUS:
        sizes = _told(("MinorDiameter", element.width), ("MajorDiameter", element.diameter))
    elif shape in _FLAT_SLOTS:
        sizes = _told(("Width", element.width), ("Length", element.length))
    elif shape is Shape.ROUND_SLOT:
        # The one feature whose size comes before its place.
        return [*_told(("Diameter", element.width)), *place, *_told(("Length", element.length))]
    return [*place, *sizes]


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
