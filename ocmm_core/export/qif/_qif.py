"""Results as a QIF 3.0 document (ANSI/DMSC QIF, ISO 23952).

It has a head, units, datums, the part and the results. Everything is in the frame of the report,
millimetres and degrees, with the job's exact numbers. A feature has definition, nominal, item,
measurement, point set; a characteristic likewise. ``combinedUncertainty`` is the standard
uncertainty u = U / 2; U is in an attribute. NOT PROVEN is INDETERMINATE. A characteristic without a
value has no measurement; the results give its name and the reason.
"""

from __future__ import annotations

import uuid
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from lxml import etree

from ocmm_core.export import report
from ocmm_core.export.qif._characteristics import (
    STATUS,
    FeatureIds,
    add_characteristics,
    add_features,
)
from ocmm_core.export.qif._writer import NAMESPACE, Writer, check_qif, count_children
from ocmm_core.geometry import Float
from ocmm_core.tolerances.decisions import PartVerdict, PartWord

_SPACE = uuid.uuid5(uuid.NAMESPACE_URL, NAMESPACE)
_PRECEDENCE = ("PRIMARY", "SECONDARY", "TERTIARY")


def make_document(data: report.ReportData) -> etree._Element:
    """Return the document of a job; StorageError if a name or number does not fit."""
    writer = Writer()
    root = writer.root
    root.set("versionQIF", "3.0.0")
    writer.add(root, "QPId", str(uuid.uuid5(_SPACE, _version_of(data))))
    writer.add(writer.add(root, "Version"), "TimeCreated", _last_change(data))
    writer.add(
        writer.add(writer.add(root, "Header"), "Application"), "Name", f"OCMM {data.written_by}"
    )
    standard = _add_standard(writer, root)
    _add_units(writer, root)
    datums, frames = _add_datums(writer, root, data)
    devices = writer.add(writer.add(root, "MeasurementResources"), "MeasurementDevices")
    devices.set("n", "1")
    device = writer.add(devices, "MeasurementDevice", own_id=True)
    origin = "SIMULATED; " if data.view.simulated else ""
    device_name = f"{origin}{data.calibration.label}; {data.probe.label}"
    writer.add(device, "Name", report.clean_text(device_name))
    path = _add_product(writer, root, data)

    features = writer.add(root, "Features")
    characteristics = writer.add(root, "Characteristics")
    writer.add(characteristics, "FormalStandardId", standard)
    results_root = writer.add(root, "Results")
    results = _begin_results(writer, results_root, data)
    measured = writer.add(results, "MeasuredFeatures")
    point_sets = writer.add(results, "MeasuredPointSets")
    measurements = writer.add(
        writer.add(results, "MeasuredCharacteristics"), "CharacteristicMeasurements"
    )
    ids = add_features(writer, features, measured, point_sets, data, str(device.get("id")))
    add_characteristics(
        writer, characteristics, measurements, data, ids, frames, str(device.get("id"))
    )
    _link_datums(writer, datums, ids)
    for element, parent in ((measured, results), (point_sets, results)):
        count_children(element, parent)
    if len(measurements):
        measurements.set("n", str(len(measurements)))
    else:
        results.remove(results[-1])
    if not data.results:
        root.remove(characteristics)
    _end_results(writer, results_root, results, data, path)
    root.set("idMax", str(writer.last_id))
    return root


def inspection_status(part: PartVerdict) -> tuple[str, str]:
    """Return element and text of the verdict; in words for undecided parts, incomplete plans."""
    if part.word is PartWord.CONFORMS and part.is_partial:
        return "OtherInspectionStatus", part.headline
    words = {PartWord.CONFORMS: "PASS", PartWord.DOES_NOT_CONFORM: "FAIL"}
    return "InspectionStatusEnum", words.get(part.word, "UNKNOWN")


def _add_standard(writer: Writer, root: etree._Element) -> str:
    standards = writer.add(root, "StandardsDefinitions")
    standards.set("n", "1")
    standard = writer.add(standards, "Standard", own_id=True)
    writer.add(writer.add(standard, "Organization"), "StandardsOrganizationEnum", "ISO")
    writer.add(standard, "Designator", "1101")
    writer.add(standard, "Year", "2017")
    return str(standard.get("id"))


def _add_units(writer: Writer, root: etree._Element) -> None:
    primary = writer.add(writer.add(root, "FileUnits"), "PrimaryUnits")
    for name, si_name, word, factor in (
        ("AngularUnit", "radian", "degree", "0.017453292519943295"),
        ("LinearUnit", "meter", "mm", "0.001"),
    ):
        element = writer.add(primary, name)
        writer.add(element, "SIUnitName", si_name)
        writer.add(element, "UnitName", word)
        writer.add(writer.add(element, "UnitConversion"), "Factor", factor)


