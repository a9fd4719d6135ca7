"""Local sizes between two opposite points (ISO 14405-1, LP), by their rank.

Two points not exactly opposite would give a chord or an oblique line. Instead, their deviations
from the element are added to its size, which for opposite points is their distance.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from ocmm_core.errors import FitError
from ocmm_core.features.elements import distance_derivatives
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import DIRECTION, GEOMETRY_SIZE, POINT, RADIUS, SECOND, Shape
from ocmm_core.geometry import Float, Int, unit
from ocmm_core.measuring import Rows
from ocmm_core.tolerances.zones._characteristic import Association
from ocmm_core.tolerances.zones._surface import own_fit, surface_points
from ocmm_core.tolerances.zones._zone_frame import moved_geometry

_OPPOSITE_DEG = 20.0
"""Largest departure from opposite of a two-point size."""
_LEVEL_MM = 3.0
"""The same for their heights on a cylinder, and for their places along two sides."""
_FLANK = 0.999
"""Least cosine between the normal at a point and the transverse direction for a point on a side."""
_FACING = -0.9
"""Cosine between the normals of two faces above which they have no size between them."""
_CONTENDERS = 50
"""Sizes that noise may make extreme; the others are far away."""
_STEP = 1e-5
"""mm, and of directions a fraction of one: step of the differences."""


def around(feature: ActualFeature, association: Association) -> tuple[Float, Rows]:
    """Return half two-point sizes of circle, sphere, cylinder, with gradients, by rank.

    Most extreme first (`_contenders`). FitError: constructed, or no two points opposite.
    """
    touches, raw = own_fit(feature)
    arms = touches.tips - raw.point
    heights = np.zeros(len(arms))
    if raw.shape is Shape.CYLINDER:
        heights = arms @ raw.direction
    if raw.shape is not Shape.SPHERE:
        arms = arms - np.outer(arms @ raw.direction, raw.direction)
    directions = arms / np.linalg.norm(arms, axis=1)[:, None]
    opposite = directions @ directions.T < -np.cos(np.deg2rad(_OPPOSITE_DEG))
    level = np.abs(heights[:, None] - heights) < _LEVEL_MM
    first, second = _pairs(np.triu(opposite & level), [feature], "at one height")
    sums, by_pair = _sums(feature, first, second, association)
    by_radius = feature.jacobian[RADIUS].outer(np.ones(len(sums)))
    return feature.fit.radius + 0.5 * sums, by_radius + 0.5 * by_pair


def _sums(
    feature: ActualFeature, first: Int, second: Int, association: Association
) -> tuple[Float, Rows]:
    """Return the sums of two residuals each that matter for a rank, or their mean, with rows."""
    slopes, raw = feature.by_residuals, own_fit(feature)[1]
    sums = raw.residuals[first] + raw.residuals[second]
    groups, count = _contenders(sums, association), len(slopes)
    weights = _weights(first, groups, count) + _weights(second, groups, count)
    return _means(sums, groups), weights @ slopes


def across_slot(
    feature: ActualFeature, association: Association, *, lengthwise: bool
) -> tuple[Float, Rows]:
    """Return the two-point sizes across the sides of a slot or rectangle, with gradients.

    `lengthwise`: between straight ends instead. FitError: constructed, or no two opposite.
    """
    touches, raw = own_fit(feature)
    beside = np.cross(raw.direction, raw.across)
    way, along = (raw.across, beside) if lengthwise else (beside, raw.across)
    place = RADIUS if lengthwise else SECOND
    arms = touches.tips - raw.point
    plus, minus = _flanks(feature, way)
    near = np.ones((len(arms), len(arms)), dtype=bool)
    for direction in (along, raw.direction):
        places = arms @ direction
        near &= np.abs(places[:, None] - places) < _LEVEL_MM
    first, second = _pairs(np.outer(plus, minus) & near, [feature], "face to face")
    sums, by_pair = _sums(feature, first, second, association)
    whole = 2.0 * float(feature.fit.geometry[place])
    return whole + sums, feature.jacobian[place].outer(np.full(len(sums), 2.0)) + by_pair


def slot_envelope(feature: ActualFeature, *, widest: bool) -> tuple[float, Rows]:
    """Return the width between two planes along the sides of a slot, with gradient, mm.

    They are parallel to the slot: the widest pair encloses all points of the sides, the other has
    none between. Points need not be opposite. FitError: constructed, or a side has no point.
    """
    _, raw = own_fit(feature)
    size, gradient = 2.0 * float(feature.fit.geometry[SECOND]), 2.0 * feature.jacobian[SECOND]
    for flank in _flanks(feature, np.cross(raw.direction, raw.across)):
        rows = np.flatnonzero(flank)
        if not rows.size:
            raise FitError(
                "characteristic.no_side",
                f"{feature.nominal.name} has no point on one of its sides.",
                "Take points on both sides.",
            )
        off = raw.residuals[rows]
        foremost = int(rows[off.argmax() if widest else off.argmin()])
        size += float(raw.residuals[foremost])
        gradient += feature.by_residuals[[foremost]].rows[0]
    return size, gradient


def _flanks(feature: ActualFeature, way: Float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return masks of the points on the side in a direction (3,), and on the opposite side."""
    touches, raw = own_fit(feature)
    sides = distance_derivatives(raw, touches.tips)[1] @ way
    # Round ends have no side, except at their start, which still belongs to the side.
    return sides > _FLANK, sides < -_FLANK


