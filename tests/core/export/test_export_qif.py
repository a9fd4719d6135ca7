"""QIF documents: whole, and every kind of fault that a schema lets pass is found."""

from __future__ import annotations

import copy
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from lxml import etree

from ocmm_core.export.qif._qif import make_document
from ocmm_core.export.qif._writer import NAMESPACE, check_qif
from ocmm_core.export.report import ReportData
from ocmm_core.features.shapes import NominalFeature, Shape, element
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.tolerances.decisions import Verdict
from ocmm_core.tolerances.kinds import KINDS
from ocmm_core.tolerances.zones import Characteristic
from tests.core.export.sample_report import feature, point, result, sample_report, sample_view
from tests.core.export.sample_report import write_incomplete as write_report

Q = f"{{{NAMESPACE}}}"


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
        for kind in KINDS
        for names in [("Circle", "Plane") if kind == "distance" else ("Circle",)]
    )
    return (replace(sample_view(), features=tuple(features), characteristics=results), nominals)


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
    assert len(measurements) == len(KINDS)
    # No number in exponent form: lengths are decimals in QIF.
    assert not any("e-" in (one.text or "") for one in root.iter(f"{Q}Value", f"{Q}Points"))


def asking(
    *asked: Characteristic, view: JobView, nominals: list[NominalFeature] | None = None
) -> ReportData:
    """Return a job with exactly these requested characteristics."""
    results = tuple(
        replace(
            result(item.name, 0.004, Verdict.CONFORM, kind=item.kind, features=(*item.features,)),
            bonus=0.002 if item.modifier else 0.0,
        )
        for item in asked
    )
    data = sample_report(replace(view, characteristics=results), nominals=nominals)
    return replace(data, plan=msgspec.structs.replace(data.plan, characteristics=list(asked)))


def every_way(**known: float) -> ReportData:
    """Return a job with a characteristic for every form that a document can express.

    ``known`` are fields of the plan for all its features.
    """
    view, nominals = everything()
    nominals = [msgspec.structs.replace(item, **known) for item in nominals]
    asked: list[Characteristic] = []

    def ask(kind: str, *features: Shape, datum: Shape | None = None, **more: str) -> None:
        names = [shape.value for shape in features]
        datums = [] if datum is None else [datum.value]
        told = " ".join((*names, "to", *datums, *more.values()))
        asked.append(
            Characteristic(
                name=f"{kind} {told}"[:60], kind=kind, features=names, datums=datums, upper=0.02,
                **more,  # type: ignore[arg-type]  # words of a plan
            )
        )  # fmt: skip

    for shape in Shape:
        ask("form", shape)
        ask("position", shape, datum=Shape.PLANE)
    for shape in (Shape.SPHERE, Shape.CIRCLE):
        ask("diameter", shape)
        ask("radius", shape)
        for datum in (Shape.SPHERE, Shape.CYLINDER):
            ask("concentricity", shape, datum=datum)
    for axis in "xyz":
        ask("coordinate", Shape.POINT, axis=axis)
        ask("distance", Shape.POINT, Shape.PLANE, axis=axis)
        ask("position", Shape.CYLINDER, datum=Shape.PLANE, zone="planes", axis=axis)
    ask("position", Shape.CIRCLE, zone="sphere")
    ask("position", Shape.CIRCLE, modifier="maximum material")
    for kind in ("parallelism", "perpendicularity", "angularity"):
        for shape in (Shape.PLANE, Shape.CYLINDER):
            for datum in (Shape.PLANE, Shape.CYLINDER):
                ask(kind, shape, datum=datum)
    ask("straightness", Shape.LINE)
    ask("straightness", Shape.CYLINDER)
    ask("angle", Shape.CONE)
    ask("angle", Shape.LINE, Shape.PLANE)
    for shape in (Shape.POINT, Shape.LINE, Shape.CIRCLE, Shape.RECTANGLE):
        ask("line profile", shape)
    ask("line profile", Shape.POINT, Shape.LINE, datum=Shape.ROUND_SLOT)
    ask("surface profile", Shape.PLANE, Shape.TORUS, datum=Shape.PLANE)
    ask("symmetry", Shape.SQUARE_SLOT, datum=Shape.PLANE)
    ask("coaxiality", Shape.SPHERE, datum=Shape.CYLINDER)
    ask("circular runout", Shape.CONE, datum=Shape.CYLINDER)
    ask("total runout", Shape.CYLINDER, datum=Shape.CYLINDER)
    return asking(*asked, view=view, nominals=nominals)


