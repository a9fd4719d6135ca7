"""Position, coaxiality and symmetry (ISO 1101, 17.12 to 17.14), with the bonus of ISO 2692."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import msgspec
import numpy as np

from ocmm_core.alignment import AnyAlignment
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import (
    ACROSS,
    DIRECTION,
    POINT,
    RADIUS,
    SECOND,
    Shape,
    nominal_geometry,
)
from ocmm_core.geometry import Float, perpendicular_pair, unit
from ocmm_core.measuring import DeviationRows, Rows
from ocmm_core.tolerances import zones
from ocmm_core.tolerances.kinds import _spec as spec
from ocmm_core.tolerances.kinds._size import associated_size, own_association, size_words

_OPPOSITE = -0.5
"""Cosine between the normals of two faces above which they have no middle between them."""


def with_bonus(
    characteristic: zones.Characteristic, feature: ActualFeature, found: zones.Evaluation
) -> zones.Evaluation:
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


def _sizes(
    characteristic: zones.Characteristic, feature: ActualFeature, sign: float
) -> list[zones.Evaluation]:
    """Return the sizes of the points, the mating one first; ``sign`` 1 if larger is more bonus."""
    slot = feature.fit.shape in spec.SLOTS
    place = SECOND if slot else RADIUS
    own = zones.Evaluation(
        2.0 * float(feature.fit.geometry[place]),
        2.0 * feature.jacobian[place],
        association=size_words(own_association(feature)),
    )
    if slot:
        size, gradient = zones.slot_envelope(feature, widest=sign < 0.0)
        return [zones.Evaluation(size, gradient, association="planes along its sides"), own]
    mating: zones.Association = "inscribed" if sign > 0.0 else "circumscribed"
    asked = [
        msgspec.structs.replace(characteristic, kind="diameter", association=word)
        for word in (mating, "least squares")
    ]
    return [*(associated_size(one, feature) for one in asked), own]


_AXES = "xyz"
_RINGS = spec.Symbol(circles=((0.5, 0.5, 0.4), (0.5, 0.5, 0.2)))


def position(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: zones.Frames,
) -> zones.Evaluation:
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
        found = zones.surface_zone(
            [zones.Surface(zones.surface_points(feature), Shape.PLANE, nominal)], frame
        )
    else:
        points = zones.derived_points(feature, characteristic.length or feature.nominal.length)
        found = zones.derived_zone(
            points, nominal[POINT], _rows(characteristic, nominal, feature), frame
        )
    return with_bonus(characteristic, feature, found)


def _rows(characteristic: zones.Characteristic, nominal: Float, feature: ActualFeature) -> Float:
    """Return the directions (d, 3), part frame, in which a centre or axis may deviate."""
    shape = feature.fit.shape
    zone = characteristic.zone or _usual_zone(shape)
    if zone == "sphere":
        return np.eye(3)
    if zone == "cylinder":
        direction = (
            np.array(feature.nominal.direction) if shape in spec.SPHERICAL else nominal[DIRECTION]
        )
        return np.stack(perpendicular_pair(direction))
    if characteristic.axis:
        return np.eye(3)[[_AXES.index(characteristic.axis)]]
    return nominal[None, DIRECTION]


def coaxiality(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: zones.Frames,
) -> zones.Evaluation:
    """Return twice the greatest distance of a centre or axis from the datum's.

    In space between balls; else across the axis of the datum, or across its own to a ball.
    """
    feature, datum = actual[characteristic.features[0]], actual[characteristic.datums[0]]
    axis, slope = datum.fit.direction, datum.jacobian[3:6]
    if not np.any(axis):
        axis, slope = feature.fit.direction, feature.jacobian[3:6]
    found = []
    for end in zones.derived_points(feature, characteristic.length or feature.nominal.length):
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
    return zones.vector_evaluation(arm, by_arm, characteristic.datums[0])


def _usual_zone(shape: Shape | None) -> spec.Zone:
    if shape in spec.SPHERICAL:
        return "sphere"
    return "planes" if shape is Shape.PLANE else "cylinder"


def _zone_of_position(
    item: zones.Characteristic | None, shape: Shape | None, datums: tuple[Shape, ...]
) -> spec.Zone:
    usual = _usual_zone(shape)
    return usual if item is None or shape is Shape.PLANE else item.zone or usual


def _axis_missing(asked: spec.PlannedCharacteristic) -> spec.Fault | None:
    if asked.of_planes and not asked.item.axis:
        return "axis", "is missing: it defines the direction of the position tolerance"
    return None


def _frame_missing(asked: spec.PlannedCharacteristic) -> spec.Fault | None:
    if not asked.item.datums and not asked.aligned:
        return "datums", "is empty, and the plan has no 'alignment' to use instead"
    return None


def _modifier_fault(asked: spec.PlannedCharacteristic) -> spec.Fault | None:
    if asked.item.modifier and asked.first not in spec.WITH_SIZE:
        return "modifier", "goes with the position of a feature that has a size only"
    return None


_PLACES = (
    spec.KindSpec(
        name="position",
        one_sided=True,
        evaluate=position,
        monte_carlo=spec.MonteCarlo.VECTOR,
        qif=spec.QifWords("Position", has_modifier=True),
        symbol=spec.Symbol(
            lines=(((0.05, 0.5), (0.95, 0.5)), ((0.5, 0.05), (0.5, 0.95))),
            circles=((0.5, 0.5, 0.28),),
        ),
        shapes=spec.ALL,
        datums=(0, 3),
        takes=frozenset({"axis", "length", "modifier"}),
        zones=("planes", "cylinder", "sphere"),
        zone_of=_zone_of_position,
        checks=(_axis_missing, _frame_missing, _modifier_fault),
        in_part=lambda item: not item.datums,
        datums_make_frame=True,
    ),
    spec.KindSpec(
        name="concentricity",
        one_sided=True,
        evaluate=coaxiality,
        monte_carlo=spec.MonteCarlo.VECTOR,
        qif=spec.QifWords("Concentricity"),
        symbol=_RINGS,
        shapes=(Shape.CIRCLE, Shape.SPHERE),
        datums=(1, 1),
        datum_shapes=(*spec.ROUND_AXES, Shape.SPHERE),
        takes=frozenset({"length"}),
        zone_of=lambda item, shape, datums: (
            "sphere" if {shape, *datums} == {Shape.SPHERE} else "cylinder"
        ),
    ),
    spec.KindSpec(
        name="coaxiality",
        one_sided=True,
        evaluate=coaxiality,
        monte_carlo=spec.MonteCarlo.VECTOR,
        qif=spec.QifWords("Coaxiality"),
        symbol=_RINGS,
        shapes=(*spec.ROUND_AXES, Shape.SPHERE),
        datums=(1, 1),
        datum_shapes=spec.ROUND_AXES,
        takes=frozenset({"length"}),
        zone_of=lambda item, shape, datums: "cylinder",
    ),
)


def symmetry(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: zones.Frames,
) -> zones.Evaluation:
    """Return twice the greatest distance of extracted median points from the datum.

    Median points of two faces are halfway between a point of either face and the other one, across
    the datum plane; those of a slot are the ends and the middle of its middle line. About a datum
    axis the middle plane contains the axis and is turned as the slot. FitError: a face has no
    points of its own, or the faces are not opposite to each other.
    """
    datum = actual[characteristic.datums[0]]
    if len(characteristic.features) == 1:
        return _of_slot(characteristic, actual)
    first, second = (actual[name] for name in characteristic.features)
    if float(first.fit.direction @ second.fit.direction) > _OPPOSITE:
        raise FitError(
            "characteristic.not_opposite",
            f"{first.nominal.name} and {second.nominal.name} do not face away from each other, "
            "so they have no mid-plane.",
            "Name two opposite faces.",
        )
    return _of_faces(first, second, datum)


def _of_slot(
    characteristic: zones.Characteristic, actual: Mapping[str, ActualFeature]
) -> zones.Evaluation:
    (slot,), name = characteristic.features, characteristic.datums[0]
    datum = actual[name].fit
    plane = datum.shape is Shape.PLANE
    found = _slot_distances(actual[slot].fit.geometry, datum.geometry, plane)
    worst = int(np.argmax(np.abs(found)))
    gradient = spec.by_differences(
        characteristic,
        {slot: actual[slot], name: actual[name]},
        lambda geometries: float(_slot_distances(geometries[slot], geometries[name], plane)[worst]),
    ).gradient
    return zones.vector_evaluation(2.0 * found[worst : worst + 1], 2.0 * gradient[None], name)


def _slot_distances(slot: Float, datum: Float, plane: bool) -> Float:
    """Return the distances (3,) of middle and ends of the middle line from the datum's middle."""
    normal = datum[DIRECTION]
    if not plane:
        width = np.cross(slot[DIRECTION], slot[ACROSS])
        normal = unit(width - (width @ normal) * normal)
    ends = np.array([0.0, -1.0, 1.0])[:, None] * slot[RADIUS] * slot[ACROSS] + slot[POINT]
    distances: Float = (ends - datum[POINT]) @ normal
    return distances


