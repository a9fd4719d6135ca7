"""Constructed features: geometry, with derivatives by all points of the job.

The geometry of a construction is a function of the geometry of its features. Its derivatives are
chained with theirs by the points, so that shared points count once.

Fits go through the centres or through the touched points of several features.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.errors import FitError
from ocmm_core.features.elements import distance_derivatives, fit_circle_projected, surface_normals
from ocmm_core.features.measured import _construct_geometry as geometry_of
from ocmm_core.features.measured._actual import ActualFeature
from ocmm_core.features.measured._construct import (
    CENTRED,
    Bisector,
    BoltCircle,
    ConeSection,
    Construction,
    FitThrough,
    HiddenPoint,
    Intersection,
    Midpoint,
    Offset,
    PartOf,
    Projection,
    Symmetry,
    TappedHole,
    in_order,
    needed_features,
    shapes_with,
)
from ocmm_core.features.measured._fit import fit_shape
from ocmm_core.features.search import unambiguous
from ocmm_core.features.shapes import (
    DIRECTION,
    GEOMETRY_SIZE,
    MINIMUM_POINTS,
    POINT,
    RADIUS,
    SECOND,
    Fit,
    NominalFeature,
    Shape,
    element,
    nominal_geometry,
    nominal_of,
)
from ocmm_core.geometry import Float, Points3, unit
from ocmm_core.measuring import DeviationRows, Rows

_SHOWS = 0.05
"""Relative size of the ordered triangle needed to define the sense."""


@dataclass(frozen=True, slots=True)
class Through:
    """An element through points that themselves depend on the points of the job."""

    fit: Fit
    jacobian: Rows
    """(12,): d(geometry) / d(ball centres, tip radius)."""
    by_residuals: DeviationRows
    """n deviations: d(residuals) / d(the same)."""


def fit_through_centres(shape: Shape, centres: Points3) -> Fit:
    """Return the least-squares element through points (n, 3), mm.

    A line points from the first point to the last; a plane or circle faces the side on which the
    ordered points run anticlockwise. The sense then agrees with the nominals for any pose of the
    part.
    """
    return unambiguous(fit_shape(shape, centres, direction_hint=_sense(shape, centres)))


def fit_through_points(
    shape: Shape,
    features: Sequence[ActualFeature],
    plane: ActualFeature | None = None,
    within: float = 0.0,
) -> Through:
    """Return the least-squares element through the touched points of probed features.

    Each ball centre is compensated along the normal of its own feature. The uncertainty of this
    normal moves the point tangentially only, without first-order effect if the features are parts
    of the element. With ``plane`` only points up to ``within``, mm, from it count, and a circle
    lies in it. FitError if a feature has no normal, or the points do not determine the element.
    """
    surface, faces = [], []
    places: list[int] = []
    for feature in features:
        touches, raw = feature.touches, feature.raw
        if touches is None or raw is None or not raw.shape.spec.has_normals:
            raise FitError(
                "construction.no_normals",
                f"{feature.nominal.name} does not define the surface normal at its points.",
                "Take the best fit through centres, or through features that are surfaces.",
            )
        normals = surface_normals(raw, touches.tips)
        approach = np.sum(touches.directions * normals, axis=1, keepdims=True)
        outward = np.where(approach < 0.0, -normals, normals)
        surface.append(touches.tips - touches.tip_radius * outward)
        faces.append(outward)
        places += touches.places
    points, outward = np.vstack(surface), np.vstack(faces)
    hint = next((f.fit.direction for f in features if f.fit.shape is shape), None)
    if plane is not None:
        near = np.abs((points - plane.fit.point) @ plane.fit.direction) <= within
        points, outward = points[near], outward[near]
        places = np.array(places, dtype=np.int64)[near].tolist()
    if plane is not None and shape is Shape.CIRCLE and len(points) >= MINIMUM_POINTS[shape]:
        fit = unambiguous(fit_circle_projected(points, plane.fit.direction)[0])
    else:
        fit = unambiguous(fit_shape(shape, points, direction_hint=hint))
    # A point moves like its ball centre, less the ball along its face.
    jacobian = Rows.of_points(places, fit.jacobian).with_radius(-fit.jacobian @ outward.ravel())
    by_geometry, normals = distance_derivatives(fit, points)
    own = DeviationRows.of_own(places, normals, -np.sum(normals * outward, axis=1))
    return Through(fit, jacobian, own.with_shared(by_geometry, jacobian))


def _sense(shape: Shape, centres: Points3) -> Float | None:
    if shape is Shape.LINE:
        along: Float = centres[-1] - centres[0]
        return along if float(np.linalg.norm(along)) > 0.0 else None
    if shape not in (Shape.PLANE, Shape.CIRCLE):
        return None
    # The area in the order of the points; if it cancels, the first sufficiently large triangle.
    arms = centres - centres[0]
    areas = np.cross(arms[:, None], arms[None, :])
    area: Float = areas[np.arange(len(arms) - 1), np.arange(1, len(arms))].sum(axis=0)
    largest = float(np.linalg.norm(areas, axis=2).max())
    if float(np.linalg.norm(area)) > _SHOWS * largest > 0.0:
        return area
    shows = np.argwhere(np.triu(np.linalg.norm(areas, axis=2)) > 0.5 * largest)
    if not len(shows):
        return None
    triangle: Float = areas[shows[0, 0], shows[0, 1]]
    return triangle


_STEPS = np.full(GEOMETRY_SIZE, 1e-5)
_STEPS[[0, 1, 2, RADIUS, SECOND]] = 1e-3
"""Steps of the central differences, mm, and for directions and angles rad.

