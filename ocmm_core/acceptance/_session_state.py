"""State of an acceptance test: a pure fold over the lines of its file.

Also these lines, and the snapshot for a screen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias, TypeVar

import msgspec

from ocmm_core.acceptance import _result as result
from ocmm_core.acceptance._guards import climate_reasons, spots_hash
from ocmm_core.acceptance._kinds import kind_of, quantities_of, values_of
from ocmm_core.acceptance._procedure import ProcedureDocument
from ocmm_core.acceptance._situation import Situation, Stage, situation_of, wanted, worst_of
from ocmm_core.calibration.guided import Spots
from ocmm_core.errors import CalibrationError


class Begun(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """First line; see `AcceptanceRecord`. ``reserved`` hashes spots used before."""

    utc: str
    procedure: ProcedureDocument
    procedure_sha256: str
    instrument: result.InstrumentState
    artefacts: tuple[result.UsedArtefact, ...]
    made_by: str
    place: str
    customer: str
    condition: str
    seed: int
    plan: tuple[result.PlannedPosition, ...]
    notes: tuple[str, ...]
    reserved: tuple[str, ...]
    air: result.RoomAir | msgspec.UnsetType = msgspec.UNSET


class PointTaken(result.Observation, frozen=True, kw_only=True, tag=True):
    """An accepted point."""


class PointRefused(result.RefusedPoint, frozen=True, kw_only=True, tag=True):
    """A point that was refused."""


class PositionRedone(result.RefusedPoint, frozen=True, kw_only=True, tag=True):
    """All points of a position were removed because of wrong placement."""


class RetestBegun(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """Positions are measured again."""

    utc: str
    positions: tuple[result.PlannedPosition, ...]


class ClimateNoted(result.ClimateReading, frozen=True, kw_only=True, tag=True):
    """A temperature."""


class Finished(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """The verdict was given; last line."""

    utc: str
    verdict: result.AcceptanceVerdict
    remark: str = ""


class Abandoned(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """The test was ended without a verdict; last line."""

    utc: str
    reason: str


Event: TypeAlias = (
    Begun
    | PointTaken
    | PointRefused
    | PositionRedone
    | RetestBegun
    | ClimateNoted
    | Finished
    | Abandoned
)


class Line(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One line of a session file."""

    event: Event


@dataclass(frozen=True, slots=True)
class AcceptanceView:
    """A snapshot for any screen."""

    title: str
    positions: tuple[result.PlannedPosition, ...]
    done: tuple[int, ...]
    """`positions`, `done`: plan with retests, and points recorded of each."""
    current: int
    next_item: int
    """`current`, `next_item`: next position and point; -1 if complete."""
    instruction: str
    values: tuple[result.JudgedValue, ...]
    verdict: result.AcceptanceVerdict | None
    """Verdict if finished now; None until complete."""
    retests_left: int
    needs_temperature: bool
    """The temperature is required before the next point."""
    refusals: tuple[str, ...]
    void_reasons: tuple[str, ...]
    finished: bool
    abandoned: bool = False
    """`finished`, `abandoned`: ended with or without a verdict."""


S = TypeVar("S", bound=msgspec.Struct)


