"""Diameter, radius, length and width, by the associations of ISO 14405-1."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from ocmm_core.alignment import AnyAlignment
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import (
    CRITERIA,
    DIRECTION,
    HALF_ANGLE,
    POINT,
    RADIUS,
    SECOND,
    Criterion,
    Shape,
)
from ocmm_core.geometry import Float
from ocmm_core.measuring import Rows
from ocmm_core.tolerances import zones
from ocmm_core.tolerances.kinds import _spec as spec

LETTERS: dict[zones.Association, str] = {
    "least squares": "GG",
    "minimum zone": "GC",
    "inscribed": "GX",
    "circumscribed": "GN",
    "two-point maximum": "LP SX",
    "two-point minimum": "LP SN",
    "two-point mean": "LP SA",
}
"""Symbols of ISO 14405-1."""


_PLACES = {
    "diameter": (RADIUS, 2.0),
    "radius": (RADIUS, 1.0),
    "length": (RADIUS, 2.0),
    "width": (SECOND, 2.0),
}
"""Place in the geometry vector, and factor, of a size."""


def size_words(association: zones.Association) -> str:
    """Return the association of a size for reports, with its symbol."""
    return f"{association} ({LETTERS[association]})"


def own_association(feature: ActualFeature) -> zones.Association:
    """Return the association of a feature's geometry."""
    words: dict[Criterion, zones.Association] = {
        Criterion.LEAST_SQUARES: "least squares",
        Criterion.MINIMUM_ZONE: "minimum zone",
        Criterion.INSCRIBED: "inscribed",
        Criterion.CIRCUMSCRIBED: "circumscribed",
    }
    return words[feature.fit.criterion]


def size(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: zones.Frames,
) -> zones.Evaluation:
    """Return the size by the feature's or the plan's association; FitError as `associated_size`."""
    feature = actual[characteristic.features[0]]
    own = own_association(feature)
    if characteristic.association not in ("", own):
        return associated_size(characteristic, feature)
    found = spec.by_geometry(characteristic, actual, alignment, size_of_geometry)
    return replace(found, association=size_words(own))


def size_of_geometry(
    characteristic: zones.Characteristic,
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    alignment: AnyAlignment | None,
) -> float:
    """Return the size of an element, mm."""
    geometry = geometries[characteristic.features[0]]
    if characteristic.datums:
        plane = geometries[characteristic.datums[0]]
        return _gauge_diameter(geometry, plane, characteristic.at)
    place, factor = _PLACES[characteristic.kind]
    return factor * float(geometry[place])


def _gauge_diameter(cone: Float, plane: Float, at: float) -> float:
    """Return the diameter of a cone at a distance ``at``, mm, from a plane, along its normal."""
    towards = float(cone[DIRECTION] @ plane[DIRECTION])
    along = (at - float((cone[POINT] - plane[POINT]) @ plane[DIRECTION])) / towards
    return 2.0 * float(cone[RADIUS] + along * np.tan(cone[HALF_ANGLE]))


def associated_size(
    characteristic: zones.Characteristic, feature: ActualFeature
) -> zones.Evaluation:
    """Return a size by the plan's association; FitError: constructed, no element, none opposite."""
    association = characteristic.association
    if characteristic.kind in ("length", "width"):
        lengthwise = characteristic.kind == "length"
        return _of_rank(
            *zones.across_slot(feature, association, lengthwise=lengthwise), association
        )
    factor = _PLACES[characteristic.kind][1]
    if association not in CRITERIA:
        halves, gradients = zones.around(feature, association)
        return _of_rank(factor * halves, factor * gradients, association)
    radius, gradient = _radius(feature, CRITERIA[association])
    return zones.Evaluation(factor * radius, factor * gradient, association=size_words(association))


