"""The growing plan: checks and account of imported items, and features by faces of a model.

No item of the model's tolerances is dropped silently.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import msgspec

from ocmm_cad.step import StepModel
from ocmm_core.errors import FitError
from ocmm_core.features.measured import nominal_geometries
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan import Plan
from ocmm_core.names import usable_name
from ocmm_core.tolerances.kinds import characteristic_fault, geometry_value, spec_of
from ocmm_core.tolerances.zones import Characteristic

Group = Literal[
    "dimension", "tolerance", "datum reference", "datum", "datum target", "annotation", "general"
]
NOT_IMPORTED = "the tolerances of the model were not imported"
"""Reason of every requirement of a model if only its features were imported."""

GROUPS: tuple[Group, ...] = (
    "dimension", "tolerance", "datum reference", "datum", "datum target", "annotation", "general",
)  # fmt: skip
NOTE = "note"
"""Kind of an annotation that is a text and not the label of an item."""
Status = Literal["taken", "partly", "refused"]


class RefusedError(ValueError):
    """Why an item is not imported, as a part of a sentence."""


class AccountItem(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One item of a model and its result."""

    group: Group
    name: str
    kind: str
    """`group`, `name`, `kind`: Type, label in the model, and content."""
    entity: int
    status: Status
    """``taken``, ``partly`` (for some of its surfaces), or ``refused``."""
    became: tuple[str, ...] = ()
    """Names of its characteristics, datums or alignment in the plan."""
    why: str = ""
    """Why it, or a part of it, was refused; part of a sentence."""
    remark: str = ""
    """Remark on an imported item; part of a sentence."""


