"""Elements of a QIF document: names, ids, numbers with all their digits.

Also the names of shapes and characteristics in QIF 3.0, and contents of their elements.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from lxml import etree

from ocmm_core.export.qif._check import NAMESPACE
from ocmm_core.export.report import Element, Units
from ocmm_core.features.shapes import QifShape, Shape
from ocmm_core.geometry import Float
from ocmm_core.tolerances.kinds import spec_for

Value = float | Float | str
Pair = tuple[str, "Value | list[Pair]"]
"""Name of an XML element and its content: a number, a vector, text, or elements."""


def feature_word(shape: Shape) -> str:
    """Return the prefix of a feature's element names."""
    return shape.spec.qif.feature


def is_told_from_start(shape: Shape) -> bool:
    """Return whether QIF locates a shape by its start along its direction."""
    return shape.spec.qif.extent in ("nominal", "definition")


def characteristic_word(kind: str, shape: Shape | None, count: int) -> str:
    """Return the prefix of a characteristic's element names, by its first feature's shape."""
    words = spec_for(kind, shape).qif
    if count == 1 and words.of_one:
        return words.of_one
    return words.word if shape is None else words.of_shape.get(shape, words.word)


def definition_of(shape: Shape, element: Element, side: str) -> list[Pair]:
    """Return the contents of a feature's definition."""
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
    """Return the location of an element in the form of nominals."""
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
    """Return the location of a nominal element; for a line and a cylinder by its start."""
    if not is_told_from_start(shape) or element.length is None or element.direction is None:
        return place_of(shape, element)
    start = element.point - 0.5 * element.length * element.direction
    place = place_of(shape, replace(element, point=start))
    return [*place, ("Length", element.length)] if shape.spec.qif.extent == "nominal" else place


def measured_of(shape: Shape, element: Element) -> list[Pair]:
    """Return location and size of a measured element."""
    words = shape.spec.qif
    sizes = _sizes(words, element)
    before, after = sizes[: words.before], sizes[words.before :]
    return [*_told(*before), *place_of(shape, element), *_told(*after)]


def _sizes(words: QifShape, element: Element) -> list[tuple[str, float | None]]:
    """Return the sizes of an element by name; None if unknown."""
    known = {
        "diameter": element.diameter,
        "length": element.length,
        "width": element.width,
        "angle_deg": element.angle_deg,
    }
    return [(name, known[field]) for name, field in words.sizes]


def _ends(element: Element, angle_deg: float) -> list[Pair]:
    """Return the ends of a cone along its axis; empty if the plan lacks its length."""
    if element.length is None:
        return []
    half = 0.5 * element.length
    ends: list[Pair] = [("LargeEndDistance", half)]
    narrowest = 0.5 * (element.diameter or 0.0) - half * np.tan(np.radians(0.5 * angle_deg))
    # Without a small end QIF extends the cone to its apex.
    return [*ends, ("SmallEndDistance", -half)] if narrowest > 0.0 else ends


def _told(*pairs: tuple[str, float | None]) -> list[Pair]:
    return [(name, value) for name, value in pairs if value is not None]


class Writer:
    """Make elements and assign ids."""

    def __init__(self) -> None:
        self.last_id = 0
        # The stubs do not know that the default namespace has no name.
        names = {None: NAMESPACE}
        self.root = etree.Element(f"{{{NAMESPACE}}}QIFDocument", nsmap=names)  # type: ignore[arg-type]

    def add(
        self,
        parent: etree._Element,
        name: str,
        content: Value | None = None,
        *,
        own_id: bool = False,
    ) -> etree._Element:
        """Add an element with text or numbers, and optionally an id."""
        element = etree.SubElement(parent, f"{{{NAMESPACE}}}{name}")
        if own_id:
            self.last_id += 1
            element.set("id", str(self.last_id))
        if content is not None:
            element.text = text_of(content)
        return element

    def add_all(self, parent: etree._Element, pairs: Sequence[Pair]) -> None:
        for name, content in pairs:
            if isinstance(content, list):
                self.add_all(self.add(parent, name), content)
            else:
                self.add(parent, name, content)

    def add_ids(self, parent: etree._Element, name: str, ids: Sequence[str]) -> None:
        """Add a list of references unless empty."""
        if ids:
            element = self.add(parent, name)
            element.set("n", str(len(ids)))
            for one in ids:
                self.add(element, "Id", one)

    def add_attributes(self, parent: etree._Element, values: Mapping[str, float | str]) -> None:
        """Add data without an element in QIF; they come first in their parent."""
        if not values:
            return
        element = self.add(parent, "Attributes")
        element.set("n", str(len(values)))
        for name, value in values.items():
            kind = "AttributeStr" if isinstance(value, str) else "AttributeD1"
            one = self.add(element, kind)
            one.set("name", name)
            one.set("value", text_of(value))


class Lists:
    """The four lists of features or characteristics: definitions, nominals, items, measurements."""

    def __init__(self, writer: Writer, parent: etree._Element, word: str) -> None:
        self.definitions = writer.add(parent, f"{word}Definitions")
        self.nominals = writer.add(parent, f"{word}Nominals")
        self.items = writer.add(parent, f"{word}Items")
        self._parent = parent

    def count(self) -> None:
        """Write the counts; empty lists are removed."""
        for element in (self.definitions, self.nominals, self.items):
            count_children(element, self._parent)


def count_children(element: etree._Element, parent: etree._Element) -> None:
    """Write the number of children of an element, or remove an empty one from its parent."""
    if len(element):
        element.set("n", str(len(element)))
    else:
        parent.remove(element)


def text_of(content: Value) -> str:
    """Return text or numbers for the document: all digits, never an exponent."""
    if isinstance(content, str):
        return content
    return " ".join(
        np.format_float_positional(value + 0.0, trim="0") for value in np.atleast_1d(content)
    )


def finite(name: str, value: float) -> float:
    """Return a number; StorageError if it cannot be reported."""
    return Units.finite(name, value, 0).value
