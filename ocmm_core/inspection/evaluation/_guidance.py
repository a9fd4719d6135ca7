"""Next target, and the cue to it, by a rough pose of the part: no result depends on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.alignment import nominal_frame
from ocmm_core.errors import FitError, OcmmError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import nominal_geometry
from ocmm_core.geometry import Float, RigidTransform, rigid_fit, unit
from ocmm_core.inspection.evaluation._cache import EvaluationCache
from ocmm_core.inspection.evaluation._evaluation import frame_of
from ocmm_core.inspection.evaluation._job_graph import FeatureGraph
from ocmm_core.inspection.evaluation._options import SessionOptions
from ocmm_core.inspection.evaluation._surfaces import places_of
from ocmm_core.inspection.evaluation._view import Target
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import MeasuredPoint

FAR_MM, NEAR_MM = 100.0, 1.0
"""Beyond the first the ring has its full size; within the second it is closed."""
_LOWEST_HZ, _HIGHEST_HZ = 220.0, 1760.0
_SMALLEST_RING = 0.06


@dataclass(frozen=True, slots=True)
class Cue:
    """Guidance cue."""

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
        if nominal.shape.spec.located == "along":
            normals.append((nominal_geometry(nominal), feature.fit.geometry))
        elif nominal.shape.spec.centred:
            plane = actual.get(nominal.projection)
            if isinstance(plane, ActualFeature):
                # The depth of touches in a bore does not locate it.
                up = plane.fit.direction
                depth = float((feature.fit.point - plane.fit.point) @ up)
                centres.append((np.array(nominal.point), feature.fit.point - depth * up))
            elif nominal.shape.spec.located == "everywhere":
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
    balls = surface + tip_radius * normals
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


def nearest(targets: Sequence[Target], tip_world: Float) -> Target | None:
    """Return the target nearest to the ball, (3,), mm; None without targets. For tests only."""
    return min(targets, key=lambda target: target.distance(tip_world), default=None)
