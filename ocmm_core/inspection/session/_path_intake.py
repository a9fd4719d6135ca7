"""Continuous probing: the path of a sliding ball to points of one feature."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.errors import FitError
from ocmm_core.features.elements import nominal_distances
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.fieldbus.described import REST_SPEED
from ocmm_core.geometry import Float, RigidTransform, unit
from ocmm_core.inspection.evaluation import (
    SessionOptions,
    Target,
    Whereabouts,
    nearness,
    targets_of,
)
from ocmm_core.inspection.session._assignment import TouchAssigner
from ocmm_core.inspection.session._job_points import ReferenceUse
from ocmm_core.inspection.session._step_log import JobLedger
from ocmm_core.inspection.session._touch_filter import SEARCH_MM, Accepted, all_measured, doubt_of
from ocmm_core.measuring import (
    PATH,
    MeasuredPoint,
    Path,
    PathPoints,
    PathProgress,
    PathSurface,
    Refusal,
    RefusalCode,
    Side,
    StablePoint,
    Thinning,
    approach_direction,
    point_uncertainties,
    points_along,
    spaced,
    transported,
)
from ocmm_core.tracking import ProbeBody

_LEAST_POINTS = 3
_NORMAL_EVERY_MM = 0.5
_MOST_FITTED = 400
_FITS, _LIFTED_MM = 3, 0.1
_REACH_MM, _SHOWN_LIFT_MM = 2.0, 0.5
"""Distance from the ball up to which a place counts as covered, and height of a lifted ball."""


class ScanGuide:
    """Open targets of a scan, covered by a ball that slides over them."""

    def __init__(
        self, nominal: NominalFeature, targets: Sequence[Target],
        T_nominal_from_world: RigidTransform, radius: float,
    ) -> None:  # fmt: skip
        self._nominal, self._place, self._radius = nominal, T_nominal_from_world, radius
        self._balls = np.array([one.ball_world for one in targets]).reshape(-1, 3)
        self._reach = max(_REACH_MM, nominal.spacing)

    def follow(self, path: PathProgress, tips_world: Float) -> PathProgress:
        """Return the progress after further ball centres (n, 3), mm."""
        tips = tips_world[np.isfinite(tips_world).all(axis=1)]
        if not len(tips):
            return path
        apart = np.linalg.norm(tips[:, None] - self._balls, axis=2)
        self._balls = self._balls[(apart > self._reach).all(axis=0)]
        gap = nearness(self._nominal, self._place.apply(tips[-1]), self._radius).gap
        covered = 1.0 - len(self._balls) / self._nominal.points
        return replace(path, covered=covered, lifted=gap > _SHOWN_LIFT_MM)


class PathIntake:
    """Make durable points of paths; thread-safe."""

    def __init__(
        self,
        ledger: JobLedger,
        rig: Rig,
        body: ProbeBody,
        options: SessionOptions,
        reference: ReferenceUse,
        assignment: TouchAssigner,
    ) -> None:
        self._ledger, self._rig, self._body = ledger, rig, body
        self._options, self._reference, self._assignment = options, reference, assignment
        self._guide: ScanGuide | None = None
        self._follows = False

    @property
    def expected(self) -> bool:
        """Return whether the active feature is measured along paths."""
        with self._ledger.lock:
            active = self._ledger.progress.active
            return bool(active) and self._ledger.plan.feature(active).spacing > 0.0

    def followed(self, path: PathProgress | None, tips_world: Float) -> PathProgress | None:
        """Return the state of an open path with contact and coverage of the planned scan.

        ``tips_world`` (n, 3), mm: the latest ball centres. Guides only: no result depends on it.
        """
        if path is not None and not self._follows:
            with self._ledger.lock:
                self._guide = self._guide_of(self._ledger.progress.active)
        self._follows = path is not None
        return path if path is None or self._guide is None else self._guide.follow(path, tips_world)

    def _guide_of(self, active: str) -> ScanGuide | None:
        """Return the open targets of the active feature; None without a scan or a pose."""
        nominals, radius = self._assignment.nominals, self._body.tip_radius
        place = nominals.find() if active and self._ledger.plan.feature(active).scan else None
        if place is None:
            return None
        own = [one for one in nominals.points if one.feature == active]
        exact = Whereabouts(place, approximate=False)
        targets = targets_of(self._ledger.plan, active, own, exact, radius, None)
        return ScanGuide(self._ledger.plan.feature(active), targets, place, radius)

    def record_path(self, path: Path, feature: str | None = None) -> MeasuredPoint | Refusal:
        """Make durable points of a path and return the last, or why not.

        StorageError if not durable.
        `feature`: intended feature; None for the active one.
        """
        with self._ledger.lock:
            outcome = self._record_path(path, feature)
            if isinstance(outcome, Refusal):
                self._ledger.note(outcome)
            return outcome

    def _record_path(self, path: Path, wanted: str | None) -> MeasuredPoint | Refusal:
        ledger, ticks = self._ledger, path.ticks
        time_s = float(ticks.time_s[0]) if ticks is not None else 0.0
        refusal = ledger.obstacle(time_s, interrupted=path.interrupted)
        if refusal is not None:
            return refusal

        def refused(code: RefusalCode, what: str, remedy: str) -> Refusal:
            return Refusal(code, what, remedy, time_s)

        if path.untimed or self._rig.markers is not None:
            what = (
                "The cameras do not prove a common exposure time: the place of a sliding ball is "
                "unknown."
            )
            if self._rig.markers is not None:
                what = "A tracker may filter its markers: the place of a sliding ball is unknown."
            remedy = "Measure this feature by single touches, or synchronise the cameras."
            return refused(RefusalCode.MOVING, what, remedy)
        if ticks is None:
            return refused(
                RefusalCode.LOST,
                "The cameras do not see the probe on the path.",
                "Turn the LEDs towards the cameras and clear the line of sight, then slide again.",
            )
        near_mm = self._options.point.approach_mm
        came = approach_direction(path.trail_world, ticks.tip_world[0], near_mm)
        ways = () if came is None else (came,)
        meant = self._assignment.assign(ticks.tip_world[0], ways, time_s, wanted)
        if isinstance(meant, Refusal):
            return meant
        if not meant.feature:
            return all_measured(time_s)
        feature = ledger.plan.feature(meant.feature)
        if not feature.spacing > 0.0:
            return refused(
                RefusalCode.AMBIGUOUS,
                f"The path is on {feature.name}, which the plan measures by single touches.",
                f"Select {feature.name} and touch it, or slide on the selected feature.",
            )
        place = self._assignment.nominals.find()
        surface = surface_along(feature, ticks.tip_world, came, place, self._body.tip_radius)
        if isinstance(surface, str):
            return refused(
                RefusalCode.NO_APPROACH,
                surface,
                f"Move the ball away by {near_mm:g} mm or more, approach square to the surface, "
                "then slide.",
            )
        low, high = np.percentile(surface.heights, [5.0, 95.0])
        if high - low > self._options.max_form:
            return refused(
                RefusalCode.WRONG_FACE,
                f"The path is up to {high - low:.1f} mm off a {feature.shape.value.lower()}.",
                f"Slide on {feature.name}, in contact all the way.",
            )
        exposure_s = self._options.point.untimed_mm / REST_SPEED
        rule = thinning_of(feature, place)
        if rule is None:
            return refused(
                RefusalCode.NO_APPROACH,
                f"The places of the gates of {feature.name} are unknown: the part frame is not "
                "measured yet.",
                "Measure the datum features first, or leave out 'gates' in the plan.",
            )
        found = points_along(ticks, surface, rule, exposure_s)
        if found.raised_mm > 0.0:
            return refused(
                RefusalCode.MOVING,
                f"A part of the path is {found.raised_mm:.2f} mm above the rest: the ball was "
                "lifted, or the surface has a bump.",
                "Slide again in contact. If it is the surface, measure it by single touches.",
            )
        return self._store(feature, found, time_s)

    def _store(
        self, feature: NominalFeature, found: PathPoints, time_s: float
    ) -> MeasuredPoint | Refusal:
        kept = self._accepted(feature.name, found)
        others = len(found.stations) - len(kept)
        if len(kept) < _LEAST_POINTS:
            return Refusal(
                RefusalCode.UNCERTAIN if others else RefusalCode.MOVING,
                f"The path gives {len(kept)} points. Left out: {found.lifted_ms:.0f} ms without "
                f"contact, {found.fast_ms:.0f} ms too fast, {found.back_mm:.0f} mm backwards, "
                f"{others} uncertain points.",
                f"Press, slide {_LEAST_POINTS * feature.spacing:g} mm or more slowly and in "
                "contact, then release.",
                time_s,
            )
        ledger, radius = self._ledger, self._body.tip_radius
        first = ledger.points.next_number()
        points = [one.point(first + number, radius) for number, one in enumerate(kept)]
        text = (
            f"{feature.name}: {len(points)} points along {found.length_mm:.1f} mm. Left out: "
            f"{found.lifted_ms:.0f} ms without contact, {found.fast_ms:.0f} ms too fast, "
            f"{found.back_mm:.0f} mm backwards, {others} uncertain points."
        )
        ledger.add(points, [one.sensitivity for one in kept], [(PATH, text)])
        return points[-1]

    def _accepted(self, name: str, found: PathPoints) -> list[Accepted]:
        """Return the stations that are seen, inside the volume and certain enough."""
        seen = [
            (station, Side(normal, PATH))
            for station, normal in zip(found.stations, found.normals, strict=True)
            if _is_seen(station)
        ]
        answers = self._reference.sensitivities(
            [(station.spots, station.reference_spots) for station, _ in seen]
        )
        random = np.array([station.random_covariance for station, _ in seen]).reshape(-1, 3, 3)
        uncertainties = point_uncertainties(answers, self._rig, self._body, random)
        limit = self._options.point.max_uncertainty
        return [
            Accepted(station, name, side, sensitivity)
            for (station, side), sensitivity, uncertainty in zip(
                seen, answers, uncertainties.tolist(), strict=True
            )
            if doubt_of(station, uncertainty, self._rig, limit) is None
        ]


def thinning_of(
    feature: NominalFeature, T_nominal_from_world: RigidTransform | None
) -> Thinning | None:
    """Return which places along a path become points; None for gates at an unknown place."""
    turn = float(np.radians(feature.turn_deg))
    if not any(feature.gates):
        return Thinning(feature.spacing, feature.interval, turn)
    if T_nominal_from_world is None:
        return None
    T_world = T_nominal_from_world.inverse()
    normal = T_world.rotation @ unit(np.array(feature.gates))
    return Thinning(feature.spacing, gates=normal, start=T_world.apply(np.array(feature.point)))


def _is_seen(station: StablePoint) -> bool:
    spots = [station.spots, station.reference_spots]
    return all(
        np.count_nonzero(np.isfinite(one[..., 0]).sum(axis=0) >= 2) >= 3
        for one in spots
        if one is not None
    )


def surface_along(
    feature: NominalFeature,
    path_world: Float,
    came: Float | None,
    T_nominal_from_world: RigidTransform | None,
    radius: float,
) -> PathSurface | str:
    """Return the surface along the path of a ball (n, 3), mm; else why unknown.

    Normals are those of the nominal surface if its pose is known, or of the element on the path; a
    straight path on an unknown surface has the direction of its approach, ``came``.
    """
    element = _element_through(feature, path_world)
    if T_nominal_from_world is not None:
        normals = _nominal_normals(feature, T_nominal_from_world, path_world, radius)
        if isinstance(normals, str):
            return normals
    elif element is not None and feature.shape is not Shape.PLANE:
        normals = element.normals
    elif came is None:
        return "The approach direction of the ball is unknown."
    elif element is not None:
        normals = np.asarray(element.normals * np.sign(element.normals[0] @ came))
    else:
        normals = transported(path_world, came, _NORMAL_EVERY_MM)
    if element is None:
        # A straight path: heights above its own line.
        away = path_world - path_world.mean(axis=0)
        along = np.linalg.svd(away[:: max(len(away) // _MOST_FITTED, 1)])[2][0]
        flat = away - np.outer(away @ along, along)
        return PathSurface(normals, np.einsum("ni,ni->n", flat, normals))
    sense = np.sign(float(np.sum(element.normals[0] * normals[0])))
    return PathSurface(normals, sense * element.heights)


def _element_through(feature: NominalFeature, path_world: Float) -> PathSurface | None:
    """Return normals and heights of the element through most of a path; None if indefinite."""
    some = path_world[:: max(len(path_world) // _MOST_FITTED, 1)]
    sign = 1.0 if feature.side == "outer" else -1.0
    kept = np.ones(len(some), dtype=np.bool_)
    try:
        for _ in range(_FITS):
            raw = fit_shape(feature.shape, some[kept])
            distances = nominal_distances(raw.shape, raw.geometry, some)[0]
            off = abs(distances - np.median(distances))
            kept = off <= max(_LIFTED_MM, 5.0 * float(np.median(off)))
        distances, outward = nominal_distances(raw.shape, raw.geometry, path_world)
    except FitError:
        return None
    return PathSurface(sign * outward, sign * distances)


def _nominal_normals(
    feature: NominalFeature, T_nominal_from_world: RigidTransform, path_world: Float, radius: float
) -> Float | str:
    path = T_nominal_from_world.apply(path_world)
    chosen, last = spaced(path, _NORMAL_EVERY_MM)
    found = [nearness(feature, ball, radius) for ball in path[chosen]]
    farthest = max(near.gap for near in found)
    if farthest > SEARCH_MM:
        return f"The path leaves {feature.name}: it is {farthest:.0f} mm away from it."
    return np.array([near.normal for near in found])[last] @ T_nominal_from_world.rotation
