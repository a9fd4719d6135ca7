"""Observations of a relocation session, converted to input of the adjustment."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from ocmm_core.calibration import guided
from ocmm_core.calibration.probe_design import UNMEASURED_K
from ocmm_core.calibration.records import LengthBar as BarArtefact
from ocmm_core.calibration.relocation import _data as data
from ocmm_core.calibration.relocation import _request as request
from ocmm_core.camera import Rig, Vector3
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody, solve

LENGTH_TOLERANCE = 0.08
"""Largest relative length error of the bar as seen by a moved frame."""

SET_NAMES = ("origin", "on X", "in XY")


class RelocationBegun(guided.SessionHeader, frozen=True, kw_only=True):
    """First line."""

    probe_identity: str
    bar: BarArtefact
    """Gives the scale."""
    poses_wanted: int
    bars_wanted: int
    length_mm: float
    length_limit_mm: float
    """`length_mm`, `length_limit_mm`: Test length, and its largest standard uncertainty."""
    lens: request.LensMode
    geometry: request.GeometryMode
    world: request.World
    control_names: tuple[str, ...]
    control_positions: tuple[Vector3, ...]
    control_sigma: float
    """`control_names`, `control_positions`, `control_sigma`: Control points with world coordinates,
    mm; empty unless they define the world frame."""
    valid_days: int
    seats: int | None = None
    """Seats visited first and last: zero for recordings without, None in earlier versions."""


class PoseTaken(guided.SessionEvent, frozen=True, kw_only=True):
    """The waved probe; (C, L), px, and the standard deviation of a spot."""

    uv: guided.Spots
    sigma_px: float


class BarTaken(guided.SessionEvent, frozen=True, kw_only=True):
    """The bar in one placement, both LEDs; (C, 2), px."""

    uv: guided.Spots
    sigma_px: float


class SeatTaken(guided.SessionEvent, frozen=True, kw_only=True):
    """The ball in a seat: a control point, or an end of the bar in a placement."""

    seat: str
    """Name of the control point; empty for the bar."""
    uv: guided.Spots
    sigma_px: float


RelocationEvent: TypeAlias = RelocationBegun | PoseTaken | BarTaken | SeatTaken | guided.SeatVisited

_SEAT_MM = 20.0
"""Largest distance of a ball from its seat as seen by moved cameras, at another attitude."""


@dataclass(slots=True)
class RelocationState:
    """Observations collected."""

    rig: Rig
    body: ProbeBody
    begun: RelocationBegun
    poses: list[PoseTaken] = field(default_factory=list)
    bars: list[BarTaken] = field(default_factory=list)
    bar_ends: list[SeatTaken] = field(default_factory=list)
    seats: list[SeatTaken] = field(default_factory=list)
    """`poses`, `bars`, `bar_ends`, `seats`: In order; two ``bar_ends`` for a placement."""
    visits: list[guided.SeatVisited] = field(default_factory=list)
    """In order, of the seats that are visited first and last."""
    _since: int = 0
    _rotations: list[Float] = field(default_factory=list)
    _tips: list[Float] = field(default_factory=list)
    _coverage: guided.VolumeCoverage | None = None

    @property
    def shown(self) -> bool:
        """Return whether the bar has LEDs; otherwise it is touched."""
        return bool(self.begun.bar.leds)

    @property
    def placements(self) -> int:
        """Return the number of complete placements of the bar."""
        return len(self.bars) if self.shown else len(self.bar_ends) // 2

    @property
    def wanted_seats(self) -> tuple[str, ...]:
        """Return the names of the required control points."""
        if self.begun.world == "set":
            return SET_NAMES
        return self.begun.control_names if self.begun.world == "points" else ()

    @property
    def next_seat(self) -> str | None:
        """Return the next control point; None after the last one."""
        taken = {one.seat for one in self.seats}
        return next((name for name in self.wanted_seats if name not in taken), None)

    @property
    def wanted_visits(self) -> int:
        """Return the number of seats visited first and last."""
        return self.begun.seats or 0

    @property
    def unvisited_seat(self) -> int | None:
        visited = {one.seat for one in self.visits}
        return next((seat for seat in range(self.wanted_visits) if seat not in visited), None)

    @property
    def seat_to_repeat(self) -> int | None:
        """Return the first seat not yet revisited after all other observations, or None."""
        first = {one.seat: i for i, one in reversed(list(enumerate(self.visits)))}
        again = {one.seat for i, one in enumerate(self.visits) if i > first[one.seat]}
        again &= {one.seat for one in self.visits[self._since :]}
        return next((seat for seat in range(self.wanted_visits) if seat not in again), None)

    def known_seats(self) -> list[Float]:
        """Return the visited seats, (3,), mm each, by the previous calibration."""
        known = []
        for seat in range(self.wanted_visits):
            first = next((one for one in self.visits if one.seat == seat), None)
            if first is not None:
                shot = guided.from_spots(first.uv)[None]
                known.append(solve(shot, self.rig, self.body, first.sigma_px).tip_world[0])
        return known

    def judge_visit(self, uv: Float, sigma_px: float, *, again: bool) -> str:
        """Return why a resting ball is not in the wanted seat; empty if it may be."""
        tip, seat = solve(uv[None], self.rig, self.body, sigma_px).tip_world[0], self.seat_to_repeat
        if again and seat is not None:
            return guided.judge_visit_again(tip, seat, self.known_seats(), _SEAT_MM)
        return guided.judge_first_visit(tip, self.known_seats(), self.rig)

    def add(self, event: PoseTaken | BarTaken | SeatTaken | guided.SeatVisited) -> None:
        if isinstance(event, guided.SeatVisited):
            self.visits.append(event)
            return
        self._since = len(self.visits)
        if isinstance(event, PoseTaken):
            self.poses.append(event)
            pose = solve(guided.from_spots(event.uv)[None], self.rig, self.body, event.sigma_px)
            self._rotations.append(pose.rotation_world_from_probe[0])
            self._tips.append(pose.tip_world[0])
            self._coverage = None
        elif isinstance(event, BarTaken):
            self.bars.append(event)
        else:
            (self.seats if event.seat else self.bar_ends).append(event)

    def remove_pose(self) -> None:
        del self.poses[-1], self._rotations[-1], self._tips[-1]
        self._coverage = None

    def coverage(self) -> guided.VolumeCoverage:
        if self._coverage is None:
            rotations = np.array(self._rotations).reshape(-1, 3, 3)
            tips = np.array(self._tips).reshape(-1, 3)
            good = np.isfinite(tips).all(axis=1)
            self._coverage = guided.coverage(self.rig, self.body, rotations[good], tips[good])
        return self._coverage

    def judge_end(self, uv: Float, sigma_px: float) -> str:
        """Return why the ball is not in the other end of the bar; empty if it may be."""
        if len(self.bar_ends) % 2 == 0:
            return ""
        shots = np.stack([guided.from_spots(self.bar_ends[-1].uv), uv])
        first, second = solve(shots, self.rig, self.body, sigma_px).tip_world
        length = self.begun.bar.nests[-1] - self.begun.bar.nests[0]
        seen = float(np.linalg.norm(second - first))
        if abs(seen - length) <= LENGTH_TOLERANCE * length:
            return ""
        return (
            f"The ball is {seen:.0f} mm from the first end of the bar, but the other end is "
            f"{length:.0f} mm away: put it there, or undo the first end."
        )

    def observations(self) -> data.Observations:
        begun = self.begun
        ends = [f"bar {i // 2 + 1} {'ab'[i % 2]}" for i in range(2 * self.placements)]
        touches = [] if self.shown else self.bar_ends[: len(ends)]
        names = ([] if self.shown else ends) + [one.seat for one in self.seats]
        shots: list[PoseTaken | SeatTaken] = [*self.poses, *touches, *self.seats]
        seats = np.full(len(shots), -1, dtype=np.int64)
        seats[len(self.poses) :] = np.arange(len(names))
        frames = data.ProbeFrames(
            np.array([guided.from_spots(one.uv) for one in shots]).reshape(
                -1, len(self.rig.cameras), self.body.n_leds, 2
            ),
            np.array([one.sigma_px for one in shots]),
            seats,
        )
        places = begun.bar.leds if self.shown else (begun.bar.nests[0], begun.bar.nests[-1])
        certified, expanded = begun.bar.artefact.at(places[1] - places[0], begun.temperature)
        per_k = (places[1] - places[0]) * begun.bar.artefact.expansion
        bar = data.BarDistance(begun.bar.artefact.use.name, certified, 0.5 * expanded, per_k)
        shown: tuple[data.ShownBar, ...] = ()
        if self.bars:
            uv = np.array([guided.from_spots(one.uv) for one in self.bars])
            shown = (data.ShownBar(bar, uv, np.array([one.sigma_px for one in self.bars])),)
        touched: tuple[data.TouchedBar, ...] = ()
        if touches:
            touched = (data.TouchedBar(bar, tuple(zip(ends[::2], ends[1::2], strict=True))),)
        return data.Observations(frames, shown, touched, tuple(names))

    def options(self) -> data.RelocationOptions:
        begun = self.begun
        world: data.WorldFrame = data.KeptByCameras()
        if begun.world == "points":
            positions = zip(begun.control_names, begun.control_positions, strict=True)
            world = data.KeptByPoints(
                {name: np.array(position) for name, position in positions}, begun.control_sigma
            )
        elif begun.world == "set":
            world = data.SetByPoints(*SET_NAMES)
        warm = begun.temperature
        sigma_k = UNMEASURED_K if warm is None else warm.sigma_k
        return data.RelocationOptions(begun.lens, begun.geometry, world, sigma_k)
