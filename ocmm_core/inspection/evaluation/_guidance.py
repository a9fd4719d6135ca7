"""Next target on the nominal surface, and the cue to it, by a rough pose of the part.

No result depends on it. A nominal surface gives the places to touch, and the distance of a ball
from it, in the frame of the plan's nominals. A feature's ``point`` is the middle of the touched
region: of the length of a line, cylinder or cone, of the area of a plane. `SURFACES` has one entry
per shape.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ocmm_core.alignment import nominal_frame
from ocmm_core.errors import FitError, OcmmError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import NominalFeature, Shape, nominal_geometry
from ocmm_core.geometry import Float, RigidTransform, perpendicular_pair, rigid_fit, unit
from ocmm_core.inspection.evaluation import _coverage as places
from ocmm_core.inspection.evaluation._cache import EvaluationCache
from ocmm_core.inspection.evaluation._coverage import Places, across_of
from ocmm_core.inspection.evaluation._evaluation import frame_of
from ocmm_core.inspection.evaluation._job_graph import FeatureGraph
from ocmm_core.inspection.evaluation._options import SessionOptions
from ocmm_core.inspection.evaluation._view import Target
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import MeasuredPoint

_DEEP_MM = 10.0


@dataclass(frozen=True, slots=True)
class Nearness:
    """Position of a ball relative to a nominal surface."""

    gap: float
    """mm: from the ball's surface to the nominal one; zero in contact."""
    normal: Float
    """(3,), unit: from the material towards the probe, at the nearest place; zero for a line."""


