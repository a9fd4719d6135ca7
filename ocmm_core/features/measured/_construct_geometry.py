"""Geometry of constructions in closed form: pure functions of geometry vectors.

All vectors are those of `features.shapes.element`, mm, in one frame. Directions need not be of unit
length, so that each function can be differentiated. Every function is equivariant to rigid motions.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.measured._actual import SHORTEST_MM, ActualFeature
from ocmm_core.features.shapes import DIRECTION, HALF_ANGLE, POINT, RADIUS, element
from ocmm_core.geometry import Float, unit

LEAST_ANGLE_DEG = 1.0
"""Below it an intersection has 57 times the error of its elements, or more."""

MOST_TILT_DEG = 10.0
"""A more oblique circle is an ellipse in the plane."""

_FARTHEST = 5.0
"""Multiple of the touched length of a gauge, up to which its axis is extended."""
_MOST_GAUGE_MM = 0.1
"""Largest deviation of a gauge from its diameter in the plan: it is another one beyond."""

_LEAST_SINE = float(np.sin(np.radians(LEAST_ANGLE_DEG)))
_LEAST_GAP = 1e-2
"""Least gap of the eigenvalue of the symmetry plane, relative to the largest."""

_MOST_SKEW = 0.03
"""Largest remaining part of the squared pair distances after mirroring: 10 degrees."""


def line_of_planes(first: Float, second: Float) -> Float:
    """Return the intersection line of two planes, at its point nearest to their points."""
    normals = unit(np.stack([first[DIRECTION], second[DIRECTION]]))
    along = np.cross(*normals)
    _clear(float(np.linalg.norm(along)), "The planes are nearly parallel")
    middle = 0.5 * (first[POINT] + second[POINT])
    system = np.vstack([normals, along])
    offsets = (normals[0] @ first[POINT], normals[1] @ second[POINT], along @ middle)
    return element(np.linalg.solve(system, np.array(offsets)), unit(along))


def point_of_planes(first: Float, second: Float, third: Float) -> Float:
    planes = (first, second, third)
    normals = unit(np.stack([plane[DIRECTION] for plane in planes]))
    _clear(abs(float(np.linalg.det(normals))), "The planes nearly meet in one line or in none")
    offsets = np.array([n @ plane[POINT] for n, plane in zip(normals, planes, strict=True)])
    return element(np.linalg.solve(normals, offsets))


def point_on_plane(axis: Float, plane: Float) -> Float:
    """Return the intersection point of a line or axis and a plane."""
    normal, along = unit(plane[DIRECTION]), unit(axis[DIRECTION])
    slope = float(normal @ along)
    _clear(abs(slope), "The line nearly lies along the plane")
    return element(axis[POINT] + (normal @ (plane[POINT] - axis[POINT])) / slope * along)


def point_of_lines(first: Float, second: Float) -> Float:
    """Return the midpoint of the shortest connection of two lines or axes."""
    a, b = unit(first[DIRECTION]), unit(second[DIRECTION])
    _clear(float(np.linalg.norm(np.cross(a, b))), "The lines are nearly parallel")
    between = second[POINT] - first[POINT]
    cosine = a @ b
    along_a = (a - cosine * b) @ between / (1.0 - cosine**2)
    along_b = (cosine * a - b) @ between / (1.0 - cosine**2)
    return element(0.5 * (first[POINT] + along_a * a + second[POINT] + along_b * b))


def dropped_on_plane(point: Float, plane: Float) -> Float:
    """Return the foot of a point or centre on a plane."""
    normal = unit(plane[DIRECTION])
    return element(point[POINT] - (normal @ (point[POINT] - plane[POINT])) * normal)


def dropped_on_axis(point: Float, axis: Float) -> Float:
    """Return the foot of a point or centre on a line or axis."""
    along = unit(axis[DIRECTION])
    return element(axis[POINT] + (along @ (point[POINT] - axis[POINT])) * along)


def line_in_plane(axis: Float, plane: Float) -> Float:
    normal, along = unit(plane[DIRECTION]), unit(axis[DIRECTION])
    flat = along - (along @ normal) * normal
    _clear(float(np.linalg.norm(flat)), "The line is nearly normal to the plane")
    return element(dropped_on_plane(axis, plane)[POINT], unit(flat))


def circle_in_plane(circle: Float, plane: Float) -> Float:
    normal, axis = unit(plane[DIRECTION]), unit(circle[DIRECTION])
    cosine = float(normal @ axis)
    if abs(cosine) < np.cos(np.radians(MOST_TILT_DEG)):
        raise FitError(
            "construction.oblique",
            f"The circle is inclined {np.degrees(np.arccos(min(abs(cosine), 1.0))):.0f} degrees "
            "to the plane, where it becomes an ellipse.",
            "Project its centre instead.",
        )
    centre = dropped_on_plane(circle, plane)[POINT]
    return element(centre, np.sign(cosine) * normal, circle[RADIUS])


def middle(first: Float, second: Float) -> Float:
    return element(0.5 * (first[POINT] + second[POINT]))


def halving_plane(first: Float, second: Float, *, between: bool) -> Float:
    """Return the plane of points equidistant from two planes.

    Between two faces its normal is the difference of theirs, across the sum: faces point outwards.
    """
    sign = -1.0 if between else 1.0
    one, other = unit(first[DIRECTION]), unit(second[DIRECTION])
    normal = one + sign * other
    length = float(np.linalg.norm(normal))
    other_way = "across" if between else "between"
    # If both planes are nearly square to it, it is far away and turns with their noise.
    if length < 2.0 * _LEAST_SINE:
        raise FitError(
            "construction.no_bisector",
            "The faces face "
            + ("the same way: nothing lies between them." if between else "each other."),
            f"Take the plane '{other_way}'.",
        )
    offset = (one @ first[POINT] + sign * (other @ second[POINT])) / length
    normal = normal / length
    start = 0.5 * (first[POINT] + second[POINT])
    return element(start - (normal @ start - offset) * normal, normal)


def halving_line(first: Float, second: Float, *, between: bool) -> Float:
    """Return the bisector of two lines or axes, equidistant if they meet or are parallel."""
    one, other = unit(first[DIRECTION]), unit(second[DIRECTION])
    cosine = float(one @ other)
    if between and abs(cosine) < _LEAST_SINE:
        raise FitError(
            "construction.no_bisector",
            "The lines are square to each other: neither angle is the smaller one.",
            "Construct the line through their intersection instead.",
        )
    sign = (1.0 if cosine >= 0.0 else -1.0) * (1.0 if between else -1.0)
    along = one + sign * other
    length = float(np.linalg.norm(along))
    if length < 2.0 * _LEAST_SINE:
        raise FitError(
            "construction.no_bisector",
            "The lines are nearly parallel: no line runs across them halfway.",
            "Take the line 'between'.",
        )
    along = along / length
    start = 0.5 * (first[POINT] + second[POINT])
    crossings = [
        line[POINT] + (along @ (start - line[POINT])) / (along @ way) * way
        for line, way in ((first, one), (second, other))
    ]
    return element(0.5 * (crossings[0] + crossings[1]), along)


def mirror_plane(pairs: Sequence[tuple[Float, Float]]) -> Float:
    """Return the plane of best mirror symmetry of point pairs (least squares).

    With middles m and differences d of the pairs, the squared distances between each second point
    and the mirrored first one add up to a constant and n' (4 S(m) - S(dd')) n, where S(m) is the
    scatter of the middles: the normal n is an eigenvector.
    """
    firsts = np.array([first[POINT] for first, _ in pairs])
    seconds = np.array([second[POINT] for _, second in pairs])
    middles, differences = 0.5 * (firsts + seconds), seconds - firsts
    spread = middles - middles.mean(axis=0)
    values, vectors = np.linalg.eigh(4.0 * spread.T @ spread - differences.T @ differences)
    normal = vectors[:, 0]
    across = float(normal @ differences.sum(axis=0))
    gap, total = values[1] - values[0], float(np.sum(differences**2))
    if (
        gap < _LEAST_GAP * np.abs(values).max()
        or total + values[0] > _MOST_SKEW * total
        or abs(across) < SHORTEST_MM
    ):
        raise FitError(
            "construction.no_symmetry",
            "The pairs do not define their plane of symmetry.",
            "Name pairs that lie on opposite sides, the first of each on the same side.",
        )
    return element(middles.mean(axis=0), np.sign(across) * normal)


def shifted(what: Float, along: Float, distance: float, towards: Float | None) -> Float:
    """Return an element moved along the direction of another one, to the side of a third."""
    way = unit(along[DIRECTION])
    if towards is not None:
        side = float((towards[POINT] - what[POINT]) @ way)
        if abs(side) < SHORTEST_MM:
            raise FitError(
                "construction.no_side",
                "The feature that defines the positive direction lies sideways to it.",
                "Name as 'towards' a feature clearly on one side.",
            )
        way = np.sign(side) * way
    moved = what.copy()
    moved[POINT] += distance * way
    return moved


def grown(what: Float, distance: float) -> Float:
    """Return a round element whose radius is greater by a distance."""
    moved = what.copy()
    moved[RADIUS] += distance
    if moved[RADIUS] <= 0.0:
        raise FitError(
            "construction.no_radius",
            f"The radius would be {moved[RADIUS]:.3f} mm.",
            "Give a distance that leaves a radius above zero.",
        )
    return moved


def beyond(first: Float, second: Float, distance: float) -> Float:
    """Return the point on the line from a first centre through a second, beyond that one."""
    way = second[POINT] - first[POINT]
    length = float(np.linalg.norm(way))
    if length < SHORTEST_MM:
        raise FitError(
            "construction.one_place",
            f"The two points lie {length:.3f} mm from each other and give no direction.",
            "Take points that lie far apart, at least as far as the hidden point is away.",
        )
    return element(second[POINT] + distance / length * way)


def refuse_gauge(gauge: ActualFeature, face: ActualFeature) -> None:
    """Raise FitError unless a gauge was touched above a face, over enough of its length."""
    if gauge.touches is None:
        raise TypeError(gauge.nominal.name)
    name, above, tips = gauge.nominal.name, face.nominal.name, gauge.touches.tips
    heights = (tips - face.fit.point) @ face.fit.direction
    highest, length = float(heights.max()), float(np.ptp(tips @ gauge.fit.direction))
    found, planned = 2.0 * gauge.fit.radius, gauge.nominal.diameter
    if heights.min() <= 0.0:
        what = f"{name} was touched {-heights.min():.1f} mm below {above}."
    elif length * _FARTHEST < highest:
        what = f"{name} was touched over {length:.1f} mm only, {highest:.1f} mm above {above}."
    elif abs(found - planned) > _MOST_GAUGE_MM:
        what = f"{name} measures {found:.3f} mm; the gauge of the plan has {planned:.3f} mm."
    else:
        return
    raise FitError(
        "construction.no_gauge",
        what,
        "Touch the gauge above the face, around it and at two heights far apart.",
    )


def gauge_point(cone: Float, radius: float) -> Float:
    """Return the point (3,), mm, on the axis of a cone at a radius, mm."""
    along = (radius - cone[RADIUS]) / np.tan(cone[HALF_ANGLE])
    point: Float = cone[POINT] + along * unit(cone[DIRECTION])
    return point


def gauge_circle(cone: Float, diameter: float) -> Float:
    return element(gauge_point(cone, 0.5 * diameter), unit(cone[DIRECTION]), 0.5 * diameter)


def cone_at(cone: Float, plane: Float, distance: float) -> Float:
    """Return the circle of a cone at the intersection of its axis with a shifted plane."""
    centre = point_on_plane(cone, shifted(plane, plane, distance, None))[POINT]
    way = unit(cone[DIRECTION])
    radius = float(cone[RADIUS] + np.tan(cone[HALF_ANGLE]) * (way @ (centre - cone[POINT])))
    if radius <= 0.0:
        raise FitError(
            "construction.beyond_apex",
            "The cone does not extend that far: its apex comes first.",
            "Give a distance within the cone.",
        )
    return element(centre, way, radius)


def _clear(sine: float, what: str) -> None:
    if sine < _LEAST_SINE:
        raise FitError(
            "construction.parallel",
            f"{what}: {np.degrees(np.arcsin(sine)):.2f} degrees.",
            f"Use features at least {LEAST_ANGLE_DEG:g} degree apart in angle; 30 or more is "
            "better.",
        )
