"""Elements of a QIF document: names, ids, numbers with all their digits.

Also the names of shapes and characteristics in QIF 3.0, contents of their elements, and faults that
the schema misses.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from lxml import etree

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
            held += _known_pairs(("Length", element.length))
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
    return [*_known_pairs(*before), *place_of(shape, element), *_known_pairs(*after)]


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


def _known_pairs(*pairs: tuple[str, float | None]) -> list[Pair]:
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


NAMESPACE = "http://qifstandards.org/xsd/qif3"

_UNIT = 1e-8
"""Tolerance of the length of a unit vector, by the standard."""

_VECTORS = frozenset({"Normal", "Direction", "Vector", "AxisVector", "AnalysisVector"})
_POINTS_TO = {
    "WholePointSetId": "MeasuredPointSet",
    "FeatureDefinitionId": "FeatureDefinition",
    "FeatureNominalId": "FeatureNominal",
    "FeatureNominalIds": "FeatureNominal",
    "FeatureItemId": "FeatureItem",
    "FeatureItemIds": "FeatureItem",
    "FeatureMeasurementIds": "FeatureMeasurement",
    "CharacteristicDefinitionId": "CharacteristicDefinition",
    "CharacteristicNominalId": "CharacteristicNominal",
    "CharacteristicItemId": "CharacteristicItem",
    "MeasurementDeviceId": "MeasurementDevice",
    "MeasurementDeviceIds": "MeasurementDevice",
    "FormalStandardId": "Standard",
    "DatumDefinitionId": "DatumDefinition",
    "DatumReferenceFrameId": "DatumReferenceFrame",
    "AsmPathId": "AsmPath",
    "Part": "Part",
    "ComponentIds": "Component",
    "ActualComponentIds": "ActualComponent",
}
"""End of the target element's name, by reference."""

_SAME_FAMILY = ("Definition", "Nominal", "Item")
"""References of this kind lead from one element of a feature or characteristic to its own next."""


def check_qif(tree: etree._Element) -> list[str]:
    """Return one sentence per fault of a document."""
    if tree.tag != f"{{{NAMESPACE}}}QIFDocument":
        return [f"The root is {tree.tag}, not a QIF document of version 3."]
    faults: list[str] = []
    by_id: dict[str, str] = {}
    for element in _elements(tree):
        own = element.get("id")
        if own is None:
            continue
        if own in by_id:
            faults.append(f"The id {own} is given twice.")
        by_id[own] = _name(element)
    largest = max((int(own) for own in by_id if own.isdigit()), default=0)
    if tree.get("idMax") != str(largest):
        faults.append(f"idMax is {tree.get('idMax')}, but the largest id is {largest}.")
    for element in _elements(tree):
        faults += _reference_faults(element, by_id)
        faults += _count_faults(element)
        faults += _number_faults(element)
    return faults


def _reference_faults(element: etree._Element, by_id: dict[str, str]) -> Iterator[str]:
    name = _name(element)
    if name == "Id" and element.getparent() is not None:
        parent = element.getparent()
        name = _name(parent) if parent is not None else name
    elif not name.endswith("Id") or name.endswith("QPId"):
        return
    wanted = (element.text or "").strip()
    if wanted not in by_id:
        yield f"{name} refers to {wanted!r}, which is not in the document."
        return
    target = _POINTS_TO.get(name)
    found = by_id[wanted]
    if target is None:
        yield f"{name} is an unknown reference."
    elif not found.endswith(target):
        yield f"{name} refers to {wanted}, which is a {found}."
    elif target.endswith(_SAME_FAMILY) and not name.endswith("Ids"):
        owner = element.getparent()
        if owner is not None and _family(_name(owner)) not in ("", _family(found)):
            yield f"{_name(owner)} {owner.get('id')} refers to {wanted}, which is a {found}."


def _count_faults(element: etree._Element) -> Iterator[str]:
    count = element.get("n")
    if count is not None:
        children = [child for child in _children(element) if _name(child) != "Attributes"]
        if count != str(len(children)):
            yield f"{_name(element)} says n = {count} and holds {len(children)}."
    if _name(element) == "MeasuredPointSet":
        wanted = element.get("count")
        for child in _children(element):
            if _name(child) in ("Points", "Normals"):
                numbers = len((child.text or "").split())
                if wanted is None or numbers != 3 * int(wanted):
                    yield (
                        f"Point set {element.get('id')} says {wanted} points; its {_name(child)} "
                        f"are {numbers} numbers."
                    )


def _number_faults(element: etree._Element) -> Iterator[str]:
    name = _name(element)
    if name not in _VECTORS and name not in ("Normals", "Points", "Value", "Location"):
        return
    try:
        numbers = [float(word) for word in (element.text or "").split()]
    except ValueError:
        if name != "Direction":
            # The direction of a coordinate is the name of an axis.
            yield f"{name} holds {element.text!r}, which is not a number."
        return
    if not all(math.isfinite(number) for number in numbers):
        yield f"{name} contains a non-finite number."
    elif name in _VECTORS or name == "Normals":
        for place in range(0, len(numbers) - 2, 3):
            length = math.hypot(*numbers[place : place + 3])
            if abs(length - 1.0) > _UNIT:
                yield f"{name} has length {length:.9f} and is not a unit vector."


def _family(name: str) -> str:
    """Return ``Circle Feature`` of ``CircleFeatureItem``; empty without a family."""
    for middle in ("Feature", "Characteristic"):
        before, found, after = name.partition(middle)
        if found and after in ("Definition", "Nominal", "Item", "Measurement"):
            return f"{before} {middle}"
    return ""


def _elements(tree: etree._Element) -> Iterator[etree._Element]:
    # Excludes comments and instructions.
    return tree.iter("{*}*")


def _children(element: etree._Element) -> list[etree._Element]:
    return list(element.iterchildren("{*}*"))


def _name(element: etree._Element) -> str:
    return etree.QName(element).localname
