"""A plan from a QIF document: ours comes back, samples item by item, hostile ones refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from lxml import etree

from ocmm_core.errors import InputError
from ocmm_core.export.qif import plan_of_qif
from ocmm_core.export.qif._qif import make_document
from ocmm_core.export.report import ReportData
from ocmm_core.tolerances.zones import Characteristic
from tests.core.export.sample_report import NOMINALS, sample_report
from tests.core.export.test_export_qif import asking

Q = "{http://qifstandards.org/xsd/qif3}"


def told(data: ReportData) -> bytes:
    return bytes(etree.tostring(make_document(data)))


def test_features_and_sizes_come_back_as_they_were() -> None:
    found = plan_of_qif(told(sample_report(frame=None)), "BACK", "Block")
    assert found.left_out == []
    features = {feature.name: feature for feature in found.plan.features}
    for nominal in NOMINALS:
        back = features[nominal.name]
        assert (back.shape, back.side) == (nominal.shape, nominal.side)
        assert back.point == pytest.approx(nominal.point, abs=1e-12)
        assert back.diameter == pytest.approx(nominal.diameter)
    items = {item.name: item for item in found.plan.characteristics}
    bore = items["Bore diameter"]
    assert (bore.kind, bore.features) == ("diameter", ["BORE 1"])
    assert (bore.nominal, bore.lower, bore.upper) == (20.0, -0.01, 0.02)


def test_a_position_comes_with_its_datums() -> None:
    asked = Characteristic(
        name="Pos", kind="position", features=["BALL"], upper=0.02, datums=["FACE", "BORE 1"]
    )
    found = plan_of_qif(told(asking(asked, view=sample_report().view)), "BACK", "Block")
    assert found.left_out == []
    (item,) = [one for one in found.plan.characteristics if one.name == "Pos"]
    assert (item.upper, item.datums) == (0.02, ["FACE", "BORE 1"])


@pytest.mark.parametrize(
    ("name", "factor", "scale"),
    [
        ("inch", "0.0254", 25.4), ("m", "1", 1000.0), ("um", "0.000001", 1e-3),
        ("ft", "0.3048", 304.8), ("furlong", "201.168", 201168.0),
    ],
)  # fmt: skip
def test_converts_declared_units(name: str, factor: str, scale: float) -> None:
    root = make_document(sample_report(frame=None))
    declare(root, name, factor)
    found = plan_of_qif(etree.tostring(root), "BACK", "Block")
    bore = next(one for one in found.plan.features if one.name == "BORE 1")
    assert bore.diameter == pytest.approx(20.0 * scale, rel=1e-12)
    item = next(one for one in found.plan.characteristics if one.name == "Bore diameter")
    assert item.upper == pytest.approx(0.02 * scale, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "factor", "why"),
    [
        ("mm", "0.0254", "25.4 mm in the document, but 1 by its name"),
        ("inch", "0.001", "1 mm in the document, but 25.4 by its name"),
        ("furlong", "", "not known"), ("mm", "nan", "is no number"),
        ("mm", "-0.001", "no positive factor"),
    ],
)  # fmt: skip
def test_refuses_contradictory_units(name: str, factor: str, why: str) -> None:
    root = make_document(sample_report(frame=None))
    declare(root, name, factor)
    with pytest.raises(InputError, match=why):
        plan_of_qif(etree.tostring(root), "BACK", "Block")


def declare(root: etree._Element, name: str, factor: str) -> None:
    unit = root.find(f"{Q}FileUnits/{Q}PrimaryUnits/{Q}LinearUnit")
    assert unit is not None
    for element, text in (("UnitName", name), (f"UnitConversion/{Q}Factor", factor)):
        found = unit.find(f"{Q}{element}")
        assert found is not None
        found.text = text
    conversion = unit.find(f"{Q}UnitConversion")
    if not factor and conversion is not None:
        unit.remove(conversion)


def test_converts_the_unit_of_each_value() -> None:
    # A bore of 0.375 inch and a tolerance of 0.01 inch in a document in mm.
    root = make_document(sample_report(frame=None))
    (bore, *_) = root.findall(f".//{Q}CircleFeatureDefinition/{Q}Diameter")
    bore.text = "0.375"
    bore.set("linearUnit", "inch")
    for limit in root.findall(f".//{Q}DiameterCharacteristicDefinition/{Q}Tolerance/{Q}MaxValue"):
        limit.text = "0.01"
        limit.set("linearUnit", "inch")
    found = plan_of_qif(etree.tostring(root), "BACK", "Block")
    assert found.plan.features[0].diameter == pytest.approx(9.525, rel=1e-12)
    item = next(one for one in found.plan.characteristics if one.name == "Bore diameter")
    assert item.upper == pytest.approx(0.254, rel=1e-12)
    bore.set("linearUnit", "cubit")
    found = plan_of_qif(etree.tostring(root), "BACK", "Block")
    assert "unit 'cubit' is not known" in next(
        one.why for one in found.left_out if one.name == "BORE 1"
    )


def test_gives_features_of_one_name_names_of_their_own() -> None:
    root = make_document(sample_report(frame=None))
    items = root.findall(f".//{Q}FeatureItems/*")
    for item in items:
        name = item.find(f"{Q}FeatureName")
        assert name is not None
        name.text = "HOLE"
    found = plan_of_qif(etree.tostring(root), "BACK", "Block")
    names = [one.name for one in found.plan.features]
    assert len(set(names)) == len(items) == len(names)
    plain = plan_of_qif(told(sample_report(frame=None)), "BACK", "Block").plan
    order = {one.name: k for k, one in enumerate(plain.features)}
    for before, after in zip(plain.characteristics, found.plan.characteristics, strict=True):
        assert [names.index(one) for one in after.features] == [
            order[one] for one in before.features
        ]


def test_takes_datums_regardless_of_feature_size() -> None:
    asked = Characteristic(
        name="Pos", kind="position", features=["BALL"], upper=0.02, datums=["FACE", "BORE 1"]
    )
    root = make_document(asking(asked, view=sample_report().view))
    for one in (*root.iter(f"{Q}MaterialModifier"), *root.iter(f"{Q}MaterialCondition")):
        one.text = "REGARDLESS"
    # The order in the document is not the order of precedence.
    datums = next(root.iter(f"{Q}Datums"))
    datums.append(datums[0])
    found = plan_of_qif(etree.tostring(root), "BACK", "Block")
    (item,) = [one for one in found.plan.characteristics if one.name == "Pos"]
    assert item.datums == ["FACE", "BORE 1"]


MODEL = """<QIFDocument xmlns="http://qifstandards.org/xsd/qif3" idMax="99" versionQIF="3.0.0">
<FileUnits><PrimaryUnits>
 <LinearUnit><SIUnitName>meter</SIUnitName><UnitName>mm</UnitName>
  <UnitConversion><Factor>0.001</Factor></UnitConversion></LinearUnit>
