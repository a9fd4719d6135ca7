"""Elements of a QIF document that track what was read, and its units.

An item is imported only if every child and attribute of its elements was read, or is listed in
`HARMLESS` with the reason. Anything else refuses the item by name: a skipped modifier would turn
one tolerance into another.

A document declares its units by name and factor (Units.xsd, ``S = (X + Offset) Factor``); a value
names one of them, or none for the primary one; none is guessed. In characteristics the PMI units
have priority. A known name must have its usual factor.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from dataclasses import dataclass

from lxml import etree

from ocmm_core.export.qif._writer import NAMESPACE
from ocmm_core.names import name_fault, normal_name, usable_name
from ocmm_core.units import Dimension, agreed_unit, find_unit, scaled

_ROUNDED = 1e-6
"""Relative: a factor is written with at least seven digits."""


class NotTakenError(Exception):
    """Why an item, or the whole document, is not imported."""


@dataclass(frozen=True, slots=True)
class DocumentUnits:
    lengths: MutableMapping[str, float]
    """mm per declared unit, by name."""
    angles: MutableMapping[str, float]
    """Degrees per declared unit, by name."""
    primary: MutableMapping[str, str]
    """Names of the primary units by element, such as ``PMIAngularUnit``."""

    def length(self, name: str, *, is_pmi: bool) -> float:
        """Return mm per unit, the primary one for an empty name; NotTakenError if unknown."""
        return self._scale(name, "LinearUnit", self.lengths, "length", is_pmi=is_pmi)

    def angle(self, name: str, *, is_pmi: bool) -> float:
        """Return degrees per unit of a value, likewise."""
        return self._scale(name, "AngularUnit", self.angles, "angle", is_pmi=is_pmi)

    def _scale(
        self,
        name: str,
        element: str,
        declared: Mapping[str, float],
        dimension: Dimension,
        *,
        is_pmi: bool,
    ) -> float:
        primary = self.primary.get(element, "")
        word = name or (self.primary.get(f"PMI{element}", primary) if is_pmi else primary)
        if not word:
            raise NotTakenError(f"the document states no {element} for it")
        known = find_unit(word, dimension)
        found = declared.get(word, None if known is None else known.factor)
        if found is None:
            raise NotTakenError(f"its unit {word[:30]!r} is not known")
        return found


def units_of(root: etree._Element, prefix: str) -> DocumentUnits:
    """Read the units that a document declares.

    `prefix`: namespace of its elements, in braces. Raises InputError if a name contradicts its
    factor, NotTakenError for an unknown unit without a factor, or one name with two factors.
    """
    units = DocumentUnits({}, {}, {})
    for group in ("PrimaryUnits", "OtherUnits"):
        for unit in root.iterfind(f"{prefix}FileUnits/{prefix}{group}/*"):
            word = str(unit.tag).removeprefix(prefix)
            if word not in ("LinearUnit", "PMILinearUnit", "AngularUnit", "PMIAngularUnit"):
                continue
            name = (unit.findtext(f"{prefix}UnitName") or "").strip()
            is_length = word.endswith("LinearUnit")
            scale = _scale_of(unit, name, prefix, "length" if is_length else "angle")
            held = units.lengths if is_length else units.angles
            if not math.isclose(held.setdefault(name, scale), scale, rel_tol=_ROUNDED):
                raise NotTakenError(f"unit {name[:30]!r} has two factors")
            if group == "PrimaryUnits" and units.primary.setdefault(word, name) != name:
                raise NotTakenError(f"it has two primary units {word}")
    return units


def _scale_of(unit: etree._Element, name: str, prefix: str, dimension: Dimension) -> float:
    """Return mm or degrees per declared unit; the exact factor of a known name."""
    si = (unit.findtext(f"{prefix}SIUnitName") or "").strip()
    if si not in ("", "meter" if dimension == "length" else "radian"):
        raise NotTakenError(f"unit {name[:30]!r} is converted to {si[:30]!r}")
    conversion, factor = unit.find(f"{prefix}UnitConversion"), None
    if conversion is not None:
        factor = number(conversion.findtext(f"{prefix}Factor") or "")
        if factor <= 0.0 or number(conversion.findtext(f"{prefix}Offset") or "0") != 0.0:
            raise NotTakenError(f"unit {name[:30]!r} has no positive factor alone")
    if find_unit(name, dimension) is not None:
        return agreed_unit(name, factor, dimension, "FileUnits").factor
    if factor is None:
        raise NotTakenError(f"unit {name[:30]!r} is not known and has no factor")
    return scaled(factor, 1000.0 if dimension == "length" else math.degrees(1.0))


def number(text: str) -> float:
    """Return a finite number; NotTakenError otherwise."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in text:
        raise NotTakenError(f"{text.strip()[:30]!r} is no number")
    return value


