"""Contradictions of a well-formed plan, found from its nominals before any touch."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from ocmm_core import alignment
from ocmm_core.errors import FitError, InputError
from ocmm_core.features.measured import FitThrough, nominal_geometries
from ocmm_core.features.shapes import (
    ACROSS,
    DIRECTION,
    POINT,
    NominalFeature,
    Shape,
    nominal_geometry,
)
from ocmm_core.geometry import Float
from ocmm_core.inspection.plan._plan import Plan
from ocmm_core.tolerances.kinds import drawn_value, spec_of
from ocmm_core.tolerances.zones import Characteristic

_SAME_MM = 1e-3
"""mm or degrees: rounding of documents; closer values are equal."""
_SAME_SINE = 1e-4
_APART = 0.02
"""mm or degrees: tolerated difference between a drawing and its model, as for an import."""
_FIT_MM, _FIT_SHARE = 0.06, 0.015
"""Least deviation of usual fits (ISO 286-1) from the nominal size, and its share of the size."""


@dataclass(frozen=True, slots=True)
class PlanFinding:
    """A contradiction of a plan, or a warning."""

    what: str
    remedy: str
    item: str = "alignment"
    """Name of the feature or characteristic, or ``alignment``."""
    is_error: bool = True
    """The plan is invalid: it can neither be released nor start a job."""


def plan_findings(plan: Plan) -> tuple[PlanFinding, ...]:
    """Return the contradictions of a plan that `check_plan` accepts, errors first."""
    found = [
        *_constructions(plan), *_alignment(plan), *_duplicates(plan), *_characteristics(plan),
    ]  # fmt: skip
    return tuple(sorted(found, key=lambda one: not one.is_error))


def require_consistent(path: Path, plan: Plan) -> None:
    """Raise InputError with the first error of `plan_findings`."""
    found = plan_findings(plan)
    if found and found[0].is_error:
        raise InputError(
            "plan.contradiction",
            f"{path}: the plan is not valid. {found[0].what}",
            f"{found[0].remedy} The plan page and 'ocmm plan check' list all errors.",
        )


def _constructions(plan: Plan) -> Iterator[PlanFinding]:
    known = nominal_geometries(plan.features, plan.constructions)
    # Touched points are not nominal: an element through all points may have no nominal.
    missing = [
        item.name
        for item in plan.constructions
        if item.name not in known
        and not (isinstance(item, FitThrough) and item.through == "points")
    ]
    if missing:
        yield PlanFinding(
            f"The nominals do not define {', '.join(missing)}: its features are parallel, "
            "coincident, or themselves undefined.",
            "Correct the nominals of its features, or construct it from others.",
            missing[0],
        )


def _alignment(plan: Plan) -> Iterator[PlanFinding]:
    """Yield why the frame is undetermined; a saved frame depends on other places."""
    bound = plan.bound_alignment
    if bound is None or isinstance(bound.rule, alignment.SavedFrame):
        return
    geometries = dict(bound.nominals)
    if isinstance(bound.rule, alignment.Relocation):
        for control in bound.rule.control:
            place = geometries[control.feature].copy()
            place[POINT] = control.place
            geometries[control.feature] = place
    try:
        alignment.frame_of(bound, geometries)
    except FitError as error:
        yield PlanFinding(
            f"Even a nominal part could not be aligned: {error.what}", error.remedy
        )  # fmt: skip
        return
    yield from _datums(plan, alignment.datums_in_precedence(bound.rule)[0], bound.nominals)


def _datums(
    plan: Plan, datums: Sequence[str], nominals: Mapping[str, Float], item: str = "alignment"
) -> Iterator[PlanFinding]:
    """Yield datums that constrain no degree of freedom."""
    if any(name not in nominals for name in datums):
        return
    try:
        left = alignment.freedoms_left(datums, plan.shapes, nominals)
    except FitError as error:
        yield PlanFinding(f"{item}: {error.what}", error.remedy, item)
        return
    for place, (before, after) in enumerate(pairwise(left)):
        if before == after:
            held = " and ".join(datums[:place])
            yield PlanFinding(
                f"{item}: datum {datums[place]} takes none of the {before} degrees of freedom "
                f"that {held} leaves open; it is parallel to it, coaxial with it or lies on it.",
                "Choose a datum across the ones before it, or remove this datum.",
                item,
                # If the part is fully constrained, another datum changes no result.
                is_error=before > 0,
            )


def _duplicates(plan: Plan) -> Iterator[PlanFinding]:
    """Yield features with one nominal surface: touches would be ambiguous."""
    for shape in dict.fromkeys(feature.shape for feature in plan.features):
        group = [feature for feature in plan.features if feature.shape is shape]
        vectors = np.array([nominal_geometry(one) for one in group])
        for part in (DIRECTION, ACROSS):
            # Opposite directions belong to one surface.
            largest = np.abs(vectors[:, part]).argmax(axis=1)[:, None]
            vectors[:, part] *= np.sign(np.take_along_axis(vectors[:, part], largest, axis=1))
        known = np.hstack([vectors, [[one.length, one.width, one.sheet] for one in group]])
        for here, other in enumerate(group):
            off = np.abs(known[:here] - known[here])
            moved = np.all(np.delete(off, POINT, axis=1) < _SAME_SINE, axis=1)
            same = moved & np.all(off[:, POINT] < _SAME_MM, axis=1)
            for place in np.flatnonzero(moved).tolist():
                one = group[place]
                gap = known[here, POINT] - known[place, POINT]
                is_same = bool(same[place]) and one.targets == other.targets
                if is_same or _overlap(one, other, gap, known[here, DIRECTION]):
                    yield _twice(one, other, is_error=is_same)
                    break


def _overlap(one: NominalFeature, other: NominalFeature, gap: Float, way: Float) -> bool:
    """Return whether two surfaces of known sizes, without targets, overlap."""
    if one.targets or other.targets or one.shape not in (Shape.PLANE, Shape.CYLINDER):
        return False
    along = abs(float(gap @ way))
    across = float(np.linalg.norm(gap - (gap @ way) * way))
    if one.shape is Shape.PLANE:
        reach = 0.5 * (min(one.length, one.width) + min(other.length, other.width))
        return along < _SAME_MM and across < 0.95 * reach
    return across < _SAME_MM and along < 0.95 * 0.5 * (one.length + other.length)


def _twice(one: NominalFeature, other: NominalFeature, *, is_error: bool) -> PlanFinding:
    shape = one.shape.value.lower()
    names = f"{one.name} and {other.name}"
    return PlanFinding(
        f"{names} are the same {shape}." if is_error else f"{names} overlap on one {shape}.",
        f"Remove one of them, or correct the point, direction or sizes of {other.name}.",
        other.name,
        is_error,
    )


def _characteristics(plan: Plan) -> Iterator[PlanFinding]:
    shapes, bound = plan.shapes, plan.bound_alignment
    nominals = nominal_geometries(plan.features, plan.constructions)
    for item in plan.characteristics:
        spec = spec_of(item.kind)
        if spec.datums_make_frame:
            yield from _datums(plan, item.datums, nominals, item.name)
        unit = "mm" if spec.unit == "mm" else "°"
        yield from _limits(item, unit)
        value = drawn_value(item, nominals, shapes, bound)
        if value is None:
            continue
        if _is_length(item) and value < _SAME_MM:
            yield PlanFinding(
                f"{item.name}: {' and '.join(item.features)} coincide, and a distance of zero has "
                "no uncertainty.",
                "Correct their nominals, or tolerance their coordinates, position or flatness.",
                item.name,
            )
            continue
        yield from _nominal(item, value, unit, _slack(plan, item, nominals))
    yield from _materials(plan)


def _limits(item: Characteristic, unit: str) -> Iterator[PlanFinding]:
    low, high = f"{item.lower:g}", f"{item.upper:g}"
    if item.limits == "proposed":
        yield PlanFinding(
            f"{item.name}: the limits {low} to {high} {unit} are proposed and not yet set.",
            "Enter the limits of the drawing, or confirm these (limits: set).",
            item.name,
        )
        return
    if item.upper == item.lower:
        yield PlanFinding(
            f"{item.name}: the tolerance is zero, so no part can conform.",
            "Enter the limits of the drawing.",
            item.name,
        )
    beyond = max(item.lower, -item.upper)
    usual = _FIT_MM + _FIT_SHARE * abs(item.nominal) if spec_of(item.kind).is_size else 0.0
    if beyond > usual:
        yield PlanFinding(
            f"{item.name}: the limits {low} to {high} {unit} exclude the nominal "
            f"{item.nominal:g} {unit}; limits are deviations from it.",
            "Check the signs, and that the limits are not sizes.",
            item.name,
            is_error=False,
        )


def _nominal(item: Characteristic, value: float, unit: str, slack: float) -> Iterator[PlanFinding]:
    """Yield a nominal of a characteristic that contradicts its features.

    A model may be drawn at the middle of its limits, and a fit at its nominal size.
    """
    off = value - item.nominal
    middle = 0.5 * (item.lower + item.upper)
    if abs(off) < _SAME_MM + slack or abs(off - middle) < _SAME_MM + slack:
        return
    outside = off > item.upper + slack or off < item.lower - slack
    if not outside and abs(off) <= _APART + slack:
        return
    names = " and ".join((*item.features, *item.datums))
    yield PlanFinding(
        f"{item.name}: the nominal is {item.nominal:g} {unit}, but the nominals of {names} give "
        f"{value:.6g} {unit}.",
        f"Correct the nominal of {item.name}, or those of {names}.",
        item.name,
        is_error=outside,
    )


def _is_length(item: Characteristic) -> bool:
    spec = spec_of(item.kind)
    return spec.folds and spec.unit == "mm" and not item.axis


def _slack(plan: Plan, item: Characteristic, nominals: Mapping[str, Float]) -> float:
    """Return by how much a distance depends on the probed places, mm."""
    if not _is_length(item):
        return 0.0
    one, other = (nominals[name][DIRECTION] for name in item.features)
    tilt = float(np.linalg.norm(np.cross(one, other)))
    sizes = [
        max(feature.length, feature.width, feature.diameter)
        for feature in plan.features
        if feature.name in item.features
    ]
    return tilt * max(sizes, default=0.0) if tilt > _SAME_SINE else 0.0


def _materials(plan: Plan) -> Iterator[PlanFinding]:
    """Yield limits of material that differ from those of the size of the same feature."""
    sides = {feature.name: feature.side for feature in plan.features}
    limits: dict[tuple[str, str], set[float]] = {}
    for item in plan.characteristics:
        side = sides.get(item.features[0])
        if spec_of(item.kind).is_size and side is not None:
            low, high = item.nominal + item.lower, item.nominal + item.upper
            most, least = (low, high) if side == "inner" else (high, low)
            limits.setdefault((item.features[0], "maximum material"), set()).add(most)
            limits.setdefault((item.features[0], "least material"), set()).add(least)
    for item in plan.characteristics:
        known = limits.get((item.features[0], item.modifier), set())
        if known and all(abs(value - item.material_size) > _SAME_MM for value in known):
            shown = " or ".join(f"{value:g}" for value in sorted(known))
            yield PlanFinding(
                f"{item.name}: its limit of {item.modifier} is {item.material_size:g} mm, but the "
                f"size of {item.features[0]} gives {shown} mm.",
                "Correct material_size, or the limits of the size.",
                item.name,
            )