def distance_of_faces(
    characteristic: zones.Characteristic, first: ActualFeature, second: ActualFeature
) -> zones.Evaluation:
    """Return the two-point size of two opposite faces; FitError as `zones.between_faces`."""
    association = characteristic.association
    return _of_rank(*zones.between_faces(first, second, association), association)


def _of_rank(sizes: Float, gradients: Rows, association: zones.Association) -> zones.Evaluation:
    """Return the size of a rank among two-point sizes sorted by it, or their mean, one alone."""
    ranked = None
    if association != "two-point mean":
        ranked = zones.Ranked(sizes, gradients, association == "two-point maximum")
    words = size_words(association)
    return zones.Evaluation(float(sizes[0]), gradients[0], ranked=ranked, association=words)


def _radius(feature: ActualFeature, criterion: Criterion) -> tuple[float, Rows]:
    # Ball centres are on a parallel surface: their element and that of the part share the axis.
    touches = zones.own_fit(feature)[0]
    start = zones.least_squares(feature)
    fit = start
    if criterion is not Criterion.LEAST_SQUARES:
        fit = zones.associated(start, touches.tips, criterion)
    sign = 1.0 if feature.nominal.side == "outer" else -1.0
    gradient = Rows.of_points(touches.places, fit.jacobian[RADIUS]).with_radius(-sign)
    return fit.radius - sign * touches.tip_radius, gradient


def two_point_fault(asked: spec.PlannedCharacteristic) -> spec.Fault | None:
    """Return the fault of an association that is not a two-point one."""
    if asked.item.association not in zones.TWO_POINT:
        words = ", ".join(repr(word) for word in zones.TWO_POINT)
        return "association", f"of a {asked.item.kind} is left out, or one of: {words}"
    return None


def _round_fault(asked: spec.PlannedCharacteristic) -> spec.Fault | None:
    if asked.first in spec.WITH_RADIUS:
        return None
    return "association", "is only for circle, sphere and cylinder"


def _oblong_fault(asked: spec.PlannedCharacteristic) -> spec.Fault | None:
    kind = asked.item.kind
    if asked.first not in spec.SLOTS:
        return "association", f"of a {kind} is only for slots and rectangles"
    if kind == "length" and asked.first is Shape.ROUND_SLOT:
        return "association", "of a length needs straight ends; those of a round slot are not"
    return two_point_fault(asked)


def _cone_fault(asked: spec.PlannedCharacteristic) -> spec.Fault | None:
    if (asked.first is Shape.CONE) != bool(asked.item.datums):
        return "datums", "goes with the diameter of a cone, which needs the plane it is taken from"
    return None


_of_size = partial(
    spec.KindSpec, evaluate=size, geometry=size_of_geometry,
    monte_carlo=spec.MonteCarlo.SECOND_ORDER,
)  # fmt: skip

KINDS = (
    _of_size(
        name="diameter",
        is_size=True,
        qif=spec.QifWords("Diameter", of_shape={Shape.SPHERE: "SphericalDiameter"}),
        symbol=spec.Symbol(lines=(((0.15, 0.9), (0.85, 0.1)),), circles=((0.5, 0.5, 0.32),)),
        shapes=spec.WITH_DIAMETER,
        datums=(0, 1),
        datum_shapes=(Shape.PLANE,),
        takes=frozenset({"at"}),
        association_fault=_round_fault,
        checks=(_cone_fault,),
    ),
    _of_size(
        name="radius",
        qif=spec.QifWords("Radius", of_shape={Shape.SPHERE: "SphericalRadius"}),
        shapes=(*spec.WITH_RADIUS, Shape.TORUS),
        association_fault=_round_fault,
    ),
    _of_size(
        name="length",
        qif=spec.QifWords("Length"),
        shapes=spec.LONG_AND_WIDE,
        association_fault=_oblong_fault,
    ),
    _of_size(
        name="width",
        is_size=True,
        qif=spec.QifWords("Width"),
        shapes=spec.WITH_WIDTH,
        association_fault=_oblong_fault,
    ),
)
