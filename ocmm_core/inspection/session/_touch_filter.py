"""Acceptance of a touch as a point, and recognition of the touched feature.

In any order a feature is recognised by the place of the ball, its paths, and open features. A touch
of a planned point on a planned surface belongs to both; it is assigned to the point while that is
open, because the surface may be touched anywhere else; not if unsafe: the surface has a target
there also, or was just selected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core import measuring
from ocmm_core.camera import Rig
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, RigidTransform, unit
from ocmm_core.inspection.evaluation import Progress, SessionOptions, nearness, places_of
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.session._job_points import ReferenceUse
from ocmm_core.inspection.session._step_log import JobLedger
from ocmm_core.measuring import Refusal, RefusalCode
from ocmm_core.tracking import ProbeBody, TipSensitivity


@dataclass(frozen=True, slots=True)
class Accepted:
    """An acceptable touch."""

    stable: measuring.StablePoint
    feature: str
    side: measuring.Side
    """Side of the probe, and its evidence."""
    sensitivity: TipSensitivity
    """Sensitivity of the tip to its inputs."""

    def point(self, number: int, tip_radius: float) -> measuring.MeasuredPoint:
        stable = self.stable
        return measuring.MeasuredPoint(
            number=number,
            feature=self.feature,
            time_s=stable.time_s,
            first_frame=stable.first_frame,
            last_frame=stable.last_frame,
            n_frames=stable.n_frames,
            tip_world=stable.tip_world,
            random_covariance=stable.random_covariance,
            direction=self.side.direction,
            tip_radius=tip_radius,
            rotation_world_from_probe=stable.rotation_world_from_probe,
            spots=stable.spots,
            chi2_per_dof=stable.chi2_per_dof,
            approach=self.side.word,
            reference_spots=stable.reference_spots,
        )


@dataclass(frozen=True, slots=True)
class TouchAssignment:
    """Feature and method of a touch."""

    feature: str
    """Empty if every feature is done."""
    method: str
    """Detection of its side (`measuring.compensation.METHODS`)."""
    nominal_normal: Float | None = None
    """(3,), unit, world: of the nominal surface at the ball; None while unknown."""


class TouchFilter:
    """Make a durable point of an acceptable touch; the last of three steps."""

    def __init__(
        self,
        ledger: JobLedger,
        rig: Rig,
        body: ProbeBody,
        options: SessionOptions,
        reference: ReferenceUse,
    ) -> None:
        self._ledger, self._rig, self._body = ledger, rig, body
        self._options, self._reference = options, reference

    def filter(
        self, touch: measuring.Touch, stable: measuring.StablePoint, meant: TouchAssignment
    ) -> measuring.MeasuredPoint | measuring.Refusal:
        """Return the point from a touch, or why it gives none."""
        ledger = self._ledger
        judged = judge_touch(
            touch, stable, meant, self._rig, self._body, self._options, self._reference
        )
        if isinstance(judged, measuring.Refusal):
            return judged
        point = judged.point(ledger.points.next_number(), self._body.tip_radius)
        ledger.add([point], [judged.sensitivity])
        return point


def judge_touch(
    touch: measuring.Touch,
    stable: measuring.StablePoint,
    meant: TouchAssignment,
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
    reference: ReferenceUse,
) -> Accepted | measuring.Refusal:
    """Return the result of a touch, or why it gives none."""
    if not meant.feature:
        return all_measured(stable.time_s)
    side = measuring.side_of(
        meant.method,
        touch,
        stable.tip_world,
        stable.rotation_world_from_probe,
        body,
        options.point.approach_mm,
        meant.nominal_normal,
        stable.time_s,
    )
    if isinstance(side, measuring.Refusal):
        return side
    sensitivity = reference.sensitivity(stable.spots, stable.reference_spots)
    uncertainty = measuring.point_uncertainty(sensitivity, rig, body, stable.random_covariance)
    refusal = doubt_of(stable, uncertainty, rig, options.point.max_uncertainty)
    return refusal or Accepted(stable, meant.feature, side, sensitivity)


def all_measured(time_s: float) -> measuring.Refusal:
    return measuring.Refusal(
        measuring.RefusalCode.NO_FEATURE,
        "All features of the plan are measured.",
        "Select a feature to reopen or repeat, or write the report.",
        time_s,
    )


def doubt_of(
    stable: measuring.StablePoint, uncertainty: float, rig: Rig, limit: float
) -> measuring.Refusal | None:
    """Return why a ball centre is no point: outside, or U greater than ``limit``, mm."""
    low, high = rig.volume_world
    if np.any(stable.tip_rig < low) or np.any(stable.tip_rig > high):
        return measuring.Refusal(
            measuring.RefusalCode.OUTSIDE,
            "The ball is outside the volume in which the cameras are calibrated.",
            "Move the part or the cameras, or calibrate a larger volume.",
            stable.time_s,
        )
    if uncertainty > limit:
        return measuring.Refusal(
            measuring.RefusalCode.UNCERTAIN,
            f"The uncertainty of the point would be {uncertainty:.3f} mm (limit {limit:.3f} mm).",
            "Turn the probe so that both cameras see more LEDs.",
            stable.time_s,
        )
    return None


SEARCH_MM = 10.0
"""A touch further than this from every nominal surface belongs to none (as in PC-DMIS)."""

APART_MM = 2.0
"""The second nearest surface must be this much further: part and frame are never quite nominal."""

MOST_SLANT_DEG = 60.0
"""A ball that came from further off the normal did not aim at that surface."""

CLEAR_DEG = 30.0
"""A path within this of one normal, and this much further from every other, distinguishes surfaces;
more slanted points are not compensated anyway (`evaluation.MAX_SLANT_DEG`)."""

_LYING_MM, _LYING_DEG = 0.1, 10.0
"""Tolerances for a planned point on a planned surface: places and directions are rounded."""


@dataclass(frozen=True, slots=True)
class Contact:
    """A ball at rest on a surface."""

    tip_world: Float
    """(3,), mm: its centre."""
    ways_world: tuple[Float, ...]
    """Unit vectors (3,) from the surface along approach and retract, if known."""
    radius: float
    """Of the ball, mm."""
    time_s: float


@dataclass(frozen=True, slots=True)
class _Near:
    """A candidate feature; its normal is zero if it names no face."""

    gap: float
    feature: NominalFeature
    normal: Float

    @property
    def name(self) -> str:
        return self.feature.name

    def angle_deg(self, ways: Sequence[Float]) -> float:
        """Return the largest angle of the paths from the normal; 0 if unknown."""
        if not ways or not np.any(self.normal):
            return 0.0
        worst = min(float(self.normal @ way) for way in ways)
        return float(np.degrees(np.arccos(np.clip(worst, -1.0, 1.0))))


def touched_feature(
    plan: Plan,
    T_nominal_from_world: RigidTransform,
    contact: Contact,
    progress: Progress,
    selected: str = "",
) -> str | Refusal:
    """Return the touched feature, or why ambiguous; `selected` by the inspector, or empty."""
    ball = T_nominal_from_world.apply(contact.tip_world)
    ways = [T_nominal_from_world.rotation @ way for way in contact.ways_world]
    found = _within_reach(plan, ball, ways, contact.radius, progress)
    if not found:
        return Refusal(
            RefusalCode.AMBIGUOUS,
            f"No feature of the plan is within {SEARCH_MM:g} mm of the ball.",
            "Touch nearer to a feature, or select the intended feature and probe in plan order.",
            contact.time_s,
        )
    close = [near for near in found if near.gap - found[0].gap < APART_MM]
    if selected in [near.name for near in close]:
        return selected
    close = _meant_by_way(close, ways)
    if len(close) == 1:
        return close[0].name
    chosen = _point_or_surface(close, ball, contact.radius, progress)
    if chosen:
        return chosen
    first, second = close[:2]
    return Refusal(
        RefusalCode.AMBIGUOUS,
        f"The touch may belong to {first.name} ({first.gap:.1f} mm away) or to {second.name} "
        f"({second.gap:.1f} mm away).",
        "Select the intended one, or touch where they are further apart.",
        contact.time_s,
    )


def _within_reach(
    plan: Plan, ball: Float, ways: Sequence[Float], radius: float, progress: Progress
) -> list[_Near]:
    found = []
    for feature in plan.features:
        near = nearness(feature, ball, radius)
        one = _Near(near.gap, feature, near.normal)
        if feature.name in progress.skipped or near.gap > SEARCH_MM:
            continue
        if one.angle_deg(ways) <= MOST_SLANT_DEG:
            found.append(one)
    return sorted(found, key=lambda one: (one.gap, one.name))


def _meant_by_way(close: list[_Near], ways: Sequence[Float]) -> list[_Near]:
    """Return the candidates consistent with the paths: all if the paths do not distinguish."""
    if not ways or not all(np.any(near.normal) for near in close):
        return close
    angles = [near.angle_deg(ways) for near in close]
    best = min(angles)
    if best > CLEAR_DEG:
        return close
    return [near for near, angle in zip(close, angles, strict=True) if angle < best + CLEAR_DEG]


def _point_or_surface(
    close: Sequence[_Near], ball: Float, radius: float, progress: Progress
) -> str:
    """Return the point or the surface it lies on for a touch of both; empty if ambiguous."""
    points = [near for near in close if near.feature.shape is Shape.POINT]
    surfaces = [near for near in close if near.feature.shape is not Shape.POINT]
    if len(surfaces) != 1 or not all(_lies_on(p.feature, surfaces[0].feature) for p in points):
        return ""
    surface = surfaces[0]
    left = [point for point in points if point.name not in progress.done]
    if not left:
        return surface.name
    if len(left) > 1:
        return ""
    point = left[0]
    if surface.name not in progress.done and _is_wanted_at(surface.feature, ball, radius):
        # A user who follows the guidance to a place of the surface does not aim at the point.
        return progress.active if progress.active in (point.name, surface.name) else ""
    return point.name


def _lies_on(point: NominalFeature, surface: NominalFeature) -> bool:
    """Return whether a touch of a point also touches a surface, by the plan alone."""
    normal = unit(np.array(point.direction))
    # Radius 0: distance from the surface itself.
    near = nearness(surface, np.array(point.point), 0.0)
    facing = float(near.normal @ normal) >= np.cos(np.radians(_LYING_DEG))
    return near.gap <= _LYING_MM and facing


def _is_wanted_at(surface: NominalFeature, ball: Float, radius: float) -> bool:
    places = places_of(surface, surface.points)
    balls = places.points + radius * places.normals
    return bool(len(balls)) and float(np.linalg.norm(balls - ball, axis=1).min()) < APART_MM
