"""How the side of the material is found, feature by feature: by the plan, or as somebody chose."""

from __future__ import annotations

import msgspec

from ocmm_core.errors import MeasuringError
from ocmm_core.inspection.evaluation import Progress
from ocmm_core.inspection.plan import Plan, step_fault
from ocmm_core.measuring import METHODS


def method_of(plan: Plan, progress: Progress, name: str) -> str:
    """Return how the side of a feature of the plan is found now; KeyError if there is none."""
    return methods_of(plan, progress)[name]


def methods_of(plan: Plan, progress: Progress) -> dict[str, str]:
    """Return how the side of every feature of the plan is found now."""
    chosen = progress.methods
    return {
        item.name: chosen.get(item.name) or item.compensation or plan.compensation
        for item in plan.features
    }


def awaits_pull(plan: Plan, progress: Progress) -> bool:
    """Return whether the next touch may be one whose ball is followed while it is pulled away."""
    names = [progress.active] if progress.active else []
    if progress.probing == "any":
        names = [n for n in progress.names if n not in progress.done | progress.skipped]
    methods = methods_of(plan, progress)
    return any(methods[name] == "pulled" for name in names)


def chosen_methods(plan: Plan, progress: Progress, method: str, name: str) -> dict[str, str]:
    """Return what is chosen when a feature, or all that allow it, get another method.

    Parameters
    ----------
    method
        One of `measuring.compensation.METHODS`.
    name
        Of the feature; empty for all.

    Raises
    ------
    MeasuringError
        There is no such way, or it says nothing about the shape of that feature.
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
