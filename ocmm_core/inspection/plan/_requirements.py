"""Requirements of a model, QIF document or table, and their presence in the plan.

The plan stores the account of each import; presence is computed at each reading, so that a deleted,
changed or widened characteristic no longer counts.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING, Literal

import msgspec

from ocmm_core.features.measured import nominal_geometries
from ocmm_core.geometry import Float
from ocmm_core.tolerances.decisions import RequirementCount
from ocmm_core.tolerances.zones import Characteristic

if TYPE_CHECKING:
    from ocmm_core.inspection.plan._plan import Plan

SourceKind = Literal["model", "QIF document", "table"]
UNCOUNTED = ("datum", "datum target", "note")
"""Groups that are listed and not counted; a note prevents a complete count."""
_HASH = re.compile(r"[0-9a-f]{64}")
_SAME = 1e-9
_DECIMALS = 6
_BY_NAME = ("name", "features", "datums", "nominal", "lower", "upper", "limits")
_DEFAULTS = {one.name: one.default for one in msgspec.structs.fields(Characteristic)}


class PlanSource(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    kind: SourceKind
    file: str
    """Name without folders."""
    sha256: str


class Requirement(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One item of a source, and the items of the plan that represent it."""

    group: str
    """``dimension``, ``tolerance``, ``characteristic``, ``feature``, or one of `UNCOUNTED`."""
    label: str
    """Name in the source."""
    asks: str
    """Requirement in words, as on a drawing."""
    source: int = 1
    """Number of its source in the plan, from 1."""
    balloon: str = ""
    """Unique in the plan: designator of the source, or a running number."""
    reference: str = ""
    """Place in the source: entity, id or line."""
    nominal: float | None = None
    lower: float | None = None
    upper: float | None = None
    """`nominal`, `lower`, `upper`: Nominal and permitted deviations; None if not stated."""
    unit: str = ""
    characteristics: list[str] = msgspec.field(default_factory=list)
    nominals: list[str] = msgspec.field(default_factory=list)
    """`characteristics`, `nominals`: Names of characteristics and features of the plan."""
    mark: str = ""
    """Hash of these items at the import, without names and limits."""
    why: str = ""
    """Reason for leaving it, or a part of it, out; part of a sentence."""
    remark: str = ""


@dataclass(frozen=True, slots=True)
class RequirementState:
    requirement: Requirement
    source: PlanSource
    why: str
    """Why it is not in the plan; empty if it is."""

    @property
    def counts(self) -> bool:
        return self.requirement.group not in UNCOUNTED


def source_of(kind: SourceKind, file: PurePath | str, sha256: str) -> PlanSource:
    return PlanSource(kind=kind, file=PurePath(file).name, sha256=sha256)


def with_requirements(plan: Plan, source: PlanSource, found: Sequence[Requirement]) -> Plan:
    """Return the plan with the account of a source added; one per file, the old one is kept."""
    if not found:
        return plan
    sources = list(plan.sources)
    if source.sha256 not in [one.sha256 for one in sources]:
        sources.append(source)
    number = 1 + [one.sha256 for one in sources].index(source.sha256)
    before = _keyed([one for one in plan.requirements if one.source == number])
    balloons = {one.balloon for one in plan.requirements}
    contents, taken = _contents(plan), dict(before)
    for key, item in _keyed(found).items():
        prior = before.get(key)
        if prior is not None and not _fault(contents, prior):
            continue
        balloon = prior.balloon if prior is not None else _free(item.balloon, balloons)
        balloons.add(balloon)
        mark = contents.mark(item)
        taken[key] = msgspec.structs.replace(item, source=number, balloon=balloon, mark=mark)
    others = [one for one in plan.requirements if one.source != number]
    requirements = sorted([*others, *taken.values()], key=lambda one: one.source)
    return msgspec.structs.replace(plan, sources=sources, requirements=requirements)


def requirement_states(plan: Plan) -> tuple[RequirementState, ...]:
    contents = _contents(plan)
    return tuple(
        RequirementState(one, plan.sources[one.source - 1], _fault(contents, one))
        for one in plan.requirements
    )


