"""Orientation, profile and run-out: tolerances related to datums (ISO 1101, 17.7 to 17.11, 17.15).

Parallelism, perpendicularity and angularity; profiles of lines and surfaces (ISO 1660); run-out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ocmm_core.alignment import AnyAlignment
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import DIRECTION, Shape, element, nominal_geometry
from ocmm_core.geometry import Float, perpendicular_pair, unit
from ocmm_core.measuring import DeviationRows
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
    return None if abs(along) > _MEANT else unit(own - along * base)


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


ORIENTATIONS = (
    _kind("parallelism", "Parallelism", ((0.2, 0.9), (0.5, 0.1)), ((0.5, 0.9), (0.8, 0.1))),
    _kind(
        "perpendicularity",
        "Perpendicularity",
        ((0.1, 0.85), (0.9, 0.85)),
        ((0.5, 0.85), (0.5, 0.12)),
    ),
    _kind("angularity", "Angularity", ((0.9, 0.2), (0.08, 0.82), (0.95, 0.82))),
)


def runout(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: zones.Frames,
) -> zones.Evaluation:
    """Return the run-out of a surface about the datum axis.

    Radially for round surfaces, square to the surface for a cone, axially for a face. Circular
    run-out is that of the worst section; sections are found from the positions of the points.
    FitError: the feature is constructed, or its points do not lie in sections.
    """
    feature, datum = actual[characteristic.features[0]], actual[characteristic.datums[0]]
    surface = zones.surface_points(feature)
    axis = datum.fit.direction
    arms = surface.points - datum.fit.point
    along = arms @ axis
    across = arms - np.outer(along, axis)
    radii = np.linalg.norm(across, axis=1)
    radial = across / np.maximum(radii, 1e-12)[:, None]
    shape = feature.fit.shape
    # Radial and axial components of the direction of measurement, square to the surface: points of
    # a section of a cone need not be at one height.
    radially, axially = 0.0, 1.0
    if shape is not Shape.PLANE:
        towards = float(np.copysign(1.0, axis @ feature.fit.direction))
        radially = float(np.cos(feature.fit.half_angle))
        axially = -towards * float(np.sin(feature.fit.half_angle))
    places = radii if shape is Shape.PLANE else along
    values = radially * radii + axially * along
    directions = radially * radial + axially * axis
    by_axis = axially * arms - radially * along[:, None] * radial
    by_datum = np.hstack([-directions, by_axis])
    frame = datum.jacobian[:6]

    found: tuple[zones.Section, ...] = (zones.Section(np.arange(len(values)), 0.0),)
    note = ""
    if characteristic.kind == "circular runout" and shape is not Shape.CIRCLE:
        found = zones.sections(feature.nominal.name, places)
    if characteristic.kind == "circular runout":
        note = zones.few_in_a_section(found)
    worst = max(found, key=lambda section: float(np.ptp(values[section.rows])))
    if len(found) > 1:
        where = "radius" if shape is Shape.PLANE else "height"
        said = f"Worst of {len(found)} sections, at {where} {worst.at:.1f} mm."
        note = " ".join(filter(None, (said, note)))
    rows = worst.rows
    high, low = int(rows[np.argmax(values[rows])]), int(rows[np.argmin(values[rows])])
    weights = np.zeros_like(directions)
    weights[high] += directions[high]
    weights[low] -= directions[low]
    touched = np.asarray(zones.own_fit(feature)[0].places)[rows]
    by_radius = -np.sum(directions[rows] * surface.normals[rows], axis=1)
    slopes = DeviationRows.of_own(touched, directions[rows], by_radius)
    return zones.Evaluation(
        float(np.ptp(values[rows])),
        (by_datum[high] - by_datum[low]) @ frame + surface.pull_back(weights),
        frame=characteristic.datums[0],
        noise=zones.FormNoise(
            values[rows], slopes.with_shared(by_datum[rows], frame), np.zeros((len(rows), 0))
        ),
        note=note,
    )


def _arrow(shift: float) -> tuple[spec.Polygon, ...]:
    return (
        ((0.1 + shift, 0.9), (0.55 + shift, 0.12)),
        ((0.37 + shift, 0.24), (0.55 + shift, 0.12), (0.55 + shift, 0.34)),
    )


_runout = partial(
    spec.KindSpec, one_sided=True, evaluate=runout, monte_carlo=spec.MonteCarlo.EVALUATED,
    datums=(1, 1), datum_shapes=spec.ROUND_AXES, own_form=True, probed="all",
)  # fmt: skip

RUNOUTS = (
    _runout(
        name="circular runout",
        qif=spec.QifWords("CircularRunout"),
        symbol=spec.Symbol(lines=_arrow(0.15)),
        shapes=(Shape.CIRCLE, Shape.CYLINDER, Shape.CONE, Shape.PLANE),
    ),
    _runout(
        name="total runout",
        qif=spec.QifWords("TotalRunout"),
        symbol=spec.Symbol(lines=(*_arrow(-0.05), *_arrow(0.35), ((0.05, 0.9), (0.45, 0.9)))),
        shapes=(Shape.CYLINDER, Shape.PLANE),
    ),
)


def profile(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: zones.Frames,
) -> zones.Evaluation:
    """Return twice the greatest distance of surface points from the nominal surface.

    The pose follows from the datums; degrees of freedom that they leave minimise the greatest
    distance. All dimensions are nominal. Several features are one surface. FitError: a feature is
    constructed, or the datums do not hold.
    """
    features = [actual[name] for name in characteristic.features]
    across, notes = None, []
    if any(characteristic.cut):
        at = frames.of_part(characteristic.name).T_frame_from_world
        features = zones.near_cut(features, characteristic, at)
        across = at.rotation.T @ unit(np.array(characteristic.cut))
        count = sum(len(one.touches.numbers) for one in features if one.touches)
        notes.append(f"{count} points within {characteristic.within:g} mm of the section.")
    if characteristic.faces:
        found = _against_model(characteristic, features, frames)
    else:
        frame = frames.of_datums(characteristic.datums, characteristic.features)
        points = [zones.surface_points(one) for one in features]
        surfaces = [_surface(one, frame, characteristic.offset) for one in points]
        found = zones.surface_zone(surfaces, frame)
    if characteristic.offset:
        notes.append(f"Zone offset by {characteristic.offset:+.4f} mm (UZ).")
    seen = None if found.seen is None else replace(found.seen, across=across)
    return replace(found, note=" ".join(filter(None, (found.note, *notes))), seen=seen)


def _against_model(
    characteristic: zones.Characteristic, features: Sequence[ActualFeature], frames: zones.Frames
) -> zones.Evaluation:
    """Return the profile of ball centres against model faces, fitted from the part frame."""
    surface = zones.ModelSurface(features, characteristic.faces, characteristic.offset)
    count = len(surface.places)
    if characteristic.datums:
        frame = frames.of_datums(characteristic.datums, characteristic.features)
        needed = frame.motions.shape[1] + 1
    else:
        part = frames.of_part(characteristic.name).T_frame_from_world
        frame, needed = zones.free_frame(part, surface.world.mean(axis=0)), 7
    if count < needed:
        raise FitError(
            "characteristic.few_points",
            f"{characteristic.name} has {count} points, which any surface fits: its place is open "
            f"in {needed - 1} motions.",
            "Take more points, or name datums.",
        )
    numbers = ", ".join(str(face.number) for face in characteristic.faces)
    note = f"Against face{'s' if len(characteristic.faces) > 1 else ''} {numbers} of the model."
    return replace(zones.surface_zone([surface], frame), note=note)


def _surface(measured: zones.SurfacePoints, frame: zones.ZoneFrame, offset: float) -> zones.Surface:
    nominal = nominal_geometry(measured.feature.nominal)
    shape = measured.feature.fit.shape
    if not shape.spec.has_normals:
        nominal[DIRECTION] = _face_normal(measured, frame, nominal)
    return zones.Surface(measured, shape, nominal, offset)


def _face_normal(measured: zones.SurfacePoints, frame: zones.ZoneFrame, nominal: Float) -> Float:
    """Return the normal (3,), frame, of the face of a probed point or line."""
    if measured.feature.fit.shape is Shape.POINT:
        return unit(np.array(measured.feature.nominal.direction))
    normal = frame.T_frame_from_world.rotation @ measured.normals[0]
    line = nominal[DIRECTION]
    return unit(normal - (normal @ line) * line)


def _cut_fault(asked: spec.PlannedCharacteristic) -> spec.Fault | None:
    item = asked.item
    if not any(item.cut):
        if item.faces or not all(asked.shapes[name] in spec.OF_A_LINE for name in item.features):
            return "cut", "is missing: the profile of a line on a surface is that of a section"
        return None
    if not asked.aligned:
        return "cut", "needs an alignment, which says where the section is"
    return None if item.within > 0.0 else ("within", f"is {item.within:g}")


_profile = partial(
    spec.KindSpec, one_sided=True, evaluate=profile, monte_carlo=spec.MonteCarlo.EVALUATED,
    features=(1, 1000), datums=(0, 3), datums_make_frame=True, own_form=True, probed="all",
    # The search for the smallest zone starts from the alignment, which also places a section.
    in_part=lambda item: any(item.cut) or (bool(item.faces) and not item.datums),
)  # fmt: skip

PROFILES = (
    _profile(
        name="line profile",
        qif=spec.QifWords("LineProfile"),
        symbol=spec.Symbol(bow="open"),
        shapes=tuple(dict.fromkeys((*spec.OF_A_LINE, *spec.OF_A_SURFACE))),
        takes=frozenset({"cut", "faces", "offset"}),
        checks=(_cut_fault,),
    ),
    _profile(
        name="surface profile",
        qif=spec.QifWords("SurfaceProfile"),
        symbol=spec.Symbol(bow="closed"),
        shapes=spec.OF_A_SURFACE,
        takes=frozenset({"faces", "offset"}),
    ),
)
