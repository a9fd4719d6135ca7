"""Measured features: fits through ball centres, compensated for the ball as a whole.

Every touch leaves the ball's centre one radius away from the surface, along the surface's own
normal there. The ball centres of a sphere, cylinder or bore therefore lie on an element with the
same centre or axis whose radius differs by that of the ball, and those of a plane on one shifted by
it; a cone moves along its own normal, slots, rectangles and the tube of a torus grow on all sides.
What lies one radius off an ellipse is no ellipse: its fit keeps the distance instead. Compensating
the element, not every point along its approach, keeps the error of a slanting
approach out of the result; the approach only says on which side the material is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.elements import ELEMENTS, Known, distance_derivatives, surface_normals
from ocmm_core.features.measured._ball_off import compensation
from ocmm_core.features.measured._fit import fit_shape
from ocmm_core.features.search import unambiguous
from ocmm_core.features.shapes import (
    CRITERIA,
    DIRECTION,
    GEOMETRY_SIZE,
    MINIMUM_POINTS,
    Fit,
    NominalFeature,
    Shape,
)
from ocmm_core.geometry import Float
from ocmm_core.measuring import MeasuredPoint

SAME_RADIUS = 1e-9
"""mm: tip radii that differ by more belong to different balls."""


@dataclass(frozen=True, slots=True)
class Touches:
    """The touches of one feature: numbers, places in the job, ball centres, sides, one radius."""

    numbers: tuple[int, ...]
    places: tuple[int, ...]
    tips: Float
    directions: Float
    tip_radius: float


@dataclass(frozen=True, slots=True)
class ActualFeature:
    """One feature of the part as measured.

    Attributes
    ----------
    nominal
        What the plan says about it.
    fit
        Compensated geometry, world frame; its jacobian is by the feature's own points, its
        residuals are those of the ball centres.
    numbers
        Of the points that it rests on.
    jacobian
        (12, 3 N + 1): d(geometry) / d(ball centres of all N points of the job, tip radius).
    residual_jacobian
        (n, 3 N + 1): d(residuals) / d(the same).
    raw, touches
        The fit of the ball centres before the ball was taken off, and these touches. None for a
        feature that is constructed from others and has no points of its own.
    """

    nominal: NominalFeature
    fit: Fit
    numbers: tuple[int, ...]
    jacobian: Float
    residual_jacobian: Float
    raw: Fit | None = None
    touches: Touches | None = None


def actual_features(
    nominals: Sequence[NominalFeature], points: Sequence[MeasuredPoint]
) -> dict[str, ActualFeature | FitError]:
    """Return every feature by its name, or why there is none.

    Parameters
    ----------
    nominals
        Features of the plan.
    points
        All N points of the job; their order is that of the columns of the jacobians.
    """
    found: dict[str, ActualFeature | FitError] = {}
    # Planes come first: circles may be projected along their normals.
    for nominal in sorted(nominals, key=lambda item: item.projection != ""):
        try:
            found[nominal.name] = _actual(nominal, points, found)
        except FitError as error:
            what = error.what if nominal.name in error.what else f"{nominal.name}: {error.what}"
            found[nominal.name] = FitError(error.code, what, error.remedy)
    return {nominal.name: found[nominal.name] for nominal in nominals}


def _actual(
    nominal: NominalFeature,
    points: Sequence[MeasuredPoint],
    found: Mapping[str, ActualFeature | FitError],
) -> ActualFeature:
    touches = _touches(nominal, points)
    coordinates = 3 * len(points) + 1
    if nominal.projection:
        plane = _projection_plane(nominal, found)
        raw, by_normal = fit_projected(nominal, touches, plane.fit.direction)
        by_all = spread_over(raw.jacobian, touches.places, coordinates)
        by_all += by_normal @ plane.jacobian[DIRECTION]
    else:
        raw = _fit(nominal, touches)
        by_all = spread_over(raw.jacobian, touches.places, coordinates)
    return compensated(nominal, touches, raw, by_all)


def compensated(
    nominal: NominalFeature, touches: Touches, raw: Fit, by_all: Float
) -> ActualFeature:
    """Return the feature of a fit of ball centres.

    Parameters
    ----------
    raw
        The fit; its jacobian is by the feature's own points.
    by_all
        (12, 3 N + 1): d(its geometry) / d(ball centres of all points, tip radius).

    Raises
    ------
    FitError
        A point was approached from the wrong side, or the feature is smaller than the ball.
    """
    sign = _sign(nominal)
    by_geometry, normals = distance_derivatives(raw, touches.tips)
    kept = nominal.shape.spec.ball == "kept"
    if kept:
        # Its fit holds the ball already: a greater one is like points that lie further inside.
        own = raw.jacobian.reshape(GEOMETRY_SIZE, -1, 3)
        by_all = by_all.copy()
        by_all[:, -1] -= sign * np.einsum("kna,na->k", own, normals)
    by_residual = by_geometry @ by_all
    if kept:
        by_residual[:, -1] -= sign
    for row, place in enumerate(touches.places):
        by_residual[row, 3 * place : 3 * place + 3] += normals[row]

    change = compensation(nominal, raw, touches, surface_normals(raw, touches.tips), sign)
    jacobian = change.by_raw @ by_all
    jacobian[:, -1] += change.by_radius
    fit = replace(raw, geometry=change.geometry, jacobian=change.by_raw @ raw.jacobian)
    return ActualFeature(nominal, fit, touches.numbers, jacobian, by_residual, raw, touches)


def _sign(nominal: NominalFeature) -> float:
    return 1.0 if nominal.side == "outer" else -1.0


def _fit(nominal: NominalFeature, touches: Touches) -> Fit:
    """Return the fit of the ball centres, of a shape that keeps the ball that of the surface.

    Raises
    ------
    FitError
        The points do not determine one element; between rivals the sizes of the plan may decide.
    """
    offset = _sign(nominal) * touches.tip_radius
    spec = nominal.shape.spec
    half_length = 0.5 * (nominal.length if spec.has_across else nominal.diameter)
    fit = fit_shape(
        nominal.shape,
        touches.tips,
        direction_hint=_sense(nominal, touches),
        radius_hint=half_length + offset,
        second_hint=0.5 * nominal.width + offset,
        half_angle_hint=np.radians(0.5 * nominal.angle_deg) if nominal.angle_deg else None,
        criterion=CRITERIA[nominal.criterion],
        free=nominal.free,
        offset=offset if spec.ball == "kept" else 0.0,
    )
    return unambiguous(fit)


def fit_projected(
    nominal: NominalFeature, touches: Touches, plane_normal: Float
) -> tuple[Fit, Float]:
    """Return the outline in a plane of given normal, and its derivatives (12, 3) by the normal.

    Raises
    ------
    FitError
        The criterion is not least squares, or the points do not determine one outline.
    """
    offset = _sign(nominal) * touches.tip_radius
    if nominal.criterion != "least squares":
        raise FitError(
            "feature.projected_criterion",
            f"{nominal.name} is projected onto {nominal.projection} and asks for the criterion "
            f"{nominal.criterion!r}, which needs unprojected points.",
            "Choose least squares, or remove the projection.",
        )
    projected = ELEMENTS[nominal.shape].projected
    if projected is None:
        # A plan that asks for it is refused (`shapes.shape_fault`).
        raise TypeError(nominal.shape)
    known = Known(
        radius=0.5 * nominal.length + offset, second=0.5 * nominal.width + offset, offset=offset
    )
    fit, by_normal = projected(touches.tips, plane_normal, known)
    return unambiguous(fit), by_normal


def _touches(nominal: NominalFeature, points: Sequence[MeasuredPoint]) -> Touches:
    places = [i for i, point in enumerate(points) if point.feature == nominal.name]
    own = [points[i] for i in places]
    minimum = MINIMUM_POINTS[nominal.shape]
    if len(own) < minimum:
        raise FitError(
            "feature.too_few_points",
            f"{nominal.name} has {len(own)} of at least {minimum} points.",
            "Take the missing points.",
        )
    radii = np.array([point.tip_radius for point in own])
    if np.ptp(radii) > SAME_RADIUS:
        raise FitError(
            "feature.mixed_tips",
            f"The points of {nominal.name} were taken with balls of different diameters.",
            "Take all points of one feature with one stylus.",
        )
    return Touches(
        numbers=tuple(point.number for point in own),
        places=tuple(places),
        tips=np.array([point.tip_world for point in own], dtype=np.float64),
        directions=np.array([point.direction for point in own], dtype=np.float64),
        tip_radius=float(radii[0]),
    )


def _sense(nominal: NominalFeature, touches: Touches) -> Float | None:
    """Return where the normal of a plane points to: away from the material, as the probe came."""
    return touches.directions.mean(axis=0) if nominal.shape is Shape.PLANE else None


def _projection_plane(
    nominal: NominalFeature, found: Mapping[str, ActualFeature | FitError]
) -> ActualFeature:
    plane = found.get(nominal.projection)
    if isinstance(plane, ActualFeature) and plane.fit.shape is Shape.PLANE:
        return plane
    raise FitError(
        "feature.no_projection_plane",
        f"{nominal.name} is projected onto {nominal.projection}, which is not measured yet.",
        f"Measure the plane {nominal.projection}.",
    )


def spread_over(by_own: Float, places: Sequence[int], coordinates: int) -> Float:
    """Return ``by_own`` (k, 3 n) with its columns at their places among all coordinates."""
    columns = (3 * np.asarray(places)[:, None] + np.arange(3)).ravel()
    spread = np.zeros((len(by_own), coordinates))
    spread[:, columns] = by_own
    return spread