def _add_datums(
    writer: Writer, root: etree._Element, data: report.ReportData
) -> tuple[dict[str, etree._Element], dict[tuple[str, ...], str]]:
    """Add all datums and datum reference frames; return the datums and the ids of the frames."""
    frames = dict.fromkeys(item.datums for item in data.reported if item.datums)
    if not frames:
        return {}, {}
    definitions = writer.add(root, "DatumDefinitions")
    datums: dict[str, etree._Element] = {}
    labels: set[str] = set()
    for name in dict.fromkeys(name for datums_of in frames for name in datums_of):
        definition = writer.add(definitions, "DatumDefinition", own_id=True)
        # A label is one word; otherwise the name is added.
        label = report.check_name("datum", name).replace(" ", "_")
        while label in labels:
            label += "_"
        labels.add(label)
        if label != name:
            writer.add_attributes(definition, {"Feature": name})
        writer.add(definition, "DatumLabel", label)
        datums[name] = definition
    definitions.set("n", str(len(datums)))
    group = writer.add(root, "DatumReferenceFrames")
    group.set("n", str(len(frames)))
    ids = {}
    for names in frames:
        frame = writer.add(group, "DatumReferenceFrame", own_id=True)
        ids[names] = str(frame.get("id"))
        held = writer.add(frame, "Datums")
        held.set("n", str(len(names)))
        for name, precedence in zip(names, _PRECEDENCE, strict=False):
            datum = writer.add(held, "Datum")
            simple = writer.add(datum, "SimpleDatum")
            writer.add(simple, "DatumDefinitionId", str(datums[name].get("id")))
            writer.add(simple, "MaterialModifier", "NONE")
            writer.add(simple, "ReferencedComponent", "ACTUAL")
            writer.add(writer.add(datum, "Precedence"), "PrecedenceEnum", precedence)
    return datums, ids


def _link_datums(writer: Writer, datums: Mapping[str, etree._Element], ids: FeatureIds) -> None:
    for name, definition in datums.items():
        if name in ids.nominals:
            writer.add_ids(definition, "FeatureNominalIds", [ids.nominals[name]])


def _add_product(writer: Writer, root: etree._Element, data: report.ReportData) -> str:
    """Add the measured part, and return the id of the path to it."""
    product = writer.add(root, "Product")
    parts = writer.add(product, "PartSet")
    parts.set("n", "1")
    part = writer.add(parts, "Part", own_id=True)
    writer.add(part, "ModelNumber", report.clean_text(data.plan.part))
    components = writer.add(product, "ComponentSet")
    components.set("n", "1")
    component = writer.add(components, "Component", own_id=True)
    writer.add(writer.add(component, "Part"), "Id", str(part.get("id")))
    paths = writer.add(product, "AsmPaths")
    paths.set("n", "1")
    path = writer.add(paths, "AsmPath", own_id=True)
    writer.add_ids(path, "ComponentIds", [str(component.get("id"))])
    return str(path.get("id"))


def _begin_results(
    writer: Writer, results_root: etree._Element, data: report.ReportData
) -> etree._Element:
    group = writer.add(results_root, "MeasurementResultsSet")
    group.set("n", "1")
    results = writer.add(group, "MeasurementResults", own_id=True)
    pairs = {str(key): str(value) for key, value in report.head_table(data).rows if value != ""}
    missing = {
        f"Not measured: {report.check_name('characteristic', result.name)}": report.clean_text(
            result.note
        )
        for result in data.results
        if result.stated is None
    }
    writer.add_attributes(results, {**pairs, **missing})
    writer.add(results, "ThisResultsInstanceQPId", str(uuid.uuid5(_SPACE, _version_of(data) + "r")))
    return results


def _end_results(
    writer: Writer,
    results_root: etree._Element,
    results: etree._Element,
    data: report.ReportData,
    path: str,
) -> None:
    status = inspection_status(data.part)
    writer.add(writer.add(results, "InspectionStatus"), *status)
    sets = writer.add(results_root, "ActualComponentSets")
    sets.set("n", "1")
    one = writer.add(sets, "ActualComponentSet")
    one.set("n", "1")
    component = writer.add(one, "ActualComponent", own_id=True)
    if data.head.serial:
        writer.add(component, "SerialNumber", report.clean_text(data.head.serial))
    writer.add(writer.add(component, "Status"), *status)
    writer.add(component, "AsmPathId", path)
    writer.add_ids(results, "ActualComponentIds", [str(component.get("id"))])


