"""Evaluation of characteristics: value, and its gradient by every point.

The value on a part exactly as drawn follows from nominal geometry alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ocmm_core.alignment import AnyAlignment, datums_refit_by, may_be_refit
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import ACROSS, DIRECTION, POINT, Shape
from ocmm_core.geometry import Float, unit
from ocmm_core.tolerances import zones
from ocmm_core.tolerances.kinds._registry import spec_of
from ocmm_core.tolerances.kinds._size import own_association

_NOTHING = 1e-6
"""Gradients below it are rounding: no point moves the value."""


def evaluate(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: zones.Frames | None = None,
) -> zones.Evaluation:
    """Return value and gradient of a characteristic.

    Parameters
    ----------
    actual
        Features as measured, by name; at least those of `involved_features`.
    alignment
        Rule of the part frame, bound to nominals if its kind needs them.
    frames
        For all features of the job and that alignment, to share between characteristics.

    Raises
    ------
    FitError
        A feature is not measured, there is no part frame, or the value is undefined: a distance of
        coincident features, form of the minimum number of points, a coordinate of the part frame's
        own origin.
    """
    names = involved_features(characteristic, alignment)
    for name in names:
        if name not in actual:
            raise FitError(
                "characteristic.not_measured",
                f"{characteristic.name} needs {name}, which is not measured.",
                f"Measure {name}.",
            )
    involved = {name: actual[name] for name in names}
    frames = frames or zones.Frames(involved, alignment)
    found = _evaluated(characteristic, involved, alignment, frames)
    moving = found.gradient if found.component_gradients is None else found.component_gradients
    if moving.greatest() < _NOTHING:
        raise FitError(
            "characteristic.by_definition",
            f"{characteristic.name} is fixed by the part frame itself, independent of the part.",
            "Remove it, or align to other features.",
        )
    of_form = spec_of(characteristic.kind).own_form
    note = zones.points_note([actual[name] for name in characteristic.features], of_form=of_form)
    datums = taken_again(characteristic, actual, alignment)
    said = [found.note, note, _precedence_note(datums, actual)]
    if datums:
        said.append(frames.note_on(characteristic.datums))
    return replace(
        found,
        note=" ".join(part for part in said if part),
        seen=found.seen or _seen_form(characteristic, actual, found),
    )


def _seen_form(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    found: zones.Evaluation,
) -> zones.Seen | None:
    """Return the deviations of a form from the middle of its zone, or None."""
    feature = actual[characteristic.features[0]]
    noise, touches = found.noise, feature.touches
    if noise is None or noise.mirrored or touches is None or len(characteristic.features) != 1:
        return None
    if len(noise.deviations) != len(touches.numbers) or not feature.fit.shape.spec.has_normals:
        # A single section, or a line, which deviates in two directions.
        return None
    measured = zones.surface_points(feature)
    away = feature.fit.shape.spec.is_curved and feature.nominal.side == "inner"
    middle = 0.5 * (noise.deviations.max() + noise.deviations.min())
    off = (noise.deviations - middle) * (-1.0 if away else 1.0)
    name = (feature.nominal.name,) * len(off)
    return zones.Seen(name, touches.numbers, measured.points, measured.normals, off)


def _precedence_note(datums: Sequence[str], actual: Mapping[str, ActualFeature]) -> str:
    """Return how datums after the first were associated, or empty text."""
    if not datums:
        return ""
    words = dict.fromkeys(own_association(actual[name]) for name in datums)
    listed = " and ".join(datums)
    verb = "follow" if len(datums) > 1 else "follows"
    return f"{listed} {verb} the orientation of the datums before ({', '.join(words)})."


def involved_features(
    characteristic: zones.Characteristic, alignment: AnyAlignment | None
) -> tuple[str, ...]:
    """Return the names of all features involved in the value, each once."""
    names = dict.fromkeys((*characteristic.features, *characteristic.datums))
    spec = spec_of(characteristic.kind)
    in_part = spec.in_part(characteristic) or spec.needs_sense(characteristic, alignment)
    if in_part and alignment is not None:
        names |= dict.fromkeys(alignment.features)
    return tuple(names)


def taken_again(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
) -> tuple[str, ...]:
    """Return the datums re-associated under the orientation of preceding ones."""
    if characteristic.datums:
        if spec_of(characteristic.kind).datums_make_frame:
            return may_be_refit(characteristic.datums, actual)
        return ()
    return datums_refit_by(alignment, actual) if needs_part_frame(characteristic) else ()


def needs_part_frame(characteristic: zones.Characteristic) -> bool:
    """Return whether the value refers to the part frame of the plan's alignment."""
    return spec_of(characteristic.kind).in_part(characteristic)


