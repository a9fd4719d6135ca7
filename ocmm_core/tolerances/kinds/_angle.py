"""Angle of two elements, with the sense given by the plan's directions.

A measured axis has no sense: a bore 0.05 degrees beyond perpendicular looks like one 0.05 degrees
short of it. In the part frame the plan defines the sense of every axis, so the angle passes through
90 degrees like any other value. Only parallel directions, at 0 and 180 degrees, have no side.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.alignment import AnyAlignment, BoundAlignment, frame_of, nominal_frame
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import DIRECTION, HALF_ANGLE, Shape
from ocmm_core.geometry import Float, perpendicular_pair
from ocmm_core.tolerances.kinds import _spec as spec
from ocmm_core.tolerances.zones import Characteristic, Evaluation, Frames, vector_evaluation

_PREFERRED_DEG = 5.0
"""The angle in the material is used unless its supplement is closer to the nominal by this."""
_SENSELESS_DEG = 20.0
"""Nominal angles closer to the fold need the sense of the axes."""
_MEANT_DEG = 20.0
"""Largest deviation of the plan's directions from the nominal angle."""
_LIKE = 0.5
"""Least cosine between a measured axis and that of the plan that determines the sense."""
_FLATTEST_DEG = 0.01
"""Directions closer to parallel have no side: differences would appear certain."""
_VECTOR_DEG = 0.5
"""Angles below this, nominally zero, are the length of a vector."""

_NO_SIDE = "The side of the right angle is undefined."
_ONE_WAY = (
    "So near its end, noise shifts the angle in one direction only, which U does not cover: use "
    "parallelism or perpendicularity."
)

_MAPS = {2: ((180.0, -1.0), (0.0, 1.0)), 0: ((0.0, 1.0), (180.0, -1.0)),
         1: ((90.0, -1.0), (-90.0, 1.0), (90.0, 1.0), (270.0, -1.0))}  # fmt: skip
"""Offset and factor from the angle between the directions to possible meanings, deg, by the number
of planes: two planes enclose the angle in the material.
"""


@dataclass(frozen=True, slots=True)
class AngleRule:
    """Computation of an angle from two directions."""

    senses: tuple[float, float]
    """1 or -1 for each direction."""
    offset: float
    factor: float
    """`offset`, `factor`: The value is offset + factor times the angle between them, deg."""
    told: bool
    """The sense of both was determined; otherwise it is the one closest to the nominal."""

    def value(self, first: Float, second: Float) -> float:
        """Return the angle of two geometry vectors (12,), deg."""
        one, other = self.senses[0] * first[DIRECTION], self.senses[1] * second[DIRECTION]
        return self.offset + self.factor * _between(one, other)

    def note(self, first: Float, second: Float) -> str:
        """Return a note on the angle of two geometry vectors (12,), or empty text."""
        between = _between(first[DIRECTION], second[DIRECTION])
        if min(between, 180.0 - between) < _VECTOR_DEG:
            return _ONE_WAY
        return "" if self.surely(self.value(first, second)) else _NO_SIDE

    def surely(self, value: float) -> bool:
        """Return whether a value cannot be on the other side of a right angle."""
        fold = self.offset + self.factor * 90.0
        return self.told or abs(value - fold) > _PREFERRED_DEG


def angle(
    characteristic: Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: Frames,
) -> Evaluation:
    """Return the apex angle of a cone, or of two elements, deg; FitError as `angle_of_axes`."""
    geometries = {name: feature.fit.geometry for name, feature in actual.items()}
    shapes = {name: feature.fit.shape for name, feature in actual.items()}
    if len(characteristic.features) == 1:
        return spec.by_differences(
            characteristic, actual, lambda moved: angle_value(characteristic, moved, shapes, None)
        )
    # Fixed once: differences then pass through a right angle like any other.
    rule = angle_rule(characteristic, geometries, shapes, alignment)
    found = angle_of_axes(characteristic, actual, rule)
    if found is not None:
        return found
    one, other = characteristic.features
    found = spec.by_differences(
        characteristic, actual, lambda moved: rule.value(moved[one], moved[other])
    )
    return replace(found, note=rule.note(geometries[one], geometries[other]))


def angle_value(
    characteristic: Characteristic,
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    alignment: AnyAlignment | None,
) -> float:
    """Return the apex angle of a cone, or the angle of two elements, deg."""
    first = geometries[characteristic.features[0]]
    if len(characteristic.features) == 1:
        return float(np.degrees(2.0 * first[HALF_ANGLE]))
    rule = angle_rule(characteristic, geometries, shapes, alignment)
    return rule.value(first, geometries[characteristic.features[1]])


def needs_sense(characteristic: Characteristic, alignment: AnyAlignment | None) -> bool:
    """Return whether the part frame determines the side of a right angle."""
    if not isinstance(alignment, BoundAlignment):
        return False
    names = characteristic.features
    if len(names) != 2 or any(name not in alignment.nominals for name in names):
        return False
    if all(alignment.shapes[name] is Shape.PLANE for name in names):
        return False
    between = _between(*(alignment.nominals[name][DIRECTION] for name in names))
    return abs(between - 90.0) < _SENSELESS_DEG


