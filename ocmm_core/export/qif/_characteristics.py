"""Features and characteristics of a QIF document: definition, nominal, item and measurement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from lxml import etree

from ocmm_core.export.qif._writer import (
    Lists,
    Writer,
    characteristic_word,
    definition_of,
    feature_word,
    finite,
    is_told_from_start,
    measured_of,
    nominal_of,
    text_of,
)
from ocmm_core.export.report import (
    Element,
    ReportData,
    ReportedFeature,
    ReportedResult,
    check_name,
    clean_text,
)
from ocmm_core.features.shapes import MINIMUM_POINTS, Shape
from ocmm_core.geometry import Float, RigidTransform, unit
from ocmm_core.tolerances.decisions import Verdict, VerdictSummary
from ocmm_core.tolerances.kinds import KindSpec, spec_for


@dataclass(frozen=True, slots=True)
class FeatureIds:
    """Ids of the nominals, items and measurements of the features, by name."""

    nominals: dict[str, str] = field(default_factory=dict)
    items: dict[str, str] = field(default_factory=dict)
    measurements: dict[str, str] = field(default_factory=dict)


def add_features(
    writer: Writer,
    features: etree._Element,
    measured: etree._Element,
    point_sets: etree._Element,
    data: ReportData,
    device: str,
) -> FeatureIds:
    lists = Lists(writer, features, "Feature")
    ids = FeatureIds()
    for feature in data.features:
        check_name("feature", feature.name)
        word = feature_word(feature.shape)
        if feature.nominal_element is not None:
            _add_nominal(writer, lists, feature, feature.nominal_element, ids)
        if feature.actual_element is None:
            continue
        element = writer.add(measured, f"{word}FeatureMeasurement", own_id=True)
        ids.measurements[feature.name] = str(element.get("id"))
        writer.add_attributes(element, _attributes(feature, data.view.verdict_of(feature.name)))
        if feature.name in ids.items:
            writer.add(element, "FeatureItemId", ids.items[feature.name])
        writer.add(element, "FeatureName", feature.name)
        if feature.seen.points:
            chosen = _add_points(writer, point_sets, feature, data, device)
            listed = writer.add(element, "PointList")
            listed.set("n", "1")
            writer.add(listed, "WholePointSetId", chosen)
        actual = _from_start(feature, feature.actual_element, data)
        writer.add_all(element, measured_of(feature.shape, actual))
    lists.count()
    return ids


def _add_nominal(
    writer: Writer, lists: Lists, feature: ReportedFeature, nominal: Element, ids: FeatureIds
) -> None:
    """Add definition, nominal and item of a feature, and note their ids."""
    word = feature_word(feature.shape)
    side = feature.nominal.side if feature.nominal is not None else "outer"
    definition = writer.add(lists.definitions, f"{word}FeatureDefinition", own_id=True)
    writer.add_all(definition, definition_of(feature.shape, nominal, side))
    place = writer.add(lists.nominals, f"{word}FeatureNominal", own_id=True)
    writer.add(place, "FeatureDefinitionId", str(definition.get("id")))
    writer.add_all(place, nominal_of(feature.shape, nominal))
    item = writer.add(lists.items, f"{word}FeatureItem", own_id=True)
    writer.add(item, "FeatureNominalId", str(place.get("id")))
    writer.add(item, "FeatureName", feature.name)
    mode = writer.add(writer.add(item, "DeterminationMode"), "Checked")
    writer.add(writer.add(mode, "CheckDetails"), "Measured")
    ids.nominals[feature.name] = str(place.get("id"))
    ids.items[feature.name] = str(item.get("id"))


def _add_points(
    writer: Writer,
    point_sets: etree._Element,
    feature: ReportedFeature,
    data: ReportData,
    device: str,
) -> str:
    """Add the compensated points of a feature; normals lead from the material."""
    points = feature.seen.points
    element = writer.add(point_sets, "MeasuredPointSet", own_id=True)
    element.set("count", str(len(points)))
    places = [data.frame.apply(point.surface_world) for point in points]
    normals = [unit(data.frame.rotation @ point.direction) for point in points]
    writer.add(element, "Points", np.concatenate(places))
    writer.add(element, "Normals", np.concatenate(normals))
    writer.add(element, "Compensated", "true")
    writer.add(element, "ProbeRadius", points[0].tip_radius)
    writer.add(element, "MeasurementDeviceId", device)
    return str(element.get("id"))


def _attributes(feature: ReportedFeature, summary: VerdictSummary) -> dict[str, float | str]:
    """Return data without an element in QIF, or without one for every shape."""
    fit = feature.seen.fit
    told: dict[str, float | str] = {}
    if summary.verdict is not None:
        told["Verdict"], told["Deciding characteristic"] = summary.verdict.value, summary.deciding
    if fit is not None:
        told["Association"] = fit.criterion.name.lower().replace("_", " ")
        if len(feature.seen.points) > MINIMUM_POINTS[feature.shape]:
            told["Form"], told["RMS"] = fit.form, fit.rms
    if feature_word(feature.shape) == "OppositeParallelLines":
        # QIF has one name for slots and rectangles.
        told["Shape"] = feature.shape.value
    if feature.seen.note:
        told["Note"] = clean_text(feature.seen.note)
    return told


def _from_start(feature: ReportedFeature, element: Element, data: ReportData) -> Element:
    """Return a measured line or cylinder with its point at the start of its measured points."""
    if (
        not is_told_from_start(feature.shape)
        or element.direction is None
        or not feature.seen.points
    ):
        return element
    places = np.array([data.frame.apply(point.surface_world) for point in feature.seen.points])
    first = float(((places - element.point) @ element.direction).min())
    return replace(element, point=element.point + first * element.direction)


STATUS = {Verdict.CONFORM: "PASS", Verdict.NOT_CONFORM: "FAIL", Verdict.NOT_PROVEN: "INDETERMINATE"}
_MODIFIERS = {"maximum material": "MAXIMUM", "least material": "LEAST"}


def add_characteristics(
    writer: Writer,
    characteristics: etree._Element,
    measurements: etree._Element,
    data: ReportData,
    ids: FeatureIds,
    frames: Mapping[tuple[str, ...], str],
    device: str,
) -> None:
    """Add all characteristics; `frames`, `device`: ids of datum frames, and of the device."""
    lists = Lists(writer, characteristics, "Characteristic")
    features = {feature.name: feature for feature in data.features}
    shapes = {name: feature.shape for name, feature in features.items()}
    for reported in data.reported:
        result = reported.result
        name = check_name("characteristic", result.name)
        shape = shapes.get(result.features[0])
        kind = spec_for(result.kind, shape)
        word = characteristic_word(result.kind, shape, len(result.features))
        definition = writer.add(lists.definitions, f"{word}CharacteristicDefinition", own_id=True)
        _define(writer, definition, reported, kind, frames, shapes)
        nominal = writer.add(lists.nominals, f"{word}CharacteristicNominal", own_id=True)
        writer.add(nominal, "CharacteristicDefinitionId", str(definition.get("id")))
        _target(writer, nominal, reported, kind, word)
        if word == "LineProfile":
            run = [features[one] for one in result.features if one in features]
            across = None if result.seen is None else result.seen.across
            of_cut = None if across is None else data.frame.rotation @ across
            plane = _plane_of_profile(run, data.frame) if of_cut is None else of_cut
            writer.add(nominal, "Vector", plane)
        item = writer.add(lists.items, f"{word}CharacteristicItem", own_id=True)
        writer.add(item, "Name", name)
        writer.add(writer.add(item, "CharacteristicDesignator"), "Designator", name)
        writer.add_ids(item, "FeatureItemIds", _known(result.features, ids.items))
        writer.add_ids(item, "MeasurementDeviceIds", [device])
        writer.add(item, "CharacteristicNominalId", str(nominal.get("id")))
        if result.stated is None:
            continue
        measured, _, uncertainty = result.stated
        element = writer.add(measurements, f"{word}CharacteristicMeasurement", own_id=True)
        writer.add_attributes(element, _told_beside(reported))
        status = writer.add(element, "Status")
        writer.add(status, "CharacteristicStatusEnum", STATUS[result.verdict])
        writer.add(element, "CharacteristicItemId", str(item.get("id")))
        writer.add_ids(element, "FeatureMeasurementIds", _known(result.features, ids.measurements))
        if word == "LinearCoordinate":
            kinds = writer.add(element, "TypeOfCoordinates")
            writer.add(kinds, "CoordinateEnum", "CARTESIAN_3D")
        value = writer.add(element, "Value", finite(name, measured))
        value.set("combinedUncertainty", text_of(finite(name, 0.5 * uncertainty)))
        if result.bonus:
            writer.add(element, "Bonus", finite(name, result.bonus))
    lists.count()


def _define(
    writer: Writer,
    definition: etree._Element,
    reported: ReportedResult,
    kind: KindSpec,
    frames: Mapping[tuple[str, ...], str],
    shapes: Mapping[str, Shape],
) -> None:
    result, asked = reported.result, reported.asked
    if not kind.one_sided:
        tolerance = writer.add(definition, "Tolerance")
        writer.add(tolerance, "MaxValue", finite(result.name, result.upper))
        writer.add(tolerance, "MinValue", finite(result.name, result.lower))
        writer.add(tolerance, "DefinedAsLimit", "false")
        return
    writer.add(definition, "ToleranceValue", finite(result.name, result.upper))
    if reported.datums in frames:
        writer.add(definition, "DatumReferenceFrameId", frames[reported.datums])
    if kind.qif.has_modifier:
        modifier = "" if asked is None else asked.modifier
        writer.add(definition, "MaterialCondition", _MODIFIERS.get(modifier, "NONE"))
    if kind.zone_of is not None:
        datums = tuple(shapes[name] for name in reported.datums if name in shapes)
        zone = kind.zone_of(asked, shapes.get(result.features[0]), datums)
        words = {
            "planes": kind.qif.planes,
            "cylinder": "DiametricalZone",
            "sphere": "SphericalZone",
        }
        writer.add(writer.add(definition, "ZoneShape"), words[zone])


def _plane_of_profile(run: Sequence[ReportedFeature], frame: RigidTransform) -> Float:
    """Return the normal (3,), unit, of the plane of a line profile."""
    rows, places = [], []
    for feature in run:
        element = feature.nominal_element or feature.actual_element
        if element is None:
            continue
        if feature.shape.spec.has_normals and element.direction is not None:
            return element.direction
        places.append(element.point)
        rows += [] if element.direction is None else [element.direction]
        if feature.shape is Shape.LINE:
            rows += [frame.rotation @ touch.direction for touch in feature.seen.points]
    # The plane contains the line, or the steps from point to point, and the surface normals.
    rows += [place - places[0] for place in places[1:]]
    normal: Float = np.linalg.svd(np.vstack([np.zeros(3), *rows]))[2][-1]
    return normal


def _target(
    writer: Writer, nominal: etree._Element, reported: ReportedResult, kind: KindSpec, word: str
) -> None:
    if kind.one_sided:
        return
    writer.add(nominal, "TargetValue", finite(reported.result.name, reported.result.nominal))
    if word == "LinearCoordinate":
        axis = "x" if reported.asked is None else reported.asked.axis
        writer.add(nominal, "Direction", f"{axis.upper()}AXIS")
    elif word == "DistanceBetween" and reported.asked is not None and reported.asked.axis:
        writer.add(nominal, "AnalysisVector", np.eye(3)["xyz".index(reported.asked.axis)])
        writer.add(nominal, "AnalysisMode", "ONEDIMENSIONAL")
    elif word in ("DistanceBetween", "AngleBetween"):
        writer.add(nominal, "AnalysisMode", "THREEDIMENSIONAL")


def _told_beside(reported: ReportedResult) -> dict[str, float | str]:
    result = reported.result
    told: dict[str, float | str] = {"Verdict": result.verdict.value}
    if result.uncertainty is not None:
        told["ExpandedUncertainty (k=2)"] = finite(result.name, result.uncertainty)
    if reported.association:
        told["Association"] = reported.association
    if result.frame:
        told["Frame"] = result.frame
    if result.note:
        told["Note"] = clean_text(result.note)
    return told


def _known(names: Sequence[str], ids: Mapping[str, str]) -> list[str]:
    return [ids[name] for name in names if name in ids]
