"""Distances and coordinates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ocmm_core.alignment import AnyAlignment, frame_of
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import DIRECTION, POINT, Shape
from ocmm_core.geometry import Float
from ocmm_core.measuring import Rows
from ocmm_core.tolerances import zones
from ocmm_core.tolerances.kinds import _spec as spec
from ocmm_core.tolerances.kinds._size import distance_of_faces, two_point_fault

_XYZ = "xyz"

_PARALLEL = np.cos(np.deg2rad(10.0))
"""Axes at less than 10 degrees are nominally parallel: their crossing point is meaningless."""

_SHORTEST_MM = 1e-3
"""A smaller distance is nonlinear within the step: differences would make it appear certain."""


def distance(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: zones.Frames,
) -> zones.Evaluation:
    """Return the distance, also along an axis; FitError: coincident, no frame, not opposite."""
    first, second = (actual[name] for name in characteristic.features)
    if characteristic.association:
        return distance_of_faces(characteristic, first, second)
    if characteristic.axis:
        frame = frames.aligned(characteristic.name)
        (one, by_one), (other, by_other) = (
            _along(characteristic, item, frame) for item in (first, second)
        )
        between = other - one
        _refuse_folded(characteristic, abs(between))
        sign = -1.0 if between < 0.0 else 1.0
        return zones.Evaluation(abs(between), sign * (by_other - by_one), frame=frame.words)
    found = spec.by_geometry(characteristic, actual, alignment, distance_of_geometry)
    _refuse_folded(characteristic, found.value)
    return found


def coordinate(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: zones.Frames,
) -> zones.Evaluation:
    """Return a coordinate of a feature's point; FitError without a part frame."""
    frame = frames.aligned(characteristic.name)
    place, slope = _along(characteristic, actual[characteristic.features[0]], frame)
    return zones.Evaluation(place, slope, frame=frame.words)


def _along(
    characteristic: zones.Characteristic, feature: ActualFeature, frame: zones.ZoneFrame
) -> tuple[float, Rows]:
    """Return a place along the axis, mm, and its gradient."""
    axis = _XYZ.index(characteristic.axis)
    point = frame.T_frame_from_world.apply(feature.fit.point)
    slope = frame.point_derivative(point, feature.jacobian[POINT])[axis]
    return float(point[axis]), slope


def thickness(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: zones.Frames,
) -> zones.Evaluation:
    """Return the thickness of a sheet amid the touches of both sides; FitError: no sheet there."""
    first, second = (actual[name] for name in characteristic.features)
    names = " and ".join(characteristic.features)
    geometries = first.fit.geometry, second.fit.geometry
    fault, gaps = _no_sheet(names, *geometries), np.zeros(1)
    if not fault and not characteristic.association:
        sites = [zones.surface_points(face).points for face in (first, second)]
        gaps = zones.gaps_between(*geometries, np.concatenate(sites))
        fault = _no_place(names, sites, gaps)
    if fault:
        raise FitError(
            "characteristic.no_sheet",
            fault,
            "Name both sides of a sheet, each touched from outside at the same place. On a wedge "
            "take the distance of one place from the other side.",
        )
    if characteristic.association:
        return distance_of_faces(characteristic, first, second)
    found = spec.by_geometry(characteristic, actual, alignment, thickness_of_geometry)
    note = f"{gaps.min():.3f} to {gaps.max():.3f} mm over the touched places."
    return replace(found, note=note)


def _no_sheet(names: str, one: Float, other: Float) -> str:
    """Return why two planes are not the sides of a sheet; empty if they are."""
    opposite = float(-one[DIRECTION] @ other[DIRECTION])
    if opposite < 0.0:
        return f"{names} face the same way: they are not the two sides of a sheet."
    if float((one[POINT] - other[POINT]) @ (one[DIRECTION] - other[DIRECTION])) <= 0.0:
        return f"{names} face each other: no material lies between."
    angle = float(np.degrees(np.arccos(min(opposite, 1.0))))
    return f"{names} are not parallel: {angle:.1f}°." if angle > _MOST_WEDGE_DEG else ""


def _no_place(names: str, sites: list[Float], gaps: Float) -> str:
    """Return why two sides were not touched at one place; empty if they were."""
    middles = [site.mean(axis=0) for site in sites]
    reach = max(np.linalg.norm(sites[i] - middles[i], axis=1).max() for i in range(2))
    mean, vary = float(gaps.mean()), float(np.ptp(gaps))
    apart = np.sqrt(max(float(np.sum((middles[1] - middles[0]) ** 2)) - mean**2, 0.0))
    if apart > reach:
        return f"The touches of {names} are {apart:.1f} mm apart along the sheet."
    if vary > _MOST_VARIED * mean:
        return f"The thickness between {names} varies by {vary:.3f} mm over the touched places."
    return ""


def thickness_of_geometry(
    characteristic: zones.Characteristic,
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    alignment: AnyAlignment | None,
) -> float:
    """Return the distance of two planes, mm, square to their middle plane amid their points."""
    one, other = (geometries[name] for name in characteristic.features)
    middle = 0.5 * (one[POINT] + other[POINT])
    return abs(float(zones.gaps_between(one, other, middle[None])[0]))


