"""Features of a QIF document: definition, nominal, item, measurement and points."""

from __future__ import annotations

import numpy as np
from lxml import etree

from ocmm_core.export.names import check_name, clean_text
from ocmm_core.export.qif_words import definition_of, feature_word, measured_of, place_of
from ocmm_core.export.qif_writer import Lists, Writer, text_of
from ocmm_core.export.report_data import ReportData, ReportedFeature
from ocmm_core.features.shapes import MINIMUM_POINTS
from ocmm_core.geometry import unit


def add_features(
    writer: Writer,
    features: etree._Element,
    measured: etree._Element,
    point_sets: etree._Element,
    data: ReportData,
    device: str,
) -> tuple[dict[str, str], dict[str, str]]:
    """Add all features; return the ids of their items and of their measurements by name."""
    lists = Lists(writer, features, "Feature")
    items: dict[str, str] = {}
    found: dict[str, str] = {}
    for feature in data.features:
        check_name("feature", feature.name)
        word, nominal = feature_word(feature.shape), feature.nominal_element
        if nominal is not None:
            items[feature.name] = _add_nominal(writer, lists, feature, word)
        if feature.actual_element is None:
            continue
        element = writer.add(measured, f"{word}FeatureMeasurement", own_id=True)
        found[feature.name] = str(element.get("id"))
        writer.add_attributes(element, _attributes(feature))
        if feature.name in items:
            writer.add(element, "FeatureItemId", items[feature.name])
        writer.add(element, "FeatureName", feature.name)
        if feature.seen.points:
            chosen = _add_points(writer, point_sets, feature, data, device)
            listed = writer.add(element, "PointList")
            listed.set("n", "1")
            writer.add(listed, "WholePointSetId", chosen)
        writer.add_all(element, measured_of(feature.shape, feature.actual_element))
    lists.count()
    return items, found


def _add_nominal(writer: Writer, lists: Lists, feature: ReportedFeature, word: str) -> str:
    """Add definition, nominal and item of a feature, and return the id of the item."""
    nominal = feature.nominal_element
    assert nominal is not None  # noqa: S101 - asked for only where there is one
    side = feature.nominal.side if feature.nominal is not None else "outer"
    definition = writer.add(lists.definitions, f"{word}FeatureDefinition", own_id=True)
    writer.add_all(definition, definition_of(feature.shape, nominal, side, _reach(feature)))
    place = writer.add(lists.nominals, f"{word}FeatureNominal", own_id=True)
    writer.add(place, "FeatureDefinitionId", str(definition.get("id")))
    writer.add_all(place, place_of(feature.shape, nominal))
    item = writer.add(lists.items, f"{word}FeatureItem", own_id=True)
    writer.add(item, "FeatureNominalId", str(place.get("id")))
    writer.add(item, "FeatureName", feature.name)
    mode = writer.add(writer.add(item, "DeterminationMode"), "Checked")
    writer.add(writer.add(mode, "CheckDetails"), "Measured")
    return str(item.get("id"))


def _add_points(
    writer: Writer,
    point_sets: etree._Element,
    feature: ReportedFeature,
    data: ReportData,
    device: str,
) -> str:
    """Add the compensated points of a feature; their normals lead from the material."""
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


def _attributes(feature: ReportedFeature) -> dict[str, float | str]:
    """Return what QIF has no element for, or none that every shape has."""
    fit, element = feature.seen.fit, feature.actual_element
    told: dict[str, float | str] = {}
    if fit is not None:
        told["Association"] = fit.criterion.name.lower().replace("_", " ")
        if len(feature.seen.points) > MINIMUM_POINTS[feature.shape]:
            told["Form"], told["RMS"] = fit.form, fit.rms
    if element is not None and feature_word(feature.shape) == "OtherCurve":
        told["Shape"] = feature.shape.value
        told["Centre"] = text_of(element.point)
        for name, value in (
            ("Normal", element.direction),
            ("Across", element.across),
            ("Length", element.length),
            ("Width", element.width),
        ):
            if value is not None:
                told[name] = value if isinstance(value, float) else text_of(value)
    if feature.seen.note:
        told["Note"] = clean_text(feature.seen.note)
    return told


def _reach(feature: ReportedFeature) -> float:
    """Return how far the points go beyond the point of a measured cone along its axis, mm."""
    fit = feature.seen.fit
    if fit is None or not feature.seen.points:
        return 0.0
    places = np.array([point.surface_world for point in feature.seen.points])
    return max(float(((places - fit.point) @ fit.direction).max()), 0.0)
