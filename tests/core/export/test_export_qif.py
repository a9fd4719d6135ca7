"""QIF documents: whole, and every kind of fault that a schema lets pass is found."""

from __future__ import annotations

import copy
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from ocmm_core.export.qif_check import NAMESPACE, check_qif
from ocmm_core.export.qif_document import make_document
from ocmm_core.export.registry import write_report
from ocmm_core.features.nominal import NominalFeature
from ocmm_core.features.shapes import Shape, element
from ocmm_core.inspection.view import JobView
from ocmm_core.tolerances.result import Verdict
from tests.core.export.sample_report import feature, point, result, sample_report, sample_view

Q = f"{{{NAMESPACE}}}"

_KINDS = (
    "diameter", "radius", "length", "width", "distance", "coordinate", "angle", "form",
    "straightness", "flatness", "roundness", "cylindricity", "parallelism", "perpendicularity",
    "angularity", "position", "concentricity", "coaxiality", "symmetry", "line profile",
    "surface profile", "circular runout", "total runout",
)  # fmt: skip


def written(tmp_path: Path) -> etree._Element:
    (path,) = write_report(sample_report(), ("qif",), tmp_path)
    return etree.parse(path).getroot()


def everything() -> tuple[JobView, list[NominalFeature]]:
    """Return a job with every shape and every kind of characteristic."""
    geometry = element(
        [1.0, 2.0, 990.0], [0.0, 0.0, 1.0], 9.0, second=4.0, half_angle=0.3, across=[1.0, 0.0, 0.0]
    )
    features, nominals = [], []
    for number, shape in enumerate(Shape):
        touches = [point(number + 1, shape.value, (1.0, 2.0, 999.0), (0.0, 0.0, 1.0))]
        actual = geometry.copy()
        if shape in (Shape.POINT, Shape.SPHERE):
            actual[3:6] = 0.0
        features.append(feature(shape.value, shape, touches, actual, [0.0]))
        nominals.append(
            NominalFeature(
                name=shape.value, shape=shape, points=20, point=(1.0, 2.0, 3.0), diameter=18.0,
                length=18.0, width=8.0, angle_deg=34.0,
            )
        )  # fmt: skip
    results = tuple(
        result(kind.capitalize(), 20.001, Verdict.CONFORM, kind=kind, features=names)
        for kind in _KINDS
        for names in [("Circle", "Plane") if kind == "distance" else ("Circle",)]
    )
    return (
        replace(sample_view(), features=tuple(features), characteristics=results),
        nominals,
    )


def test_the_document_says_what_was_measured(tmp_path: Path) -> None:
    root = written(tmp_path)
    assert check_qif(root) == []
    points = root.find(f".//{Q}MeasuredPointSet/{Q}Points")
    normals = root.find(f".//{Q}MeasuredPointSet/{Q}Normals")
    assert points is not None
    assert normals is not None
    places = np.array((points.text or "").split(), dtype=float).reshape(-1, 3)
    assert np.hypot(places[:, 0], places[:, 1]) == pytest.approx(10.0, abs=2e-5)
    told = {
        name.text: [item.text for item in root.iter(f"{Q}CharacteristicStatusEnum")]
        for name in root.iter(f"{Q}Designator")
    }
    assert "Bore diameter" in told
    statuses = [item.text for item in root.iter(f"{Q}CharacteristicStatusEnum")]
    assert statuses == ["PASS", "FAIL", "FAIL", "INDETERMINATE"]
    values = list(root.iter(f"{Q}Value"))
    assert float(values[0].text or "") == 20.00246
    # The combined standard uncertainty is half of U, k = 2.
    assert float(values[0].get("combinedUncertainty", "")) == pytest.approx(0.00192)
    names = [one.get("name") for one in root.iter(f"{Q}AttributeStr")]
    assert "Not measured: Ball diameter" in names
    assert "Serial number" in names


def test_every_shape_and_kind_has_a_place() -> None:
    view, nominals = everything()
    data = sample_report(view, nominals=nominals)
    root = make_document(data)
    assert check_qif(root) == []
    words = {etree.QName(one).localname for one in root.iter("{*}*")}
    for wanted in ("TorusFeatureMeasurement", "ElongatedCircleFeatureNominal", "FullAngle"):
        assert wanted in words
    measurements = root.findall(f".//{Q}CharacteristicMeasurements/*")
    assert len(measurements) == len(_KINDS)
    # No number in exponent form: lengths are decimals in QIF.
    assert not any("e-" in (one.text or "") for one in root.iter(f"{Q}Value", f"{Q}Points"))