def angle_rule(
    characteristic: Characteristic,
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    alignment: AnyAlignment | None,
) -> AngleRule:
    """Return the computation of the angle of two features from their directions.

    Between two faces it is the angle in the material, else the acute one, and in either case the
    supplement if that is clearly meant by the nominal. Near a right angle, where both are alike,
    the directions of the plan decide. FitError: the part frame is needed and undetermined.
    """
    names = characteristic.features
    flat = [shapes[name] is Shape.PLANE for name in names]
    if needs_sense(characteristic, alignment) and isinstance(alignment, BoundAlignment):
        found = _by_plan(characteristic, geometries, flat, alignment)
        if found is not None:
            return found
    first, second = (geometries[name][DIRECTION] for name in names)
    maps = _MAPS[sum(flat)]
    if all(flat):
        senses = (1.0, 1.0)
    else:
        # The acute angle: an axis, unlike a face, has no sense.
        sense = 1.0 if float(first @ second) >= 0.0 else -1.0
        senses = (1.0, sense) if flat[0] else (sense, 1.0)
    between = _between(senses[0] * first, senses[1] * second)
    offset, factor = maps[0]
    value = offset + factor * between
    nearer = abs(value - characteristic.nominal) - abs(180.0 - value - characteristic.nominal)
    if nearer > _PREFERRED_DEG:
        offset, factor = 180.0 - offset, -factor
    return AngleRule(senses, offset, factor, told=all(flat))


def angle_of_axes(
    characteristic: Characteristic, actual: Mapping[str, ActualFeature], rule: AngleRule
) -> Evaluation | None:
    """Return the evaluation of a nominally zero angle, the length of a vector; else None.

    Deviation of directions in two directions. FitError: no side at this value, or undetermined.
    """
    first, second = (actual[name] for name in characteristic.features)
    one = rule.senses[0] * first.fit.direction
    other = rule.senses[1] * second.fit.direction
    by_one = rule.senses[0] * first.jacobian[DIRECTION]
    by_other = rule.senses[1] * second.jacobian[DIRECTION]
    between = _between(one, other)
    if rule.offset == 180.0 and rule.factor < 0.0:
        other, by_other, between = -other, -by_other, 180.0 - between
    vector = rule.offset in (0.0, 180.0) and characteristic.nominal == 0.0
    if vector and between < _VECTOR_DEG and characteristic.lower <= 0.0:
        across = np.stack(perpendicular_pair(one))
        components = across @ other
        length = float(np.linalg.norm(components))
        scale = float(between / length) if length > 0.0 else float(np.degrees(1.0))
        return vector_evaluation(scale * components, scale * (across @ (by_other - by_one)), "")
    value = rule.value(first.fit.geometry, second.fit.geometry)
    if min(between, 180.0 - between) < _FLATTEST_DEG:
        raise FitError(
            "characteristic.no_angle",
            f"The angle of {characteristic.name} has no sense at {value:.3f} degrees, so no "
            "uncertainty can be stated.",
            "Tolerance parallelism, perpendicularity or angularity instead.",
        )
    if not rule.surely(value) and not _both_sides_alike(characteristic, rule, value):
        raise FitError(
            "characteristic.no_side",
            f"It is undefined on which side of a right angle the {value:.3f} degrees of "
            f"{characteristic.name} are: an axis has no direction of its own.",
            "Give the plan an alignment, and its features their nominal directions.",
        )
    return None


def _both_sides_alike(characteristic: Characteristic, rule: AngleRule, value: float) -> bool:
    """Return whether an angle without a sense is the same on both sides of the fold."""
    fold = rule.offset + rule.factor * 90.0
    middle = characteristic.nominal + 0.5 * (characteristic.lower + characteristic.upper)
    return abs(middle - fold) < 1e-9 and abs(value - fold) >= _FLATTEST_DEG


def _by_plan(
    characteristic: Characteristic,
    geometries: Mapping[str, Float],
    flat: list[bool],
    alignment: BoundAlignment,
) -> AngleRule | None:
    """Return the rule with the senses of the plan's directions; None if undetermined."""
    T_nominal_from_part = nominal_frame(alignment).inverse()
    rotation = T_nominal_from_part.rotation @ frame_of(alignment, geometries).rotation
    senses = []
    for name, plane in zip(characteristic.features, flat, strict=True):
        cosine = float(rotation @ geometries[name][DIRECTION] @ alignment.nominals[name][DIRECTION])
        if not plane and abs(cosine) < _LIKE:
            return None
        senses.append(1.0 if plane or cosine > 0.0 else -1.0)
    meant = _between(*(alignment.nominals[name][DIRECTION] for name in characteristic.features))
    offset, factor = min(
        _MAPS[sum(flat)], key=lambda item: abs(item[0] + item[1] * meant - characteristic.nominal)
    )
    if abs(offset + factor * meant - characteristic.nominal) > _MEANT_DEG:
        return None
    return AngleRule((senses[0], senses[1]), offset, factor, told=True)


def _between(first: Float, second: Float) -> float:
    sine = float(np.linalg.norm(np.cross(first, second)))
    return float(np.degrees(np.arctan2(sine, float(first @ second))))


def _cone_fault(asked: spec.PlannedCharacteristic) -> spec.Fault | None:
    if len(asked.item.features) == 1 and asked.first is not Shape.CONE:
        return "features", "names one feature; an angle needs two, or one cone"
    return None


KINDS = (
    spec.KindSpec(
        name="angle",
        unit="deg",
        evaluate=angle,
        geometry=angle_value,
        monte_carlo=spec.MonteCarlo.SECOND_ORDER,
        qif=spec.QifWords("AngleBetween", of_one="Angle"),
        shapes=spec.DIRECTED,
        features=(1, 2),
        checks=(_cone_fault,),
        needs_sense=needs_sense,
        folds=True,
    ),
)
