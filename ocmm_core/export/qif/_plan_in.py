"""Features and characteristics of a QIF 3.0 plan or MBD document become a plan.

A document from elsewhere is hostile until it was read: no document type, no entity, no other file,
no network, and at most `LARGEST` bytes. What is not taken is named with its reason; nothing is
guessed. A tolerance that cannot be taken whole is not taken at all.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from lxml import etree

from ocmm_core.errors import InputError, OcmmError
from ocmm_core.export.qif._check import NAMESPACE
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan import (
    NAME_PATTERN,
    Plan,
    add_characteristic,
    add_feature,
    new_plan,
    usual_points,
)
from ocmm_core.tolerances.kinds import KINDS
from ocmm_core.tolerances.zones import Characteristic

LARGEST = 200_000_000
_Q = f"{{{NAMESPACE}}}"
_UNITS = {"mm": 1.0, "millimeter": 1.0, "millimetre": 1.0, "inch": 25.4, "in": 25.4}
_MODIFIERS = {"MAXIMUM": "maximum material", "LEAST": "least material"}
_PLACES = ("Location", "Axis/AxisPoint", "CenterLine/StartPoint")
_DIRECTIONS = ("Normal", "AxisVector", "Axis/Direction", "Direction", "Vector")
_ACROSS = ("CenterLine/Vector",)
_REGARDLESS = (None, "NONE", "REGARDLESS_OF_FEATURE_SIZE")
_AXES = {"XAXIS": "x", "YAXIS": "y", "ZAXIS": "z"}


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Something of the document that the plan does not have, and why."""

    name: str
    why: str


@dataclass(slots=True)
class QifPlan:
    """What became of a document."""

    plan: Plan
    """With everything that was taken."""
    left_out: list[LeftOut] = field(default_factory=list)
    """Everything else, by name."""


class _No(Exception):  # noqa: N818 -- not an error: a reason that is told
    """Why an item is not taken."""


def plan_of_qif(content: bytes, name: str, part: str) -> QifPlan:
    """Return the plan of a document, and what it could not take.

    Raises
    ------
    InputError
        It is no QIF document of version 3, too large, has a document type, or has no feature that
        can be taken.
    """
    root = _root(content)
    document = _Document(root, _scale(root))
    found = QifPlan(new_plan(name, part))
    for feature, why, what in document.features():
        _take(found, what, why, feature)
    if not found.plan.features:
        named = "; ".join(f"{one.name}: {one.why}" for one in found.left_out[:5])
        raise _refused(f"it has no feature that can be probed{f' ({named})' if named else ''}")
    known = {one.name for one in found.plan.features}
    for item, why, what in document.characteristics(known):
        _take(found, what, why, item)
    return found


def _take(
    found: QifPlan, what: str, why: str, kept: NominalFeature | Characteristic | None
) -> None:
    try:
        if isinstance(kept, NominalFeature):
            found.plan = add_feature(found.plan, kept)
        elif isinstance(kept, Characteristic):
            found.plan = add_characteristic(found.plan, kept)
        else:
            found.left_out.append(LeftOut(what, why))
    except OcmmError as error:
        found.left_out.append(LeftOut(what, error.what))