def _version_of(data: report.ReportData) -> str:
    """Return the identity of these results among others of the same job."""
    told = [(item.name, item.measured, item.verdict.value) for item in data.results]
    numbers = [point.number for item in data.features for point in item.seen.points]
    part = (data.part.headline, data.part.missing, data.states)
    return repr((data.head.job_uuid, told, numbers, data.view.held, data.system, part))


def _last_change(data: report.ReportData) -> str:
    moment = report.last_moment(data.head.created_utc, data.taken_utc.values())
    return moment.strftime("%Y-%m-%dT%H:%M:%S")


_SAME = 1e-9
"""mm: numbers are written with all their digits."""


def _contents(jobs: Sequence[report.ReportData], profile: report.Profile) -> dict[str, bytes]:
    (data,) = jobs
    root = make_document(data)
    content: bytes = etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
    return {_file_name(data): content}


def _differences(
    jobs: Sequence[report.ReportData], profile: report.Profile, files: Mapping[str, bytes]
) -> list[str]:
    (data,) = jobs
    name = _file_name(data)
    parser = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=False)
    try:
        root = etree.fromstring(files[name], parser)
    except etree.XMLSyntaxError as error:
        return [f"{name}: not XML ({error})."]
    faults = check_qif(root)
    if not faults:
        faults = [
            *_other_part(root, data), *_other_results(root, data), *_other_points(root, data)
        ]  # fmt: skip
    return [f"{name}: {fault}" for fault in faults]


def _other_part(root: etree._Element, data: report.ReportData) -> Iterator[str]:
    """Yield differences of the verdict on the part, or of the states of the job."""
    element, wanted = inspection_status(data.part)
    for parent in ("MeasurementResults/{*}InspectionStatus", "ActualComponent/{*}Status"):
        path = f".//{{*}}{parent}/{{*}}{element}"
        if [one.text for one in root.iterfind(path)] != [wanted]:
            yield f"The status of the part is not {wanted}."
    path = f".//{{{NAMESPACE}}}MeasurementResults/{{{NAMESPACE}}}Attributes/*"
    told = {one.get("name"): one.get("value") for one in root.iterfind(path)}
    rows = report.head_table(data).rows
    for name, value in rows[: [name for name, _ in rows].index("Job")]:
        if told.get(str(name), "") != value:
            yield f"{name} is not {value!r}."


def _other_results(root: etree._Element, data: report.ReportData) -> Iterator[str]:
    names = {
        str(item.get("id")): item.findtext(f"{{{NAMESPACE}}}Name")
        for item in root.iter("{*}*")
        if etree.QName(item).localname.endswith("CharacteristicItem")
    }
    found = {}
    for element in root.iter("{*}*"):
        if etree.QName(element).localname.endswith("CharacteristicMeasurement"):
            item = element.findtext(f"{{{NAMESPACE}}}CharacteristicItemId") or ""
            value = element.find(f"{{{NAMESPACE}}}Value")
            status = element.findtext(f".//{{{NAMESPACE}}}CharacteristicStatusEnum")
            if value is not None:
                number = float(value.text or "nan")
                u = float(value.get("combinedUncertainty", "nan"))
                found[names.get(item)] = (number, 2.0 * u, status)
    for result in data.results:
        told = found.pop(result.name, None)
        if result.stated is None:
            if told is not None:
                yield f"{result.name} has a value, and was not measured."
        elif told is None or told[2] != STATUS[result.verdict]:
            yield f"{result.name} is missing or has another status."
        elif not np.allclose(
            told[:2], (result.stated[0], result.stated[2] or np.nan), 0.0, _SAME, equal_nan=True
        ):
            yield f"{result.name} has another value or uncertainty."
    yield from (f"{name} is not a result of the job." for name in found)


def _other_points(root: etree._Element, data: report.ReportData) -> Iterator[str]:
    sets = [
        np.array((one.findtext(f"{{{NAMESPACE}}}Points") or "").split(), dtype=np.float64)
        for one in root.iter(f"{{{NAMESPACE}}}MeasuredPointSet")
    ]
    wanted: list[Float] = [
        np.concatenate([data.frame.apply(point.surface_world) for point in feature.seen.points])
        for feature in data.features
        if feature.actual_element is not None and feature.seen.points
    ]
    if len(sets) != len(wanted) or not all(
        len(told) == len(places) and np.allclose(told, places, 0.0, _SAME)
        for told, places in zip(sets, wanted, strict=False)
    ):
        yield "The points are not the measured ones."


def _file_name(data: report.ReportData) -> str:
    return f"{data.stem}.qif"


QIF: report.Exporter = report.Exporter(
    name="qif",
    title="QIF 3.0 results",
    purpose="any program that reads QIF 3.0 results (ISO 23952)",
    suffixes=(".qif",),
    profile="",
    contents=_contents, differences=_differences, preview=report.exact_preview,
)  # fmt: skip
