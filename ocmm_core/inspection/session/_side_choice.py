"""Detection of the side of the material per feature: by the plan, or by the inspector."""

from __future__ import annotations

import msgspec

from ocmm_core.errors import MeasuringError
from ocmm_core.inspection.evaluation import Progress
from ocmm_core.inspection.plan import Plan, step_fault
from ocmm_core.measuring import METHODS


def method_of(plan: Plan, progress: Progress, name: str) -> str:
    """Return the current method of a feature; KeyError if unknown."""
    return methods_of(plan, progress)[name]


def methods_of(plan: Plan, progress: Progress) -> dict[str, str]:
    """Return the current method of every feature of the plan."""
    chosen = progress.methods
    return {
        item.name: chosen.get(item.name) or item.compensation or plan.compensation
        for item in plan.features
    }


def awaits_pull(plan: Plan, progress: Progress) -> bool:
    """Return whether the ball may be followed during its retract at the next touch."""
    names = [progress.active] if progress.active else []
    if progress.probing == "any":
        names = [n for n in progress.names if n not in progress.done | progress.skipped]
    methods = methods_of(plan, progress)
    return any(methods[name] == "pulled" for name in names)


def chosen_methods(plan: Plan, progress: Progress, method: str, name: str) -> dict[str, str]:
    """Return the choices after a change for one feature, or (`name` empty) for all that allow it.

    MeasuringError if not one of `measuring.compensation.METHODS`, or unsuitable for the shape.
    """
    if method not in METHODS:
        raise MeasuringError(
            "session.method",
            f"{method!r} is not a method for finding the probe side.",
            f"Choose one of: {', '.join(METHODS)}.",
        )
    chosen = dict(progress.methods)
    for feature in plan.features:
        if name and feature.name != name:
            continue
        fault = step_fault(msgspec.structs.replace(feature, compensation=method), method)
        if fault is None:
            chosen[feature.name] = method
        elif name:
            raise MeasuringError(
                "session.method",
                f"The compensation of {name} {fault[1]}.",
                "Choose another method.",
            )
    return chosen