class _Document:
    """What refers to what in a document."""

    def __init__(self, root: etree._Element, scale: float) -> None:
        self._root, self._scale = root, scale
        self._by_id = {own: one for one in root.iter() if (own := one.get("id"))}
        self._names: dict[str, str] = {}
        self._drawn: dict[str, str] = {}

    def features(self) -> Iterator[tuple[NominalFeature | None, str, str]]:
        """Yield every feature item: what it becomes or None, why not, and its name."""
        for item in self._root.iterfind(f".//{_Q}FeatureItems/*"):
            name = _name(item.findtext(f"{_Q}FeatureName") or item.findtext(f"{_Q}Name"), item)
            nominal = self._at(item, "FeatureNominalId")
            try:
                if nominal is None:
                    raise _No("it has no nominal")
                kept = self._feature(name, nominal)
            except _No as why:
                yield None, str(why), name
                continue
            self._names[str(item.get("id"))] = name
            self._drawn.setdefault(str(nominal.get("id")), name)
            yield kept, "", name

    def characteristics(self, known: set[str]) -> Iterator[tuple[Characteristic | None, str, str]]:
        """Yield every characteristic item likewise."""
        for item in self._root.iterfind(f".//{_Q}CharacteristicItems/*"):
            name = _name(item.findtext(f"{_Q}Name"), item)
            try:
                yield self._characteristic(name, item, known), "", name
            except _No as why:
                yield None, str(why), name

    def _feature(self, name: str, nominal: etree._Element) -> NominalFeature:
        word = _tag(nominal).removesuffix("FeatureNominal")
        shapes = [shape for shape in Shape if shape.spec.qif.feature == word]
        if len(shapes) != 1 or shapes[0].spec.qif.extent in ("cone", "flat"):
            raise _No(f"{word} features are not taken")
        (shape,) = shapes
        spec = shape.spec
        definition = self._at(nominal, "FeatureDefinitionId")
        point = self._vector(nominal, _PLACES)
        if point is None:
            raise _No("it has no place")
        told: dict[str, Any] = {}
        direction = self._vector(nominal, _DIRECTIONS, scaled=False)
        if spec.planned_direction:
            if direction is None or not math.isclose(math.hypot(*direction), 1.0, abs_tol=1e-6):
                raise _No("it has no direction of length one")
            told["direction"] = direction
        if spec.has_across:
            across = self._vector(nominal, _ACROSS, scaled=False)
            if across is None:
                raise _No("the direction of its length is not told")
            told["across"] = across
        for element, size in spec.qif.sizes:
            value = None if definition is None else self._number(definition, element)
            if value is None or value <= 0.0:
                raise _No(f"its {element} is not told")
            told[size] = value if size != "angle_deg" else value / self._scale
        length = self._number(nominal, "Length")
        if length is None and definition is not None:
            length = self._number(definition, "Length")
        if spec.qif.extent in ("nominal", "definition") and length and direction is not None:
            # QIF tells where it begins, we where its middle is.
            point = tuple(  # type: ignore[assignment]
                p + 0.5 * length * d for p, d in zip(point, direction, strict=True)
            )
            told["length"] = length
        inner = definition is not None and definition.findtext(f"{_Q}InternalExternal")
        return NominalFeature(
            name=name, shape=shape, points=usual_points(shape), point=point,
            side="inner" if inner == "INTERNAL" else "outer", **told,
        )  # fmt: skip

    def _characteristic(self, name: str, item: etree._Element, known: set[str]) -> Characteristic:
        word = _tag(item).removesuffix("CharacteristicItem")
        kinds = [
            kind
            for kind, spec in KINDS.items()
            if word in (spec.qif.word, spec.qif.of_one, *spec.qif.of_shape.values())
            and kind != "form"
        ]
        if len(kinds) != 1:
            raise _No(f"{word} characteristics are not taken")
        features = [self._names.get(own, "") for own in _ids(item, "FeatureItemIds")]
        if not features or not set(features) <= known:
            raise _No("it is about a feature that was not taken")
        nominal = self._at(item, "CharacteristicNominalId")
        definition = None if nominal is None else self._at(nominal, "CharacteristicDefinitionId")
        if nominal is None or definition is None:
            raise _No("it has no nominal or definition")
        spec = KINDS[kinds[0]]
        angle = spec.unit == "deg"
        if spec.one_sided:
            told = self._zone(definition, known)
        else:
            told = self._limits(definition, nominal, angle=angle)
            told["axis"] = _AXES.get(nominal.findtext(f"{_Q}Direction") or "", "")
            if nominal.find(f"{_Q}AnalysisVector") is not None:
                raise _No("it is taken along a vector")
        return Characteristic(name=name, kind=kinds[0], features=features, **told)

    def _zone(self, definition: etree._Element, known: set[str]) -> dict[str, Any]:
        tolerance = self._number(definition, "ToleranceValue")
        if tolerance is None:
            raise _No("its tolerance is not told")
        if definition.findtext(f"{_Q}MaterialCondition") not in _REGARDLESS:
            # The size that the condition is counted from is not in the document.
            raise _No("its material condition is not taken")
        datums = []
        frame = self._at(definition, "DatumReferenceFrameId")
        for datum in [] if frame is None else frame.iterfind(f"{_Q}Datums/{_Q}Datum"):
            if datum.findtext(f".//{_Q}MaterialModifier") not in _REGARDLESS:
                raise _No("a datum has a modifier")
            meant = self._at(datum, "SimpleDatum/DatumDefinitionId")
            if meant is None:
                meant = self._at(datum, "DatumDefinitionId")
            ids = [] if meant is None else _ids(meant, "FeatureNominalIds")
            names = [self._drawn.get(own, "") for own in ids]
            if len(names) != 1 or names[0] not in known:
                raise _No("a datum of it is not one feature that was taken")
            datums += names
        return {"upper": tolerance, "datums": datums}

    def _limits(
        self, definition: etree._Element, nominal: etree._Element, *, angle: bool
    ) -> dict[str, Any]:
        tolerance = definition.find(f"{_Q}Tolerance")
        target = self._number(nominal, "TargetValue", scaled=not angle)
        high = low = None
        if tolerance is not None:
            high = self._number(tolerance, "MaxValue", scaled=not angle)
            low = self._number(tolerance, "MinValue", scaled=not angle)
        if tolerance is None or high is None or low is None or target is None:
            raise _No("it has no nominal with two limits")
        as_limits = tolerance.findtext(f"{_Q}DefinedAsLimit") == "true"
        return {
            "nominal": target,
            "upper": high - target if as_limits else high,
            "lower": low - target if as_limits else low,
        }

    def _at(self, element: etree._Element, path: str) -> etree._Element | None:
        found = element.findtext("/".join(f"{_Q}{step}" for step in path.split("/")))
        return self._by_id.get((found or "").strip())

    def _vector(
        self, element: etree._Element, paths: tuple[str, ...], *, scaled: bool = True
    ) -> tuple[float, float, float] | None:
        for path in paths:
            text = element.findtext("/".join(f"{_Q}{step}" for step in path.split("/")))
            numbers = [_number(word) for word in (text or "").split()]
            if len(numbers) == 3:
                x, y, z = (one * (self._scale if scaled else 1.0) for one in numbers)
                return x, y, z
        return None

    def _number(self, element: etree._Element, name: str, *, scaled: bool = True) -> float | None:
        text = element.findtext(f"{_Q}{name}")
        return None if text is None else _number(text) * (self._scale if scaled else 1.0)


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in text:
        raise _No(f"{text.strip()[:30]!r} is no number")
    return value


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
    if root.tag != f"{_Q}QIFDocument":
        raise _refused(f"it begins with {str(root.tag)[:80]}")
    return root