Q = f"{{{NAMESPACE}}}"

HARMLESS = frozenset({
    # Data of the writing program, prose, labels, identity, places on a drawing, links to a model.
    "Attributes", "Balloon", "CharacteristicDesignator", "Description", "LocationOnDrawing", "Name",
    "UUID", "EntityExternalIds", "EntityInternalIds", "ParentFeatureItemId",
    "ParentFeatureNominalId", "SurfaceFeatureNominalId",
    # An earlier measurement.
    "MeasurementDeviceIds", "NotableEventIds", "PointList",
    # Extents without touches, and outlines: imported planes have no targets.
    "Bottom", "Depth", "PolyLine", "Rectangle", "Circle",
    # The same value in a second unit, for display.
    "ToleranceDualValue", "TargetDualValue", "MaxDualValue", "MinDualValue",
})  # fmt: skip
"""Children that change neither geometry nor tolerance."""

FLAGS = frozenset({
    "FreeState", "StatisticalCharacteristic", "CommonZone", "CommonTolerance", "MedianFeature",
    "EnvelopeRequirement", "Independency", "UnitedOrContinuousFeature", "SeparateZone",
    "OrientationOnly", "TangentPlane", "EachRadialElement", "EachElement", "OffsetZone",
    "VariableAngle", "NotConvex", "SingleOpenEnd", "ContactingFeature", "DistanceVariable",
    "DatumFixed", "ConstrainOrientation", "ConstrainSubsequent",
})  # fmt: skip
"""Modifiers that are off if false; true refuses the item."""

UNDEFINED = frozenset({
    "AssociatedTolerancedFeatureSpecificationElement", "Extent",
})  # fmt: skip
"""Choices that add nothing if their whole text is UNDEFINED."""

HARMLESS_ATTRIBUTES = frozenset({
    "id", "label", "decimalPlaces", "significantFigures", "validity",
    "xDecimalPlaces", "xSignificantFigures", "xValidity",
    "yDecimalPlaces", "ySignificantFigures", "yValidity",
    "zDecimalPlaces", "zSignificantFigures", "zValidity",
})  # fmt: skip
"""Identity, and digits for display."""


_STATED = (
    "TargetValue", "MaxValue", "MinValue", "ToleranceValue", "MaterialCondition",
)  # fmt: skip
"""Elements that describe a requirement in its account."""


