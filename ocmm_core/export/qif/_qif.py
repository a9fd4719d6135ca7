"""Results as a QIF 3.0 document (ANSI/DMSC QIF, ISO 23952).

Everything is in the frame of the report, millimetres and degrees, with the job's exact numbers. A
feature has definition, nominal, item, measurement, point set; a characteristic likewise.
``combinedUncertainty`` is the standard uncertainty u = U / 2; U is in an attribute. NOT PROVEN is
INDETERMINATE. A characteristic without a value has no measurement; the results give its name and
the reason.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from lxml import etree

from ocmm_core.export.qif._characteristics import STATUS
from ocmm_core.export.qif._check import NAMESPACE, check_qif
from ocmm_core.export.qif._document import inspection_status, make_document
from ocmm_core.export.report import (
    Exporter,
    Profile,
    ReportData,
    ReportTable,
    Units,
    features_table,
    head_table,
    points_table,
    report_table,
)
from ocmm_core.geometry import Float

_SAME = 1e-9
"""mm: numbers are written with all their digits."""


def _contents(jobs: Sequence[ReportData], profile: Profile) -> dict[str, bytes]:
    (data,) = jobs
    root = make_document(data)
    content: bytes = etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
    return {_file_name(data): content}


def _differences(
    jobs: Sequence[ReportData], profile: Profile, files: Mapping[str, bytes]
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


def _other_part(root: etree._Element, data: ReportData) -> Iterator[str]:
    """Yield differences of the verdict on the part, or of the states of the job."""
    element, wanted = inspection_status(data.part)
    for parent in ("MeasurementResults/{*}InspectionStatus", "ActualComponent/{*}Status"):
        path = f".//{{*}}{parent}/{{*}}{element}"
        if [one.text for one in root.iterfind(path)] != [wanted]:
            yield f"The status of the part is not {wanted}."
    path = f".//{{{NAMESPACE}}}MeasurementResults/{{{NAMESPACE}}}Attributes/*"
    told = {one.get("name"): one.get("value") for one in root.iterfind(path)}
    rows = head_table(data).rows
    for name, value in rows[: [name for name, _ in rows].index("Job")]:
        if told.get(str(name), "") != value:
            yield f"{name} is not {value!r}."


def _other_results(root: etree._Element, data: ReportData) -> Iterator[str]:
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


def _other_points(root: etree._Element, data: ReportData) -> Iterator[str]:
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


def _preview(jobs: Sequence[ReportData], profile: Profile) -> tuple[ReportTable, ...]:
    (data,) = jobs
    units = Units(length_decimals=6, angle_decimals=6)
    return (
        head_table(data),
        report_table(data, units),
        features_table(data, units),
        points_table(data, units),
    )


def _file_name(data: ReportData) -> str:
    return f"{data.stem}.qif"


QIF = Exporter(
    name="qif",
    title="QIF 3.0 results",
    purpose="any program that reads QIF 3.0 results (ISO 23952)",
    suffixes=(".qif",),
    profile="",
    contents=_contents,
    differences=_differences,
    preview=_preview,
    batch=False,
)
