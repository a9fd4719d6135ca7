"""Plans from models (MBD) in the dialect of the NIST documents, against an independent reading.

Features are nominals with axis, diameter and length, requirements name them by their ids; units are
primary, for PMI, or of each value. Items that the plan cannot hold are interspersed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal

import numpy as np
import pytest
from lxml import etree

from ocmm_core.export.qif import plan_of_qif
from tests.host import amount

Q = "{http://qifstandards.org/xsd/qif3}"
MM = {"mm": Decimal(1), "inch": Decimal("25.4"), "m": Decimal(1000), "cm": Decimal(10)}
FACTORS = {"mm": "0.001", "inch": "0.0254", "m": "1", "cm": "0.01"}
AXES = ("0 0 1", "0 1 0", "1 0 0", "0 0 -1")
ATTRIBUTES = (
    '<Attributes n="1"><AttributeStr name="_3dv.DefaultFittingAlgo" value="LEASTSQUARES"/>'
    "</Attributes>"
)
FOREIGN = (
    '<SecondCompositeSegmentPositionDefinition><DatumReferenceFrameId>90</DatumReferenceFrameId>'
    "<ToleranceValue>0.02</ToleranceValue></SecondCompositeSegmentPositionDefinition>",
    "<FreeState>true</FreeState>",
    "<ProjectedToleranceZone><ZoneLength>3</ZoneLength></ProjectedToleranceZone>",
)  # fmt: skip


def unit(element: str, name: str) -> str:
    return (
        f"<{element}><SIUnitName>meter</SIUnitName><UnitName>{name}</UnitName>"
        f"<UnitConversion><Factor>{FACTORS[name]}</Factor></UnitConversion></{element}>"
    )


@dataclass(slots=True)
class Model:
    """A document under construction."""

    rng: np.random.Generator
    definitions: list[str] = field(default_factory=list)
    nominals: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)
    named: list[str] = field(default_factory=list)
    last: int = 100

    def id(self) -> int:
        self.last += 1
        return self.last

    def number(self, most: float = 9.0) -> str:
        return f"{self.rng.uniform(0.01, most):.{self.rng.integers(2, 6)}f}"

    def unit(self) -> str:
        chosen = self.rng.choice(["", "", *MM])
        return f' linearUnit="{chosen}"' if chosen else ""

    def point(self) -> str:
        signs = ("", "-")
        return " ".join(f"{signs[self.rng.integers(2)]}{self.number(90.0)}" for _ in range(3))

    def feature(self, kind: str, nominal: str, definition: str = "") -> int:
        one, other = self.id(), self.id()
        self.definitions.append(
            f'<{kind}FeatureDefinition id="{one}">{definition}</{kind}FeatureDefinition>'
        )
        self.nominals.append(
            f'<{kind}FeatureNominal id="{other}">{ATTRIBUTES}<Name>Nominal {other}</Name>'
            f"<FeatureDefinitionId>{one}</FeatureDefinitionId>"
            f'<EntityInternalIds n="1"><Id>7</Id></EntityInternalIds>{nominal}'
            f"</{kind}FeatureNominal>"
        )
        return other

    def round_one(self, kind: str) -> int:
        size = f"<Diameter{self.unit()}>{self.number()}</Diameter>"
        side = self.rng.choice(["INTERNAL", "EXTERNAL"])
        definition = f"<InternalExternal>{side}</InternalExternal>{size}"
        axis = AXES[self.rng.integers(4)]
        place = f"<Location{self.unit()}>{self.point()}</Location>"
        if kind == "Cylinder":
            definition += f"<Length{self.unit()}>{self.number()}</Length>"
            definition += "<Bottom><BottomEnum>THROUGH</BottomEnum></Bottom>"
            point = place.replace("Location", "AxisPoint")
            place = f"<Axis>{point}<Direction>{axis}</Direction></Axis>"
        elif kind == "Circle":
            place += f"<Normal>{axis}</Normal>"
        return self.feature(kind, place, definition)

    def ask(self, kind: str, about: int, definition: str, target: str = "") -> None:
        one, other = self.id(), self.id()
        self.asked.append(
            f'<{kind}CharacteristicDefinition id="{one}">{definition}'
            f"</{kind}CharacteristicDefinition>"
        )
        self.named.append(
            f'<{kind}CharacteristicNominal id="{other}">'
            f"<CharacteristicDefinitionId>{one}</CharacteristicDefinitionId>"
            f'<FeatureNominalIds n="1"><Id>{about}</Id></FeatureNominalIds>'
            f"<Name>{kind} {other}</Name>{target}</{kind}CharacteristicNominal>"
        )

    def zone(self, rest: str = "") -> str:
        value = f"<ToleranceValue{self.unit()}>{self.number(0.5)}</ToleranceValue>"
        return f"<StatisticalCharacteristic>false</StatisticalCharacteristic>{value}{rest}"


def frame(number: int, count: int) -> str:
    words = ("PRIMARY", "SECONDARY", "TERTIARY")[:count]
    return f'<DatumReferenceFrame id="{number}"><Datums n="{count}">' + "".join(
        f"<Datum><SimpleDatum><DatumDefinitionId>{80 + place}</DatumDefinitionId>"
        "<MaterialModifier>NONE</MaterialModifier><ReferencedComponent>NOMINAL"
        "</ReferencedComponent></SimpleDatum><Precedence><PrecedenceEnum>"
        f"{word}</PrecedenceEnum></Precedence></Datum>"
        for place, word in enumerate(words)
    ) + "</Datums></DatumReferenceFrame>"  # fmt: skip


def document(seed: int) -> bytes:
    model = Model(np.random.default_rng(seed))
    planes = [
        model.feature("Plane", f"<Location{model.unit()}>{model.point()}</Location>"
                               f'<Normal>{axis}</Normal><PolyLine count="1">0 0 0</PolyLine>')
        for axis in AXES[:3]
    ]  # fmt: skip
    rounds = [model.round_one(kind) for kind in ("Cylinder", "Cylinder", "Sphere", "Circle")]
    odd = model.feature("OtherNonShape", "", "<Description>x</Description>")
    model.feature("CylindricalSegment", "<Sweep/>", "<Diameter>3</Diameter>")
    for one in rounds:
        value, low = model.number(), model.number(0.2)
        as_limit = bool(model.rng.integers(2))
        common = model.unit()
        high = f"{Decimal(value) + Decimal(low)}" if as_limit else low
        limit = f"{Decimal(value) - Decimal(low) / 2}" if as_limit else f"-{low}"
        model.ask(
            "Diameter", one,
            f"<Tolerance><MaxValue{common}>{high}</MaxValue><MinValue{common}>{limit}</MinValue>"
            f"<DefinedAsLimit>{str(as_limit).lower()}</DefinedAsLimit></Tolerance>",
            f'<TargetValue decimalPlaces="2"{common}>{value}</TargetValue>',
        )  # fmt: skip
    for one in planes:
        model.ask("Flatness", one, model.zone())
    none = "<MaterialCondition>NONE</MaterialCondition>"
    round_zone = "<ZoneShape><DiametricalZone/></ZoneShape>"
    flat_zone = "<ZoneShape><PlanarZone/></ZoneShape>"
    whole = f"<DatumReferenceFrameId>90</DatumReferenceFrameId>{none}"
    for one in rounds[:2]:
        model.ask("Position", one, model.zone(whole + round_zone))
        foreign = FOREIGN[model.rng.integers(len(FOREIGN))]
        model.ask("Position", one, f"<!--foreign-->{model.zone(whole + round_zone)}{foreign}")
    alone = f"<DatumReferenceFrameId>91</DatumReferenceFrameId>{none}{flat_zone}"
    model.ask("Perpendicularity", planes[1], model.zone(alone))
    model.ask("Flatness", odd, model.zone())
    primary = model.rng.choice(list(MM))
    pmi = model.rng.choice(["", *MM])
    units = unit("LinearUnit", primary) + (unit("PMILinearUnit", pmi) if pmi else "")
    datums = "".join(
        f'<DatumDefinition id="{80 + place}"><DatumLabel>{letter}</DatumLabel>'
        f'<FeatureNominalIds n="1"><Id>{plane}</Id></FeatureNominalIds></DatumDefinition>'
        for place, (letter, plane) in enumerate(zip("ABC", planes, strict=True))
    )
    return (
        f'<QIFDocument xmlns="{Q[1:-1]}" idMax="999" versionQIF="3.0.0"><FileUnits><PrimaryUnits>'
        f"{units}</PrimaryUnits></FileUnits>"
        f'<DatumDefinitions n="3">{datums}</DatumDefinitions>'
        f'<DatumReferenceFrames n="2">{frame(90, 3)}{frame(91, 1)}</DatumReferenceFrames>'
        f"<Features><FeatureDefinitions>{''.join(model.definitions)}</FeatureDefinitions>"
        f"<FeatureNominals>{''.join(model.nominals)}</FeatureNominals></Features>"
        f"<Characteristics><CharacteristicDefinitions>{''.join(model.asked)}"
        f"</CharacteristicDefinitions><CharacteristicNominals>{''.join(model.named)}"
        "</CharacteristicNominals></Characteristics></QIFDocument>"
    ).encode()


class Reading:
    """The document as an XPath with exact decimals reads it."""

    def __init__(self, content: bytes) -> None:
        self.root = etree.fromstring(content)
        names = [self.root.findtext(f".//{Q}{word}/{Q}UnitName")
                 for word in ("LinearUnit", "PMILinearUnit")]  # fmt: skip
        self.primary, self.pmi = str(names[0]), str(names[1] or names[0])

    def by_id(self, number: str | None) -> etree._Element:
        return next(one for one in self.root.iter(etree.Element) if one.get("id") == number)

    def mm(self, item: etree._Element, word: str, *, is_pmi: bool) -> list[float]:
        (one,) = item.findall(f".//{Q}{word}")
        factor = MM[one.get("linearUnit") or (self.pmi if is_pmi else self.primary)]
        return [float(Decimal(part) * factor) for part in str(one.text).split()]

    def named(self) -> dict[str, tuple[etree._Element, etree._Element]]:
        found = {}
        for one in self.root.findall(f".//{Q}CharacteristicNominals/*"):
            definition = self.by_id(one.findtext(f"{Q}CharacteristicDefinitionId"))
            found[str(one.findtext(f"{Q}Name"))] = (one, definition)
        return found


@pytest.mark.parametrize("seed", range(amount(10, 200)))
def test_a_model_gives_the_numbers_of_an_independent_reading(seed: int) -> None:
    content = document(seed)
    found, reading = plan_of_qif(content, "MODEL", "Part"), Reading(content)
    left_out = {one.name for one in found.left_out}
    for feature in found.plan.features:
        nominal = reading.by_id(feature.name.removeprefix("Nominal "))
        definition = reading.by_id(nominal.findtext(f"{Q}FeatureDefinitionId"))
        word = "AxisPoint" if nominal.find(f".//{Q}AxisPoint") is not None else "Location"
        point = np.array(reading.mm(nominal, word, is_pmi=False))
        if definition.find(f"{Q}Diameter") is not None:
            assert [feature.diameter] == reading.mm(definition, "Diameter", is_pmi=False)
            inner = definition.findtext(f"{Q}InternalExternal") == "INTERNAL"
            assert feature.side == ("inner" if inner else "outer")
        if definition.find(f"{Q}Length") is not None:
            assert [feature.length] == reading.mm(definition, "Length", is_pmi=False)
            point = point + 0.5 * feature.length * np.array(feature.direction)
        assert feature.point == pytest.approx(point, abs=1e-9)
    assert len(found.plan.features) == 7
    kinds = {"Diameter": 4, "Flatness": 3, "Position": 2, "Perpendicularity": 1}
    taken = [one.name.split()[0] for one in found.plan.characteristics]
    assert {word: taken.count(word) for word in kinds} == kinds
    for item in found.plan.characteristics:
        nominal, definition = reading.named()[item.name]
        if item.kind == "diameter":
            target, high, low = (
                reading.mm(where, word, is_pmi=True)[0]
                for where, word in ((nominal, "TargetValue"), (definition, "MaxValue"),
                                    (definition, "MinValue"))
            )  # fmt: skip
            off = target if definition.findtext(f".//{Q}DefinedAsLimit") == "true" else 0.0
            assert item.nominal == target
            assert (item.lower, item.upper) == pytest.approx((low - off, high - off), abs=1e-9)
        else:
            assert [item.upper] == reading.mm(definition, "ToleranceValue", is_pmi=True)
        assert definition.find(f"{Q}SecondCompositeSegmentPositionDefinition") is None
        assert definition.findtext(f"{Q}FreeState") != "true"
    rest = set(reading.named()) - {one.name for one in found.plan.characteristics}
    assert rest <= left_out
    assert sum(name.startswith("Nominal") for name in left_out) == 2
