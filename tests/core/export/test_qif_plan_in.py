"""A plan from a QIF document: ours comes back, samples item by item, hostile ones refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from lxml import etree

from ocmm_core.errors import InputError
from ocmm_core.export.qif import plan_of_qif
from ocmm_core.export.qif._document import make_document
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


def test_inches_become_millimetres() -> None:
    root = make_document(sample_report(frame=None))
    unit = root.find(f"{Q}FileUnits/{Q}PrimaryUnits/{Q}LinearUnit/{Q}UnitName")
    assert unit is not None
    unit.text = "inch"
    found = plan_of_qif(etree.tostring(root), "BACK", "Block")
    bore = next(one for one in found.plan.features if one.name == "BORE 1")
    assert bore.diameter == pytest.approx(20.0 * 25.4)
    unit.text = "furlong"
    with pytest.raises(InputError, match="neither mm nor inch"):
        plan_of_qif(etree.tostring(root), "BACK", "Block")


@pytest.mark.parametrize(
    ("element", "text", "why"),
    [
        ("Diameter", "nan", "no number"),
        ("Diameter", "-3", "Diameter is not told"),
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
        # What is about it is named, too, and not attached to another feature.
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
