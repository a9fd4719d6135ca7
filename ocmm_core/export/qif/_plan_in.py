"""Import of a plan from a QIF 3.0 plan or MBD document.

Documents are untrusted: no document type, no entity, no other file, no network, and at most
`LARGEST` bytes. An item is imported completely, with everything that the schema allows in it, or
omitted by name with the reason (`_nodes`). Items come first; nominals without items, as in models
(MBD), are read directly.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import Any

from lxml import etree

from ocmm_core.errors import InputError, OcmmError
from ocmm_core.export.qif._characteristics_in import characteristics_of
from ocmm_core.export.qif._nodes import Node, Q, References, local_name
from ocmm_core.export.qif._units import NotTakenError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection import plan as plans
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.zones import Characteristic

LARGEST = 200_000_000
_PLACES = {
    "location": ("Location", "", ""),
    "axis": ("Axis/AxisPoint", "Axis/Direction", ""),
    "location, axis": ("Location", "AxisVector", ""),
    "location, direction": ("Location", "Direction", ""),
    "location, normal": ("Location", "Normal", ""),
    "long axis": ("Axis/AxisPoint", "Normal", "Axis/Direction"),
    "centre line": ("CenterLine/StartPoint", "Normal", "CenterLine/Vector"),
}
"""Paths of point, direction and direction of the length, by `QifShape.place`."""


@dataclass(frozen=True, slots=True)
class QifOmission:
    """An omitted item, and the reason."""

    name: str
    why: str


@dataclass(slots=True)
class QifPlan:
    """A plan, and the account of its document."""

    plan: plans.Plan
    left_out: list[QifOmission] = field(default_factory=list)


def plan_of_qif(content: bytes, name: str, part: str, file: str = "QIF document") -> QifPlan:
    """Return the plan of a document with its account, and the omitted items.

    InputError: it is no QIF document of version 3, too large, has a document type or contradictory
    units, or no importable feature.
    """
    root = _root(content)
    try:
        references = References(root)
    except (NotTakenError, InputError) as error:
        raise _refused(_reason(error)) from error
    found = QifPlan(plans.new_plan(name, part))
    for item, nominal in references.pairs("Feature"):
        own = references.name(item, nominal, "FeatureName")
        try:
            if nominal is None:
                raise NotTakenError("it has no nominal")
            found.plan = plans.add_feature(found.plan, _feature(references, own, item, nominal))
        except (NotTakenError, OcmmError) as error:
            found.left_out.append(QifOmission(own, _reason(error)))
        else:
            references.add_feature(item, nominal, own)
    unprobed = list(found.left_out)
    if not found.plan.features:
        named = "; ".join(f"{one.name}: {one.why}" for one in found.left_out[:5])
        raise _refused(f"it has no feature that can be probed{f' ({named})' if named else ''}")
    features = {one.name: one for one in found.plan.features}
    account: list[plans.Requirement] = []
    for item, nominal in references.pairs("Characteristic"):
        own, plan, why = references.name(item, nominal, "Name"), found.plan, ""
        kept: list[Characteristic] = []
        try:
            kept = list(characteristics_of(references, own, item, nominal, features))
            for one in kept:
                plan = plans.add_characteristic(plan, one)
            found.plan = plan
        except (NotTakenError, OcmmError) as error:
            why = _reason(error)
            found.left_out.append(QifOmission(own, why))
        account.append(_requirement(references, own, item, nominal, [] if why else kept, why))
    account += [
        plans.Requirement(group="feature", label=one.name, asks=f"feature {one.name}", why=one.why)
        for one in unprobed
    ]
    source = plans.source_of("QIF document", file, hashlib.sha256(content).hexdigest())
    found.plan = plans.with_requirements(found.plan, source, account)
    return found


def _requirement(
    references: References,
    name: str,
    item: etree._Element,
    nominal: etree._Element | None,
    kept: list[Characteristic],
    why: str,
) -> plans.Requirement:
    """Return the account of a characteristic, with the texts of the document."""
    word = local_name(item).removesuffix("Item").removesuffix("Nominal")
    told = [word.removesuffix("Characteristic").lower(), *references.stated(item, nominal)]
    one = kept[0] if kept else None
    return plans.Requirement(
        group="characteristic", label=name, asks=" ".join(told),
        balloon=(item.findtext(f".//{Q}CharacteristicDesignator/{Q}Designator") or "").strip()[:40],
        reference=f"id {item.get('id', '')}", unit="" if one is None else spec_of(one.kind).unit,
        nominal=None if one is None else one.nominal, lower=None if one is None else one.lower,
        upper=None if one is None else one.upper, characteristics=[one.name for one in kept],
        why=why,
    )  # fmt: skip


def _reason(error: NotTakenError | OcmmError) -> str:
    return error.what if isinstance(error, OcmmError) else str(error)


def _feature(
    references: References, name: str, item: etree._Element, nominal: etree._Element
) -> NominalFeature:
    word = local_name(nominal).removesuffix("FeatureNominal")
    shapes = [shape for shape in Shape if shape.spec.qif.feature == word]
    if len(shapes) != 1 or shapes[0].spec.qif.extent in ("cone", "flat"):
        raise NotTakenError(f"{word} features are not taken")
    (shape,) = shapes
    spec = shape.spec
    if item is not nominal:
        _close_item(references.node(item))
    node = references.node(nominal)
    definition = references.at(node.text("FeatureDefinitionId"))
    fit = node.child("SubstituteFeatureAlgorithm")
    if fit is not None and fit.text("SubstituteFeatureAlgorithmEnum") != "LEASTSQUARES":
        raise NotTakenError("its fit is not by least squares")
    place, direction_at, across_at = _PLACES[spec.qif.place]
    point = node.point(place)
    if point is None:
        raise NotTakenError("it has no place")
    told: dict[str, Any] = {}
    direction = node.direction(direction_at) if direction_at else None
    if spec.planned_direction:
        if direction is None:
            raise NotTakenError("it has no direction of length one")
        told["direction"] = direction
    if spec.has_across:
        told["across"] = node.direction(across_at)
        if told["across"] is None:
            raise NotTakenError("the direction of its length is not stated")
    for element, size in spec.qif.sizes:
        value = definition.length(element)
        if value is None or value <= 0.0:
            raise NotTakenError(f"its {element} is not stated")
        told[size] = value
    told |= _extent(shape, node, definition, point, direction)
    side = definition.text("InternalExternal")
    if side not in (("INTERNAL", "EXTERNAL") if spec.qif.sizes else ("", "NOT_APPLICABLE")):
        raise NotTakenError(f"its side {side or 'INTERNAL or EXTERNAL'!r} is not stated")
    node.close()
    definition.close()
    return NominalFeature(
        name=name, shape=shape, points=plans.usual_points(shape),
        side="inner" if side == "INTERNAL" else "outer", **{"point": point, **told},
    )  # fmt: skip


def _extent(
    shape: Shape,
    node: Node,
    definition: Node,
    point: tuple[float, float, float],
    direction: tuple[float, float, float] | None,
) -> dict[str, Any]:
    """Return length and middle: QIF states the start, a plan the middle."""
    extent = shape.spec.qif.extent
    if extent not in ("nominal", "definition") or direction is None:
        return {}
    length = (node if extent == "nominal" else definition).length("Length")
    if length is None:
        return {}
    if length <= 0.0:
        raise NotTakenError("its Length is not positive")
    middle = tuple(p + 0.5 * length * d for p, d in zip(point, direction, strict=True))
    return {"length": length, "point": middle}


def _close_item(node: Node) -> None:
    """Refuse an item that is not one feature measured by its own points."""
    node.child("FeatureNominalId")
    node.child("FeatureName")
    mode = node.child("DeterminationMode")
    details = None if mode is None else mode.at("Checked/CheckDetails")
    if mode is not None and (details is None or details.child("Measured") is None):
        raise NotTakenError("it is not measured by its own points")
    node.close()


def _root(content: bytes) -> etree._Element:
    if len(content) > LARGEST:
        raise _refused(f"it has {len(content)} bytes, more than {LARGEST}")
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, dtd_validation=False,
        huge_tree=False, recover=False, remove_comments=True, remove_pis=True,
    )  # fmt: skip
    try:
        root = etree.fromstring(content, parser)
    except (etree.XMLSyntaxError, ValueError) as error:
        raise _refused(str(error)[:200]) from error
    if root.getroottree().docinfo.internalDTD is not None:
        raise _refused("it has a document type, which may name other files")
    if root.tag != f"{Q}QIFDocument":
        raise _refused(f"it begins with {str(root.tag)[:80]}")
    return root


def _refused(why: str) -> InputError:
    return InputError(
        "qif.unreadable",
        f"This is no QIF document that a plan can be made of: {why}.",
        "Give a QIF 3.0 plan or model (MBD) with features and their units.",
    )