def test_datums_become_one_frame_for_those_that_share_them() -> None:
    view, nominals = everything()
    data = sample_report(view, nominals=nominals)
    asked = [
        replaced
        for item in data.plan.characteristics
        for replaced in [
            type(item)(
                name=item.name, kind=item.kind, features=item.features, upper=item.upper,
                datums=["Plane", "Line"] if item.kind in ("position", "symmetry") else [],
            )
        ]
    ]  # fmt: skip
    plan = type(data.plan)(
        **{
            name: getattr(data.plan, name)
            for name in data.plan.__struct_fields__
            if name != "characteristics"
        },
        characteristics=asked,
    )
    root = make_document(replace(data, plan=plan))
    assert check_qif(root) == []
    assert len(root.findall(f".//{Q}DatumReferenceFrame")) == 1
    assert [one.text for one in root.iter(f"{Q}DatumLabel")] == ["Plane", "Line"]


def _set_text(name: str, text: str) -> Callable[[etree._Element], None]:
    def change(root: etree._Element) -> None:
        found = root.find(f".//{Q}{name}")
        assert found is not None
        found.text = text

    return change


def _set(name: str, attribute: str, value: str) -> Callable[[etree._Element], None]:
    def change(root: etree._Element) -> None:
        found = root if name == "" else root.find(f".//{Q}{name}")
        assert found is not None
        found.set(attribute, value)

    return change


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (_set_text("WholePointSetId", "9999"), "WholePointSetId refers to '9999'"),
        (_set_text("WholePointSetId", "1"), "which is a Standard"),
        (_set_text("FeatureMeasurementIds/{http://qifstandards.org/xsd/qif3}Id", "0"), "'0'"),
        (_set_text("MeasurementDeviceId", "nobody"), "'nobody'"),
        (_set_text("FormalStandardId", ""), "FormalStandardId refers to ''"),
        (_set_text("FeatureNominalId", "2"), "FeatureNominalId refers to 2"),
        (_set_text("Normals", "0 0 2 " * 4), "no unit vector"),
        (_set_text("Points", "1 2 3"), "its Points are 3 numbers"),
        (_set_text("Normal", "0 0 nan"), "not finite"),
        (_set_text("Value", "twenty"), "no number"),
        (_set("MeasuredPointSet", "count", "5"), "says 5 points"),
        (_set("CharacteristicItems", "n", "4"), "says n = 4"),
        (_set("", "idMax", "7"), "idMax is 7"),
        (_set("FeatureItems/*", "id", "1"), "The id 1 is given twice"),
    ],
)
def test_what_no_schema_sees_is_found(
    tmp_path: Path, change: Callable[[etree._Element], None], told: str
) -> None:
    root = written(tmp_path)
    broken = copy.deepcopy(root)
    change(broken)
    assert any(told in fault for fault in check_qif(broken)), check_qif(broken)
    assert check_qif(root) == []


def test_an_item_that_leads_to_another_shape_is_found(tmp_path: Path) -> None:
    root = written(tmp_path)
    circle = root.find(f".//{Q}CircleFeatureItem/{Q}FeatureNominalId")
    plane = root.find(f".//{Q}PlaneFeatureNominal")
    assert circle is not None
    assert plane is not None
    circle.text = plane.get("id")
    assert any("PlaneFeatureNominal" in fault for fault in check_qif(root))


@pytest.mark.skipif(
    not os.environ.get("OCMM_QIF_SCHEMAS"),
    reason="the schemas of QIF 3.0 are not here: set OCMM_QIF_SCHEMAS to QIFDocument.xsd",
)
def test_the_schemas_of_the_standard_accept_the_document(tmp_path: Path) -> None:
    schema = etree.XMLSchema(etree.parse(os.environ["OCMM_QIF_SCHEMAS"]))
    view, nominals = everything()
    for data in (sample_report(), sample_report(view, nominals=nominals)):
        (path,) = write_report(data, ("qif",), tmp_path)
        schema.assertValid(etree.parse(path))