def test_datums_become_one_frame_for_those_that_share_them() -> None:
    asked = [
        Characteristic(
            name=kind, kind=kind, features=["BALL"], upper=0.02,
            datums=["FACE", "BORE 1"] if kind != "diameter" else [],
        )
        for kind in ("position", "surface profile", "diameter")
    ]  # fmt: skip
    root = make_document(asking(*asked, view=sample_view()))
    assert check_qif(root) == []
    assert len(root.findall(f".//{Q}DatumReferenceFrame")) == 1
    # A label is one word (xs:NMTOKEN); it refers to the feature, whose name follows.
    assert [one.text for one in root.iter(f"{Q}DatumLabel")] == ["FACE", "BORE_1"]
    bore = root.find(f".//{Q}CircleFeatureNominal")
    datum = root.findall(f".//{Q}DatumDefinition")[1]
    assert bore is not None
    assert datum.findtext(f"{Q}FeatureNominalIds/{Q}Id") == bore.get("id")
    name = datum.find(f"{Q}Attributes/{Q}AttributeStr")
    assert name is not None
    assert name.get("value") == "BORE 1"


def names_under(root: etree._Element, path: str) -> list[str]:
    found = root.find(".//" + "/".join(Q + part for part in path.split("/")))
    assert found is not None, path
    return [etree.QName(one).localname for one in found.iterchildren("{*}*")]


def test_elements_stand_where_the_standard_has_them() -> None:
    root = make_document(every_way())
    assert check_qif(root) == []
    for path, wanted in (
        ("ElongatedCircleFeatureNominal/CenterLine", "StartPoint Vector"),
        ("ElongatedCircleFeatureMeasurement/CenterLine", "StartPoint Vector"),
        ("OppositeParallelLinesFeatureDefinition", "InternalExternal Width Length EndType"),
        ("OppositeParallelLinesFeatureNominal", "FeatureDefinitionId CenterLine Normal"),
        ("CylinderFeatureDefinition", "InternalExternal Diameter Length"),
        (
            "ConeFeatureDefinition",
            "InternalExternal Diameter FullAngle LargeEndDistance SmallEndDistance",
        ),
        ("LineFeatureNominal", "FeatureDefinitionId Location Direction Length"),
        ("LineProfileCharacteristicNominal", "CharacteristicDefinitionId Vector"),
        ("SphericalDiameterCharacteristicDefinition", "Tolerance"),
        ("EllipticityCharacteristicDefinition", "ToleranceValue"),
        ("ToroidicityCharacteristicDefinition", "ToleranceValue"),
        (
            "DistanceBetweenCharacteristicNominal",
            "CharacteristicDefinitionId TargetValue AnalysisVector AnalysisMode",
        ),
        ("ActualComponent", "SerialNumber Status AsmPathId"),
    ):
        assert names_under(root, path) == wanted.split(), path


def test_lines_cylinders_and_cones_are_told_from_where_they_begin_and_end() -> None:
    root = make_document(every_way())
    # The plan has their points in the middle of 18 mm along z, at (1, 2, 3).
    for path in ("LineFeatureNominal/{Q}Location", "CylinderFeatureNominal/{Q}Axis/{Q}AxisPoint"):
        text = root.findtext(f".//{Q}{path.format(Q=Q)}")
        assert text is not None
        assert [float(word) for word in text.split()] == pytest.approx([1.0, 2.0, -6.0])
    # The first measured point on it determines the start.
    for path in (
        "LineFeatureMeasurement/{Q}Location", "CylinderFeatureMeasurement/{Q}Axis/{Q}AxisPoint"
    ):  # fmt: skip
        text = root.findtext(f".//{Q}{path.format(Q=Q)}")
        assert text is not None
        assert float(text.split()[2]) == pytest.approx(999.0 - 1.5 - 1000.0)
    cone = root.find(f".//{Q}ConeFeatureDefinition")
    assert cone is not None
    ends = [float(cone.findtext(f"{Q}{end}EndDistance") or "nan") for end in ("Large", "Small")]
    assert ends == [9.0, -9.0]
    # A cone whose 18 mm go beyond its apex has no small end.
    root = make_document(every_way(angle_deg=120.0))
    assert root.find(f".//{Q}SmallEndDistance") is None
    # Without a length their ends are undetermined.
    root = make_document(every_way(length=0.0))
    assert root.find(f".//{Q}LargeEndDistance") is None
    assert names_under(root, "LineFeatureNominal")[-1] == "Direction"