def geometry_value(
    characteristic: zones.Characteristic,
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    alignment: AnyAlignment | None,
) -> float:
    """Return a size, distance or coordinate, mm, or an angle, deg.

    `geometries`: geometry vectors (12,) by name (`features.shapes.element`), in one frame.
    `alignment`: rule of the part frame; needed for values along an axis, possibly for angles near a
    right one. FitError: there is no part frame, or the kind needs points rather than geometry.
    KeyError: a feature of the characteristic is missing.
    """
    value = spec_of(characteristic.kind).geometry
    if value is None:
        raise FitError(
            "characteristic.no_geometry",
            f"The {characteristic.kind} of {characteristic.name} cannot be evaluated from "
            "geometry alone.",
            "Evaluate it from the points.",
        )
    return value(characteristic, geometries, shapes, alignment)


def _evaluated(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: zones.Frames,
) -> zones.Evaluation:
    spec = spec_of(characteristic.kind)
    found = spec.evaluate(characteristic, actual, alignment, frames)
    if found.association:
        return found
    first = actual[characteristic.features[0]]
    face = first.fit.shape is Shape.PLANE and first.touches is not None
    points = spec.one_sided and (spec.probed == "all" or face)
    return replace(found, association="all points" if points else own_association(first))


_ARM_MM = 10.0
"""Half of the length of an axis, or radius of a face, on which a tilt shows."""


def drawn_value(
    item: zones.Characteristic,
    nominals: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    alignment: AnyAlignment | None,
) -> float | None:
    """Return the value as drawn, mm or deg (zero at its own nominal); None if undetermined."""
    spec = spec_of(item.kind)
    names = (*item.features, *item.datums)
    if any(name not in nominals for name in names):
        return None
    if spec.geometry is not None:
        try:
            return spec.geometry(item, nominals, shapes, alignment)
        except FitError:
            return None
    if spec.form_alone or spec.datums_make_frame:
        return 0.0
    return _off_datum([shapes[name] for name in names], [nominals[name] for name in names])


def _off_datum(shapes: list[Shape], geometries: list[Float]) -> float:
    """Return twice the greatest distance of the features' middle from the datum's, mm."""
    *own, datum = geometries
    first, about = own[0], datum[DIRECTION]
    if shapes[-1] is Shape.PLANE:
        return 2.0 * max(abs(float((place - datum[POINT]) @ about)) for place in _middle(own))
    if shapes[0] is Shape.PLANE:
        return 2.0 * _ARM_MM * float(np.linalg.norm(np.cross(first[DIRECTION], about)))
    if shapes[0].spec.has_sides:
        width = np.cross(first[DIRECTION], first[ACROSS])
        normal = unit(width - (width @ about) * about)
        return 2.0 * abs(float((first[POINT] - datum[POINT]) @ normal))
    ends = (-_ARM_MM, _ARM_MM) if shapes[0] in zones.AXES and np.any(about) else (0.0,)
    arms = [first[POINT] + end * first[DIRECTION] - datum[POINT] for end in ends]
    if np.any(about):
        arms = [arm - (arm @ about) * about for arm in arms]
    elif np.any(first[DIRECTION]) and shapes[0] is not Shape.SPHERE:
        arms = [arm - (arm @ first[DIRECTION]) * first[DIRECTION] for arm in arms]
    return 2.0 * max(float(np.linalg.norm(arm)) for arm in arms)


def _middle(own: list[Float]) -> list[Float]:
    """Return places (3,) of the middle of a slot, or half way between two faces."""
    if len(own) == 2:
        return [0.5 * (own[0][POINT] + own[1][POINT])]
    return [own[0][POINT], *(own[0][POINT] + end * own[0][ACROSS] for end in (-_ARM_MM, _ARM_MM))]
