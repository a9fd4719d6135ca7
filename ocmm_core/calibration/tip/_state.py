"""Observations on the sphere and in the cone, and their display form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ocmm_core.calibration import guided
from ocmm_core.calibration.tip import _sphere_layout as sphere_layout
from ocmm_core.calibration.tip._fit import (
    LEAST_POINTS,
    BallFit,
    DiameterErrors,
    centre_of_few,
    fit_ball_on,
    predicted_errors,
)
from ocmm_core.calibration.tip._qualification import BallInCone, BallOnSphere, TouchBegun
from ocmm_core.calibration.tip._views import ConeAttitude, ConeProgress, SpherePlace, SphereProgress
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Points3
from ocmm_core.tracking import ProbeBody

_NEIGHBOUR = np.radians(6.0)
"""Two points nearer than this on the sphere are the same place."""


@dataclass(frozen=True, slots=True)
class TouchPlan:
    """Requirements of a procedure."""

    frame: sphere_layout.LayoutFrame
    places: sphere_layout.Layout
    attitudes: sphere_layout.Layout
    """`frame`, `places`, `attitudes`: Layouts about the pole."""
    points: int
    places_needed: int
    """`points`, `places_needed`: Minimum on the sphere."""
    sigma_of: Callable[[DiameterErrors], float]
    """Decisive standard uncertainty, mm, from the contributions to a diameter."""
    diameter_sigma: float
    """Its limit, mm."""
    artefact_limit: float
    """Permissible diameter error, mm, to judge the certificate of the sphere."""
    chance: float = guided.ARTICULATION_CHANCE


@dataclass(slots=True)
class TouchState:
    """Observations collected, with their ball centres."""

    rig: Rig
    body: ProbeBody
    begun: TouchBegun
    wanted: TouchPlan
    """`rig`, `body`, `begun`, `wanted`: Context; the body is the calibrated one."""
    on_sphere: list[tuple[BallOnSphere, guided.RestingTouch]] = field(default_factory=list)
    in_cone: list[tuple[BallInCone, guided.RestingTouch]] = field(default_factory=list)
    _sphere: SphereProgress | None = None
    _cone: ConeProgress | None = None

    def add(self, event: BallOnSphere | BallInCone) -> None:
        """Add an observation; raise TrackingError if its spots determine no pose."""
        touch = guided.touch_of(guided.from_spots(event.uv), event.sigma_px, self.rig, self.body)
        if isinstance(event, BallOnSphere):
            self.on_sphere.append((event, touch))
            self._sphere = None
        else:
            self.in_cone.append((event, touch))
            self._cone = None

    def remove(self, step: str, point: int) -> None:
        del (self.on_sphere if step == "sphere" else self.in_cone)[point]
        self._sphere = self._cone = None

    @property
    def taken(self) -> tuple[BallOnSphere | BallInCone, ...]:
        """Return all observations, those on the sphere first."""
        on_sphere = (event for event, _ in self.on_sphere)
        return (*on_sphere, *(event for event, _ in self.in_cone))

    @property
    def sphere_touches(self) -> tuple[guided.RestingTouch, ...]:
        return tuple(touch for _, touch in self.on_sphere)

    @property
    def cone_touches(self) -> tuple[guided.RestingTouch, ...]:
        return tuple(touch for _, touch in self.in_cone)

    @property
    def reach(self) -> float:
        """Return the expected distance of a ball centre from that of the sphere, mm."""
        begun = self.begun
        certified, _ = begun.sphere.artefact.at(begun.sphere.diameter, begun.temperature)
        return 0.5 * (certified + begun.nominal_mm)

    @property
    def sphere(self) -> SphereProgress:
        """Return the points on the sphere in display form."""
        if self._sphere is None:
            self._sphere = self._sphere_progress()
        return self._sphere

    @property
    def cone(self) -> ConeProgress:
        """Return the attitudes in the cone in display form."""
        if self._cone is None:
            self._cone = self._cone_progress()
        return self._cone

    def centre(self) -> Float | None:
        """Return the estimated centre of the sphere, (3,), mm, or None."""
        progress = self.sphere
        if not len(progress.tips_world):
            return None
        return np.asarray(
            np.mean(progress.tips_world - self.reach * progress.directions_world, axis=0)
        )

    def handle(self, touch: guided.RestingTouch) -> Float:
        """Return the direction from the ball to the handle, (3,), world."""
        return touch.rotation_world_from_probe @ guided.handle_axis(self.body)

    def next_words(self) -> str:
        """Return the name of the next place on the sphere; empty after the last."""
        progress = self.sphere
        if progress.next_place is not None:
            return progress.places[progress.next_place].name
        if progress.also_world is not None:
            return sphere_layout.place_name(progress.also_world, self.wanted.frame)
        return ""

    def _fit(self) -> BallFit | None:
        if len(self.on_sphere) < LEAST_POINTS:
            return None
        begun = self.begun
        try:
            return fit_ball_on(
                self.sphere_touches, begun.sphere, self.rig, self.body, begun.temperature
            )
        except CalibrationError:
            return None

    def _sphere_progress(self) -> SphereProgress:
        touches, wanted = self.sphere_touches, self.wanted
        tips, n = guided.tips_of(touches), len(touches)
        none = np.empty((0, 3))
        fit = self._fit()
        directions = none
        if n:
            few = centre_of_few(tips, self.reach, wanted.frame.pole)
            # On a small patch, the given radius determines the centre better than a fit.
            known = fit is not None and float(np.sqrt(np.trace(fit.covariance[:3, :3]))) < 0.5
            away = tips - (fit.centre_world if fit is not None and known else few)
            directions = away / np.linalg.norm(away, axis=1)[:, None]
        slots = sphere_layout.match_places(directions, wanted.places)
        points = sphere_layout.points_of_places(slots, len(wanted.places.names))
        missing = [i for i, point in enumerate(points) if point is None]
        sigma = self._sigma(touches, directions, none)
        complete = len(points) - len(missing) >= wanted.places_needed and n >= wanted.points
        also = None
        if complete and sigma > wanted.diameter_sigma:
            also = self._most_useful(touches, directions)
        return SphereProgress(
            places=tuple(
                SpherePlace(name, direction, point)
                for name, direction, point in zip(
                    wanted.places.names, wanted.places.directions, points, strict=True
                )
            ),
            next_place=None if complete else _nearest(directions, wanted.places, missing),
            also_world=also,
            tips_world=tips,
            directions_world=directions,
            slots=slots,
            residuals_mm=np.full(n, np.nan) if fit is None else fit.residuals,
            doubtful=() if fit is None else fit.doubtful,
            diameter_mm=np.nan if fit is None else fit.diameter,
            diameter_sigma_mm=sigma,
            diameter_sigma_end_mm=(
                self._sigma(touches, directions, wanted.places.directions[missing]) if n else np.nan
            ),
            diameter_sigma_limit_mm=wanted.diameter_sigma,
            form_mm=np.nan if fit is None else fit.form,
        )

    def _sigma(
        self, touches: Sequence[guided.RestingTouch], directions: Points3, more: Points3
    ) -> float:
        """Return the predicted diameter uncertainty with more points, mm; see `Wanted.sigma_of`."""
        errors = predicted_errors(touches, directions, self.rig, self.body, more)
        return np.inf if errors is None else self.wanted.sigma_of(errors)

    def _most_useful(
        self, touches: Sequence[guided.RestingTouch], directions: Points3
    ) -> Float | None:
        """Return the untouched equatorial direction that reduces the uncertainty most."""
        candidates = sphere_layout.round_equator(self.wanted.frame)
        near = (candidates @ directions.T).max(axis=1) > np.cos(_NEIGHBOUR)
        free = candidates[~near] if not near.all() else candidates
        sigmas = [self._sigma(touches, directions, one[None]) for one in free]
        return np.asarray(free[int(np.argmin(sigmas))])

    def _cone_progress(self) -> ConeProgress:
        touches, layout = self.cone_touches, self.wanted.attitudes
        n = len(touches)
        handles = np.array([self.handle(one) for one in touches]).reshape(-1, 3)
        points = sphere_layout.points_of_places(
            sphere_layout.match_places(handles, layout, sphere_layout.CONE_TOLERANCE),
            len(layout.names),
        )
        missing = [i for i, point in enumerate(points) if point is None]
        found = (
            guided.articulate(touches, self.rig, self.body, self.wanted.chance) if n > 1 else None
        )
        nothing = np.full(3, np.nan)
        return ConeProgress(
            attitudes=tuple(
                ConeAttitude(name, direction, point)
                for name, direction, point in zip(
                    layout.names, layout.directions, points, strict=True
                )
            ),
            next_attitude=_nearest(handles, layout, missing),
            tips_world=guided.tips_of(touches),
            handles_world=handles,
            off_world=np.full((n, 3), np.nan) if found is None else found.off_world,
            spread_2s_mm=np.nan if found is None else found.spread_2s,
            largest_mm=np.nan if found is None else found.largest,
            half_range_mm=nothing if found is None else found.half_range,
            spread_limit_mm=np.nan if found is None else found.spread_limit,
            largest_limit_mm=np.nan if found is None else found.largest_limit,
        )


def _nearest(
    directions: Points3, layout: sphere_layout.Layout, missing: Sequence[int]
) -> int | None:
    """Return the missing place nearest to the last direction: the shortest path."""
    if not missing:
        return None
    if not len(directions):
        return missing[0]
    return missing[int(np.argmax(layout.directions[list(missing)] @ directions[-1]))]
