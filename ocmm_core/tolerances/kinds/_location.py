"""Position and coaxiality (ISO 1101, 17.12 and 17.13), with the bonus of ISO 2692."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import msgspec
import numpy as np

from ocmm_core.alignment import AnyAlignment
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import DIRECTION, POINT, RADIUS, SECOND, Shape, nominal_geometry
from ocmm_core.geometry import Float, perpendicular_pair
from ocmm_core.measuring import Rows
from ocmm_core.tolerances.kinds._size import associated_size, own_association, size_words
from ocmm_core.tolerances.kinds._spec import (
    ALL,
    ROUND_AXES,
    SLOTS,
    SPHERICAL,
    WITH_SIZE,
    Fault,
    KindSpec,
    MonteCarlo,
    PlannedCharacteristic,
    QifWords,
    Symbol,
    Zone,
)
from ocmm_core.tolerances.zones import (
    Association,
    Characteristic,
    Evaluation,
    Frames,
    Surface,
    derived_points,
    derived_zone,
    slot_envelope,
    surface_points,
    surface_zone,
    vector_evaluation,
)


def with_bonus(
    characteristic: Characteristic, feature: ActualFeature, found: Evaluation
) -> Evaluation:
    """Return an evaluation with the bonus of the size.

    At maximum material a bore is smallest, a shaft largest; at least material the other way round.
    The zone is widened by the departure of the size from that limit. Among the sizes of the points,
    the one with the least bonus counts: the mating one (largest inscribed or smallest
    circumscribed; of a slot the planes along its sides), that of least squares, and the feature's
    own. Without a mating size there is no bonus.
    """
    if not characteristic.modifier:
        return found
    inner = feature.nominal.side == "inner"
    sign = 1.0 if inner == (characteristic.modifier == "maximum material") else -1.0
    bonus, gradient = 0.0, Rows.nothing()
    try:
        size = min(_sizes(characteristic, feature, sign), key=lambda one: sign * one.value)
    except FitError as error:
        note = f"No bonus, there is no mating size: {error.what}"
    else:
        own, kind = size.value, size.association
        note = f"Size for the bonus: {own:.4f} mm, {kind}."
        if sign * (size.value - characteristic.material_size) > 0.0:
            bonus = sign * (size.value - characteristic.material_size)
            gradient = sign * size.gradient
    return replace(found, bonus=bonus, bonus_gradient=gradient, note=f"{found.note} {note}".strip())


def _sizes(characteristic: Characteristic, feature: ActualFeature, sign: float) -> list[Evaluation]:
    """Return the sizes of the points, the mating one first; ``sign`` 1 if larger is more bonus."""
    slot = feature.fit.shape in SLOTS
    place = SECOND if slot else RADIUS
    own = Evaluation(
        2.0 * float(feature.fit.geometry[place]),
        2.0 * feature.jacobian[place],
        association=size_words(own_association(feature)),
    )
    if slot:
        size, gradient = slot_envelope(feature, widest=sign < 0.0)
        return [Evaluation(size, gradient, association="planes along its sides"), own]
    mating: Association = "inscribed" if sign > 0.0 else "circumscribed"
    asked = [
        msgspec.structs.replace(characteristic, kind="diameter", association=word)
        for word in (mating, "least squares")
    ]
    return [*(associated_size(one, feature) for one in asked), own]


_AXES = "xyz"
_RINGS = Symbol(circles=((0.5, 0.5, 0.4), (0.5, 0.5, 0.2)))


def position(
    characteristic: Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: Frames,
) -> Evaluation:
    """Return the smallest zone about the true place; FitError without datum or part frame."""
    name = characteristic.features[0]
    feature = actual[name]
    frame = (
        frames.of_datums(characteristic.datums, [name])
        if characteristic.datums
        else frames.of_part(characteristic.name)
    )
    nominal = nominal_geometry(feature.nominal)
    if feature.fit.shape is Shape.PLANE and feature.touches is not None:
        found = surface_zone([Surface(surface_points(feature), Shape.PLANE, nominal)], frame)
    else:
        points = derived_points(feature, characteristic.length or feature.nominal.length)
        found = derived_zone(points, nominal[POINT], _rows(characteristic, nominal, feature), frame)
    return with_bonus(characteristic, feature, found)


def _rows(characteristic: Characteristic, nominal: Float, feature: ActualFeature) -> Float:
    """Return the directions (d, 3), part frame, in which a centre or axis may deviate."""
    shape = feature.fit.shape
    zone = characteristic.zone or _usual_zone(shape)
    if zone == "sphere":
        return np.eye(3)
    if zone == "cylinder":
        direction = (
            np.array(feature.nominal.direction) if shape in SPHERICAL else nominal[DIRECTION]
        )
        return np.stack(perpendicular_pair(direction))
    if characteristic.axis:
        return np.eye(3)[[_AXES.index(characteristic.axis)]]
    return nominal[None, DIRECTION]


def coaxiality(
    characteristic: Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: Frames,
) -> Evaluation:
    """Return twice the greatest distance of a centre or axis from the datum's.

    In space between balls; else across the axis of the datum, or across its own to a ball.
    """
    feature, datum = actual[characteristic.features[0]], actual[characteristic.datums[0]]
    axis, slope = datum.fit.direction, datum.jacobian[3:6]
    if not np.any(axis):
        axis, slope = feature.fit.direction, feature.jacobian[3:6]
    found = []
    for end in derived_points(feature, characteristic.length or feature.nominal.length):
        arm = end.point - datum.fit.point
        by_arm = end.by_coordinates - datum.jacobian[0:3]
        if np.any(axis):
            along = float(arm @ axis)
            by_arm = by_arm - (axis @ by_arm + arm @ slope).outer(axis) - along * slope
            arm = arm - along * axis
        found.append((2.0 * arm, 2.0 * by_arm))
    arm, by_arm = max(found, key=lambda item: float(np.linalg.norm(item[0])))
    if np.any(axis):
        across = np.stack(perpendicular_pair(axis))
        arm, by_arm = across @ arm, across @ by_arm
    return vector_evaluation(arm, by_arm, characteristic.datums[0])


def _usual_zone(shape: Shape | None) -> Zone:
    if shape in SPHERICAL:
        return "sphere"
    return "planes" if shape is Shape.PLANE else "cylinder"


def _zone_of_position(
    item: Characteristic | None, shape: Shape | None, datums: tuple[Shape, ...]
) -> Zone:
    usual = _usual_zone(shape)
    return usual if item is None or shape is Shape.PLANE else item.zone or usual


def _zone_of_coaxiality(
    item: Characteristic | None, shape: Shape | None, datums: tuple[Shape, ...]
) -> Zone:
    return "cylinder"


def _zone_of_concentricity(
    item: Characteristic | None, shape: Shape | None, datums: tuple[Shape, ...]
) -> Zone:
    return "sphere" if {shape, *datums} == {Shape.SPHERE} else "cylinder"


def _without_datums(item: Characteristic) -> bool:
    return not item.datums


def _axis_missing(asked: PlannedCharacteristic) -> Fault | None:
    if asked.of_planes and not asked.item.axis:
        return "axis", "is missing: it defines the direction of the position tolerance"
    return None


def _frame_missing(asked: PlannedCharacteristic) -> Fault | None:
    if not asked.item.datums and not asked.aligned:
        return "datums", "is empty, and the plan has no 'alignment' to use instead"
    return None


def _modifier_fault(asked: PlannedCharacteristic) -> Fault | None:
    if asked.item.modifier and asked.first not in WITH_SIZE:
        return "modifier", "goes with the position of a feature that has a size only"
    return None


KINDS = (
    KindSpec(
        name="position",
        words="position",
        unit="mm",
        one_sided=True,
        evaluate=position,
        geometry=None,
        monte_carlo=MonteCarlo.VECTOR,
        qif=QifWords("Position", has_modifier=True),
        symbol=Symbol(
            lines=(((0.05, 0.5), (0.95, 0.5)), ((0.5, 0.05), (0.5, 0.95))),
            circles=((0.5, 0.5, 0.28),),
        ),
        shapes=ALL,
        datums=(0, 3),
        takes=frozenset({"axis", "length", "modifier"}),
        zones=("planes", "cylinder", "sphere"),
        zone_of=_zone_of_position,
        checks=(_axis_missing, _frame_missing, _modifier_fault),
        in_part=_without_datums,
        datums_make_frame=True,
    ),
    KindSpec(
        name="concentricity",
        words="concentricity",
        unit="mm",
        one_sided=True,
        evaluate=coaxiality,
        geometry=None,
        monte_carlo=MonteCarlo.VECTOR,
        qif=QifWords("Concentricity"),
        symbol=_RINGS,
        shapes=(Shape.CIRCLE, Shape.SPHERE),
        datums=(1, 1),
        datum_shapes=(*ROUND_AXES, Shape.SPHERE),
        takes=frozenset({"length"}),
        zone_of=_zone_of_concentricity,
    ),
    KindSpec(
        name="coaxiality",
        words="coaxiality",
        unit="mm",
        one_sided=True,
        evaluate=coaxiality,
        geometry=None,
        monte_carlo=MonteCarlo.VECTOR,
        qif=QifWords("Coaxiality"),
        symbol=_RINGS,
        shapes=(*ROUND_AXES, Shape.SPHERE),
        datums=(1, 1),
        datum_shapes=ROUND_AXES,
        takes=frozenset({"length"}),
        zone_of=_zone_of_coaxiality,
    ),
)
