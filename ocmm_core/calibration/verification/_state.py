"""Observations of a verification, with placements, gates and checks derived from them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from ocmm_core.calibration.guided import (
    OPEN,
    SEATS,
    Gate,
    Rest,
    SeatVisited,
    SessionEvent,
    SessionHeader,
    Spots,
    again_gate,
    first_gate,
    from_spots,
    judge_first_visit,
    judge_visit_again,
    rest_of,
)
from ocmm_core.calibration.records import Check, Corner, LengthBar, Sphere
from ocmm_core.calibration.verification import _verification as verification
from ocmm_core.calibration.verification._limits import Limits
from ocmm_core.calibration.verification._line_planning import (
    CORNER_NAMES,
    LinePlanning,
    PlannedLine,
    corners_of,
)
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Points3, unit
from ocmm_core.tracking import ProbeBody

PLACES = ("near third", "far third")
"""Parts of the volume as seen by the cameras, for spheres touched in two places."""

_MOST_GAIN = 1.0
"""Standard deviation of diameter over point; beyond, points are too close to the pole."""


class VerificationBegun(SessionHeader, frozen=True, kw_only=True):
    """First line."""

    probe_identity: str
    bar: LengthBar
    spheres: tuple[Sphere, ...]
    """`bar`, `spheres`: Artefacts; a sphere touched in two places is listed twice."""
    places: tuple[str, ...]
    """One for each sphere: one of `PLACES`, or empty for any place."""
    limits: Limits


class NestTaken(SessionEvent, frozen=True, kw_only=True):
    """The probe in one nest of one line."""

    line: int
    nest: int
    uv: Spots
    """(C, L), px."""
    sigma_px: float


class SphereTouched(SessionEvent, frozen=True, kw_only=True):
    """The probe at one point of one sphere; see `NestTaken`."""

    sphere: int
    uv: Spots
    sigma_px: float


class CornerExcused(SessionEvent, frozen=True, kw_only=True):
    """The user's reason why a corner cannot be reached; an empty reason removes it."""

    corner: str
    reason: str


class LineRepeated(SessionEvent, frozen=True, kw_only=True):
    """A line is repeated: its placement was wrong, or it failed (allowed once)."""

    line: int
    failed: bool


VerificationEvent: TypeAlias = (
    VerificationBegun | NestTaken | SphereTouched | SeatVisited | CornerExcused | LineRepeated
)
Resting: TypeAlias = NestTaken | SphereTouched | SeatVisited


@dataclass(frozen=True, slots=True, eq=False)
class Taken:
    event: Resting
    rest: Rest

    @property
    def tip(self) -> Float:
        """Return the ball's centre (3,), mm, world."""
        return self.rest.touch.tip_world