def test_the_zone_is_the_one_that_counted() -> None:
    data = every_way()
    root = make_document(data)
    definitions = root.find(f".//{Q}CharacteristicDefinitions")
    assert definitions is not None
    told = {
        result.name: [etree.QName(one).localname for one in element_.findall(f"{Q}ZoneShape/*")]
        for result, element_ in zip(data.results, definitions, strict=True)
    }
    for name, zone in (
        ("position Point to Plane", "SphericalZone"),
        ("position Plane to Plane", "NonDiametricalZone"),
        ("position Cylinder to Plane", "DiametricalZone"),
        ("position Cylinder to Plane planes x", "NonDiametricalZone"),
        ("position Circle to sphere", "SphericalZone"),
        ("parallelism Plane to Cylinder", "PlanarZone"),
        ("parallelism Cylinder to Cylinder", "DiametricalZone"),
        ("perpendicularity Cylinder to Plane", "DiametricalZone"),
        ("perpendicularity Cylinder to Cylinder", "PlanarZone"),
        ("straightness Line to", "NonDiametricalZone"),
        ("form Line to", "NonDiametricalZone"),
        ("straightness Cylinder to", "DiametricalZone"),
        ("concentricity Sphere to Sphere", "SphericalZone"),
        ("concentricity Circle to Sphere", "DiametricalZone"),
        ("coaxiality Sphere to Cylinder", "DiametricalZone"),
    ):
        assert told[name] == [zone], name
    (bonus,) = root.iter(f"{Q}Bonus")
    assert float(bonus.text or "") == 0.002


def test_the_plane_of_a_profile_holds_its_line_and_the_normals_of_the_surface() -> None:
    data = every_way()
    root = make_document(data)
    items = [item for item in data.plan.characteristics if item.kind == "line profile"]
    vectors = [
        np.array((one.findtext(f"{Q}Vector") or "").split(), dtype=float)
        for one in root.iter(f"{Q}LineProfileCharacteristicNominal")
    ]
    # Circle and rectangle lie in their own planes; points and lines were probed along z, and the
    # line also leads along z.
    for item, vector in zip(items, vectors, strict=True):
        along = abs(vector[2])
        assert along == pytest.approx(0.0 if item.features[0] in ("Point", "Line") else 1.0)


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
        (_set_text("Normals", "0 0 2 " * 4), "not a unit vector"),
        (_set_text("Normal", "0 0 1.0000001"), "1.000000100 and is not a unit vector"),
        (_set_text("Points", "1 2 3"), "its Points are 3 numbers"),
        (_set_text("Normal", "0 0 nan"), "non-finite"),
        (_set_text("Value", "twenty"), "not a number"),
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


@pytest.fixture(name="schema", scope="module")
def _schema(request: pytest.FixtureRequest) -> etree.XMLSchema:
    """Return the schema of QIF 3.0: that of OCMM_QIF_SCHEMAS, or of the reference data."""
    named = os.environ.get("OCMM_QIF_SCHEMAS")
    if named:
        return etree.XMLSchema(etree.parse(named))
    home: Path = request.getfixturevalue("reference")
    return etree.XMLSchema(etree.parse(home / "qif" / "QIFApplications" / "QIFDocument.xsd"))


_DRAWING_ONLY = ("A-AN-UV", "A-AN-NG")
"""Messages of the preview checks about annotations of drawings (see their README)."""


def test_the_schemas_of_the_standard_accept_what_we_write(
    tmp_path: Path, schema: etree.XMLSchema
) -> None:
    for number, data in enumerate((sample_report(), every_way(), every_way(length=0.0, width=0.0),
                                   sample_report(frame=None))):  # fmt: skip
        (path,) = write_report(data, ("qif",), tmp_path / str(number))
        schema.assertValid(etree.parse(path))
        # It is the judge that it should be: the same document with a word too many is invalid.
        spoiled = etree.parse(path)
        etree.SubElement(spoiled.getroot(), f"{Q}Opinion")
        assert not schema.validate(spoiled)


def test_the_schemas_of_the_standard_accept_its_samples(
    schema: etree.XMLSchema, reference: Path
) -> None:
    samples = sorted((reference / "qif" / "samples").glob("*.[qQ][iI][fF]"))
    assert samples
    for sample in samples:
        schema.assertValid(etree.parse(sample))


def test_the_checks_of_the_standard_have_no_message(tmp_path: Path, reference: Path) -> None:
    checks = etree.XSLT(etree.parse(reference / "qif" / "checks" / "Check.xsl"))
    for number, data in enumerate((sample_report(), every_way(), every_way(length=0.0, width=0.0),
                                   sample_report(frame=None))):  # fmt: skip
        (path,) = write_report(data, ("qif",), tmp_path / str(number))
        told = messages_of(checks(etree.parse(path)))
        assert told == [], told[:5]
        # The checks detect errors in our documents.
        spoiled = etree.parse(path)
        counted = next(one for one in spoiled.iter() if one.get("n") and len(one))
        counted.set("n", "77")
        assert messages_of(checks(spoiled))


def messages_of(found: etree._XSLTResultTree) -> list[str]:
    """Return the messages of the checks about anything but drawings."""
    reports = [str(one.text) for one in found.getroot().iter("Report")]
    return [text for text in reports if not any(word in text for word in _DRAWING_ONLY)]