def near_point(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    return Nearness(float(np.linalg.norm(arm - radius * axis)), axis)


def near_line(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    """Return the nearness to a line, on either face."""
    height, reach, _ = _about_axis(arm, axis)
    beyond = _beyond(abs(height), 0.5 * nominal.length)
    return Nearness(float(np.hypot(abs(reach - radius), beyond)), np.zeros(3))


def near_plane(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    """Return the nearness to a plane within its planned extent."""
    height = float(arm @ axis)
    along = across_of(nominal)
    beyond_u = _beyond(abs(float(arm @ along)), 0.5 * nominal.length)
    beyond_v = _beyond(abs(float(arm @ np.cross(axis, along))), 0.5 * nominal.width)
    return Nearness(float(np.linalg.norm([height - radius, beyond_u, beyond_v])), axis)


def near_axis(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    height, reach, outward = _about_axis(arm, axis)
    half, flat = np.radians(0.5 * nominal.angle_deg), nominal.shape.spec.is_flat
    free = _DEEP_MM if flat else 0.5 * nominal.length + radius
    beyond = _beyond(abs(height), free) if flat or nominal.length > 0.0 else 0.0
    surface = 0.5 * nominal.diameter + height * np.tan(half)
    gap = (reach - surface) * np.cos(half) - sign * radius
    normal = sign * (np.cos(half) * outward - np.sin(half) * axis)
    return Nearness(float(np.hypot(gap, beyond)), normal)


def near_sphere(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    far = float(np.linalg.norm(arm))
    gap = far - 0.5 * nominal.diameter - sign * radius
    return Nearness(abs(gap), sign * arm / max(far, 1e-9))


def near_torus(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    ring = arm - 0.5 * nominal.diameter * _about_axis(arm, axis)[2]
    far = float(np.linalg.norm(ring))
    return Nearness(abs(far - 0.5 * nominal.width - sign * radius), sign * ring / max(far, 1e-9))


def near_places(places: Places, arm: Float, axis: Float, radius: float) -> Nearness:
    """Return the nearness to an outline given by many places about the feature's point."""
    height = float(arm @ axis)
    offsets = arm - height * axis - (places.points + radius * places.normals)
    nearest = int(np.argmin(np.sum(offsets**2, axis=1)))
    beyond = _beyond(abs(height), _DEEP_MM)
    gap = float(np.hypot(np.linalg.norm(offsets[nearest]), beyond))
    return Nearness(gap, places.normals[nearest])


def _about_axis(arm: Float, axis: Float) -> tuple[float, float, Float]:
    """Return height along an axis, distance from it, and the unit vector (3,) away from it."""
    height = float(arm @ axis)
    flat = arm - height * axis
    reach = float(np.linalg.norm(flat))
    outward: Float = flat / reach if reach > 1e-9 else perpendicular_pair(axis)[0]
    return height, reach, outward


def _beyond(distance: float, half: float) -> float:
    """Return the distance outside a stretch of half length ``half``; 0 if unbounded."""
    return max(distance - half, 0.0) if half > 0.0 else 0.0


_OUTLINE = 200
_ON_IT_MM = 0.05
"""mm: a target farther from the surface belongs to another one."""

PlacesOf: TypeAlias = Callable[[NominalFeature, Float, Float, float, int], Places]
"""From a feature, its point (3,), its direction (3,), 1 or -1 for outer or inner, and a count."""
NearnessTo: TypeAlias = Callable[[NominalFeature, Float, Float, float, float], Nearness]
"""From a feature, the arm (3,) of a ball from its point, its direction (3,), 1 or -1 for outer or
inner, and the radius of the ball, mm."""


@dataclass(frozen=True, slots=True)
class SurfaceSpec:
    places: PlacesOf
    nearness: NearnessTo


def _outline(on_it: PlacesOf) -> SurfaceSpec:
    def nearness_to(
        nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
    ) -> Nearness:
        return near_places(on_it(nominal, np.zeros(3), axis, sign, _OUTLINE), arm, axis, radius)

    return SurfaceSpec(on_it, nearness_to)


_AROUND = SurfaceSpec(places.around_axis, near_axis)
_RECTANGLE = _outline(places.on_rectangle)

SURFACES = {
    Shape.POINT: SurfaceSpec(places.at_point, near_point),
    Shape.LINE: SurfaceSpec(places.along_line, near_line),
    Shape.PLANE: SurfaceSpec(places.on_plane, near_plane),
    Shape.CIRCLE: _AROUND,
    Shape.SPHERE: SurfaceSpec(places.on_cap, near_sphere),
    Shape.CYLINDER: _AROUND,
    Shape.ELLIPSE: _outline(places.on_ellipse),
    Shape.ROUND_SLOT: _outline(places.on_round_slot),
    Shape.SQUARE_SLOT: _RECTANGLE,
    Shape.RECTANGLE: _RECTANGLE,
    Shape.CONE: _AROUND,
    Shape.TORUS: SurfaceSpec(places.on_torus, near_torus),
}


def _along_scan(
    nominal: NominalFeature, centre: Float, axis: Float, sign: float, count: int
) -> Places:
    """Return places along the scan of a plan, evenly and in its order."""
    share, length = np.linspace(0.0, 1.0, count), nominal.spacing * count
    if nominal.scan == "raster":
        along, lines = across_of(nominal), max(round(length / nominal.length), 2)
        ends = np.array([-0.5, 0.5, 0.5, -0.5]) * (1.0 - 2.0 * places.EDGE) * nominal.length
        u, v = np.resize(ends, 2 * lines), np.repeat(places.spread(lines) * nominal.width, 2)
        way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(u), np.diff(v)))])
        flat = [np.interp(share * way[-1], way, corner)[:, None] for corner in (u, v)]
        points = centre + flat[0] * along + flat[1] * np.cross(axis, along)
        return Places(points, np.tile(axis, (count, 1)))
    radius, half = 0.5 * nominal.diameter, np.radians(0.5 * nominal.angle_deg)
    turns = 1.0 if nominal.scan == "ring" else max(length / (2.0 * np.pi * radius), 1.0)
    around = places.radial(*perpendicular_pair(axis), 2.0 * np.pi * turns * share)
    if nominal.shape is Shape.SPHERE:
        tilt = 0.5 * np.pi * share[:, None]
        normals = np.cos(tilt) * axis + np.sin(tilt) * around
        return Places(centre + sign * radius * normals, normals)
    reach = 0.0 if nominal.scan == "ring" else places.LEVELS * nominal.length
    level = sign * reach * (2.0 * share - 1.0)
    points = centre + level[:, None] * axis + (radius + level * np.tan(half))[:, None] * around
    return Places(points, sign * (np.cos(half) * around - np.sin(half) * axis))


def places_of(nominal: NominalFeature, count: int) -> Places:
    """Return ``count`` places on the nominal surface.

    The targets of the plan, maybe fewer; places spread over it if there are none, or if one is off
    the surface, changed since.
    """
    named = _named(nominal, count)
    if named is not None:
        return named
    axis, centre = unit(np.array(nominal.direction)), np.array(nominal.point)
    on_it = _along_scan if nominal.scan else SURFACES[nominal.shape].places
    return on_it(nominal, centre, axis, _sign(nominal), count)


def nearness(nominal: NominalFeature, ball: Float, radius: float) -> Nearness:
    """Return the nearness of a ball at ``ball`` (3,), mm, with ``radius``, mm, to the surface.

    A circle is a bore or shaft: depth counts beyond ten millimetres. Lengths bound the surface.
    """
    arm, axis = ball - np.array(nominal.point), unit(np.array(nominal.direction))
    reach = radius + nominal.sheet
    return SURFACES[nominal.shape].nearness(nominal, arm, axis, _sign(nominal), reach)


def _named(nominal: NominalFeature, count: int) -> Places | None:
    """Return the targets of the plan; None without usable ones."""
    if not nominal.targets:
        return None
    points = np.array(nominal.targets)
    # Radius 0: distance from the surface of the plan, also behind a sheet.
    found = [nearness(nominal, point, -nominal.sheet) for point in points]
    if not all(one.gap <= _ON_IT_MM for one in found):
        return None
    return Places(points[:count], np.array([one.normal for one in found])[:count])


def _sign(nominal: NominalFeature) -> float:
    return 1.0 if nominal.side == "outer" else -1.0


FAR_MM, NEAR_MM = 100.0, 1.0
"""Beyond the first the ring has its full size; within the second it is closed."""
_LOWEST_HZ, _HIGHEST_HZ = 220.0, 1760.0
_SMALLEST_RING = 0.06


@dataclass(frozen=True, slots=True)
class Cue:
    ring_px_fraction: float
    """Radius of the ring, relative to its largest one."""
    tone_hz: float
    """Pitch of the tone; three octaves higher at the target than far from it."""
    arrived: bool


def cue(distance_mm: float) -> Cue:
    """Return ring and tone for a distance, mm: the ring shrinks and the tone rises.

    By the logarithm: the last millimetres are as distinct as the first hundred. NaN is farthest.
    """
    distance = distance_mm if np.isfinite(distance_mm) else FAR_MM
    share = float(np.log(np.clip(distance, NEAR_MM, FAR_MM) / NEAR_MM) / np.log(FAR_MM / NEAR_MM))
    return Cue(
        ring_px_fraction=_SMALLEST_RING + (1.0 - _SMALLEST_RING) * share,
        tone_hz=float(_HIGHEST_HZ * (_LOWEST_HZ / _HIGHEST_HZ) ** share),
        arrived=distance <= NEAR_MM,
    )


@dataclass(frozen=True, slots=True)
class Whereabouts:
    """Pose of the nominals in the world."""

    T_nominal_from_world: RigidTransform
    approximate: bool
    """From other features than the plan's datums, or only some of them."""


def whereabouts(plan: Plan, actual: Mapping[str, ActualFeature | FitError]) -> Whereabouts | None:
    """Return the pose of the nominals by the features measured so far; None if undetermined.

    By the alignment, or before its datums are measured by planes and centres that leave no freedom.
    """
    aligned = aligned_nominals(plan, actual)
    if aligned is not None:
        return Whereabouts(aligned, approximate=False)
    near = _by_features(plan, actual)
    return None if near is None else Whereabouts(near, approximate=True)


def aligned_nominals(
    plan: Plan, actual: Mapping[str, ActualFeature | FitError]
) -> RigidTransform | None:
    """Return the motion from the world to the frame of the nominals, by the plan's alignment.

    That of the alignment may be another one; the alignment of the nominals relates the two.
    """
    T_part_from_world = frame_of(plan, actual)
    bound = plan.bound_alignment
    if T_part_from_world is None or bound is None:
        return None
    try:
        T_part_from_nominal = nominal_frame(bound)
    except OcmmError:
        return None
    return T_part_from_nominal.inverse().compose(T_part_from_world)


def place_of_nominals(
    plan: Plan, points: Sequence[MeasuredPoint], options: SessionOptions, cache: EvaluationCache
) -> RigidTransform | None:
    """Return `aligned_nominals` of stored points, using the cache."""
    graph = FeatureGraph(plan, options, cache)
    actual = graph.features(graph.touched(points))
    return cache.watched("nominals", (plan,), actual, lambda watch: aligned_nominals(plan, watch))


def _by_features(
    plan: Plan, actual: Mapping[str, ActualFeature | FitError]
) -> RigidTransform | None:
    """Return the motion by normals of planes and centres, or None if undetermined."""
    normals, centres = [], []
    for nominal in plan.features:
        feature = actual.get(nominal.name)
        if not isinstance(feature, ActualFeature):
            continue
        spec = nominal.shape.spec
        if spec.located == "along":
            normals.append((nominal_geometry(nominal), feature.fit.geometry))
        elif spec.centred:
            plane = actual.get(nominal.projection) if nominal.projection else None
            if isinstance(plane, ActualFeature):
                # The depth of touches in a bore does not locate it.
                up = plane.fit.direction
                depth = float((feature.fit.point - plane.fit.point) @ up)
                centres.append((np.array(nominal.point), feature.fit.point - depth * up))
            elif spec.located == "everywhere":
                centres.append((np.array(nominal.point), feature.fit.point))
    there = np.array([there[3:6] for there, _ in normals]).reshape(-1, 3)
    here = np.array([here[3:6] for _, here in normals]).reshape(-1, 3)
    if len(centres) > 1:
        between = np.array(centres)[1:] - np.array(centres[0])
        between = between[np.linalg.norm(between[:, 0], axis=1) > 1.0]
        there = np.concatenate([there, unit(between[:, 0])])
        here = np.concatenate([here, unit(between[:, 1])])
    if len(there) < 2 or (not centres and len(normals) < 3):
        return None
    if np.linalg.svd(there, compute_uv=False)[1] < 0.1:
        return None
    # Directions have no location: each with its opposite, so that only the rotation is fitted.
    rotation, _ = rigid_fit(np.concatenate([here, -here]), np.concatenate([there, -there]))
    rows = [np.eye(3)] * len(centres)
    rest = [there_c - rotation @ here_c for there_c, here_c in centres]
    for there_p, here_p in normals:
        rows.append(there_p[None, 3:6])
        rest.append(there_p[None, 3:6] @ (there_p[0:3] - rotation @ here_p[0:3]))
    matrix = np.concatenate(rows)
    if np.linalg.svd(matrix, compute_uv=False)[-1] < 0.1:
        return None
    shift = np.asarray(np.linalg.pinv(matrix) @ np.concatenate(rest), dtype=np.float64)
    return RigidTransform(rotation, shift)


def targets_of(
    plan: Plan,
    name: str,
    points: Sequence[MeasuredPoint],
    place: Whereabouts | None,
    tip_radius: float,
    last_world: Float | None,
) -> tuple[Target, ...]:
    """Return the open targets of a feature, the one nearest to the last point first.

    Each of its ``points`` covers the nearest target. Without the pose ``place`` there are none.
    ``tip_radius``, mm; ``last_world`` (3,), mm: ball centre of the last point of the job, or None.
    """
    if place is None:
        return ()
    nominal = plan.feature(name)
    places = places_of(nominal, nominal.points)
    T_world = place.T_nominal_from_world.inverse()
    surface = T_world.apply(places.points)
    normals = places.normals @ T_world.rotation.T
    balls = surface + (tip_radius + nominal.sheet) * normals
    free = list(range(len(balls)))
    for point in points:
        if free:
            apart = np.linalg.norm(balls[free] - point.tip_world, axis=1)
            del free[int(np.argmin(apart))]
    if last_world is not None:
        free.sort(key=lambda index: float(np.linalg.norm(balls[index] - last_world)))
    return tuple(
        Target(name, surface[index], normals[index], balls[index], place.approximate)
        for index in free
    )