class SessionState:
    """State from a session file, retests included; ``finished``, ``abandoned``: None while open."""

    def __init__(self, begun: Begun) -> None:
        self.begun = begun
        self.stage = Stage(begun.procedure, begun.instrument, begun.artefacts, begun.seed)
        self.plan = list(begun.plan)
        self.taken: list[list[result.Observation]] = [[] for _ in self.plan]
        self.refusals: list[result.RefusedPoint] = []
        self.climate: list[result.ClimateReading] = []
        self.retests = 0
        self.finished: Finished | None = None
        self.abandoned: Abandoned | None = None
        self._seen: set[str] = set(begun.reserved)

    def fold(self, event: Event) -> None:
        if isinstance(event, PointTaken):
            self.taken[event.position].append(event)
            if event.uv is not None:
                self._seen.add(spots_hash(event.uv))
        elif isinstance(event, PositionRedone):
            self.taken[event.position] = []
            self.refusals.append(event)
        elif isinstance(event, PointRefused):
            self.refusals.append(event)
        elif isinstance(event, RetestBegun):
            self.plan += event.positions
            self.taken += [[] for _ in event.positions]
            self.retests += 1
        elif isinstance(event, ClimateNoted):
            self.climate.append(event)
        elif isinstance(event, Finished):
            self.finished = event
        elif isinstance(event, Abandoned):
            self.abandoned = event

    def situation(self) -> Situation:
        return situation_of(
            self.stage, self.plan, [one for many in self.taken for one in many], self.climate
        )

    def current(self) -> int:
        """Return the position of the next points; -1 if complete."""
        for position, plan in enumerate(self.plan):
            if len(self.taken[position]) < wanted(plan):
                return position
        return -1

    def missing(self) -> int:
        """Return the number of missing points."""
        return sum(wanted(one) for one in self.plan) - sum(len(one) for one in self.taken)

    def open_end(self) -> str:
        """Return what the verdict still requires, in one sentence; empty if nothing."""
        missing = self.missing()
        if missing:
            return _missing_words(missing)
        return kind_of(self.stage).open_end(self.situation(), self.stage.procedure.test)

    def require_open(self) -> None:
        """Raise CalibrationError if the test is closed."""
        if self.finished is not None or self.abandoned is not None:
            raise CalibrationError(
                "acceptance.finished",
                "The test is finished; nothing is added to it.",
                "Begin a new test.",
            )

    def require_next(self) -> int:
        """Return the position of the next point; raise CalibrationError if none is due."""
        position = self.current()
        if position < 0:
            raise CalibrationError(
                "acceptance.nothing_next", "All points were taken.", "Finish the test."
            )
        if self.needs_temperature():
            raise CalibrationError(
                "acceptance.no_temperature",
                f"No temperature was noted for '{self.plan[position].name}'.",
                "Note the temperature, then take the point.",
            )
        return position

    def require_complete(self) -> None:
        """Raise CalibrationError if points are missing."""
        missing = self.missing()
        if missing:
            raise CalibrationError(
                "acceptance.incomplete", _missing_words(missing), "Take them first."
            )

    def last_touched(self) -> int:
        """Return the last position with points, or -1."""
        touched = [i for i, one in enumerate(self.taken) if one]
        return touched[-1] if touched else -1

    def needs_temperature(self) -> bool:
        """Return whether the temperature is required before the next point."""
        position = self.current()
        if position < 0 or self.taken[position]:
            return False
        name = self.plan[position].name
        return not any(one.position == name and one.when == "begin" for one in self.climate)

    def next_item(self, position: int) -> int:
        return len(self.taken[position]) % len(self.plan[position].points_world)

    def reused(self, uv: Spots | None) -> str:
        """Return why averaged spots may not be used; empty if they may."""
        if uv is None or spots_hash(uv) not in self._seen:
            return ""
        return "These spots were used before, in the calibration or in this test."

    def verdict(
        self, values: tuple[result.JudgedValue, ...] | None = None
    ) -> result.AcceptanceVerdict:
        if climate_reasons(self.stage, self.climate):
            return result.AcceptanceVerdict.VOID
        judged = values_of(self.situation()) if values is None else values
        return worst_of([one.verdict for one in judged if not one.superseded])

    def instruction(self, position: int) -> str:
        """Return the next instruction, in one sentence."""
        if position < 0:
            return "All points taken. Finish, or repeat what failed."
        plan, item = self.plan[position], self.next_item(position)
        x, y, z = (f"{one:z.0f}" for one in plan.points_world[item])
        sentence, points = plan.name, len(plan.points_world)
        if plan.role == "bar":
            text = (
                f"{sentence}: put the ball into nest {item + 1} of {points} at ({x}, {y}, {z}) mm "
                "in the world frame."
            )
        elif plan.role == "cone":
            text = (
                f"{sentence}: put the ball into the cone at ({x}, {y}, {z}) mm in the world frame "
                "and turn the probe."
            )
        else:
            text = (
                f"{sentence}: touch point {item + 1} of {points} at ({x}, {y}, {z}) mm in the "
                "world frame."
            )
        turn = len(self.taken[position]) // points + 1
        return f"{text} Repeat {turn} of {plan.repeats}." if plan.repeats > 1 else text

    def view(self) -> AcceptanceView:
        position = self.current()
        complete = position < 0
        values = tuple(values_of(self.situation())) if any(self.taken) else ()
        return AcceptanceView(
            title=self.stage.procedure.title,
            positions=tuple(self.plan), done=tuple(len(one) for one in self.taken),
            current=position, next_item=-1 if complete else self.next_item(position),
            instruction=self.instruction(position), values=values,
            verdict=self.verdict(values) if complete else None,
            retests_left=self.stage.procedure.retests_allowed - self.retests,
            needs_temperature=self.needs_temperature(),
            refusals=tuple(one.reason for one in self.refusals),
            void_reasons=tuple(climate_reasons(self.stage, self.climate)),
            finished=self.finished is not None,
            abandoned=self.abandoned is not None,
        )  # fmt: skip

    def record(self, number: str, chain_head: str) -> result.AcceptanceRecord:
        """Return the record of a finished test; raise CalibrationError if unfinished."""
        if self.finished is None:
            raise CalibrationError(
                "acceptance.unfinished", "The test is not finished.", "Take what is missing."
            )
        begun, values = self.begun, tuple(values_of(self.situation()))
        said = (f"Remark: {self.finished.remark}",) if self.finished.remark else ()
        return result.AcceptanceRecord(
            schema=result.RECORD_SCHEMA, number=number, procedure=begun.procedure,
            procedure_sha256=begun.procedure_sha256, instrument=begun.instrument,
            artefacts=begun.artefacts, made_by=begun.made_by, place=begun.place,
            customer=begun.customer, condition=begun.condition, begun_utc=begun.utc,
            ended_utc=self.finished.utc, seed=begun.seed, plan=tuple(self.plan),
            notes=begun.notes + said,
            observations=tuple(
                _plain(one, result.Observation) for many in self.taken for one in many
            ),
            climate=tuple(_plain(one, result.ClimateReading) for one in self.climate),
            refusals=tuple(_plain(one, result.RefusedPoint) for one in self.refusals),
            values=values, quantities=quantities_of(values), retests=self.retests,
            void_reasons=tuple(climate_reasons(self.stage, self.climate)),
            verdict=self.finished.verdict, wording=begun.procedure.wording, chain_head=chain_head,
            air=begun.air,
        )  # fmt: skip


def _plain(event: msgspec.Struct, kind: type[S]) -> S:
    """Return an event as its base struct, without tag."""
    return kind(**{name: getattr(event, name) for name in kind.__struct_fields__})


def _missing_words(missing: int) -> str:
    return "1 point is missing." if missing == 1 else f"{missing} points are missing."
