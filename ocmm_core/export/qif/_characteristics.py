"""Characteristics of a QIF document: definition, nominal, item and measurement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from lxml import etree

from ocmm_core.export.qif._features import FeatureIds
from ocmm_core.export.qif._terms import characteristic_word
from ocmm_core.export.qif._writer import Lists, Writer, finite, text_of
from ocmm_core.export.report import (
    ReportData,
    ReportedFeature,
    ReportedResult,
    check_name,
    clean_text,
)
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.tolerances.decisions import Verdict
from ocmm_core.tolerances.kinds import KindSpec, spec_for

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
            writer.add(nominal, "Vector", _plane_of_profile(run, data.frame))
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