class Node:
    """An element that tracks which of its children and attributes were read.

    `units`: of the document. `is_pmi`: use those of PMI (characteristics).
    """

    def __init__(self, element: etree._Element, units: DocumentUnits, *, is_pmi: bool) -> None:
        self.element, self._units, self._is_pmi = element, units, is_pmi
        self._children: dict[str, list[etree._Element]] = {}
        for child in element.iterchildren(tag=etree.Element):
            self._children.setdefault(local_name(child), []).append(child)
        texts = (element.text, *(child.tail for child in element)) if len(element) else ()
        self._mixed = " ".join("".join(text or "" for text in texts).split())
        self._attributes = {str(key) for key in element.attrib} - HARMLESS_ATTRIBUTES
        self._opened: list[Node] = []
        self._by_name: dict[str, Node] = {}

    @property
    def word(self) -> str:
        return local_name(self.element)

    def child(self, name: str) -> Node | None:
        found = self._children.pop(name, [])
        if len(found) > 1:
            raise NotTakenError(f"it has {len(found)} elements {name}")
        if found:
            self._by_name[name] = self._open(found[0])
        return self._by_name.get(name)

    def at(self, path: str) -> Node | None:
        """Return the element at a path of names, or None."""
        node: Node | None = self
        for name in path.split("/"):
            node = None if node is None else node.child(name)
        return node

    def children(self, name: str) -> list[Node]:
        return [self._open(one) for one in self._children.pop(name, [])]

    def names(self) -> Iterator[str]:
        """Yield the names of unread children."""
        yield from self._children

    def attribute(self, name: str) -> str:
        """Return an attribute, or an empty text."""
        self._attributes.discard(name)
        return (self.element.get(name) or "").strip()

    def text(self, path: str) -> str:
        node = self.at(path)
        return "" if node is None else node.content()

    def content(self) -> str:
        return (self.element.text or "").strip()

    def ids(self, name: str) -> list[str]:
        """Return the ids in a list; empty if it is missing."""
        node = self.child(name)
        if node is None:
            return []
        listed = [one.content() for one in node.children("Id")]
        if (count := node.attribute("n")) and count != str(len(listed)):
            raise NotTakenError(f"{name} announces {count} ids and has {len(listed)}")
        if not listed:
            raise NotTakenError(f"{name} is empty")
        return listed

    def length(self, name: str) -> float | None:
        """Return a length, mm, or None."""
        return self._quantity(name, "linearUnit", self._units.length)

    def angle(self, name: str) -> float | None:
        """Return an angle, degrees, or None."""
        return self._quantity(name, "angularUnit", self._units.angle)

    def _quantity(self, name: str, unit: str, scale: Callable[..., float]) -> float | None:
        node = self.child(name)
        if node is None:
            return None
        return scaled(number(node.content()), scale(node.attribute(unit), is_pmi=self._is_pmi))

    def point(self, path: str) -> tuple[float, float, float] | None:
        node = self.at(path)
        if node is None:
            return None
        scale = self._units.length(node.attribute("linearUnit"), is_pmi=self._is_pmi)
        x, y, z = _three(node)
        return scaled(x, scale), scaled(y, scale), scaled(z, scale)

    def direction(self, path: str) -> tuple[float, float, float] | None:
        """Return a unit vector, or None."""
        node = self.at(path)
        if node is None:
            return None
        x, y, z = _three(node)
        if not math.isclose(math.hypot(x, y, z), 1.0, abs_tol=1e-6):
            raise NotTakenError("it has no direction of length one")
        return x, y, z

    def close(self) -> None:
        """Raise NotTakenError for the first child or attribute that is unread and not harmless."""
        if self._mixed:
            raise NotTakenError(f"the text {self._mixed[:30]!r} in {self.word} is not supported")
        for name in self._attributes:
            raise NotTakenError(f"attribute {name} of {self.word} is not supported")
        for name, found in self._children.items():
            for one in found:
                text = "".join(part for part in one.itertext() if isinstance(part, str)).strip()
                off = name in FLAGS and text in ("false", "0") and not len(one)
                none = name in UNDEFINED and text == "UNDEFINED"
                if not (off or none or name in HARMLESS):
                    raise NotTakenError(f"{name} of {self.word} is not supported")
        for node in self._opened:
            node.close()

    def _open(self, element: etree._Element) -> Node:
        node = Node(element, self._units, is_pmi=self._is_pmi)
        self._opened.append(node)
        return node


def local_name(element: etree._Element) -> str:
    """Return the name of a QIF element; foreign ones keep their namespace."""
    return str(element.tag).removeprefix(Q)


def _three(node: Node) -> tuple[float, float, float]:
    numbers = [number(word) for word in node.content().split()]
    if len(numbers) != 3:
        raise NotTakenError(f"{node.word} has {len(numbers)} numbers of three")
    return numbers[0], numbers[1], numbers[2]


