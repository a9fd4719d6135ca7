"""Characteristics of a QIF document: definition, nominal, item and measurement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from lxml import etree

from ocmm_core.export.names import check_name, clean_text
from ocmm_core.export.qif_words import Kind, kind_of
from ocmm_core.export.qif_writer import Lists, Writer, finite, text_of
from ocmm_core.export.report_data import ReportData, ReportedResult
from ocmm_core.tolerances.result import Verdict

STATUS = {
    Verdict.CONFORM: "PASS",
    Verdict.NOT_CONFORM: "FAIL",
    Verdict.NOT_PROVEN: "INDETERMINATE",
}
_MODIFIERS = {"maximum material": "MAXIMUM", "least material": "LEAST"}


def add_characteristics(
    writer: Writer,
    characteristics: etree._Element,
    measurements: etree._Element,
    data: ReportData,
    items: Mapping[str, str],
    found: Mapping[str, str],
    frames: Mapping[tuple[str, ...], str],
    device: str,
) -> None:
    """Add all characteristics.

    Parameters
    ----------
    characteristics, measurements
        Elements that hold them.
    items, found
        Ids of the items and of the measurements of the features, by their names.
    frames
        Ids of the frames of datums.
    device
        Id of what everything was measured with.
    """
    lists = Lists(writer, characteristics, "Characteristic")
    shapes = {feature.name: feature.shape for feature in data.features}
    for reported in data.reported:
        result = reported.result
        name = check_name("characteristic", result.name)
        kind = kind_of(result.kind, shapes.get(result.features[0]), len(result.features))
        definition = writer.add(
            lists.definitions, f"{kind.word}CharacteristicDefinition", own_id=True
        )
        _define(writer, definition, reported, kind, frames)
        nominal = writer.add(lists.nominals, f"{kind.word}CharacteristicNominal", own_id=True)
        writer.add(nominal, "CharacteristicDefinitionId", str(definition.get("id")))
        _target(writer, nominal, reported, kind)
        item = writer.add(lists.items, f"{kind.word}CharacteristicItem", own_id=True)
        writer.add(item, "Name", name)
        writer.add(writer.add(item, "CharacteristicDesignator"), "Designator", name)
        writer.add_ids(item, "FeatureItemIds", _known(result.features, items))
        writer.add_ids(item, "MeasurementDeviceIds", [device])
        writer.add(item, "CharacteristicNominalId", str(nominal.get("id")))
        if result.verdict is Verdict.NOT_MEASURED or result.measured is None:
            continue
        element = writer.add(measurements, f"{kind.word}CharacteristicMeasurement", own_id=True)
        writer.add_attributes(element, _told_beside(reported))
        status = writer.add(element, "Status")
        writer.add(status, "CharacteristicStatusEnum", STATUS[result.verdict])
        writer.add(element, "CharacteristicItemId", str(item.get("id")))
        writer.add_ids(element, "FeatureMeasurementIds", _known(result.features, found))
        if kind.word == "LinearCoordinate":
            kinds = writer.add(element, "TypeOfCoordinates")
            writer.add(kinds, "CoordinateEnum", "CARTESIAN_3D")
        value = writer.add(element, "Value", finite(name, result.measured))
        if result.uncertainty is not None:
            value.set("combinedUncertainty", text_of(finite(name, 0.5 * result.uncertainty)))
    lists.count()


def _define(
    writer: Writer,
    definition: etree._Element,
    reported: ReportedResult,
    kind: Kind,
    frames: Mapping[tuple[str, ...], str],
) -> None:
    result, asked = reported.result, reported.asked
    if not kind.is_zone:
        tolerance = writer.add(definition, "Tolerance")
        writer.add(tolerance, "MaxValue", finite(result.name, result.upper))
        writer.add(tolerance, "MinValue", finite(result.name, result.lower))
        writer.add(tolerance, "DefinedAsLimit", "false")
        return
    writer.add(definition, "ToleranceValue", finite(result.name, result.upper))
    if reported.datums in frames:
        writer.add(definition, "DatumReferenceFrameId", frames[reported.datums])
    if kind.zone in ("orientation", "position"):
        modifier = "" if asked is None else asked.modifier
        writer.add(definition, "MaterialCondition", _MODIFIERS.get(modifier, "NONE"))
    if kind.zone:
        shape = "" if asked is None else asked.zone
        flat = "PlanarZone" if kind.zone == "orientation" else "NonDiametricalZone"
        usual = flat if kind.zone in ("straightness", "orientation") else "DiametricalZone"
        zone = {"planes": flat, "cylinder": "DiametricalZone", "sphere": "SphericalZone"}
        writer.add(writer.add(definition, "ZoneShape"), zone.get(shape, usual))


def _target(
    writer: Writer, nominal: etree._Element, reported: ReportedResult, kind: Kind
) -> None:
    if kind.is_zone:
        return
    writer.add(nominal, "TargetValue", finite(reported.result.name, reported.result.nominal))
    if kind.word == "LinearCoordinate":
        axis = "x" if reported.asked is None else reported.asked.axis
        writer.add(nominal, "Direction", f"{axis.upper()}AXIS")
    elif kind.word in ("DistanceBetween", "AngleBetween"):
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
    if result.bonus:
        told["Bonus"] = finite(result.name, result.bonus)
    if result.note:
        told["Note"] = clean_text(result.note)
    return told


def _known(names: Sequence[str], ids: Mapping[str, str]) -> list[str]:
    return [ids[name] for name in names if name in ids]