Relative to a common middle, coordinates are at most some metres: rounding stays below 1e-8, and the
third derivatives, at most 57 for the permitted angles, below 1e-7.
"""


def constructed_features(
    constructions: Sequence[Construction],
    actual: Mapping[str, ActualFeature | FitError],
    nominals: Mapping[str, Float],
) -> dict[str, ActualFeature | FitError]:
    """Return all constructed features by name, or the errors.

    The constructions are those of a checked plan, in any order; ``nominals`` are geometry vectors
    (12,) of probed and constructed features, part frame, by name (`nominal_geometries`).
    """
    known = dict(actual)
    found: dict[str, ActualFeature | FitError] = {}
    for item in in_order(constructions):
        try:
            found[item.name] = _constructed(item, known, nominals.get(item.name))
        except FitError as error:
            what = error.what if error.what.startswith(item.name) else f"{item.name}: {error.what}"
            found[item.name] = FitError(error.code, what, error.remedy)
        known[item.name] = found[item.name]
    return {item.name: found[item.name] for item in constructions}


def nominal_geometries(
    features: Sequence[NominalFeature], constructions: Sequence[Construction]
) -> dict[str, Float]:
    """Return nominal geometry vectors (12,), part frame, by name, without undetermined ones."""
    geometries = {item.name: nominal_geometry(item) for item in features}
    shapes = shapes_with({item.name: item.shape for item in features}, constructions)
    for item in in_order(constructions):
        names = needed_features(item)
        if any(name not in geometries for name in names):
            continue
        inputs = [geometries[name] for name in names]
        try:
            if isinstance(item, FitThrough) and item.through == "points":
                # Touched places are not nominal; one feature of the shape determines the sense.
                same = [
                    g
                    for name, g in geometries.items()
                    if name in item.features and shapes[name] is item.shape
                ]
                if same:
                    geometries[item.name] = same[0]
            elif isinstance(item, (FitThrough, BoltCircle)):
                centres = np.array([geometry[POINT] for geometry in inputs])
                geometries[item.name] = fit_through_centres(shapes[item.name], centres).geometry
            else:
                geometries[item.name] = construct(item, [shapes[name] for name in names], inputs)
        except FitError:
            continue
    return geometries


def construct(
    construction: Construction, shapes: Sequence[Shape], geometries: Sequence[Float]
) -> Float:
    """Return the geometry vector (12,) of a construction in closed form.

    ``shapes`` and ``geometries`` (12,), mm, one frame, are in the order of `needed_features`.
    FitError if they do not determine it.
    """
    first, second = geometries[0], geometries[min(1, len(geometries) - 1)]
    match construction:
        case Intersection() | TappedHole():
            return _intersection(shapes, geometries)
        case Projection():
            return _projection(shapes, first, second)
        case Midpoint():
            return geometry_of.middle(first, second)
        case Bisector():
            between = construction.which == "between"
            plane = shapes[0] is Shape.PLANE
            halving = geometry_of.halving_plane if plane else geometry_of.halving_line
            return halving(first, second, between=between)
        case Symmetry():
            if shapes[0] is Shape.PLANE:
                return geometry_of.halving_plane(first, second, between=True)
            pairs = list(zip(geometries[::2], geometries[1::2], strict=True))
            return geometry_of.mirror_plane(pairs)
        case Offset():
            if len(construction.features) == 2:
                towards = None
                if construction.towards:
                    place = needed_features(construction).index(construction.towards)
                    towards = geometries[place]
                return geometry_of.shifted(first, second, construction.distance, towards)
            if shapes[0] is Shape.PLANE:
                return geometry_of.shifted(first, first, construction.distance, None)
            return geometry_of.grown(first, construction.distance)
        case ConeSection():
            if len(construction.features) == 1:
                return geometry_of.gauge_circle(first, construction.diameter)
            return geometry_of.cone_at(first, second, construction.distance)
        case HiddenPoint():
            return geometry_of.beyond(first, second, construction.distance)
        case PartOf():
            if construction.part == "all":
                return first.copy()
            along = unit(first[DIRECTION]) if construction.part == "axis" else np.zeros(3)
            return element(first[POINT], along)
        case FitThrough() | BoltCircle():
            raise TypeError(construction)


def slopes(
    construction: Construction,
    shapes: Sequence[Shape],
    geometries: Sequence[Float],
    moving: NDArray[np.bool_],
) -> Float:
    """Return d(`construct`) / d(geometries), (12, 12 k), by central differences.

    ``moving`` (12 k,) marks numbers that depend on points; the others stay zero.
    """
    # Coordinates relative to their middle, to limit rounding.
    inputs = np.array(geometries)
    inputs[:, POINT] -= inputs[:, POINT].mean(axis=0)
    by_inputs = np.zeros((GEOMETRY_SIZE, inputs.size))
    for column in np.flatnonzero(moving):
        step = _STEPS[column % GEOMETRY_SIZE]
        ends = []
        for sign in (1.0, -1.0):
            moved = inputs.copy()
            moved.flat[column] += sign * step
            ends.append(construct(construction, shapes, list(moved)))
        by_inputs[:, column] = (ends[0] - ends[1]) / (2.0 * step)
    return by_inputs


def _constructed(
    item: Construction, known: Mapping[str, ActualFeature | FitError], nominal: Float | None
) -> ActualFeature:
    inputs: list[ActualFeature] = []
    for name in needed_features(item):
        feature = known[name]
        if isinstance(feature, FitError):
            raise FitError(
                "construction.not_measured",
                f"{item.name} needs {name}. {feature.what}",
                feature.remedy,
            )
        inputs.append(feature)
    numbers = tuple(sorted({number for feature in inputs for number in feature.numbers}))
    if isinstance(item, (FitThrough, BoltCircle)):
        through = _through(item, inputs)
        return ActualFeature(
            nominal=nominal_of(
                item.name,
                through.fit.shape,
                through.fit.geometry if nominal is None else nominal,
                side=inputs[0].nominal.side,
            ),
            fit=through.fit,
            numbers=numbers,
            jacobian=through.jacobian,
            by_residuals=through.by_residuals,
        )
    if isinstance(item, TappedHole):
        geometry_of.refuse_gauge(*inputs)
    shapes = [feature.fit.shape for feature in inputs]
    geometries = [feature.fit.geometry for feature in inputs]
    names = needed_features(item)
    shape = shapes_with(dict(zip(names, shapes, strict=True)), [item])[item.name]
    geometry = construct(item, shapes, geometries)
    moves = Rows.stacked([feature.jacobian for feature in inputs])
    jacobian = slopes(item, shapes, geometries, moves.moving()) @ moves
    nothing = np.zeros((GEOMETRY_SIZE, 0))
    fit = Fit(shape, geometry, nothing, np.zeros(0), 0.0, 0.0)
    return ActualFeature(
        nominal=nominal_of(
            item.name, shape, geometry if nominal is None else nominal, side=inputs[0].nominal.side
        ),
        fit=fit,
        numbers=numbers,
        jacobian=jacobian,
        by_residuals=DeviationRows.of_rows(Rows.nothing(0)),
    )


def _through(item: FitThrough | BoltCircle, inputs: Sequence[ActualFeature]) -> Through:
    if isinstance(item, FitThrough) and item.through == "points":
        cut = inputs[-1] if item.plane else None
        return fit_through_points(item.shape, inputs[: len(item.features)], cut, item.within)
    shape = item.shape if isinstance(item, FitThrough) else Shape.CIRCLE
    centres = np.array([feature.fit.point for feature in inputs])
    moves = Rows.stacked([feature.jacobian[POINT] for feature in inputs])
    fit = fit_through_centres(shape, centres)
    jacobian = fit.jacobian @ moves
    by_geometry, normals = distance_derivatives(fit, centres)
    own = moves.reshaped(len(centres), 3).along(normals)
    return Through(fit, jacobian, DeviationRows.of_rows(by_geometry @ jacobian + own))


def _intersection(shapes: Sequence[Shape], geometries: Sequence[Float]) -> Float:
    if len(shapes) == 3:
        return geometry_of.point_of_planes(*geometries)
    first, second = geometries
    match [shape is Shape.PLANE for shape in shapes]:
        case [True, True]:
            return geometry_of.line_of_planes(first, second)
        case [True, False]:
            return geometry_of.point_on_plane(second, first)
        case [False, True]:
            return geometry_of.point_on_plane(first, second)
        case _:
            return geometry_of.point_of_lines(first, second)


def _projection(shapes: Sequence[Shape], what: Float, onto: Float) -> Float:
    if shapes[1] is not Shape.PLANE:
        return geometry_of.dropped_on_axis(what, onto)
    if shapes[0] is Shape.CIRCLE:
        return geometry_of.circle_in_plane(what, onto)
    if shapes[0] in CENTRED:
        return geometry_of.dropped_on_plane(what, onto)
    return geometry_of.line_in_plane(what, onto)
