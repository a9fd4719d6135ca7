"""Measured features: fits through ball centres, compensated for the ball as a whole.

The ball's centre is one radius from the surface, along the surface normal. Ball centres of a
sphere, cylinder or bore are therefore on an element with the same centre or axis whose radius
differs by that of the ball, and those of a plane on a shifted one; a cone moves along its normal,
slots, rectangles and the tube of a torus grow on all sides. The parallel curve of an ellipse is no
ellipse: its fit keeps the distance instead. Compensating the element, not every point along its
approach, excludes the error of an oblique approach; the approach only determines the side of the
material.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import assert_never

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.elements import ELEMENTS, FitPrior, distance_derivatives, surface_normals
from ocmm_core.features.measured._fit import fit_shape
from ocmm_core.features.search import unambiguous
from ocmm_core.features.shapes import (
    CRITERIA,
    DIRECTION,
    GEOMETRY_SIZE,
    HALF_ANGLE,
    MINIMUM_POINTS,
    RADIUS,
    Fit,
    NominalFeature,
    Shape,
)
from ocmm_core.geometry import Float
from ocmm_core.measuring import PATH, DeviationRows, MeasuredPoint, Rows

ALONG = 0.1
"""Part of the approach square to a line below which it does not show the side of the material."""

_BESIDE = 0.5
"""The same for the edge of a sheet, square to its face."""

_CORNER_MM = 0.001
"""Error of an edge that is allowed for a ball beyond the side of the sheet."""

SHORTEST_MM = 1.0
"""Closer points give no direction."""


@dataclass(frozen=True, slots=True)
class Compensation:
    """Compensated geometry (12,), derivatives by raw geometry (12, 12) and ball (12,)."""

    geometry: Float
    by_raw: Float
    by_radius: Float


def compensation(
    nominal: NominalFeature, raw: Fit, touches: Touches, normals: Float, sign: float
) -> Compensation:
    """Return the surface element of a fit of ball centres.

    ``normals`` (n, 3): of the element at the ball centres, towards greater distances; ``sign``: 1.0
    for a probe outside the curve of the material, -1.0 inside. FitError if a point was approached
    from the wrong side, or the feature is smaller than the ball.
    """
    geometry = raw.geometry.copy()
    by_raw = np.eye(GEOMETRY_SIZE)
    by_radius = np.zeros(GEOMETRY_SIZE)
    radius, spec = touches.tip_radius, nominal.shape.spec
    if spec.is_curved:
        _check_sides(nominal, touches, sign * np.sum(touches.directions * normals, axis=1))
    match spec.ball:
        case "approach":
            by_radius[0:3] = -touches.directions.mean(axis=0)
        case "normal":
            _check_sides(nominal, touches, touches.directions @ raw.direction)
            by_radius[0:3] = -raw.direction
            by_raw[0:3, 3:6] = -radius * np.eye(3)
        case "beside":
            towards, by_direction = _beside_line(nominal, raw, touches)
            _check_sides(nominal, touches, touches.directions @ towards)
            by_radius[0:3] = -towards
            by_raw[0:3, 3:6] = -radius * by_direction
        case "slanted":
            # The cone of the ball centres is shifted square to its surface, not to its axis.
            by_radius[RADIUS] = -sign / np.cos(raw.half_angle)
            by_raw[RADIUS, HALF_ANGLE] = radius * by_radius[RADIUS] * np.tan(raw.half_angle)
        case "sizes":
            for size in spec.sizes:
                by_radius[size.place] = -sign if size.grows else 0.0
        case "kept":
            pass
        case _:
            assert_never(spec.ball)
    geometry += radius * by_radius
    sizes = [size.whole(geometry) for size in spec.sizes if not size.is_angle]
    if sizes and min(sizes) <= 0.0:
        word = "width" if spec.has_sides else "diameter"
        raise FitError(
            "feature.smaller_than_ball",
            f"{nominal.name} would have a {word} of {min(sizes):.3f} mm after ball compensation.",
            "Check the probe side in the plan and the stylus in use.",
        )
    return Compensation(geometry, by_raw, by_radius)


def _beside_line(nominal: NominalFeature, raw: Fit, touches: Touches) -> tuple[Float, Float]:
    """Return the unit vector (3,) from edge to probe, square to the line, and its derivative."""
    mean = touches.directions.mean(axis=0)
    along = float(mean @ raw.direction)
    beside = mean - along * raw.direction
    length = float(np.linalg.norm(beside))
    if length < ALONG:
        raise FitError(
            "feature.no_side",
            f"The points of {nominal.name} were approached along the line, or from all sides.",
            "Approach a line from one side, square to it.",
        )
    towards = beside / length
    turned = -along * np.eye(3) - np.outer(raw.direction, mean)
    by_direction: Float = (np.eye(3) - np.outer(towards, towards)) @ turned / length
    return towards, by_direction


def _check_sides(nominal: NominalFeature, touches: Touches, approach: Float) -> None:
    """Raise FitError if a point was approached from the wrong side."""
    wrong = np.flatnonzero(~(approach > 0.0))
    if not wrong.size:
        return
    listed = ", ".join(str(touches.numbers[i]) for i in wrong[:5])
    listed += " and more" if wrong.size > 5 else ""
    where = "the other points were taken on the other face"
    if nominal.shape.spec.is_curved:
        where = f"the plan says {nominal.side!r}"
    raise FitError(
        "feature.wrong_side",
        f"Point{'s' if wrong.size > 1 else ''} {listed} of {nominal.name} "
        f"{'were' if wrong.size > 1 else 'was'} approached from the wrong side: {where}.",
        "Flip that point or take it again; a wrong side gives an error of a whole ball diameter.",
    )


SAME_RADIUS = 1e-9
"""mm: tip radii that differ by more belong to different balls."""


@dataclass(frozen=True, slots=True)
class Touches:
    """Touches of one feature: numbers, places in the job, ball centres, sides, one radius."""

    numbers: tuple[int, ...]
    places: tuple[int, ...]
    tips: Float
    directions: Float
    tip_radius: float
    along_path: bool = False
    """Whether some were measured by continuous probing, so that neighbours share their form."""

    @classmethod
    def of(cls, points: Sequence[MeasuredPoint], places: Sequence[int]) -> Touches:
        """Return the touches of one or more points; the radius of different balls is NaN."""
        radii = [point.tip_radius for point in points]
        return cls(
            tuple(point.number for point in points), tuple(places),
            np.array([point.tip_world for point in points], dtype=np.float64),
            np.array([point.direction for point in points], dtype=np.float64),
            float(radii[0]) if max(radii) - min(radii) <= SAME_RADIUS else np.nan,
            any(point.approach == PATH for point in points),
        )  # fmt: skip

    def __add__(self, other: Touches) -> Touches:
        same = abs(self.tip_radius - other.tip_radius) <= SAME_RADIUS
        return Touches(
            self.numbers + other.numbers, self.places + other.places,
            np.concatenate([self.tips, other.tips]),
            np.concatenate([self.directions, other.directions]),
            self.tip_radius if same else np.nan, self.along_path or other.along_path,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class ActualFeature:
    """One feature of the part as measured."""

    nominal: NominalFeature
    fit: Fit
    """Compensated geometry, world frame; its jacobian is by the feature's own points, its residuals
    are those of the ball centres.
    """
    numbers: tuple[int, ...]
    jacobian: Rows
    """(12,): d(geometry) / d(ball centres of the job, tip radius), of the points involved."""
    by_residuals: DeviationRows
    """Derivatives of its residuals by the same."""
    raw: Fit | None = None
    touches: Touches | None = None
    """`raw`, `touches`: Fit of the ball centres before compensation, and the touches. None for a
    constructed feature without own points.
    """


def actual_features(
    nominals: Sequence[NominalFeature],
    points: Sequence[MeasuredPoint],
    places: Sequence[int] | None = None,
) -> dict[str, ActualFeature | FitError]:
    """Return all features by name, or the errors.

    ``places`` are indices of the points in rows of jacobians; None for 0 to N - 1.
    """
    own: dict[str, list[tuple[MeasuredPoint, int]]] = {}
    for touched in zip(points, places or range(len(points)), strict=True):
        own.setdefault(touched[0].feature, []).append(touched)
    touches = {name: Touches.of(*zip(*some, strict=True)) for name, some in own.items()}
    return features_of_touches(nominals, touches)


def features_of_touches(
    nominals: Sequence[NominalFeature], own: Mapping[str, Touches]
) -> dict[str, ActualFeature | FitError]:
    """Return all features by name, or the errors; ``own`` are the touches by feature."""
    found: dict[str, ActualFeature | FitError] = {}
    # Planes first: circles may be projected along their normals.
    for nominal in sorted(nominals, key=lambda item: item.projection != ""):
        try:
            touches = checked_touches(nominal, own.get(nominal.name))
            found[nominal.name] = _actual(nominal, touches, found)
        except FitError as error:
            what = error.what if nominal.name in error.what else f"{nominal.name}: {error.what}"
            found[nominal.name] = FitError(error.code, what, error.remedy)
    return {nominal.name: found[nominal.name] for nominal in nominals}


def _actual(
    nominal: NominalFeature, touches: Touches, found: Mapping[str, ActualFeature | FitError]
) -> ActualFeature:
    if nominal.projection:
        plane = _projection_plane(nominal, found)
        if nominal.shape is Shape.LINE:
            return _edge(nominal, touches, plane)
        raw, by_normal = fit_projected(nominal, touches, plane.fit.direction)
        by_all = Rows.of_points(touches.places, raw.jacobian)
        by_all += by_normal @ plane.jacobian[DIRECTION]
    else:
        raw = fit_touches(nominal, touches)
        by_all = Rows.of_points(touches.places, raw.jacobian)
    return compensated(nominal, touches, unambiguous(raw), by_all)


def _edge(nominal: NominalFeature, touches: Touches, plane: ActualFeature) -> ActualFeature:
    """Return a line on the side of a sheet, seen along the normal of its face; or FitError."""
    normal = plane.fit.direction
    heights = (touches.tips - plane.fit.point) @ normal
    beyond = np.maximum(heights, -nominal.width - heights)
    worst = int(beyond.argmax())
    if beyond[worst] > np.sqrt(2.0 * touches.tip_radius * _CORNER_MM):
        raise FitError(
            "feature.corner",
            f"The ball of point {touches.numbers[worst]} of {nominal.name} touched the corner of "
            f"the edge: its centre was {beyond[worst]:.2f} mm beyond the side of the sheet.",
            "Touch again with the centre of the ball within the thickness of the sheet. If the "
            "sheet is too thin, hold a block against the edge and touch that.",
        )
    away = (touches.tips - touches.tips.mean(axis=0)) @ normal
    flat = flattened(nominal, touches, normal)
    raw = fit_touches(nominal, flat)
    own = raw.jacobian.reshape(GEOMETRY_SIZE, -1, 3)
    along = own @ normal
    by_normal = -np.einsum("kni,n->ki", own, away) - along @ (flat.tips - flat.tips.mean(axis=0))
    own = own + (along.mean(axis=1, keepdims=True) - along)[:, :, None] * normal
    raw = replace(raw, jacobian=own.reshape(GEOMETRY_SIZE, -1))
    by_all = Rows.of_points(touches.places, raw.jacobian) + by_normal @ plane.jacobian[DIRECTION]
    return compensated(nominal, flat, raw, by_all)


def flattened(nominal: NominalFeature, touches: Touches, normal: Float) -> Touches:
    """Return touches at their mean height along a normal, with approaches square to it.

    FitError if one came from above rather than from the side, or all are at one place.
    """
    away = touches.tips - touches.tips.mean(axis=0)
    tips = touches.tips - np.outer(away @ normal, normal)
    beside = touches.directions - np.outer(touches.directions @ normal, normal)
    lengths = np.linalg.norm(beside, axis=1)
    if lengths.min() < _BESIDE:
        number = touches.numbers[int(lengths.argmin())]
        raise FitError(
            "feature.no_side",
            f"Point {number} of {nominal.name} was approached from above, not from the side.",
            "Approach the edge along the sheet, square to the edge.",
        )
    longest = float(np.linalg.norm(tips - tips[0], axis=1).max())
    if longest < SHORTEST_MM:
        raise FitError(
            "feature.one_place",
            f"The points of {nominal.name} lie {longest:.2f} mm from each other along the edge.",
            "Take them further apart, 10 mm or more.",
        )
    return replace(touches, tips=tips, directions=beside / lengths[:, None])


def compensated(nominal: NominalFeature, touches: Touches, raw: Fit, by_all: Rows) -> ActualFeature:
    """Return the feature of a fit of ball centres; FitError as `compensation`.

    ``raw`` has the jacobian by its own points, ``by_all`` (12,) by all centres and tip radius.
    """
    sign, kept = sign_of(nominal), nominal.shape.spec.ball == "kept"
    by_geometry, normals = distance_derivatives(raw, touches.tips)
    if kept:
        # Its fit already includes the ball: a larger one is like points further inside.
        own = raw.jacobian.reshape(GEOMETRY_SIZE, -1, 3)
        by_all = by_all.with_radius(-sign * np.einsum("kna,na->k", own, normals))
    alone = DeviationRows.of_own(touches.places, normals, -sign if kept else 0.0)
    slopes = alone.with_shared(by_geometry, by_all)

    change = compensation(nominal, raw, touches, surface_normals(raw, touches.tips), sign)
    jacobian = (change.by_raw @ by_all).with_radius(change.by_radius)
    fit = replace(raw, geometry=change.geometry, jacobian=change.by_raw @ raw.jacobian)
    return ActualFeature(nominal, fit, touches.numbers, jacobian, slopes, raw, touches)


def sign_of(nominal: NominalFeature) -> float:
    return 1.0 if nominal.side == "outer" else -1.0


def fit_touches(nominal: NominalFeature, touches: Touches) -> Fit:
    """Return the fit of the ball centres; for shapes that keep the ball, of the surface."""
    offset, spec = sign_of(nominal) * touches.tip_radius, nominal.shape.spec
    half_length = 0.5 * (nominal.length if spec.has_across else nominal.diameter)
    return fit_shape(
        nominal.shape,
        touches.tips,
        # A plane faces away from the material, towards the probe.
        direction_hint=touches.directions.mean(axis=0) if nominal.shape is Shape.PLANE else None,
        radius_hint=half_length + offset,
        second_hint=0.5 * nominal.width + offset,
        half_angle_hint=np.radians(0.5 * nominal.angle_deg) if nominal.angle_deg else None,
        criterion=CRITERIA[nominal.criterion],
        free=nominal.free,
        offset=offset if spec.ball == "kept" else 0.0,
    )


def fit_projected(
    nominal: NominalFeature, touches: Touches, plane_normal: Float
) -> tuple[Fit, Float]:
    """Return the outline in a plane of given normal, and d(outline)/d(normal), (12, 3).

    FitError if the criterion is not least squares, or the points do not determine an outline.
    """
    offset = sign_of(nominal) * touches.tip_radius
    if nominal.criterion != "least squares":
        raise FitError(
            "feature.projected_criterion",
            f"{nominal.name} is projected onto {nominal.projection} and asks for the criterion "
            f"{nominal.criterion!r}, which needs unprojected points.",
            "Choose least squares, or remove the projection.",
        )
    projected = ELEMENTS[nominal.shape].projected
    if projected is None:
        # Plans that request it are refused (`shapes.shape_fault`).
        raise TypeError(nominal.shape)
    known = FitPrior(
        radius=0.5 * nominal.length + offset, second=0.5 * nominal.width + offset, offset=offset
    )
    return projected(touches.tips, plane_normal, known)


def checked_touches(nominal: NominalFeature, touches: Touches | None) -> Touches:
    """Return the touches of a feature; FitError for too few, or with different balls."""
    minimum, taken = MINIMUM_POINTS[nominal.shape], len(touches.numbers) if touches else 0
    if touches is None or taken < minimum:
        what = f"{nominal.name} needs at least {minimum} points ({taken} taken)."
        if minimum == 1:
            what = f"{nominal.name} has no points."
        raise FitError("feature.too_few_points", what, "Take the missing points.")
    if np.isnan(touches.tip_radius):
        raise FitError(
            "feature.mixed_tips",
            f"The points of {nominal.name} were taken with balls of different diameters.",
            "Take all points of one feature with one stylus.",
        )
    # A ball larger by the thickness would touch the other side of the sheet.
    return replace(touches, tip_radius=touches.tip_radius + nominal.sheet)


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
