"""How our shapes and characteristics are called in QIF 3.0, and what their elements hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ocmm_core.export.report_data import Element
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float

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
    # QIF knows these two only as pairs of opposite lines: their sizes stand in attributes.
    Shape.SQUARE_SLOT: "OtherCurve",
    Shape.RECTANGLE: "OtherCurve",
    Shape.CONE: "Cone",
    Shape.TORUS: "Torus",
}

Zone = Literal["", "straightness", "orientation", "position", "round"]


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of characteristic.

    Attributes
    ----------
    word
        Begins the names of its elements.
    is_zone
        It is toleranced by the width of a zone, not by limits of a size.
    zone
        What the shape of the zone is called for; empty where there is none to tell.
    """

    word: str
    is_zone: bool = False
    zone: Zone = ""


_KINDS = {
    "diameter": Kind("Diameter"),
    "radius": Kind("Radius"),
    "length": Kind("Length"),
    "width": Kind("Width"),
    "distance": Kind("DistanceBetween"),
    "coordinate": Kind("LinearCoordinate"),
    "angle": Kind("AngleBetween"),
    "straightness": Kind("Straightness", is_zone=True, zone="straightness"),
    "flatness": Kind("Flatness", is_zone=True),
    "roundness": Kind("Circularity", is_zone=True),
    "cylindricity": Kind("Cylindricity", is_zone=True),
    "parallelism": Kind("Parallelism", is_zone=True, zone="orientation"),
    "perpendicularity": Kind("Perpendicularity", is_zone=True, zone="orientation"),
    "angularity": Kind("Angularity", is_zone=True, zone="orientation"),
    "position": Kind("Position", is_zone=True, zone="position"),
    "concentricity": Kind("Concentricity", is_zone=True, zone="round"),
    "coaxiality": Kind("Coaxiality", is_zone=True, zone="round"),
    "symmetry": Kind("Symmetry", is_zone=True),
    "line profile": Kind("LineProfile", is_zone=True),
    "surface profile": Kind("SurfaceProfile", is_zone=True),
    "circular runout": Kind("CircularRunout", is_zone=True),
    "total runout": Kind("TotalRunout", is_zone=True),
}

_FORMS = {
    Shape.LINE: _KINDS["straightness"],
    Shape.PLANE: _KINDS["flatness"],
    Shape.CIRCLE: _KINDS["roundness"],
    Shape.CYLINDER: _KINDS["cylindricity"],
    Shape.SPHERE: Kind("Sphericity", is_zone=True),
    Shape.CONE: Kind("Conicity", is_zone=True),
}


def feature_word(shape: Shape) -> str:
    """Return how the names of the elements of a feature begin."""
    return _WORDS[shape]


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
        return _FORMS.get(shape, Kind("OtherForm", is_zone=True)) if shape else Kind("OtherForm")
    if kind == "angle" and count == 1:
        return Kind("Angle")
    return _KINDS.get(kind, Kind("OtherForm", is_zone=True))


def definition_of(shape: Shape, element: Element, side: str, reach: float) -> list[Pair]:
    """Return what the definition of a feature holds; ``reach`` is how far a cone goes, mm."""
    sided: list[Pair] = [("InternalExternal", "INTERNAL" if side == "inner" else "EXTERNAL")]
    diameter, length, width = element.diameter or 0.0, element.length or 0.0, element.width or 0.0
    if shape in (Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER):
        return [*sided, ("Diameter", diameter)]
    if shape is Shape.CONE:
        return [
            *sided, ("Diameter", diameter), ("FullAngle", element.angle_deg or 0.0),
            ("LargeEndDistance", length or reach),
        ]  # fmt: skip
    if shape is Shape.ELLIPSE:
        return [*sided, ("MajorDiameter", length), ("MinorDiameter", width)]
    if shape is Shape.ROUND_SLOT:
        return [*sided, ("Diameter", width), ("Length", length)]
    if shape is Shape.TORUS:
        return [*sided, ("MinorDiameter", width), ("MajorDiameter", diameter)]
    return []


def place_of(shape: Shape, element: Element) -> list[Pair]:
    """Return where an element lies, as nominals tell it."""
    point, direction, across = element.point, element.direction, element.across
    if shape in (Shape.SQUARE_SLOT, Shape.RECTANGLE):
        return []
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
    if across is not None and shape is Shape.ROUND_SLOT:
        return [("CenterLine", [("Point", point), ("Vector", across)]), ("Normal", direction)]
    return [("Location", point), ("Normal", direction)]


def measured_of(shape: Shape, element: Element) -> list[Pair]:
    """Return where a measured element lies and how large it is."""
    place = place_of(shape, element)
    sizes: list[Pair] = []
    if shape in (Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER, Shape.CONE):
        sizes = _told(("Diameter", element.diameter), ("FullAngle", element.angle_deg))
    elif shape is Shape.ELLIPSE:
        sizes = _told(("MajorDiameter", element.length), ("MinorDiameter", element.width))
    elif shape is Shape.TORUS:
        sizes = _told(("MinorDiameter", element.width), ("MajorDiameter", element.diameter))
    elif shape is Shape.ROUND_SLOT:
        # The one feature whose size comes before its place.
        return [
            *_told(("Diameter", element.width)), *place, *_told(("Length", element.length))
        ]
    return [*place, *sizes]


def _told(*pairs: tuple[str, float | None]) -> list[Pair]:
    return [(name, value) for name, value in pairs if value is not None]