def _scale(root: etree._Element) -> float:
    """Return mm for one of the document's lengths."""
    path = f"{_Q}FileUnits/{_Q}PrimaryUnits/{_Q}LinearUnit/{_Q}UnitName"
    unit = (root.findtext(path) or "").strip().lower()
    if unit not in _UNITS:
        raise _refused(f"its unit of length is {unit[:30]!r}, neither mm nor inch")
    return _UNITS[unit]


def _name(text: str | None, item: etree._Element) -> str:
    """Return a name as plans have it; one that cannot be such is told by its kind and id."""
    plain = " ".join((text or "").split())
    if NAME_PATTERN.fullmatch(plain):
        return plain
    kept = "".join(sign if sign.isascii() and (sign.isalnum() or sign in " _.-") else "_"
                   for sign in plain)[:40].strip(" .-")  # fmt: skip
    return f"{kept or _tag(item)}_{item.get('id', '0')}"[:60]


def _ids(element: etree._Element, name: str) -> list[str]:
    return [
        (one.text or "").strip()
        for one in element.iterfind(f"{_Q}{name}/{_Q}Id")
    ]  # fmt: skip


def _tag(element: etree._Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _refused(why: str) -> InputError:
    return InputError(
        "qif.unreadable",
        f"This is no QIF document that a plan can be made of: {why}.",
        "Give a QIF 3.0 plan or model (MBD) with features in mm or inch.",
    )