</PrimaryUnits></FileUnits>
<Features>
 <FeatureDefinitions n="2">
  <PlaneFeatureDefinition id="1"/>
  <CylinderFeatureDefinition id="2"><InternalExternal>INTERNAL</InternalExternal>
   <Diameter>35.000000000000199</Diameter><Length>100</Length>
   <Bottom><BottomEnum>THROUGH</BottomEnum></Bottom></CylinderFeatureDefinition>
 </FeatureDefinitions>
 <FeatureNominals n="3">
  <PlaneFeatureNominal id="3"><Attributes n="1"><AttributeStr name="a" value="b"/></Attributes>
   <Name>Nominal 3</Name><FeatureDefinitionId>1</FeatureDefinitionId>
   <EntityInternalIds n="1"><Id>77</Id></EntityInternalIds>
   <Location>0 0 0</Location><Normal>0 0 1</Normal><PolyLine count="1">0 0 0</PolyLine>
  </PlaneFeatureNominal>
  <CylinderFeatureNominal id="4"><Name>Nominal 4</Name>
   <FeatureDefinitionId>2</FeatureDefinitionId>
   <Axis><AxisPoint>325 175 0</AxisPoint><Direction>0 0 -1</Direction></Axis>
  </CylinderFeatureNominal>
  <CylinderFeatureNominal id="5"><Name>Nominal 5</Name>
   <FeatureDefinitionId>2</FeatureDefinitionId>
   <Axis><AxisPoint linearUnit="m">-0.325 0.175 0</AxisPoint><Direction>0 0 -1</Direction></Axis>
  </CylinderFeatureNominal>
 </FeatureNominals>