def _of_faces(
    first: ActualFeature, second: ActualFeature, datum: ActualFeature
) -> zones.Evaluation:
    normal, origin = datum.fit.direction, datum.fit.point
    values, slopes = [], []
    for near, far in ((first, second), (second, first)):
        surface, touches = zones.surface_points(near), zones.own_fit(near)[0]
        towards = far.fit.direction
        cosine = float(normal @ towards)
        arms = far.fit.point - surface.points
        gaps = arms @ towards
        by_point = normal - 0.5 * towards / cosine
        by_towards = 0.5 * (arms / cosine - np.outer(gaps, normal) / cosine**2)
        by_normal = surface.points - origin - 0.5 * np.outer(gaps, towards) / cosine**2
        alike = 0.5 / cosine * (towards @ far.jacobian[POINT]) - normal @ datum.jacobian[POINT]
        # The contact point moves with the normal of its face, along which it is offset from the
        # ball.
        alike -= touches.tip_radius * by_point @ near.jacobian[DIRECTION]
        alike = alike.with_radius(-float(by_point @ near.fit.direction))
        rows = DeviationRows.of_own(touches.places, np.tile(by_point, (len(gaps), 1)))
        for by, shared in (
            (by_towards, far.jacobian[DIRECTION]),
            (by_normal, datum.jacobian[DIRECTION]),
            (np.ones((len(gaps), 1)), alike[None]),
        ):
            rows = rows.with_shared(by, shared)
        values.append((surface.points - origin) @ normal + 0.5 * gaps / cosine)
        slopes.append(rows)
    distances, rows = np.concatenate(values), DeviationRows.stacked(slopes)
    worst = int(np.argmax(np.abs(distances)))
    sign = -1.0 if distances[worst] < 0.0 else 1.0
    return zones.Evaluation(
        2.0 * abs(float(distances[worst])),
        2.0 * sign * rows[[worst]].rows[0],
        frame=datum.nominal.name,
        noise=zones.form_noise(distances, rows, np.zeros((len(distances), 0))),
    )


