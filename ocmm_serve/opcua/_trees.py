"""Values of the facts by name, with the types of OPC 40210 that they have in the address space."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any, get_args

import msgspec
from asyncua import ua

from ocmm_serve.published import (
    CalibrationFacts,
    CorrectionFacts,
    PublishedFacts,
    PublishedResult,
    evaluation_of,
)

_CORRECTION, _SENSOR, _CHARACTERISTIC, _PROGNOSIS = "gms:1005", "gms:1007", "gms:1009", "gms:1019"
"""Numbers of types in the nodeset."""
_TACTILE_MEASURING = 4
_MEASUREMENT_ERROR = 4
_QUALIFIED, _IMPRECISE, _NOT_QUALIFIED = 0, 1, 2
_NO_LIMIT, _LIMIT = 0, 1
"""Members of its enumerations."""
_UNITS = {"mm": ("MMT", "mm", "millimetre"), "deg": ("DD", "°", "degree")}
"""Code of UNECE recommendation 20, sign and name."""
_UNECE = "http://www.opcfoundation.org/UA/units/un/cefact"
_FLAG, _REAL, _NUMBER = ua.VariantType.Boolean, ua.VariantType.Double, ua.VariantType.Int32
_TEXT, _TIME, _COUNT = ua.VariantType.String, ua.VariantType.DateTime, ua.VariantType.UInt32
_KINDS = {bool: _FLAG, float: _REAL, int: _NUMBER, str: _TEXT}


@dataclass(frozen=True, slots=True)
class Leaf:
    """A variable; None is shown as BadNoData."""

    value: Any
    kind: ua.VariantType
    members: Tree = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class TypedObject:
    """An object of a type of the nodesets, with its members."""

    kind: str
    members: Tree


Tree = Mapping[str, "Leaf | TypedObject | Tree"]
"""By name; `gms:Nominal` is in the namespace of that nodeset, any other one in ours."""


def paths_of(tree: Tree, parent: str) -> Iterator[tuple[str, str, str, Leaf | TypedObject | Tree]]:
    """Yield path, parent, name and content of each node, parents first."""
    for name, one in tree.items():
        # Names of characteristics may contain the separator.
        path = f"{parent}/{name.replace('/', '|')}"
        yield path, parent, name, one
        yield from paths_of(one.members if isinstance(one, Leaf | TypedObject) else one, path)


def trees_of(facts: PublishedFacts) -> dict[str, Tree]:
    """Return the nodes below each root of the machine."""
    latest = facts.results[-1:]
    version = {"0:NodeVersion": Leaf(str(facts.version), _TEXT)}
    calibrations = {f"{one.of} {one.name}": one for one in facts.calibrations}
    return {
        "Machine": {
            "Station": _tree(facts.state),
            "LatestResult": {} if not latest else _of_result(latest[0]),
            "Calibrations": {name: _tree(one) for name, one in calibrations.items()},
            "Corrections": {one.offset: _tree(one) for one in facts.corrections},
        },
        "Prognoses": version | {name: _prognosis(one) for name, one in calibrations.items()},
        "Tools": version
        | {
            one.name: _sensor(number, one)
            for number, one in enumerate(facts.calibrations, 1)
            if one.of == "tip"
        },
        # Those of practice are no corrections.
        "Changes": {one.offset: _correction(one) for one in facts.corrections if not one.practice},
    }


def _tree(struct: msgspec.Struct, *without: str) -> dict[str, Leaf]:
    """Return the fields of a structure that are plain values, or lists of texts."""
    found: dict[str, Leaf] = {}
    for one in msgspec.structs.fields(struct):
        value, types = getattr(struct, one.name), (one.type, *get_args(one.type))
        name = one.name.title().replace("_", "")
        kinds = [kind for plain, kind in _KINDS.items() if plain in types]
        if one.name in without:
            continue
        if one.name.endswith("_utc"):
            found[name] = Leaf(_moment(value), _TIME)
        elif isinstance(value, tuple) and kinds == [_TEXT]:
            found[name] = Leaf(list(value), _TEXT)
        elif kinds or isinstance(value, str):
            found[name] = Leaf(value, kinds[0] if kinds else _TEXT)
    return found


def _of_result(result: PublishedResult) -> Tree:
    report = result.report
    return {
        **_tree(report.job),
        "Simulated": Leaf(report.simulated, _FLAG),
        "Partial": Leaf(result.partial, _FLAG),
        "PartVerdict": Leaf(result.verdict_text, _TEXT),
        "Evaluation": Leaf(int(result.evaluation), _NUMBER),
        "Characteristics": {one.name: _characteristic(one) for one in report.results},
    }


def _characteristic(one: Any) -> TypedObject:
    """Return a characteristic; U and the verdict in words are in our namespace."""
    values = {"Nominal": one.nominal, "ResultValue": one.measured}
    limits = {"LowerToleranceLimit": one.lower, "UpperToleranceLimit": one.upper}
    return TypedObject(
        _CHARACTERISTIC,
        {
            "gms:CharacteristicIdentifier": Leaf(one.name, _TEXT),
            "gms:IsValid": Leaf(one.measured is not None, _FLAG),
            "gms:ResultEvaluation": Leaf(int(evaluation_of(one.verdict)), _NUMBER),
            **{f"gms:{name}": _quantity(value, one.unit) for name, value in values.items()},
            **{
                f"gms:{name}": _quantity(value, one.unit, **{"gms:ToleranceForm": _form(value)})
                for name, value in limits.items()
            },
            **_tree(one, "name", "nominal", "lower", "upper", "measured"),
        },
    )


def _form(limit: float | None) -> Leaf:
    none = limit is None or math.isinf(limit)
    return Leaf(_NO_LIMIT if none else _LIMIT, _NUMBER)


def _quantity(value: float | None, unit: str, **members: Leaf) -> Leaf:
    code, sign, name = _UNITS[unit]
    number = ua.Int32(int.from_bytes(code.encode(), "big"))
    stated = ua.EUInformation(_UNECE, number, ua.LocalizedText(sign), ua.LocalizedText(name))
    units = Leaf(stated, ua.VariantType.ExtensionObject)
    return Leaf(value, _REAL, {"0:EngineeringUnits": units, **members})


def _prognosis(one: CalibrationFacts) -> TypedObject:
    return TypedObject(
        _PROGNOSIS,
        {
            "gms:Calibrated": Leaf(one.usable, _FLAG),
            "gms:DateOfCalibration": Leaf(_moment(one.made_utc), _TIME),
            "tool:PredictedTime": Leaf(_moment(one.due_utc), _TIME),
        },
    )


def _sensor(number: int, one: CalibrationFacts) -> TypedObject:
    """Return a tip as a tool."""
    qualified = _QUALIFIED if one.status == "VALID" else _IMPRECISE
    why = Leaf(0 if one.usable else _MEASUREMENT_ERROR, _NUMBER)
    return TypedObject(
        _SENSOR,
        {
            "tool:Name": Leaf(one.name, _TEXT),
            "gms:Class": Leaf(_TACTILE_MEASURING, _COUNT),
            "gms:IsQualifiedStatus": Leaf(qualified if one.usable else _NOT_QUALIFIED, _NUMBER),
            "tool:ControlIdentifier1": Leaf(number, _COUNT),
            "tool:ControlIdentifierInterpretation": Leaf(0, _NUMBER),
            "tool:Locked": Leaf(not one.usable, _FLAG, {"tool:ReasonForLocking": why}),
            "tool:ToolLife": {},
        },
    )


def _correction(one: CorrectionFacts) -> TypedObject:
    """Return the last change of an offset; the specification does not define its sign."""
    text = f"{one.what}: CorrectionValueAbsolute is the offset in the control after the change."
    return TypedObject(
        _CORRECTION,
        {
            "gms:Identifier": Leaf(one.offset, _TEXT),
            "gms:CharacteristicIdentifier": Leaf(", ".join(one.characteristics), _TEXT),
            "gms:CorrectionValueAbsolute": _quantity(one.after, one.unit),
            "gms:CorrectionValueRelative": _quantity(one.after - one.before, one.unit),
            "gms:Description": Leaf(ua.LocalizedText(text), ua.VariantType.LocalizedText),
        },
    )


def structure_of(result: PublishedResult) -> Any:
    """Return a result as the structure of the specification; its content is the report."""
    report = result.report
    kinds: Any = ua  # the classes of the nodesets are made when these are loaded
    meta = kinds.ResultMetaDataType(
        ResultId=report.job.uuid, IsPartial=result.partial, IsSimulated=report.simulated,
        PartId=report.job.serial, ProductId=report.job.part, InternalRecipeId=report.job.plan,
        JobId=report.job.name, CreationTime=_moment(report.job.created_utc),
        ResultEvaluation=kinds.ResultEvaluationEnum(int(result.evaluation)),
        ResultEvaluationDetails=ua.LocalizedText(result.verdict_text), FileFormat=[report.schema],
    )  # fmt: skip
    content = [ua.Variant(result.json.decode("utf-8"), ua.VariantType.String)]
    return kinds.ResultDataType(ResultMetaData=meta, ResultContent=content)


def _moment(text: str) -> datetime | None:
    """Return a time as this protocol has it: UTC, without a zone."""
    return datetime.fromisoformat(text).astimezone(UTC).replace(tzinfo=None) if text else None
