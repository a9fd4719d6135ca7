"""Faults of a QIF document that the schema misses: references, counts and unit vectors.

The schemas of QIF 3.0 accept dangling references, wrong counts and vectors of any length; its
normative XSLT checks find some of that. These checks find all of it in result documents.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from lxml import etree

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