</Features>
<Characteristics>
 <CharacteristicDefinitions n="3">
  <DiameterCharacteristicDefinition id="10"><Tolerance>
   <MaxValue decimalPlaces="2" linearUnit="mm">35.2</MaxValue><MinValue>34.8</MinValue>
   <DefinedAsLimit>true</DefinedAsLimit></Tolerance></DiameterCharacteristicDefinition>
  <FlatnessCharacteristicDefinition id="11">
   <StatisticalCharacteristic>false</StatisticalCharacteristic>
   <ToleranceValue linearUnit="inch">0.01</ToleranceValue></FlatnessCharacteristicDefinition>
  <SurfaceProfileCharacteristicDefinition id="12"><ToleranceValue>0.5</ToleranceValue>
   <UnequallyDisposedZone>0.1</UnequallyDisposedZone>
   </SurfaceProfileCharacteristicDefinition>
 </CharacteristicDefinitions>
 <CharacteristicNominals n="3">
  <DiameterCharacteristicNominal id="20">
   <CharacteristicDefinitionId>10</CharacteristicDefinitionId>
   <FeatureNominalIds n="2"><Id>4</Id><Id>5</Id></FeatureNominalIds><Name>Bores</Name>
  </DiameterCharacteristicNominal>
  <FlatnessCharacteristicNominal id="21">
   <CharacteristicDefinitionId>11</CharacteristicDefinitionId>
   <FeatureNominalIds n="1"><Id>3</Id></FeatureNominalIds><Name>Flat</Name>
  </FlatnessCharacteristicNominal>
  <SurfaceProfileCharacteristicNominal id="22">
   <CharacteristicDefinitionId>12</CharacteristicDefinitionId>
   <FeatureNominalIds n="1"><Id>3</Id></FeatureNominalIds><Name>Profile</Name>
  </SurfaceProfileCharacteristicNominal>
 </CharacteristicNominals>
