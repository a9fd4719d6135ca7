"""Observations of a relocation session, converted to input of the adjustment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from ocmm_core.calibration import guided
from ocmm_core.calibration.probe_design import UNMEASURED_K, Temperature
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


def observations_of(
    shots: Sequence[guided.Shot], views: tuple[int, int], bar: BarArtefact | None,
    temperature: Temperature | None,
) -> data.Observations:  # fmt: skip
    """Return the observations of shots: poses, the bar, and the ball in its ends and in seats.

    ``views``: numbers of cameras and LEDs. Without a bar, shots of it are left out.
    """
    known = [] if bar is None else list(shots)
    shown = [one for one in known if one.kind == "bar"]
    touches = [one for one in known if one.kind == "seat" and not one.place]
    ends = [f"bar {i // 2 + 1} {'ab'[i % 2]}" for i in range(len(touches) // 2 * 2)]
    seated = [one for one in shots if one.kind == "seat" and one.place]
    names = (*ends, *(one.place for one in seated))
    poses = [one for one in shots if one.kind == "pose"]
    frames = [*poses, *touches[: len(ends)], *seated]
    seats = np.full(len(frames), -1, dtype=np.int64)
    seats[len(poses) :] = np.arange(len(names))
    of_probe = data.ProbeFrames(
        np.array([one.uv for one in frames]).reshape(-1, *views, 2),
        np.array([one.sigma_px for one in frames], dtype=np.float64), seats,
    )  # fmt: skip
    shown_bars: tuple[data.ShownBar, ...] = ()
    touched: tuple[data.TouchedBar, ...] = ()
    if bar is not None and shown:
        uv, sigmas = (
            np.array(part) for part in zip(*((s.uv, s.sigma_px) for s in shown), strict=True)
        )
        shown_bars = (data.ShownBar(_distance(bar, bar.leds, temperature), uv, sigmas),)
    if bar is not None and ends:
        pairs = tuple(zip(ends[::2], ends[1::2], strict=True))
        touched = (data.TouchedBar(_distance(bar, bar.nests, temperature), pairs),)
    return data.Observations(of_probe, shown_bars, touched, names)


def _shot(
    kind: guided.ShotKind, event: PoseTaken | BarTaken | SeatTaken, place: str = ""
) -> guided.Shot:
    return guided.Shot(kind, place, guided.from_spots(event.uv), event.sigma_px)


def _distance(
    bar: BarArtefact, places: tuple[float, ...], temperature: Temperature | None
) -> data.BarDistance:
    length = places[-1] - places[0]
    certified, expanded = bar.artefact.at(length, temperature)
    per_k = length * bar.artefact.expansion
    return data.BarDistance(bar.artefact.use.name, certified, 0.5 * expanded, per_k)


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
        ends = [] if self.shown else self.bar_ends[: 2 * self.placements]
        shots = [
            *(_shot("pose", one) for one in self.poses),
            *(_shot("bar", one) for one in self.bars),
            *(_shot("seat", one) for one in ends),
            *(_shot("seat", one, one.seat) for one in self.seats),
        ]
        begun, views = self.begun, (len(self.rig.cameras), self.body.n_leds)
        return observations_of(shots, views, begun.bar, begun.temperature)

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
