"""Profiles of lines and surfaces (ISO 1101, 17.7, 17.8; ISO 1660), and run-out (17.15, 17.16)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from ocmm_core.alignment import AnyAlignment
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import DIRECTION, Shape, nominal_geometry
from ocmm_core.geometry import Float, unit
from ocmm_core.measuring import DeviationRows
from ocmm_core.tolerances import zones
from ocmm_core.tolerances.kinds import _spec as spec


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
    if characteristic.faces:
        return _against_model(characteristic, actual, frames)
    frame = frames.of_datums(characteristic.datums, characteristic.features)
    surfaces = [
        _surface(zones.surface_points(actual[name]), frame, characteristic.offset)
        for name in characteristic.features
    ]
    found = zones.surface_zone(surfaces, frame)
    if characteristic.offset:
        return replace(found, note=f"Zone offset by {characteristic.offset:+.4f} mm (UZ).")
    return found


def _against_model(
    characteristic: zones.Characteristic, actual: Mapping[str, ActualFeature], frames: zones.Frames
) -> zones.Evaluation:
    """Return the profile of ball centres against model faces, fitted from the part frame."""
    features = [actual[name] for name in characteristic.features]
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
    if characteristic.offset:
        note += f" Zone offset by {characteristic.offset:+.4f} mm (UZ)."
    return replace(zones.surface_zone([surface], frame), note=note)


def _from_part_frame(characteristic: zones.Characteristic) -> bool:
    """Return whether the search for the smallest zone starts from the alignment."""
    return bool(characteristic.faces) and not characteristic.datums


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


_profile = partial(
    spec.KindSpec, one_sided=True, evaluate=profile, monte_carlo=spec.MonteCarlo.EVALUATED,
    features=(1, 1000), datums=(0, 3), datums_make_frame=True, own_form=True, probed="all",
)  # fmt: skip

KINDS = (
    _profile(
        name="line profile",
        qif=spec.QifWords("LineProfile"),
        symbol=spec.Symbol(bow="open"),
        shapes=spec.OF_A_LINE,
        takes=frozenset({"offset"}),
    ),
    _profile(
        name="surface profile",
        qif=spec.QifWords("SurfaceProfile"),
        symbol=spec.Symbol(bow="closed"),
        shapes=spec.OF_A_SURFACE,
        takes=frozenset({"faces", "offset"}),
        in_part=_from_part_frame,
    ),
)
