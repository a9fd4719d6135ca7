"""Each optional child and attribute of the QIF schema is taken, harmless, or refuses its item."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from pathlib import Path

import pytest
from lxml import etree

from ocmm_core.export.qif import QifPlan, plan_of_qif
from ocmm_core.export.qif._nodes import FLAGS, HARMLESS, HARMLESS_ATTRIBUTES, Q
from ocmm_core.export.qif._qif import make_document
from ocmm_core.tolerances.zones import Characteristic
from tests.core.export.sample_report import sample_report
from tests.core.export.test_export_qif import asking

X = "{http://www.w3.org/2001/XMLSchema}"
READ = (
    "FeatureItem", "FeatureNominal", "FeatureDefinition", "CharacteristicItem",
    "CharacteristicNominal", "CharacteristicDefinition", "DatumReferenceFrame", "DatumDefinition",
    "SimpleDatum", "Axis", "Tolerance",
)  # fmt: skip
VALUES = (
    "Diameter", "Length", "ToleranceValue", "MaxValue", "MinValue", "TargetValue", "AxisPoint",
    "Location", "Normal", "Direction",
)  # fmt: skip
NEEDED = {"FeatureNominalId", "FeatureDefinitionId", "CharacteristicNominalId", "Name",
          "CharacteristicDefinitionId", "FeatureName"}  # fmt: skip


class Schema:
    """Types of the schema files by name."""

    def __init__(self, folder: Path) -> None:
        self.types = {
            str(one.get("name")): one
            for path in sorted(folder.rglob("*.xsd"))
            for one in etree.parse(path).getroot()
            if one.tag in (f"{X}complexType", f"{X}attributeGroup")
        }

    def parts(self, name: str) -> tuple[list[tuple[str, str]], list[str]]:
        """Return children with their types, and attributes, of a type and its bases."""
        children: list[tuple[str, str]] = []
        attributes: list[str] = []
        one = self.types.get(name)
        wanted = ("element", "attribute", "extension", "attributeGroup")
        for part in () if one is None else one.iter(*(f"{X}{word}" for word in wanted)):
            if part.tag == f"{X}extension" or (
                part.tag == f"{X}attributeGroup" and part.get("ref")
            ):
                more = self.parts(str(part.get("base") or part.get("ref")))
                children += more[0]
                attributes += more[1]
            elif part.tag == f"{X}element" and part.get("name"):
                children.append((str(part.get("name")), str(part.get("type"))))
            elif part.tag == f"{X}attribute" and part.get("name"):
                attributes.append(str(part.get("name")))
        return children, attributes


def sizes() -> etree._Element:
    root: etree._Element = make_document(sample_report(frame=None))
    return root


def document() -> etree._Element:
    asked = Characteristic(
        name="Pos", kind="position", features=["BORE 1"], upper=0.02, datums=["FACE", "BALL"]
    )
    root: etree._Element = make_document(asking(asked, view=sample_report().view))
    return root


def additions(root: etree._Element, schema: Schema) -> Iterator[tuple[str, etree._Element]]:
    """Yield copies of the document with one child or attribute more."""
    seen = set()
    for index, element in enumerate(root.iter(etree.Element)):
        word = str(element.tag).removeprefix(Q)
        within = "".join(str(one.tag) for one in element.iterancestors())
        if "Measure" in word or "Measurement" in within:
            continue
        is_value = word in VALUES
        if not is_value and not word.endswith(READ):
            continue
        kind = {"AxisPoint": "PointType", "Location": "PointType", "Normal": "UnitVectorType",
                "Direction": "UnitVectorType", "SimpleDatum": "DatumType"}.get(word)  # fmt: skip
        children, attributes = schema.parts(
            kind or ("LinearValueType" if is_value else f"{word}Type")
        )
        for name, type_name in children:
            if name in NEEDED or (word, name) in seen or element.find(f"{Q}{name}") is not None:
                continue
            seen.add((word, name))
            changed = copy.deepcopy(root)
            place = list(changed.iter(etree.Element))[index]
            added = etree.SubElement(place, f"{Q}{name}")
            added.text = "true" if type_name == "xs:boolean" else "7"
            yield f"{word}/{name}", changed
        for name in attributes:
            if (word, name) in seen or element.get(name) is not None:
                continue
            seen.add((word, name))
            changed = copy.deepcopy(root)
            list(changed.iter(etree.Element))[index].set(name, "inch" if "Unit" in name else "3")
            yield f"{word}/@{name}", changed


def told(found: QifPlan) -> tuple[object, ...]:
    plan = found.plan
    return (*plan.features, *plan.characteristics, *found.left_out)


@pytest.mark.parametrize("root", [document(), sizes()], ids=["position", "sizes"])
def test_ignores_no_child_or_attribute_of_the_schema(reference: Path, root: etree._Element) -> None:
    schema = Schema(reference / "qif")
    plain = told(plan_of_qif(etree.tostring(root), "PLAN", "Part"))
    tried, ignored = 0, []
    for what, changed in additions(root, schema):
        tried += 1
        if told(plan_of_qif(etree.tostring(changed), "PLAN", "Part")) != plain:
            continue
        name = what.partition("/")[2]
        if name in HARMLESS or name.removeprefix("@") in HARMLESS_ATTRIBUTES:
            continue
        ignored.append(what)
    assert tried > 100
    assert not ignored


@pytest.mark.parametrize("flag", sorted(FLAGS))
def test_takes_a_modifier_that_is_off(flag: str) -> None:
    root = document()
    plain = told(plan_of_qif(etree.tostring(root), "PLAN", "Part"))
    for definition in root.findall(f".//{Q}CharacteristicDefinitions/*"):
        etree.SubElement(definition, f"{Q}{flag}").text = "false"
    assert told(plan_of_qif(etree.tostring(root), "PLAN", "Part")) == plain
