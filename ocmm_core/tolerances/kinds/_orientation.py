"""Parallelism, perpendicularity and angularity (ISO 1101, 17.9 to 17.11)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocmm_core.alignment import AnyAlignment
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import DIRECTION, Shape, element, nominal_geometry
from ocmm_core.geometry import Float, perpendicular_pair, unit
from ocmm_core.tolerances import zones
from ocmm_core.tolerances.kinds import _spec as spec

_MEANT = np.sin(np.deg2rad(0.5))
"""Nominal directions further from parallel or square are not meant to be so."""

_AXES = "xyz"

_ROUND_ABOUT: Mapping[str, Mapping[bool, spec.Zone]] = {
    "parallelism": {False: "cylinder"},
    "perpendicularity": {True: "cylinder"},
    "angularity": {},
}
"""Usual zone of an axis other than two planes, by whether the datum is a plane."""


def orientation(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: zones.Frames,
) -> zones.Evaluation:
    """Return the width of the zone of a face, or the width or diameter of that of an axis.

    The true direction is that of the plan in the frame of the datums, made exactly parallel or
    square to the primary datum if the kind implies it. A face must have all points between two
    planes; for an axis both ends of its toleranced length count. FitError: the plan's directions
    contradict the kind, a feature is constructed, or the datums do not hold.
    """
    name = characteristic.features[0]
    feature, datum = actual[name], actual[characteristic.datums[0]]
    direction = _true_direction(characteristic, feature, datum)
    frame = frames.of_datums(characteristic.datums, [name])
    if feature.fit.shape is Shape.PLANE:
        plane = element(np.zeros(3), direction)
        surface = zones.Surface(zones.surface_points(feature), Shape.PLANE, plane)
        return zones.surface_zone([surface], frame.with_shifts())
    rows = _rows(characteristic, datum, direction)
    low, high = zones.derived_points(feature, characteristic.length or feature.nominal.length)
    # The zone shifts freely: only half of the axis about its middle counts.
    half = zones.DerivedPoint(
        0.5 * (high.point - low.point), 0.5 * (high.by_coordinates - low.by_coordinates)
    )
    return zones.derived_zone([half], np.zeros(3), rows, frame.turning())


def meant_direction(kind: str, own: Float, base: Float, *, alike: bool) -> Float | None:
    """Return the intended direction (3,), unit, of a feature, or None if not intended.

    ``own``, ``base``: nominals of feature and datum; ``alike``: both planes or both axes.
    """
    if kind == "angularity":
        return own
    along = float(own @ base)
    if alike == (kind == "parallelism"):
        if np.linalg.norm(own - along * base) > _MEANT:
            return None
        return base if along > 0.0 else -base
    if abs(along) > _MEANT:
        return None
    return unit(own - along * base)


def _true_direction(
    characteristic: zones.Characteristic, feature: ActualFeature, datum: ActualFeature
) -> Float:
    """Return the true direction (3,), unit, frame of the plan, of a feature."""
    alike = (feature.fit.shape is Shape.PLANE) == (datum.fit.shape is Shape.PLANE)
    own, base = (nominal_geometry(item.nominal)[DIRECTION] for item in (feature, datum))
    meant = meant_direction(characteristic.kind, own, base, alike=alike)
    if meant is None:
        word = "parallel" if characteristic.kind == "parallelism" else "square"
        raise FitError(
            "characteristic.direction",
            f"{characteristic.name}: the directions of {feature.nominal.name} and "
            f"{datum.nominal.name} in the plan are not {word}.",
            "Correct the directions, or use angularity.",
        )
    return meant


def _zone_of_axis(characteristic: zones.Characteristic, datum: Shape) -> spec.Zone:
    """Return the zone of an axis, from the characteristic or the usual one."""
    if characteristic.zone:
        return characteristic.zone
    return _ROUND_ABOUT[characteristic.kind].get(datum is Shape.PLANE, "planes")


def _rows(characteristic: zones.Characteristic, datum: ActualFeature, direction: Float) -> Float:
    """Return the directions (d, 3), frame, in which the ends of an axis may deviate."""
    if _zone_of_axis(characteristic, datum.fit.shape) == "cylinder":
        return np.stack(perpendicular_pair(direction))
    across = nominal_geometry(datum.nominal)[DIRECTION]
    if characteristic.axis:
        across = np.eye(3)[_AXES.index(characteristic.axis)]
    across = across - (across @ direction) * direction
    if float(np.linalg.norm(across)) < _MEANT:
        raise FitError(
            "characteristic.no_zone",
            f"{characteristic.name} does not define the orientation of its two planes.",
            "Give it the 'axis' across the planes, or the zone 'cylinder'.",
        )
    return unit(across)[None]


def _zone_of(
    item: zones.Characteristic | None, shape: Shape | None, datums: tuple[Shape, ...]
) -> spec.Zone:
    if shape is Shape.PLANE or item is None or not datums:
        return "planes"
    return _zone_of_axis(item, datums[0])


def _direction_fault(asked: spec.PlannedCharacteristic) -> spec.Fault | None:
    names = (asked.item.features[0], asked.item.datums[0])
    flat = [asked.shapes[name] is Shape.PLANE for name in names]
    own, base = (asked.nominals[name][DIRECTION] for name in names)
    if meant_direction(asked.item.kind, own, base, alike=flat[0] == flat[1]) is None:
        word = "parallel" if asked.item.kind == "parallelism" else "square"
        return "features", (
            f"names {names[0]!r}, whose nominal direction is not {word} to that of {names[1]!r}"
        )
    return None


def _kind(name: str, qif: str, *symbol: spec.Polygon) -> spec.KindSpec:
    return spec.KindSpec(
        name=name,
        one_sided=True,
        evaluate=orientation,
        monte_carlo=spec.MonteCarlo.VECTOR,
        qif=spec.QifWords(qif, has_modifier=True, planes="PlanarZone"),
        symbol=spec.Symbol(lines=symbol),
        shapes=spec.DIRECTED,
        datums=(1, 3),
        datum_shapes=spec.DIRECTED,
        takes=frozenset({"axis", "length"}),
        zones=("planes", "cylinder"),
        zone_of=_zone_of,
        checks=(_direction_fault,),
        datums_make_frame=True,
        probed="faces",
    )


KINDS = (
    _kind("parallelism", "Parallelism", ((0.2, 0.9), (0.5, 0.1)), ((0.5, 0.9), (0.8, 0.1))),
    _kind(
        "perpendicularity",
        "Perpendicularity",
        ((0.1, 0.85), (0.9, 0.85)),
        ((0.5, 0.85), (0.5, 0.12)),
    ),
    _kind("angularity", "Angularity", ((0.9, 0.2), (0.08, 0.82), (0.95, 0.82))),
)
