"""Profile of a line and of a surface (ISO 1101, 17.7 and 17.8; ISO 1660)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ocmm_core.alignment import AnyAlignment
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import DIRECTION, Shape, nominal_geometry
from ocmm_core.geometry import Float, unit
from ocmm_core.tolerances import zones
from ocmm_core.tolerances.kinds import _spec as spec


def profile(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: zones.Frames,
) -> zones.Evaluation:
    """Return twice the greatest distance of surface points from the nominal surface.

    The pose follows from the datums; degrees of freedom that they leave minimise the greatest
    distance. All dimensions are nominal. Several features are one surface. FitError: a feature has
    no points of its own, or the datums do not hold.
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


KINDS = (
    spec.KindSpec(
        name="line profile",
        words="line profile",
        unit="mm",
        one_sided=True,
        evaluate=profile,
        monte_carlo=spec.MonteCarlo.EVALUATED,
        qif=spec.QifWords("LineProfile"),
        symbol=spec.Symbol(bow="open"),
        shapes=spec.OF_A_LINE,
        features=(1, 1000),
        datums=(0, 3),
        takes=frozenset({"offset"}),
        datums_make_frame=True,
        own_form=True,
        probed="all",
    ),
    spec.KindSpec(
        name="surface profile",
        words="surface profile",
        unit="mm",
        one_sided=True,
        evaluate=profile,
        monte_carlo=spec.MonteCarlo.EVALUATED,
        qif=spec.QifWords("SurfaceProfile"),
        symbol=spec.Symbol(bow="closed"),
        shapes=spec.OF_A_SURFACE,
        features=(1, 1000),
        datums=(0, 3),
        takes=frozenset({"faces", "offset"}),
        in_part=_from_part_frame,
        datums_make_frame=True,
        own_form=True,
        probed="all",
    ),
)