def between_faces(
    one: ActualFeature, other: ActualFeature, association: Association
) -> tuple[Float, Rows]:
    """Return the two-point sizes between two opposite faces, and their gradients.

    They are square to the middle plane of the two faces. FitError: a face is constructed, they do
    not face away from each other or towards each other, or no two points are opposite.
    """
    if float(one.fit.direction @ other.fit.direction) > _FACING:
        raise FitError(
            "characteristic.not_opposite",
            f"{one.nominal.name} and {other.nominal.name} are not opposite to each other; there "
            "is no two-point size between them.",
            "Name two opposite faces, or omit the association.",
        )
    across = _across(one.fit.geometry, other.fit.geometry)
    square = np.eye(3) - np.outer(across, across)
    sites = [surface_points(face).points @ square for face in (one, other)]
    level = scipy.spatial.distance.cdist(sites[0], sites[1]) < _LEVEL_MM
    first, second = _pairs(level, [one, other], "face to face")
    middles = 0.5 * (sites[0][first] + sites[1][second])
    residuals = [own_fit(face)[1].residuals for face in (one, other)]
    lean = [float(face.fit.direction @ across) for face in (one, other)]
    gaps = gaps_between(one.fit.geometry, other.fit.geometry, middles)
    gaps = gaps + residuals[0][first] / lean[0] - residuals[1][second] / lean[1]
    sign = 1.0 if float(gaps.mean()) > 0.0 else -1.0
    groups = _contenders(sign * gaps, association)

    geometries = {"one": one.fit.geometry, "other": other.fit.geometry}
    # A mean of gaps is the gap at the mean place.
    places, gradients = _means(middles, groups), Rows.nothing(len(groups))
    for key, face in (("one", one), ("other", other)):
        slopes = np.zeros((len(groups), GEOMETRY_SIZE))
        for k in np.flatnonzero(face.jacobian.moving()).tolist():
            ends = []
            for step in (_STEP, -_STEP):
                moved = moved_geometry(geometries, key, k, step)
                ends.append(gaps_between(moved["one"], moved["other"], places))
            slopes[:, k] = (ends[0] - ends[1]) / (2.0 * _STEP)
        gradients += slopes @ face.jacobian
    gradients += _weights(first, groups, len(one.by_residuals)) @ one.by_residuals / lean[0]
    gradients -= _weights(second, groups, len(other.by_residuals)) @ other.by_residuals / lean[1]
    return sign * _means(gaps, groups), sign * gradients


def _across(one: Float, other: Float) -> Float:
    return unit(one[DIRECTION] - other[DIRECTION])


def gaps_between(one: Float, other: Float, sites: Float) -> Float:
    """Return the gaps between two planes, square to their middle, at sites (m, 3)."""
    across = _across(one, other)
    heights = [
        (plane[POINT] - sites) @ plane[DIRECTION] / float(plane[DIRECTION] @ across)
        for plane in (one, other)
    ]
    return heights[0] - heights[1]


def _pairs(opposite: NDArray[np.bool_], features: list[ActualFeature], how: str) -> tuple[Int, Int]:
    first, second = np.nonzero(opposite)
    if not first.size:
        names = " and ".join(feature.nominal.name for feature in features)
        raise FitError(
            "characteristic.no_pairs",
            f"No two points of {names} are opposite to each other.",
            f"Take points in opposite pairs, {how}.",
        )
    return first, second


def _contenders(sums: Float, association: Association) -> list[Int]:
    """Return the pairs of each size relevant for a rank, most extreme first; all for the mean."""
    if association == "two-point mean":
        return [np.arange(len(sums))]
    ahead = -sums if association == "two-point maximum" else sums
    order = np.argsort(ahead, kind="stable")[:_CONTENDERS]
    return np.split(order, len(order))


def _means(values: Float, groups: list[Int]) -> Float:
    return np.array([values[group].mean(axis=0) for group in groups])


def _weights(places: Int, groups: list[Int], count: int) -> Float:
    """Return the weights (k, n) of residuals in the means over k groups of pairs."""
    return np.array([np.bincount(places[group], minlength=count) / len(group) for group in groups])
