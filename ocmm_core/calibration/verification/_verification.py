"""Verify a calibration with calibrated lengths and spheres (after VDI/VDE 2634 part 1).

The distances of all nests from the first one are five test lengths on each line (`_line_planning`).
Spheres are touched at 25 points each, and judged by size and form. A check passes if its error plus
the uncertainty of the artefact is within the limit (ISO 14253-1, proof of conformity). It does not
replace an acceptance test according to the guideline.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ocmm_core.calibration.guided import STILL_FRAMES, sigma_of_mean, touch_of
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import Check, Corner, LengthBar, Sphere
from ocmm_core.calibration.verification import _line_planning as line_planning
from ocmm_core.calibration.verification._limits import Limits
from ocmm_core.camera import Rig, project
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Points3
from ocmm_core.tracking import ProbeBody

SPHERE_POINTS = 25

_OFF_PLAN_MM = 75.0
_OFF_NEST_MM = 10.0
"""Above any calibration error worth a verdict, below the step of a bar."""
_NEST_MM = 1.0
"""Largest calibration error for which nests are distinguishable."""
_SPHERE_STEPS = 20
_PREDICTED = 4.0
"""Standard deviations that the largest of some thirty lengths stays within."""


def limits_of(rig: Rig, body: ProbeBody) -> Limits:
    """Return the usual limits; for a tracker four standard deviations of what its noise predicts.

    Of a resting ball in the middle of the volume, in its worst direction.
    """
    if rig.markers is None:
        return Limits()
    origin = rig.volume_world.mean(axis=0) - body.leds_probe.mean(axis=0)
    uv = np.array([project(camera, body.leds_probe + origin) for camera in rig.cameras])
    noise = touch_of(uv, sigma_of_mean(rig, STILL_FRAMES), rig, body).noise
    length = _PREDICTED * float(np.sqrt(2.0 * np.linalg.eigvalsh(noise)[-1]))
    usual, scale = Limits(), rig.markers.document.noise.scale_sigma
    constant = max(length, usual.constant)
    per_length = max(_PREDICTED * scale, usual.per_length)
    return replace(
        usual, constant=constant, per_length=per_length,
        largest=max(2.0 * constant, usual.largest), diameter=constant, form=2.0 * constant,
    )  # fmt: skip


def judge_placement(
    plan: line_planning.PlannedLine, ends_world: Float, others: Sequence[Float], volume_world: Float
) -> str:
    """Return the objection to a placement, or empty text.

    ``ends_world`` (2, 3), mm: first and last nest; ``others``: those of the recorded lines.
    """
    direction = ends_world[1] - ends_world[0]
    for other in others:
        between = other[1] - other[0]
        cosine = abs(float(direction @ between))
        cosine /= float(np.linalg.norm(direction) * np.linalg.norm(between))
        if np.arccos(min(cosine, 1.0)) < line_planning.MIN_ANGLE:
            return "The bar is nearly parallel to another line: place it in another direction."
    swapped = ends_world[::-1]
    off = min(
        float(np.linalg.norm(one - plan.ends_world, axis=1).max()) for one in (ends_world, swapped)
    )
    if off > _OFF_PLAN_MM:
        return f"The bar is {off:.0f} mm from its planned place ({plan.name}): place it there."
    low, high = volume_world
    if np.any(ends_world < low) or np.any(ends_world > high):
        return "The bar extends beyond the calibrated volume: place it inside."
    shares = line_planning.corner_distances(ends_world, volume_world).min(axis=0)
    for corner in plan.corners:
        if shares[corner] > line_planning.CORNER_SHARE:
            return (
                f"The bar ends {100.0 * shares[corner]:.0f} % of an edge from corner "
                f"{line_planning.CORNER_NAMES[corner]}; {100.0 * line_planning.CORNER_SHARE:.0f} % "
                "are allowed: place it nearer."
            )
    return ""


def judge_nest(
    plan: line_planning.PlannedLine, tip_world: Float, taken_world: Points3, bar: LengthBar
) -> str:
    """Return why a resting ball is not in the next nest of a line; empty if it may be.

    A skipped nest would otherwise show only at the end of the line. mm; ``taken_world`` (n, 3):
    recorded nests.
    """
    nest = len(taken_world)
    if not nest:
        off = float(np.linalg.norm(tip_world - plan.ends_world, axis=1).min())
        if off > _OFF_PLAN_MM:
            return (
                f"The ball is {off:.0f} mm from both ends of the planned line ({plan.name}): "
                "start with the first nest there."
            )
        return ""
    wanted = bar.nests[nest] - bar.nests[0]
    seen = float(np.linalg.norm(tip_world - taken_world[0]))
    reverse = bar.nests[-1] - bar.nests[-1 - nest]
    if abs(seen - wanted) > _NEST_MM and abs(seen - reverse) <= _NEST_MM:
        return "The bar is reversed: turn it round and repeat this line from its first nest."
    others = [nest_ - bar.nests[0] for nest_ in bar.nests]
    elsewhere = min(abs(seen - one) for one in others) <= _NEST_MM < abs(seen - wanted)
    if elsewhere or abs(seen - wanted) > _OFF_NEST_MM:
        return (
            f"The ball is {seen:.0f} mm from nest 1, but nest {nest + 1} is {wanted:.0f} mm from "
            f"it: put the ball into nest {nest + 1}."
        )
    return ""


def length_checks(
    line: str, tips_world: Points3, bar: LengthBar, limits: Limits, temperature: Temperature | None
) -> tuple[Check, ...]:
    """Return the test lengths of one line; tips (n, 3), mm, in the order of the nests."""
    checks = []
    for nest in range(1, len(bar.nests)):
        nominal = bar.nests[nest] - bar.nests[0]
        certified, expanded = bar.artefact.at(nominal, temperature)
        checks.append(
            Check(
                name=f"{line}, {nominal:.0f} mm",
                measured_mm=float(np.linalg.norm(tips_world[nest] - tips_world[0])),
                certified_mm=certified,
                expanded_mm=expanded,
                limit_mm=limits.of_length(nominal),
            )
        )
    return tuple(checks)


def sphere_checks(
    name: str,
    tips_world: Points3,
    ball: tuple[float, float],
    sphere: Sphere,
    limits: Limits,
    temperature: Temperature | None,
) -> tuple[Check, Check]:
    """Return size and form of a sphere, both from one fit of all points (ISO 10360-5).

    ``tips_world`` (n, 3), mm: ball centres; ``ball``: radius and standard uncertainty, mm.
    """
    centre, radius, _ = fit_sphere(tips_world)
    certified, expanded = sphere.artefact.at(sphere.diameter, temperature)
    return (
        Check(
            name=f"{name}, size",
            measured_mm=2.0 * (radius - ball[0]),
            certified_mm=certified,
            expanded_mm=float(np.hypot(expanded, 4.0 * ball[1])),
            limit_mm=limits.diameter,
        ),
        Check(
            name=f"{name}, form",
            measured_mm=form_of(tips_world, centre),
            certified_mm=0.0,
            # A certificate of the diameter includes the sphere's own form.
            expanded_mm=sphere.artefact.expanded,
            limit_mm=limits.form,
        ),
    )


def form_of(points: Points3, centre: Float) -> float:
    """Return largest less smallest distance of points (n, 3) from a centre (3,), mm."""
    return float(np.ptp(np.linalg.norm(points - centre, axis=1)))


def fit_sphere(points: Points3) -> tuple[Float, float, float]:
    """Return centre (3,), radius and gain of the least-squares sphere.

    Gain: standard deviation of the diameter over that of one distance; 0.65 for 25 points over half
    a sphere. CalibrationError if the points do not determine a sphere.
    """
    mean = points.mean(axis=0)
    at = points - mean
    rows = np.column_stack([2.0 * at, np.ones(len(at))])
    if np.linalg.matrix_rank(rows) < 4:
        raise CalibrationError(
            "verification.sphere",
            "The points do not determine a sphere.",
            "Touch it all around, from the pole to the equator.",
        )
    solution = np.linalg.lstsq(rows, np.sum(at**2, axis=1))[0]
    centre = solution[:3]
    radius = float(np.sqrt(max(solution[3] + centre @ centre, 0.0)))
    for _ in range(_SPHERE_STEPS):
        away = at - centre
        distance = np.linalg.norm(away, axis=1)
        jacobian = np.column_stack([away / distance[:, None], np.ones(len(at))])
        step = np.linalg.lstsq(jacobian, distance - radius)[0]
        centre, radius = centre + step[:3], radius + float(step[3])
        if float(np.abs(step).max()) < 1e-10:
            break
    gain = 2.0 * float(np.sqrt(np.linalg.inv(jacobian.T @ jacobian)[3, 3]))
    return centre + mean, radius, gain


def reached_corners(
    nests_world: Points3, volume_world: Float, reasons: Mapping[str, str]
) -> tuple[Corner, ...]:
    """Return the corners of a volume (2, 3), mm, as reached by nests (n, 3), mm.

    Every nest ends a test length; ``reasons`` for unreached corners are by name.
    """
    shares = line_planning.corner_distances(nests_world, volume_world).min(axis=0)
    return tuple(
        Corner(
            name=name,
            off=float(share),
            reached=bool(share <= line_planning.CORNER_SHARE),
            reason="" if share <= line_planning.CORNER_SHARE else reasons.get(name, ""),
        )
        for name, share in zip(line_planning.CORNER_NAMES, shares, strict=True)
    )


def worst(checks: Sequence[Check]) -> int:
    """Return the index of the check closest to, or farthest beyond, its limit."""
    shares = [(abs(one.error_mm) + one.expanded_mm) / one.limit_mm for one in checks]
    return int(np.argmax(shares))