def distance_of_geometry(
    characteristic: zones.Characteristic,
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    alignment: AnyAlignment | None,
) -> float:
    """Return the distance of two elements, mm; along an axis FitError without a part frame."""
    one, other = characteristic.features
    if not characteristic.axis:
        return _distance(geometries[one], shapes[one], geometries[other], shapes[other])
    places = (_place(characteristic, name, geometries, alignment) for name in (one, other))
    first, second = places
    return abs(second - first)


def coordinate_of_geometry(
    characteristic: zones.Characteristic,
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    alignment: AnyAlignment | None,
) -> float:
    """Return a coordinate of an element's point, mm, part frame; FitError without one."""
    return _place(characteristic, characteristic.features[0], geometries, alignment)


def _place(
    characteristic: zones.Characteristic,
    name: str,
    geometries: Mapping[str, Float],
    alignment: AnyAlignment | None,
) -> float:
    if alignment is None:
        raise zones.no_part_frame(characteristic.name)
    T_part_from_world = frame_of(alignment, geometries)
    axis = _XYZ.index(characteristic.axis)
    return float(T_part_from_world.apply(geometries[name][POINT])[axis])


def _distance(first: Float, shape: Shape, second: Float, other: Shape) -> float:
    """Return the distance of two elements, nonnegative.

    From a plane along its normal to the point of the other; between two planes along the second
    one's normal at the first one's centroid; from an axis square to it; between two axes at the
    first one's point if nearly parallel, else by the common perpendicular; else by centres.
    """
    arm = first[POINT] - second[POINT]
    if other is Shape.PLANE:
        return abs(float(arm @ second[DIRECTION]))
    if shape is Shape.PLANE:
        return abs(float(arm @ first[DIRECTION]))
    if shape in zones.AXES and other in zones.AXES:
        if abs(float(first[DIRECTION] @ second[DIRECTION])) < _PARALLEL:
            common = np.cross(first[DIRECTION], second[DIRECTION])
            return abs(float(arm @ common)) / float(np.linalg.norm(common))
        return float(np.linalg.norm(np.cross(arm, second[DIRECTION])))
    if other in zones.AXES:
        return float(np.linalg.norm(np.cross(arm, second[DIRECTION])))
    if shape in zones.AXES:
        return float(np.linalg.norm(np.cross(arm, first[DIRECTION])))
    return float(np.linalg.norm(arm))


_MOST_WEDGE_DEG = 1.0
"""Sides at a greater angle have no thickness."""
_MOST_VARIED = 0.1
"""Relative change of a thickness over the touched places, beyond which it has no one value."""


def _refuse_folded(characteristic: zones.Characteristic, value: float) -> None:
    """Raise FitError at the fold of a distance, where differences make it appear certain."""
    if value < _SHORTEST_MM:
        raise FitError(
            "characteristic.no_distance",
            f"The features of {characteristic.name} coincide; no uncertainty can be stated for "
            "a distance of zero.",
            "Tolerance the coordinates of the features instead.",
        )


def _faces_fault(asked: spec.PlannedCharacteristic) -> spec.Fault | None:
    item = asked.item
    if item.axis or any(asked.shapes[name] is not Shape.PLANE for name in item.features):
        return "association", "of a distance needs two opposite planes, and no 'axis'"
    return two_point_fault(asked)


def _sides_fault(asked: spec.PlannedCharacteristic) -> spec.Fault | None:
    if not _no_sheet("", *(asked.nominals[name] for name in asked.item.features)):
        return None
    return "features", "names no sheet, which is two opposite planes with material between"


def _axis_missing(asked: spec.PlannedCharacteristic) -> spec.Fault | None:
    return None if asked.item.axis else ("axis", "is missing: a coordinate is x, y or z")


def _frame_missing(asked: spec.PlannedCharacteristic) -> spec.Fault | None:
    item = asked.item
    if item.axis and not asked.aligned:
        return "axis", f"needs a part frame: the plan has no 'alignment' for this {item.kind}"
    return None


KINDS = (
    spec.KindSpec(
        name="distance",
        evaluate=distance,
        geometry=distance_of_geometry,
        monte_carlo=spec.MonteCarlo.SECOND_ORDER,
        qif=spec.QifWords("DistanceBetween"),
        shapes=spec.ALL,
        features=(2, 2),
        takes=frozenset({"axis"}),
        association_fault=_faces_fault,
        checks=(_frame_missing,),
        in_part=lambda item: item.axis != "",
        folds=True,
        below_u="The distance is smaller than its uncertainty.",
    ),
    spec.KindSpec(
        name="thickness",
        evaluate=thickness,
        geometry=thickness_of_geometry,
        monte_carlo=spec.MonteCarlo.SECOND_ORDER,
        qif=spec.QifWords("Thickness"),
        shapes=(Shape.PLANE,),
        features=(2, 2),
        association_fault=_faces_fault,
        checks=(_sides_fault,),
        probed="all",
    ),
    spec.KindSpec(
        name="coordinate",
        evaluate=coordinate,
        geometry=coordinate_of_geometry,
        monte_carlo=spec.MonteCarlo.SECOND_ORDER,
        qif=spec.QifWords("LinearCoordinate"),
        shapes=zones.CENTRES,
        takes=frozenset({"axis"}),
        checks=(_axis_missing, _frame_missing),
        in_part=lambda item: True,
        is_place=True,
    ),
)
