"""Teach nominals on a master part: measured values, rounded, become nominals."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from ocmm_core.errors import FitError, InputError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.plan._plan import Plan

_DIRECTION_DECIMALS = 6


def taught_plan(
    plan: Plan,
    actual: Mapping[str, ActualFeature | FitError],
    T_part_from_world: RigidTransform | None,
    decimals: int = 3,
) -> Plan:
    """Return the plan with the nominals of all measured features, in the part frame.

    ``actual``: as measured on the master part, world frame; ``decimals`` of mm. InputError if the
    part frame is not measured: nominals in the world would be meaningless.
    """
    if T_part_from_world is None:
        raise InputError(
            "plan.no_frame",
            "Nominals are taught in the part frame, which is not measured yet.",
            "Give the plan an alignment and measure its features.",
        )
    features = []
    for nominal in plan.features:
        feature = actual.get(nominal.name)
        features.append(
            _taught(nominal, feature, T_part_from_world, decimals)
            if isinstance(feature, ActualFeature)
            else nominal
        )
    return msgspec.structs.replace(plan, features=features)


def _taught(
    nominal: NominalFeature, feature: ActualFeature, T: RigidTransform, decimals: int
) -> NominalFeature:
    fit = feature.fit
    changes: dict[str, object] = {"point": _vector(T.apply(fit.point), decimals)}
    spec = nominal.shape.spec
    if spec.has_direction:
        changes["direction"] = _vector(T.rotation @ fit.direction, _DIRECTION_DECIMALS)
    if spec.has_across:
        changes["across"] = _vector(T.rotation @ fit.across, _DIRECTION_DECIMALS)
    for size in spec.sizes:
        changes[size.field] = round(size.whole(fit.geometry), decimals)
    return msgspec.structs.replace(nominal, **changes)


def _vector(values: Float, decimals: int) -> tuple[float, float, float]:
    # Adding zero turns -0.0 into 0.0.
    x, y, z = (round(float(value), decimals) + 0.0 for value in values)
    return (x, y, z)