@dataclass(slots=True)
class VerificationState:
    """Observations collected, with their ball centres."""

    rig: Rig
    body: ProbeBody
    begun: VerificationBegun
    planning: LinePlanning
    taken: list[Taken] = field(default_factory=list)
    """Valid observations in time order."""
    replaced: list[Taken] = field(default_factory=list)
    """Nests of a failed and repeated line."""
    superseded: tuple[Check, ...] = ()
    """The first checks of that line."""
    repeated: list[int] = field(default_factory=list)
    """Failed and repeated lines; one at most."""
    excused: dict[str, str] = field(default_factory=dict)
    """Reasons for unreached corners, by name."""
    _on_lines: dict[int, tuple[Taken, ...]] | None = None

    @property
    def plans(self) -> tuple[PlannedLine, ...]:
        return self.planning.lines

    def add(self, event: Resting) -> None:
        """Add an observation; raise TrackingError if its spots determine no pose."""
        rest = rest_of(from_spots(event.uv), event.sigma_px, event.utc, self.rig, self.body)
        self.taken.append(Taken(event, rest))
        self._on_lines = None

    def last(self, kind: type[Resting]) -> Taken | None:
        return next((one for one in reversed(self.taken) if isinstance(one.event, kind)), None)

    def remove(self, one: Taken) -> None:
        self.taken.remove(one)
        self._on_lines = None

    def repeat(self, event: LineRepeated) -> None:
        """Remove all of a line; keep it separately if it failed."""
        own = [one for one in self.taken if _line_of(one) == event.line]
        if event.failed:
            self.superseded += self.lengths(event.line)
            self.replaced += own
            self.repeated.append(event.line)
        self.taken = [one for one in self.taken if _line_of(one) != event.line]
        self._on_lines = None

    def excuse(self, event: CornerExcused) -> None:
        self.excused.pop(event.corner, None)
        if event.reason:
            self.excused[event.corner] = event.reason

    # Lines.

    def line_taken(self, line: int) -> tuple[Taken, ...]:
        """Return the observations of a line, nest by nest."""
        if self._on_lines is None:
            # Cached: every gate polls every line, many times a second.
            found: dict[int, list[tuple[int, Taken]]] = {}
            for one in self.taken:
                if isinstance(one.event, NestTaken):
                    found.setdefault(one.event.line, []).append((one.event.nest, one))
            self._on_lines = {
                number: tuple(one for _, one in sorted(own, key=lambda item: item[0]))
                for number, own in found.items()
            }
        return self._on_lines.get(line, ())

    def line_tips(self, line: int) -> Points3:
        """Return the ball centres (n, 3), mm, on a line, nest by nest."""
        return np.array([one.tip for one in self.line_taken(line)]).reshape(-1, 3)

    def is_complete(self, line: int) -> bool:
        return len(self.line_taken(line)) == len(self.begun.bar.nests)

    def is_begun(self, line: int) -> bool:
        return len(self.line_taken(line)) > 0 and not self.is_complete(line)

    def current_line(self) -> int | None:
        return next((i for i in range(len(self.plans)) if not self.is_complete(i)), None)

    def hint(self, line: int) -> str:
        """Return the objection to the placement of a line, or empty text."""
        if not self.is_complete(line):
            return ""
        others = [self.line_tips(one)[[0, -1]] for one in range(line) if self.is_complete(one)]
        ends = self.line_tips(line)[[0, -1]]
        plan, reasons = self.plans[line], self.excused
        wanted = tuple(one for one in plan.corners if CORNER_NAMES[one] not in reasons)
        plan = PlannedLine(plan.name, plan.ends_world, wanted)
        return verification.judge_placement(plan, ends, others, self.rig.volume_world)

    def lengths(self, line: int) -> tuple[Check, ...]:
        return verification.length_checks(
            self.plans[line].name,
            self.line_tips(line),
            self.begun.bar,
            self.begun.limits,
            self.begun.temperature,
        )

    def has_failed(self, line: int) -> bool:
        return self.is_complete(line) and not all(
            self.begun.limits.passes(check) for check in self.lengths(line)
        )

    def corners(self) -> tuple[Corner, ...]:
        """Return the corners with their present status."""
        tips = [self.line_tips(line) for line in range(len(self.plans)) if self.is_complete(line)]
        nowhere = np.full((1, 3), 1e6)
        nests = np.concatenate([*tips, nowhere])
        return verification.reached_corners(nests, self.rig.volume_world, self.excused)

    # Spheres.

    def sphere_tips(self, sphere: int) -> Points3:
        """Return the ball centres (n, 3), mm, on a sphere."""
        own = [
            one.tip
            for one in self.taken
            if isinstance(one.event, SphereTouched) and one.event.sphere == sphere
        ]
        return np.array(own).reshape(-1, 3)

    def current_sphere(self) -> int | None:
        return next(
            (
                number
                for number in range(len(self.begun.spheres))
                if len(self.sphere_tips(number)) < verification.SPHERE_POINTS
            ),
            None,
        )

    def sphere_name(self, sphere: int) -> str:
        place = self.begun.places[sphere] or f"place {sphere + 1}"
        return f"{self.begun.spheres[sphere].artefact.use.name}, {place}"

    # Seats.

    def visits(self, seat: int) -> list[int]:
        return [
            i
            for i, one in enumerate(self.taken)
            if isinstance(one.event, SeatVisited) and one.event.seat == seat
        ]

    def unvisited_seat(self) -> int | None:
        return next((seat for seat in range(SEATS) if not self.visits(seat)), None)

    def seat_to_repeat(self) -> int | None:
        """Return the first seat not yet revisited after all else, or None."""
        last = max(
            (i for i, one in enumerate(self.taken) if not isinstance(one.event, SeatVisited)),
            default=0,
        )
        return next(
            (
                seat
                for seat in range(SEATS)
                if len(self.visits(seat)) < 2 or self.visits(seat)[-1] < last
            ),
            None,
        )

    def judge_seat(self, tip_world: Float, *, again: bool) -> str:
        """Return why a resting ball is not in the wanted seat; empty if it may be."""
        seat = self.seat_to_repeat() if again else self.unvisited_seat()
        known = [self.taken[self.visits(one)[0]].tip for one in range(SEATS) if self.visits(one)]
        if again and seat is not None:
            return judge_visit_again(tip_world, seat, known)
        return judge_first_visit(tip_world, known, self.rig)

    # Gates.

    def seats_gate(self) -> Gate:
        return first_gate(self.unvisited_seat())

    def again_gate(self) -> Gate:
        return again_gate(self.seat_to_repeat())

    def lines_gate(self) -> Gate:
        """Return whether all lines were recorded and placed correctly."""
        missing = sum(not self.is_complete(line) for line in range(len(self.plans)))
        if missing:
            return Gate(False, f"{missing} of {len(self.plans)} lines to go.", "Take them.")
        for line, plan in enumerate(self.plans):
            hint = self.hint(line)
            if hint:
                return Gate(False, f"Line '{plan.name}': {hint}", "Repeat this line.")
        return OPEN

    def spheres_gate(self) -> Gate:
        """Return whether all spheres were touched all around, in the right place."""
        touched = sum(isinstance(one.event, SphereTouched) for one in self.taken)
        missing = len(self.begun.spheres) * verification.SPHERE_POINTS - touched
        if missing > 0:
            points = "1 point" if missing == 1 else f"{missing} points"
            return Gate(False, f"{points} on spheres to go.", "Touch them.")
        for number, one in enumerate(self.begun.spheres):
            centre, _, gain = verification.fit_sphere(self.sphere_tips(number))
            if gain > _MOST_GAIN:
                return Gate(
                    False,
                    f"The points on '{one.artefact.use.name}' are too near its pole.",
                    "Undo some of them and touch it nearer to its equator.",
                )
            depth_part = self.begun.places[number]
            if depth_part and depth_part != third_of(centre, self.rig):
                return Gate(
                    False,
                    f"'{one.artefact.use.name}' is not in the {depth_part} of the volume.",
                    "Undo its points, put it there, and touch it again.",
                )
        return OPEN


def third_of(point_world: Float, rig: Rig) -> str:
    """Return the third of the volume of a point (3,), mm, as seen by the cameras."""
    centres = np.array([camera.centre_world for camera in rig.cameras])
    corners = corners_of(rig.volume_world)
    away = unit(corners.mean(axis=0) - centres.mean(axis=0))
    depths = corners @ away
    share = (float(point_world @ away) - depths.min()) / np.ptp(depths)
    return PLACES[0] if share < 1.0 / 3.0 else PLACES[1] if share > 2.0 / 3.0 else "middle third"


def _line_of(one: Taken) -> int:
    return one.event.line if isinstance(one.event, NestTaken) else -1
