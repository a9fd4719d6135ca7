"""Objections to a recorded position, by geometry only; its values are not inspected."""

from __future__ import annotations

import numpy as np
import scipy

from ocmm_core.acceptance import _procedure as procedure
from ocmm_core.acceptance._situation import Situation, depth_share, third_of
from ocmm_core.acceptance._values import faces_normal, flatness, nest_lengths, sphere_values
from ocmm_core.calibration.verification import CORNER_NAMES, corner_distances
from ocmm_core.geometry import Float, Points3, unit

_NEST_MM = 10.0
"""A ball farther from its nest is in another one; less than the pitch of a bar."""

_OUTSIDE_MM = 1.0
_OFF_PLAN_MM = 75.0
_CONE_MM = 2.0
_BLOCK_MM = 1.0
_BLOCK_FLAT_MM = 0.5
"""Far above the noise of a point, far below an edge or fixture touched instead."""
_BLOCK_SPREAD = 0.15
"""Standard deviation across the narrow side of a face, relative to its width."""


def judge_point(at: Situation, position: int, tip: Float) -> str:
    """Return why a ball at rest is not the next point of a position, or empty."""
    plan, taken = at.plan[position], at.tips[position]
    points = np.array(plan.points_world)
    item = len(taken) % len(points)
    if plan.role == "bar":
        if item == 0 and len(taken):
            off = float(np.linalg.norm(tip - taken[0]))
            return "" if off <= _NEST_MM else f"The ball is {off:.0f} mm from nest 1."
        if item == 0:
            off = float(np.linalg.norm(points[[0, -1]] - tip, axis=1).min())
            return (
                ""
                if off <= _OFF_PLAN_MM
                else f"The ball is {off:.0f} mm from where {plan.name} begins."
            )
        begin = taken[len(taken) - item]
        seen, want = float(np.linalg.norm(tip - begin)), nest_lengths(points)
        if abs(seen - want[item - 1]) > _NEST_MM:
            return (
                f"The ball is {seen:.0f} mm from nest 1 and should be {want[item - 1]:.0f} mm "
                f"from it: put it into nest {item + 1} of this position."
            )
        return ""
    if plan.role == "cone" and len(taken):
        off = float(np.linalg.norm(tip - taken[0]))
        return (
            ""
            if off <= _CONE_MM
            else f"The ball is {off:.1f} mm from the first point: use one cone."
        )
    off = float(np.linalg.norm(points[item] - tip))
    if off > _OFF_PLAN_MM and not len(taken):
        return f"The ball is {off:.0f} mm from where {plan.name} begins."
    # A block is measured several times, at the same place.
    now = taken[len(taken) - item :] if plan.role == "gauge block" else taken
    if any(float(np.linalg.norm(tip - one)) < 0.2 for one in now) and plan.role != "cone":
        return "This point was taken already: take the next one."
    return ""


def judge_position(at: Situation, position: int) -> str:
    """Return objections to a complete position, or empty."""
    low, high = at.stage.volume
    tips = at.tips[position]
    if np.any(tips < low - _OUTSIDE_MM) or np.any(tips > high + _OUTSIDE_MM):
        return "Points lie outside the calibrated volume: place the artefact inside."
    numbers, plan = at.stage.procedure.test, at.plan[position]
    if plan.role == "gauge block" and isinstance(numbers, procedure.E0BlockTest):
        return _block(at, position, numbers)
    if isinstance(numbers, procedure.VolumetricTest):
        return _octant(at, position)
    if isinstance(numbers, procedure.LengthTest | procedure.E0Test):
        return _line(at, position, numbers)
    if plan.role == "sphere":
        hint = _sphere(at, position)
        if hint:
            return hint
    if isinstance(numbers, procedure.LocationTest):
        return _attitude(at, position, numbers)
    return _turned(at, position, numbers) if isinstance(numbers, procedure.SpatTest) else ""


