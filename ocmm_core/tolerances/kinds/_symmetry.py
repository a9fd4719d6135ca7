"""Symmetry of slots and of pairs of faces (ISO 1101, 17.14)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocmm_core.alignment import AnyAlignment
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import ACROSS, DIRECTION, GEOMETRY_SIZE, POINT, RADIUS, Shape
from ocmm_core.geometry import Float, unit
from ocmm_core.measuring import Rows
from ocmm_core.tolerances.kinds._spec import (
    DIRECTED,
    SLOTS,
    Fault,
    KindSpec,
    MonteCarlo,
    PlannedCharacteristic,
    QifWords,
    Symbol,
)
from ocmm_core.tolerances.zones import (
    Characteristic,
    Evaluation,
    Frames,
    form_noise,
    moved_geometry,
    own_fit,
    surface_points,
    vector_evaluation,
)

_STEP = 1e-5
"""mm, and of directions a fraction of one: step of the differences."""

_OPPOSITE = -0.5
"""Cosine between the normals of two faces above which they have no middle between them."""


def symmetry(
    characteristic: Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: Frames,
) -> Evaluation:
    """Return twice the greatest distance of extracted median points from the datum.

    Median points of two faces are halfway between a point of either face and the other one, across
    the datum plane; those of a slot are the ends and the middle of its middle line. About a datum
    axis the middle plane contains the axis and is turned as the slot. FitError: a face has no
    points of its own, or the faces are not opposite to each other.
    """
    datum = actual[characteristic.datums[0]]
    if len(characteristic.features) == 1:
        return _of_slot(actual[characteristic.features[0]], datum)
    first, second = (actual[name] for name in characteristic.features)
    if float(first.fit.direction @ second.fit.direction) > _OPPOSITE:
        raise FitError(
            "characteristic.not_opposite",
            f"{first.nominal.name} and {second.nominal.name} do not face away from each other, "
            "so they have no mid-plane.",
            "Name two opposite faces.",
        )
    return _of_faces(first, second, datum)


def _of_slot(feature: ActualFeature, datum: ActualFeature) -> Evaluation:
    geometries = {"slot": feature.fit.geometry, "datum": datum.fit.geometry}
    plane = datum.fit.shape is Shape.PLANE
    found = _slot_distances(geometries, plane)
    worst = int(np.argmax(np.abs(found)))
    gradient = Rows.nothing()
    for key, item in (("slot", feature), ("datum", datum)):
        slope = np.zeros(GEOMETRY_SIZE)
        for k in np.flatnonzero(item.jacobian.moving()).tolist():
            ahead, behind = (
                _slot_distances(moved_geometry(geometries, key, k, step), plane)[worst]
                for step in (_STEP, -_STEP)
            )
            slope[k] = (ahead - behind) / (2.0 * _STEP)
        gradient += slope @ item.jacobian
    return vector_evaluation(
        2.0 * found[worst : worst + 1], 2.0 * gradient[None], datum.nominal.name
    )


def _slot_distances(geometries: Mapping[str, Float], plane: bool) -> Float:
    """Return the distances (3,) of middle and ends of the middle line from the datum's middle."""
    slot, datum = geometries["slot"], geometries["datum"]
    normal = datum[DIRECTION]
    if not plane:
        width = np.cross(slot[DIRECTION], slot[ACROSS])
        normal = unit(width - (width @ normal) * normal)
    ends = np.array([0.0, -1.0, 1.0])[:, None] * slot[RADIUS] * slot[ACROSS] + slot[POINT]
    distances: Float = (ends - datum[POINT]) @ normal
    return distances


def _of_faces(first: ActualFeature, second: ActualFeature, datum: ActualFeature) -> Evaluation:
    normal, origin = datum.fit.direction, datum.fit.point
    values, slopes = [], []
    for near, far in ((first, second), (second, first)):
        surface, touches = surface_points(near), own_fit(near)[0]
        towards = far.fit.direction
        cosine = float(normal @ towards)
        arms = far.fit.point - surface.points
        gaps = arms @ towards
        by_point = normal - 0.5 * towards / cosine
        by_towards = 0.5 * (arms / cosine - np.outer(gaps, normal) / cosine**2)
        by_normal = surface.points - origin - 0.5 * np.outer(gaps, towards) / cosine**2
        rows = by_towards @ far.jacobian[DIRECTION] + by_normal @ datum.jacobian[DIRECTION]
        alike = 0.5 / cosine * (towards @ far.jacobian[POINT]) - normal @ datum.jacobian[POINT]
        # The contact point moves with the normal of its face, along which it is offset from the
        # ball.
        alike -= touches.tip_radius * by_point @ near.jacobian[DIRECTION]
        alike = alike.with_radius(-float(by_point @ near.fit.direction))
        rows += alike.outer(np.ones(len(gaps)))
        rows += Rows.of_own_points(touches.places, np.tile(by_point, (len(gaps), 1)))
        values.append((surface.points - origin) @ normal + 0.5 * gaps / cosine)
        slopes.append(rows)
    distances, rows = np.concatenate(values), Rows.stacked(slopes)
    worst = int(np.argmax(np.abs(distances)))
    sign = -1.0 if distances[worst] < 0.0 else 1.0
    return Evaluation(
        2.0 * abs(float(distances[worst])),
        2.0 * sign * rows[worst],
        frame=datum.nominal.name,
        noise=form_noise(distances, rows, np.zeros((len(distances), 0))),
    )


def _pair_fault(asked: PlannedCharacteristic) -> Fault | None:
    item = asked.item
    if (len(item.features) == 1) != (asked.first in SLOTS):
        return "features", "needs one slot or rectangle, or two opposite planes"
    if asked.first is Shape.PLANE:
        if asked.shapes[item.features[1]] is not Shape.PLANE:
            return "features", "needs two opposite planes"
        if asked.shapes[item.datums[0]] is not Shape.PLANE:
            return "datums", "needs a plane: two faces are symmetrical about one"
    return None


KINDS = (
    KindSpec(
        name="symmetry",
        words="symmetry",
        unit="mm",
        one_sided=True,
        evaluate=symmetry,
        geometry=None,
        monte_carlo=MonteCarlo.EVALUATED,
        qif=QifWords("Symmetry"),
        symbol=Symbol(
            lines=(
                ((0.05, 0.5), (0.95, 0.5)),
                ((0.22, 0.27), (0.78, 0.27)),
                ((0.22, 0.73), (0.78, 0.73)),
            )
        ),
        shapes=(Shape.PLANE, *SLOTS),
        features=(1, 2),
        datums=(1, 1),
        datum_shapes=DIRECTED,
        checks=(_pair_fault,),
        probed="faces",
    ),
)
