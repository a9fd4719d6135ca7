"""The value of a characteristic on a part exactly as drawn, from nominal geometry alone."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocmm_core.alignment import AnyAlignment
from ocmm_core.errors import FitError
from ocmm_core.features.shapes import ACROSS, DIRECTION, POINT, Shape
from ocmm_core.geometry import Float, unit
from ocmm_core.tolerances.kinds._registry import spec_of
from ocmm_core.tolerances.zones import AXES, Characteristic

_ARM_MM = 10.0
"""Half of the length of an axis, or radius of a face, on which a tilt shows."""


def drawn_value(
    item: Characteristic,
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
    ends = (-_ARM_MM, _ARM_MM) if shapes[0] in AXES and np.any(about) else (0.0,)
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