def _line(at: Situation, position: int, numbers: procedure.LengthTest | procedure.E0Test) -> str:
    plan = at.plan[position]
    ends = _ends(at, position)
    direction = unit(ends[1] - ends[0])
    for other in at.complete():
        same = other == position or at.root(other) == at.root(position)
        if same or at.plan[other].role != plan.role:
            continue
        between = _ends(at, other)
        cosine = abs(float(direction @ unit(between[1] - between[0])))
        if np.degrees(np.arccos(min(cosine, 1.0))) < numbers.angle_deg:
            return (
                f"The bar is within {numbers.angle_deg:g}° of the direction of "
                f"'{at.plan[other].name}': place it in another direction."
            )
    if isinstance(numbers, procedure.E0Test):
        points = np.array(plan.points_world)
        off = float(np.linalg.norm(ends - points[[0, -1]], axis=1).max())
        off = min(off, float(np.linalg.norm(ends - points[[-1, 0]], axis=1).max()))
        return "" if off <= _OFF_PLAN_MM else f"The bar is {off:.0f} mm from its planned place."
    shares = corner_distances(ends, at.stage.volume).min(axis=0)
    for corner in plan.corners:
        if shares[corner] > numbers.corner_share:
            return (
                f"The bar ends {100.0 * shares[corner]:.0f} % of an edge from corner "
                f"{CORNER_NAMES[corner]}; {100.0 * numbers.corner_share:.0f} % are allowed: "
                "place it nearer."
            )
    return ""


def _block(at: Situation, position: int, numbers: procedure.E0BlockTest) -> str:
    """Judge the points on a gauge block; its length to a millimetre only."""
    plan = at.plan[position]
    planned = np.array(plan.points_world).reshape(2, -1, 3).mean(axis=1)
    wanted = float(np.linalg.norm(planned[1] - planned[0]))
    for number, (one, two) in enumerate(at.tips[position].reshape(plan.repeats, 2, -1, 3)):
        for face in (one, two):
            arms = face - face.mean(axis=0)
            across = np.linalg.svd(arms, compute_uv=False)[1] / np.sqrt(len(face))
            if across < _BLOCK_SPREAD * min(numbers.block_face):
                return (
                    f"Repeat {number + 1}: the points of a face lie on a line; spread them over "
                    "the face, or the direction of the block is not known."
                )
        normal = faces_normal(one, two)
        apart = float((two.mean(axis=0) - one.mean(axis=0)) @ normal)
        if abs(apart - wanted) > _BLOCK_MM:
            return (
                f"Repeat {number + 1}: the faces are {apart:.1f} mm apart as the ball lies, and "
                f"{wanted:.1f} mm are wanted: probe both measuring faces of this block."
            )
        for face in (one, two):
            if flatness(face) > _BLOCK_FLAT_MM:
                return f"Repeat {number + 1}: the points of a face do not lie in one plane."
    return ""


def octant_of(point: Float, volume: Float) -> int:
    """Return the octant of a point (3,) in the volume, in the order of `CORNER_NAMES`."""
    upper = point > volume.mean(axis=0)
    return int(upper[0]) * 4 + int(upper[1]) * 2 + int(upper[2])


def _octant(at: Situation, position: int) -> str:
    """Return why too few placements would remain for the empty octants, or ""."""
    same = [one for one in range(len(at.plan)) if at.depth(one) == at.depth(position)]
    done = [one for one in same if at.is_complete(one)]
    open_now, left = _empty_octants(at, done), len(same) - len(done)
    if len(open_now) <= left:
        return ""
    names = ", ".join(CORNER_NAMES[one] for one in sorted(open_now))
    return (
        f"The bar is not in octant {_planned_octant(at, position)}, where it was planned: {left} "
        f"placements are left, and the octants {names} of the volume would stay empty."
    )


def _planned_octant(at: Situation, position: int) -> str:
    points = np.array(at.plan[position].points_world)
    return CORNER_NAMES[octant_of(points.mean(axis=0), at.stage.volume)]


def _empty_octants(at: Situation, positions: list[int]) -> set[int]:
    """Return the octants of the plan without the middle of a placement."""
    volume = at.stage.volume
    planned = {octant_of(np.array(one.points_world).mean(axis=0), volume) for one in at.plan}
    return planned - {octant_of(at.tips[one].mean(axis=0), volume) for one in positions}


def missing_octants(at: Situation, numbers: procedure.VolumetricTest) -> str:
    """Return the empty octants of the volume, or that placements are missing."""
    volume = at.stage.volume
    filled = {octant_of(at.tips[one].mean(axis=0), volume) for one in at.complete()}
    if len(filled) >= numbers.octants:
        return ""
    names = ", ".join(CORNER_NAMES[one] for one in sorted(set(range(8)) - filled))
    return (
        f"Placements lie in {len(filled)} octants of the volume and {numbers.octants} are needed: "
        f"{names} are empty."
    )