</Characteristics></QIFDocument>"""


def test_takes_a_model_from_its_nominals() -> None:
    found = plan_of_qif(MODEL.encode(), "MODEL", "Block")
    plane, first, second = found.plan.features
    assert (plane.name, plane.point, plane.direction) == ("Nominal 3", (0, 0, 0), (0, 0, 1))
    assert (first.point, first.length, first.side) == ((325.0, 175.0, -50.0), 100.0, "inner")
    assert second.point == pytest.approx((-325.0, 175.0, -50.0), abs=1e-9)
    told_of = {
        one.name: (one.features, round(one.nominal, 9), round(one.lower, 9), round(one.upper, 9))
        for one in found.plan.characteristics
    }
    assert told_of == {
        "Bores Nominal 4": (["Nominal 4"], 35.0, -0.2, 0.2),
        "Bores Nominal 5": (["Nominal 5"], 35.0, -0.2, 0.2),
        "Flat": (["Nominal 3"], 0.0, 0.0, 0.254),
    }
    (left,) = found.left_out
    assert (left.name, "UnequallyDisposedZone" in left.why) == ("Profile", True)


@pytest.mark.parametrize(
    ("before", "after", "name"),
    [
        ("<Axis>", "<CoordinateSystemId>7</CoordinateSystemId><Axis>", "Nominal 4"),
        ("<Id>77</Id>", '<Id xId="2">77</Id>', ""),
        ("<FeatureDefinitionId>2<", '<FeatureDefinitionId xId="1">2<', "Nominal 4"),
        ('id="5"', 'id="4"', "refused"),
        ("<Normal>0 0 1", '<Normal linearUnit="inch">0 0 1', "Nominal 3"),
        ("<ToleranceValue>0.5", "<ToleranceValue/><ToleranceValue>0.5", "Profile"),
        ("<DefinedAsLimit>true", "<DefinedAsLimit>maybe", "Bores"),
        ("<DefinedAsLimit>true", "unless noted<DefinedAsLimit>true", "Bores"),
        ("</Axis>", "</Axis>inch", "Nominal 4"),
    ],
)
def test_names_the_item_with_a_foreign_reference(before: str, after: str, name: str) -> None:
    assert before in MODEL
    content = MODEL.replace(before, after, 1).encode()
    if name == "refused":
        with pytest.raises(InputError, match="used twice"):
            plan_of_qif(content, "MODEL", "Block")
        return
    found = plan_of_qif(content, "MODEL", "Block")
    assert not name or name in [one.name for one in found.left_out]


def test_refuses_a_scaled_model() -> None:
    scale = "<Product><Header><ScaleCoefficient>{}</ScaleCoefficient></Header></Product><Features>"
    one, other = (
        MODEL.replace("<Features>", scale.format(text), 1).encode() for text in ("1", "25.4")
    )
    assert plan_of_qif(one, "MODEL", "Block").plan.features
    with pytest.raises(InputError, match=r"the scale of its model is 25\.4"):
        plan_of_qif(other, "MODEL", "Block")


@pytest.mark.parametrize(
    ("element", "text", "why"),
    [
        ("Diameter", "nan", "no number"),
        ("Diameter", "-3", "Diameter is not stated"),
        ("Normal", "0 0 2", "direction of length one"),
        ("ToleranceValue", "x", ""),
    ],
)
def test_what_is_not_taken_is_named(element: str, text: str, why: str) -> None:
    root = make_document(sample_report(frame=None))
    spoiled = [one for one in root.iter(f"{Q}{element}") if "Measure" not in str(one.getparent())]
    for one in spoiled:
        one.text = text
    found = plan_of_qif(etree.tostring(root), "BACK", "Block")
    names = [one.name for one in found.left_out]
    if spoiled and why:
        assert any(why in one.why for one in found.left_out), found.left_out
        assert "BORE 1" in names
        # Its surroundings are named as well, and not attached to another feature.
        assert "Bore diameter" in names


def test_every_item_of_the_samples_is_taken_or_named(reference: Path) -> None:
    samples = sorted((reference / "qif" / "samples").glob("*.[qQ][iI][fF]"))
    assert samples
    taken = 0
    for sample in samples:
        content = sample.read_bytes()
        root = etree.fromstring(content)
        items = len(root.findall(f".//{Q}FeatureItems/*")) + len(
            root.findall(f".//{Q}CharacteristicItems/*")
        )
        try:
            found = plan_of_qif(content, "SAMPLE", "Sample")
        except InputError:
            # One without a feature that can be probed.
            continue
        kept = len(found.plan.features) + len(found.plan.characteristics)
        assert kept + len(found.left_out) == items, sample.name
        taken += kept
    assert taken


@pytest.mark.parametrize(
    "content",
    [
        b"", b"text", b"<a/>",
        b'<!DOCTYPE x [<!ENTITY f SYSTEM "file:///etc/passwd">]>'
        b'<QIFDocument xmlns="http://qifstandards.org/xsd/qif3">&f;</QIFDocument>',
        b'<QIFDocument xmlns="http://qifstandards.org/xsd/qif3"/>',
    ],
)  # fmt: skip
def test_what_is_hostile_or_empty_is_refused(content: bytes) -> None:
    with pytest.raises(InputError, match="no QIF document that a plan can be made of"):
        plan_of_qif(content, "X", "X")
