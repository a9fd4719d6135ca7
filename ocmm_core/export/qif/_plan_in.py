"""Import of a plan from a QIF 3.0 plan or MBD document.

Documents are untrusted: no document type, no entity, no other file, no network, and at most
`LARGEST` bytes. An item is imported completely, with everything that the schema allows in it, or
omitted by name with the reason (`_nodes`). Items come first; nominals without items, as in models
(MBD), are read directly.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from lxml import etree

from ocmm_core.documents import untrusted_xml
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.export.qif._nodes import Node, NotTakenError, Q, References, local_name
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection import plan as plans
from ocmm_core.tolerances.kinds import KINDS, KindSpec, spec_of
from ocmm_core.tolerances.zones import Characteristic

_REGARDLESS = ("", "NONE", "REGARDLESS", "REGARDLESS_OF_FEATURE_SIZE")
_AXES = {"XAXIS": "x", "YAXIS": "y", "ZAXIS": "z"}
_PRECEDENCE = ("PRIMARY", "SECONDARY", "TERTIARY")
_ZONES = {
    "DiametricalZone": "cylinder", "SphericalZone": "sphere",
    "NonDiametricalZone": "planes", "PlanarZone": "planes",
}  # fmt: skip
_SIZES = frozenset({"diameter", "radius", "length", "width"})
"""Kinds stated once for a pattern: each feature gets its own characteristic."""


def characteristics_of(
    references: References,
    name: str,
    item: etree._Element,
    nominal: etree._Element | None,
    features: Mapping[str, NominalFeature],
) -> Iterator[Characteristic]:
    """Yield the characteristics of an item or a lone nominal; NotTakenError if unclear."""
    node = references.node(item)
    word = node.word.removesuffix("Item").removesuffix("Nominal").removesuffix("Characteristic")
    kinds = [
        kind
        for kind, spec in KINDS.items()
        if word in (spec.qif.word, spec.qif.of_one, *spec.qif.of_shape.values()) and kind != "form"
    ]
    if len(kinds) != 1:
        raise NotTakenError(f"{word} characteristics are not taken")
    if nominal is None:
        raise NotTakenError("it has no nominal or definition")
    spec = KINDS[kinds[0]]
    drawn = node if item is nominal else references.node(nominal)
    names = _features_of(references, node, drawn, features)
    if item is not nominal:
        node.child("CharacteristicNominalId")
        node.close()
    definition = references.at(drawn.text("CharacteristicDefinitionId"))
    if spec.one_sided:
        told = _zone(references, spec, definition, names, features)
    else:
        told = _limits(spec, definition, drawn, features[names[0]])
    drawn.close()
    definition.close()
    each = kinds[0] in _SIZES and len(names) > 1
    for group in [[one] for one in names] if each else [names]:
        own = references.unique(f"{name} {group[0]}", "Name") if each else name
        yield Characteristic(name=own, kind=kinds[0], features=group, **told)


def _features_of(
    references: References, node: Node, drawn: Node, features: Mapping[str, NominalFeature]
) -> list[str]:
    items = [references.feature_of_item(own) for own in node.ids("FeatureItemIds")]
    nominals = drawn.ids("FeatureNominalIds")
    names = items or [references.feature_of_nominal(own) for own in nominals]
    if items and any(not set(names) & set(references.features_of_nominal(own)) for own in nominals):
        raise NotTakenError("its item and its nominal are about different features")
    if not names or not set(names) <= set(features):
        raise NotTakenError("it is about a feature that was not taken")
    return names


def _zone(
    references: References,
    spec: KindSpec,
    definition: Node,
    names: list[str],
    features: Mapping[str, NominalFeature],
) -> dict[str, Any]:
    tolerance = definition.length("ToleranceValue")
    if tolerance is None:
        raise NotTakenError("its tolerance is not stated")
    if definition.text("MaterialCondition") not in _REGARDLESS:
        # The document lacks the size that the condition refers to.
        raise NotTakenError("its material condition is not taken")
    datums = _datums(references, definition, features)
    shape, bases = features[names[0]].shape, tuple(features[one].shape for one in datums)
    told: dict[str, Any] = {"upper": tolerance, "datums": datums}
    zone = definition.child("ZoneShape")
    if spec.zone_of is not None:
        meant = "" if zone is None else _ZONES.get(next(zone.names(), ""), "")
        if zone is None or not meant:
            raise NotTakenError("the shape of its zone is not stated")
        zone.child(next(zone.names()))
        if spec.zone_of(None, shape, bases) != meant and spec.zones:
            told["zone"] = meant
        item = Characteristic(name="-", kind=spec.name, features=names, **told)
        if spec.zone_of(item, shape, bases) != meant:
            raise NotTakenError(f"a zone of {meant} is not taken for it")
    elif zone is not None:
        raise NotTakenError("the shape of its zone is not taken")
    return told


def _datums(
    references: References, definition: Node, features: Mapping[str, NominalFeature]
) -> list[str]:
    """Return the features of the datums in order of precedence."""
    own = definition.text("DatumReferenceFrameId")
    if not own:
        return []
    frame = references.at(own)
    ordered: dict[str, str] = {}
    group = frame.child("Datums")
    for datum in [] if group is None else group.children("Datum"):
        datum_name = _datum(references, datum)
        if datum_name not in features:
            raise NotTakenError("a datum of it is not one feature that was taken")
        precedence = datum.text("Precedence/PrecedenceEnum")
        if precedence not in _PRECEDENCE or precedence in ordered:
            raise NotTakenError(f"the precedence {precedence or '-'} of a datum is not taken")
        ordered[precedence] = datum_name
    if group is None or sorted(ordered, key=_PRECEDENCE.index) != list(_PRECEDENCE[: len(ordered)]):
        raise NotTakenError("its datums are not complete")
    if (count := group.attribute("n")) and count != str(len(ordered)):
        raise NotTakenError("the number of its datums contradicts their list")
    frame.close()
    return [ordered[one] for one in _PRECEDENCE[: len(ordered)]]


def _datum(references: References, datum: Node) -> str:
    """Return the feature of a simple datum, or an empty text."""
    simple = datum.child("SimpleDatum")
    if simple is None:
        raise NotTakenError("a datum of it is not a simple one")
    if simple.text("MaterialModifier") not in _REGARDLESS:
        raise NotTakenError("a datum has a modifier")
    if simple.text("ReferencedComponent") not in ("", "NOMINAL", "ACTUAL"):
        raise NotTakenError("the component of a datum is not taken")
    meant = references.at(simple.text("DatumDefinitionId"))
    meant.child("DatumLabel")
    ids = meant.ids("FeatureNominalIds")
    meant.close()
    return references.feature_of_nominal(ids[0]) if len(ids) == 1 else ""


_DECIMALS = 12
"""Of a difference in mm: 35.2 less 35 is 0.2."""


def _limits(
    spec: KindSpec, definition: Node, drawn: Node, feature: NominalFeature
) -> dict[str, Any]:
    tolerance = definition.child("Tolerance")
    read = Node.angle if spec.unit == "deg" else Node.length
    target = read(drawn, "TargetValue")
    if target is None:
        # Models state the size once, in the feature.
        target = getattr(feature, spec.name, None) if spec.name in _SIZES else None
    high = None if tolerance is None else read(tolerance, "MaxValue")
    low = None if tolerance is None else read(tolerance, "MinValue")
    if tolerance is None or high is None or low is None or target is None:
        raise NotTakenError("it has no nominal with two limits")
    as_limits = tolerance.text("DefinedAsLimit")
    if as_limits not in ("true", "false", "1", "0"):
        raise NotTakenError("whether its tolerance is limits or deviations is not stated")
    told: dict[str, Any] = {"nominal": target, "upper": high, "lower": low}
    if as_limits in ("true", "1"):
        told |= {"upper": round(high - target, _DECIMALS), "lower": round(low - target, _DECIMALS)}
    axis = drawn.text("Direction")
    if axis and axis not in _AXES:
        raise NotTakenError(f"its direction {axis[:20]} is not taken")
    vector = drawn.direction("AnalysisVector")
    mode = drawn.text("AnalysisMode")
    if vector is not None:
        along = [k for k, one in enumerate(vector) if abs(one) > 1.0 - 1e-9]
        if mode != "ONEDIMENSIONAL" or not along or spec.name != "distance":
            raise NotTakenError("it is taken along a vector")
        axis = f"{'XYZ'[along[0]]}AXIS"
    elif mode not in ("", "THREEDIMENSIONAL"):
        raise NotTakenError(f"its analysis {mode[:20]} is not taken")
    return told | ({"axis": _AXES[axis]} if axis else {})


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
    try:
        root = untrusted_xml(content)
    except ValueError as error:
        raise _refused(str(error)[:200]) from error
    if root.tag != f"{Q}QIFDocument":
        raise _refused(f"it begins with {str(root.tag)[:80]}")
    return root


def _refused(why: str) -> InputError:
    return InputError(
        "qif.unreadable",
        f"This is no QIF document that a plan can be made of: {why}.",
        "Give a QIF 3.0 plan or model (MBD) with features and their units.",
    )