def _ends(at: Situation, position: int) -> Float:
    tips, count = at.tips[position], len(at.plan[position].points_world)
    return tips[[0, count - 1]]


def missing_corners(at: Situation, numbers: procedure.LengthTest) -> str:
    """Return the volume corners not reached by a test length; empty if all are."""
    nests = np.concatenate([at.tips[one] for one in at.complete()])
    shares = corner_distances(nests, at.stage.volume).min(axis=0)
    missing = [
        name
        for name, share in zip(CORNER_NAMES, shares, strict=True)
        if share > numbers.corner_share
    ]
    return f"No test length ends in corner {', '.join(missing)}." if missing else ""


def _sphere(at: Situation, position: int) -> str:
    plan, tips, numbers = at.plan[position], at.tips[position], at.stage.procedure.test
    found = sphere_values(tips)
    if isinstance(numbers, procedure.SphereTest):
        if found.gain > numbers.gain:
            return (
                "The points are too near the pole: the diameter is known to "
                f"{found.gain:.2f} sigma of a point, {numbers.gain:g} are allowed."
            )
        missing = _missing_places(tips - found.centre, np.array(plan.normals), numbers.match_deg)
        if missing:
            return (
                f"1 of {len(tips)} points is not at its place on the sphere."
                if missing == 1
                else f"{missing} of {len(tips)} points are not at their places on the sphere."
            )
    wanted = at.stage.only("sphere").sizes[0] + 2.0 * at.stage.instrument.ball_radius
    if abs(found.diameter - wanted) > 1.0:
        return (
            f"The sphere measures {found.diameter - 2 * at.stage.instrument.ball_radius:.2f} mm "
            f"and is certified {at.stage.only('sphere').sizes[0]:.2f} mm: another sphere."
        )
    if plan.place and not isinstance(numbers, procedure.DiameterTest):
        depth_part, wanted_part = third_of(found.centre, at.stage), plan.place
        if depth_part != wanted_part:
            return (
                f"The sphere is in the {depth_part} of the volume and should be in the "
                f"{wanted_part}."
            )
    return ""


def _missing_places(arms: Points3, normals: Points3, match_deg: float) -> int:
    """Return the number of wanted directions without their own point nearby."""
    directions = arms / np.linalg.norm(arms, axis=1)[:, None]
    angles = np.degrees(np.arccos(np.clip(directions @ normals.T, -1.0, 1.0)))
    costs = np.where(angles <= match_deg, angles**2, 1e3 * match_deg**2)
    rows, columns = scipy.optimize.linear_sum_assignment(costs)
    return int(np.sum(angles[rows, columns] > match_deg))


def _attitude(at: Situation, position: int, numbers: procedure.LocationTest) -> str:
    handles, wanted = at.handles[position], at.plan[position].handle
    if not len(handles) or wanted is None:
        return ""
    angles = np.degrees(np.arccos(np.clip(handles @ np.array(wanted), -1.0, 1.0)))
    worst = float(np.max(angles))
    if worst > numbers.attitude_deg:
        return (
            f"The probe was held {worst:.0f}° from the attitude '{at.plan[position].name}'; "
            f"{numbers.attitude_deg:g}° are allowed."
        )
    return ""


def _turned(at: Situation, position: int, numbers: procedure.SpatTest) -> str:
    plan = at.plan[position]
    share = depth_share(at.tips[position].mean(axis=0), at.stage)
    depth_part = third_of(at.tips[position].mean(axis=0), at.stage)
    wanted_part = plan.place
    if depth_part != wanted_part:
        return (
            f"The cone is in the {depth_part} of the volume ({share:.2f} of its depth), "
            f"not in the {wanted_part}."
        )
    handles = at.handles[position]
    if not len(handles):
        return ""
    spread = float(np.degrees(np.arccos(np.clip(handles @ handles.T, -1.0, 1.0))).max())
    if spread < numbers.spread_deg:
        return (
            f"The probe was turned by {spread:.0f}° only; {numbers.spread_deg:g}° are needed: "
            "turn it between the extremes."
        )
    return ""