class References:
    """A document, its references and imported names; NotTakenError: units, duplicate ids."""

    def __init__(self, root: etree._Element) -> None:
        self.root, self._units = root, units_of(root, Q)
        self._by_id: dict[str, etree._Element] = {}
        for one in root.iter():
            own = one.get("id")
            if own and self._by_id.setdefault(own, one) is not one:
                raise NotTakenError(f"id {own[:30]} is used twice")
        for one in root.iter(f"{Q}ScaleCoefficient"):
            if number(one.text or "") != 1.0:
                raise NotTakenError(f"the scale of its model is {(one.text or '').strip()[:20]}")
        self._names: set[tuple[str, str]] = set()
        self._of_item: dict[str, str] = {}
        self._of_nominal: dict[str, list[str]] = {}

    def pairs(self, word: str) -> Iterator[tuple[etree._Element, etree._Element | None]]:
        """Yield items with their nominals, then nominals without items."""
        drawn = set()
        for item in self.root.iterfind(f".//{Q}{word}Items/*"):
            own = (item.findtext(f"{Q}{word}NominalId") or "").strip()
            drawn.add(own)
            yield item, self._by_id.get(own)
        for nominal in self.root.iterfind(f".//{Q}{word}Nominals/*"):
            if nominal.get("id") not in drawn:
                yield nominal, nominal

    def node(self, element: etree._Element | None) -> Node:
        if element is None:
            raise NotTakenError("an element that it refers to is missing")
        return Node(element, self._units, is_pmi="Characteristic" in local_name(element))

    def at(self, own_id: str) -> Node:
        return self.node(self._by_id.get(own_id))

    def name(self, item: etree._Element, nominal: etree._Element | None, element: str) -> str:
        """Return a unique valid name from the child ``element`` of the item."""
        text = item.findtext(f"{Q}{element}") or item.findtext(f"{Q}Name")
        if not text and nominal is not None:
            text = nominal.findtext(f"{Q}Name")
        plain = normal_name(" ".join((text or "").split()))
        if name_fault(plain):
            kept = usable_name(plain, 40)
            plain = f"{kept or local_name(item)}_{item.get('id', '0')}"[:60]
        return self.unique(plain, element, f"_{item.get('id', '0')}")

    def unique(self, name: str, element: str, suffix: str = "_2") -> str:
        """Return a unique name: two of one name would be judged as one."""
        made, count = name[:60], 1
        while (element, made.casefold()) in self._names:
            end = suffix if count == 1 else f"_{count + 1}"
            made, count = f"{name[: 60 - len(end)]}{end}", count + 1
        self._names.add((element, made.casefold()))
        return made

    def stated(self, item: etree._Element, nominal: etree._Element | None) -> list[str]:
        """Return the numbers of a characteristic as in the document, with their units."""
        own = "" if nominal is None else nominal.findtext(f"{Q}CharacteristicDefinitionId") or ""
        found = dict.fromkeys(
            f"{local_name(one)} {text}{' ' if unit else ''}{unit}"
            for part in (item, nominal, self._by_id.get(own.strip()))
            for one in ([] if part is None else part.iter(*(f"{Q}{name}" for name in _STATED)))
            if (text := " ".join((one.text or "").split())[:40])
            for unit in [one.get("linearUnit") or one.get("angularUnit") or ""]
        )
        return list(found)

    def add_feature(self, item: etree._Element, nominal: etree._Element, name: str) -> None:
        self._of_item[str(item.get("id"))] = name
        self._of_nominal.setdefault(str(nominal.get("id")), []).append(name)

    def feature_of_item(self, own_id: str) -> str:
        """Return the name of the feature of an item, or an empty text."""
        return self._of_item.get(own_id, "")

    def features_of_nominal(self, own_id: str) -> list[str]:
        return self._of_nominal.get(own_id, [])

    def feature_of_nominal(self, own_id: str) -> str:
        """Return the name of the only feature of a nominal, or an empty text."""
        names = self.features_of_nominal(own_id)
        return names[0] if len(names) == 1 else ""
