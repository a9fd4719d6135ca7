"""Features of a QIF document: definition, nominal, item, measurement and points."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from lxml import etree

from ocmm_core.export.qif._terms import (
    definition_of,
    feature_word,
    is_told_from_start,
    measured_of,
    nominal_of,
)
from ocmm_core.export.qif._writer import Lists, Writer
from ocmm_core.export.report import Element, ReportData, ReportedFeature, check_name, clean_text
from ocmm_core.features.shapes import MINIMUM_POINTS
from ocmm_core.geometry import unit
from ocmm_core.tolerances.decisions import VerdictSummary


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
