"""The growing plan, and the checks of every imported item."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from ocmm_cad.drawing._account import RefusedError
from ocmm_cad.drawing._surfaces import Surfaces
from ocmm_core.errors import FitError
from ocmm_core.features.measured import nominal_geometries
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.inspection.plan import Plan
from ocmm_core.names import usable_name
from ocmm_core.tolerances.kinds import characteristic_fault, geometry_value, spec_of
from ocmm_core.tolerances.zones import Characteristic

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
        is_angle = spec_of(item.kind).unit == "deg"
        same, unit = (SAME_DEG, "degrees") if is_angle else (SAME_MM, "mm")
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