def _pair_fault(asked: spec.PlannedCharacteristic) -> spec.Fault | None:
    item = asked.item
    if (len(item.features) == 1) != (asked.first in spec.SLOTS):
        return "features", "needs one slot or rectangle, or two opposite planes"
    if asked.first is Shape.PLANE:
        if asked.shapes[item.features[1]] is not Shape.PLANE:
            return "features", "needs two opposite planes"
        if asked.shapes[item.datums[0]] is not Shape.PLANE:
            return "datums", "needs a plane: two faces are symmetrical about one"
    return None


KINDS = (
    *_PLACES,
    spec.KindSpec(
        name="symmetry",
        one_sided=True,
        evaluate=symmetry,
        monte_carlo=spec.MonteCarlo.EVALUATED,
        qif=spec.QifWords("Symmetry"),
        symbol=spec.Symbol(
            lines=(
                ((0.05, 0.5), (0.95, 0.5)),
                ((0.22, 0.27), (0.78, 0.27)),
                ((0.22, 0.73), (0.78, 0.73)),
            )
        ),
        shapes=(Shape.PLANE, *spec.SLOTS),
        features=(1, 2),
        datums=(1, 1),
        datum_shapes=spec.DIRECTED,
        checks=(_pair_fault,),
        probed="faces",
    ),
)