def requirement_count(plan: Plan) -> RequirementCount | None:
    """Return how many requirements of its sources the plan contains; None without a source."""
    if not plan.requirements:
        return None
    states = requirement_states(plan)
    counted = [one for one in states if one.counts]
    notes = sum(one.requirement.group == "note" for one in states)
    kinds = {one.kind for one in plan.sources}
    origin = kinds.pop() if len(kinds) == 1 else "sources"
    return RequirementCount(sum(not one.why for one in counted), len(counted), notes, origin)


def requirements_fault(plan: Plan) -> tuple[str, str] | None:
    """Return field and fault of an unusable account; None if usable."""
    for index, source in enumerate(plan.sources):
        if not _HASH.fullmatch(source.sha256):
            return f"sources[{index}].sha256", "is no SHA-256: 64 digits from 0 to f"
    balloons: set[str] = set()
    for index, one in enumerate(plan.requirements):
        if not 1 <= one.source <= len(plan.sources):
            return f"requirements[{index}].source", f"is {one.source}, which is no source"
        if not one.balloon or one.balloon in balloons:
            return f"requirements[{index}].balloon", f"is {one.balloon!r}, which is not unique"
        balloons.add(one.balloon)
    return None


@dataclass(frozen=True, slots=True)
class _Contents:
    characteristics: Mapping[str, Characteristic]
    shapes: Mapping[str, str]
    geometries: Mapping[str, Float]

    def lacks(self, one: Requirement) -> list[str]:
        absent = [name for name in one.characteristics if name not in self.characteristics]
        return absent + [name for name in one.nominals if name not in self.shapes]

    def mark(self, one: Requirement) -> str:
        """Return the hash of the items of a requirement; empty if it has none."""
        if self.lacks(one) or not (one.characteristics or one.nominals):
            return ""
        told: list[object] = [self._geometry(name) for name in one.nominals]
        for name in one.characteristics:
            item = self.characteristics[name]
            # Without defaults, so that a field of a later version does not change the hash.
            fields = {
                key: value
                for key, value in msgspec.to_builtins(item).items()
                if key not in _BY_NAME and value and value != _DEFAULTS[key]
            }
            told.append([fields, *(self._geometry(own) for own in (*item.features, *item.datums))])
        return hashlib.sha256(msgspec.json.encode(told, order="deterministic")).hexdigest()[:16]

    def _geometry(self, name: str) -> list[object]:
        geometry = self.geometries.get(name, ())
        return [
            self.shapes.get(name, ""),
            *(round(float(value), _DECIMALS) + 0.0 for value in geometry),
        ]


def _contents(plan: Plan) -> _Contents:
    sides = {one.name: f"{one.side} {one.criterion}" for one in plan.features}
    shapes = {name: f"{one.value} {sides.get(name, '')}" for name, one in plan.shapes.items()}
    return _Contents(
        {one.name: one for one in plan.characteristics},
        shapes, nominal_geometries(plan.features, plan.constructions),
    )  # fmt: skip


def _fault(contents: _Contents, one: Requirement) -> str:
    if one.why:
        return one.why
    if absent := contents.lacks(one):
        return f"removed from the plan: {', '.join(absent)}"
    if not one.mark or contents.mark(one) != one.mark:
        return "changed in the plan after the import"
    if one.lower is not None and one.upper is not None:
        low, high = (one.nominal or 0.0) + one.lower, (one.nominal or 0.0) + one.upper
        for name in one.characteristics:
            item = contents.characteristics[name]
            if item.nominal + item.lower < low - _SAME or item.nominal + item.upper > high + _SAME:
                return "its limits in the plan are wider than asked for"
    return ""


def _keyed(items: Sequence[Requirement]) -> dict[tuple[str, ...], Requirement]:
    found: dict[tuple[str, ...], Requirement] = {}
    for one in items:
        key: tuple[str, ...] = (one.group, one.reference, one.label, one.asks)
        while key in found:
            key = (*key, "again")
        found[key] = one
    return found


def _free(wanted: str, used: set[str]) -> str:
    """Return an unused balloon: the wanted one, or the next number."""
    if wanted and wanted not in used:
        return wanted
    numbers = [int(one) for one in used if one.isdecimal() and len(one) < 9]
    return f"{wanted}-{len(used) + 1}" if wanted else str(max(numbers, default=0) + 1)