class Account(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All items of a model, in the order of the file within their groups."""

    items: tuple[AccountItem, ...] = ()
    remarks: tuple[str, ...] = ()
    """General sentences: the standard, the alignment."""

    def counts(self) -> dict[Group, dict[Status, int]]:
        found = Counter((item.group, item.status) for item in self.items)
        words: tuple[Status, ...] = ("taken", "partly", "refused")
        return {
            group: {word: found[group, word] for word in words}
            for group in GROUPS
            if any(found[group, word] for word in words)
        }

    def by_itself(self) -> tuple[AccountItem, ...]:
        """Return the items without datum references of tolerances and labels of items."""
        return tuple(
            item
            for item in self.items
            if item.group != "datum reference" and (item.group != "annotation" or item.kind == NOTE)
        )

    @property
    def taken(self) -> int:
        return sum(item.status == "taken" for item in self.items)

    @property
    def is_complete(self) -> bool:
        return self.taken == len(self.items)


@dataclass(frozen=True, slots=True)
class Found:
    features: tuple[NominalFeature, ...]
    """Each once, in the order of the faces."""
    missing: tuple[str, ...]
    """Why faces are no features: parts of a sentence, each once."""
    part_of: tuple[str, ...]
    """Features of which only some faces were named."""


class Surfaces:
    """Features of a plan by their faces, without omitted ones."""

    def __init__(self, model: StepModel, features: Mapping[str, NominalFeature]) -> None:
        self._model, self._features = model, features
        self._why = {one.feature.name: one.why for one in model.left_out}
        self._faces: dict[str, set[int]] = {}
        for number, names in model.faces.items():
            for name in names:
                self._faces.setdefault(name, set()).add(number)

    def find(self, faces: Sequence[int]) -> Found:
        found: dict[str, NominalFeature] = {}
        missing: dict[str, int] = {}
        for number in faces:
            name, why = self._name(number)
            if why:
                missing[why] = missing.get(why, 0) + 1
            else:
                found[name] = self._features[name]
        said = tuple(f"{why} ({n} faces)" if n > 1 else why for why, n in missing.items())
        whole = set(faces)
        part_of = tuple(name for name in found if not self._faces[name] <= whole)
        return Found(tuple(found.values()), said, part_of)

    def one(self, faces: Sequence[int], odd: Sequence[str]) -> NominalFeature:
        """Return the one feature of some faces; RefusedError if none, several, or other items."""
        found = self.all_of(faces, odd)
        if found.missing:
            raise RefusedError(found.missing[0])
        if len(found.features) != 1:
            names = ", ".join(feature.name for feature in found.features)
            raise RefusedError(f"it is between more than two surfaces: {names}")
        return found.features[0]

    def all_of(self, faces: Sequence[int], odd: Sequence[str]) -> Found:
        """Return the features of faces; RefusedError if none, or if edges are included."""
        if odd:
            words = ", ".join(word.lower().replace("_", " ") for word in odd)
            raise RefusedError(f"it is attached to something that is not probed ({words})")
        if not faces:
            raise RefusedError("the file names no faces for it")
        found = self.find(faces)
        if not found.features:
            raise RefusedError("; ".join(found.missing))
        return found

    def _name(self, number: int) -> tuple[str, str]:
        names = self._model.faces.get(number, ())
        if len(names) > 1:
            return "", f"its part stands {len(names)} times in the assembly"
        if not names:
            word = self._model.face_words.get(number, "")
            known = word in {shape.value for shape in Shape}
            if known or not word:
                return "", "its face is no part of a solid, or was not found by the reader"
            return "", f"its surface is of the kind {word}"
        if names[0] not in self._features:
            return "", self._why.get(names[0], "its surface is not among the features of the plan")
        return names[0], ""


SAME_MM = 0.02
"""mm: a dimension further from its surface belongs to another one, or has another unit; three
decimals of an inch are not rounded by more."""
SAME_DEG = 0.02
_LONGEST = 60


class Context:
    """A growing plan; characteristics that could not be measured are refused."""

    def __init__(self, plan: Plan, surfaces: Surfaces) -> None:
        self.plan, self.surfaces = plan, surfaces
        self._nominals = nominal_geometries(plan.features, plan.constructions)

    def changed(self, plan: Plan) -> None:
        """Continue with another plan, with additional features or an alignment."""
        self.plan = plan
        self._nominals = nominal_geometries(plan.features, plan.constructions)

    def checked(self, items: Sequence[Characteristic]) -> list[Characteristic]:
        """Return characteristics; RefusedError if unmeasurable, or not of the model's nominal."""
        probed = {feature.name for feature in self.plan.features}
        for item in items:
            fault = characteristic_fault(
                item, self.plan.shapes, self._nominals, probed,
                aligned=self.plan.alignment is not None,
            )  # fmt: skip
            if fault is not None:
                raise RefusedError(f"the {item.kind} is not offered so: '{fault[0]}' {fault[1]}")
            self._check_nominal(item)
        return list(items)

    def drawn_value(self, item: Characteristic) -> float:
        """Return a size, distance or angle in the model; RefusedError if undefined."""
        try:
            return geometry_value(item, self._nominals, self.plan.shapes, self.plan.bound_alignment)
        except (FitError, KeyError) as error:
            what = error.what if isinstance(error, FitError) else f"{error} is not known"
            raise RefusedError(f"it cannot be compared with the model: {what}") from error

    def add(self, items: Sequence[Characteristic]) -> tuple[str, ...]:
        """Add characteristics to the plan and return their names, which are made unique."""
        named = []
        for item in items:
            name = self._free_name(item.name)
            changed = msgspec.structs.replace(item, name=name)
            self.plan = msgspec.structs.replace(
                self.plan, characteristics=[*self.plan.characteristics, changed]
            )
            named.append(name)
        return tuple(named)

    def _check_nominal(self, item: Characteristic) -> None:
        if item.nominal == 0.0:
            return
        same, unit = (SAME_DEG, "degrees") if spec_of(item.kind).unit == "deg" else (SAME_MM, "mm")
        drawn = self.drawn_value(item)
        if not abs(drawn - item.nominal) <= same:
            names = " and ".join(item.features)
            raise RefusedError(
                f"it says {item.nominal:g} {unit}, but the {item.kind} of {names} in the model is "
                f"{drawn:.4f} {unit}"
            )

    def _free_name(self, name: str) -> str:
        taken = {item.name for item in self.plan.characteristics}
        if name not in taken:
            return name
        for number in range(2, len(taken) + 3):
            more = f"{name[: _LONGEST - 5]}-{number}"
            if more not in taken:
                return more
        return name


def plan_name(label: str, feature: NominalFeature | None = None) -> str:
    """Return a label as a valid name of a plan, with the feature if it has several."""
    name = usable_name(label, len(label)) or "item"
    if feature is not None:
        name = f"{name[: _LONGEST - len(feature.name) - 1].rstrip()} {feature.name}"
    return usable_name(name) or "item"
