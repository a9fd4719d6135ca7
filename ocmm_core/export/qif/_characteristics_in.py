"""Import of characteristics from a QIF document, complete or not at all."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from lxml import etree

from ocmm_core.export.qif._nodes import Node, References
from ocmm_core.export.qif._units import NotTakenError
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.tolerances.kinds import KINDS, KindSpec
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
    """Yield the characteristics of one item, or of a nominal without an item.

    Raises NotTakenError if unclear.
    """
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
