"""Lines of a session file, and the snapshot for a screen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import msgspec

from ocmm_core.acceptance._procedure import ProcedureDocument
from ocmm_core.acceptance._result import (
    AcceptanceVerdict,
    ClimateReading,
    InstrumentState,
    JudgedValue,
    Observation,
    PlannedPosition,
    RefusedPoint,
    RoomAir,
    UsedArtefact,
)


class Begun(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """First line; see `AcceptanceRecord`. ``reserved`` hashes spots used before."""

    utc: str
    procedure: ProcedureDocument
    procedure_sha256: str
    instrument: InstrumentState
    artefacts: tuple[UsedArtefact, ...]
    made_by: str
    place: str
    customer: str
    condition: str
    seed: int
    plan: tuple[PlannedPosition, ...]
    notes: tuple[str, ...]
    reserved: tuple[str, ...]
    air: RoomAir | msgspec.UnsetType = msgspec.UNSET


class PointTaken(Observation, frozen=True, kw_only=True, tag=True):
    """An accepted point."""


class PointRefused(RefusedPoint, frozen=True, kw_only=True, tag=True):
    """A point that was refused."""


class PositionRedone(RefusedPoint, frozen=True, kw_only=True, tag=True):
    """All points of a position were removed because of wrong placement."""


class RetestBegun(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """Positions are measured again."""

    utc: str
    positions: tuple[PlannedPosition, ...]


class ClimateNoted(ClimateReading, frozen=True, kw_only=True, tag=True):
    """A temperature."""


class Finished(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """The verdict was given; last line."""

    utc: str
    verdict: AcceptanceVerdict
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
    wording: str
    positions: tuple[PlannedPosition, ...]
    done: tuple[int, ...]
    """`positions`, `done`: plan with retests, and points recorded of each."""
    current: int
    next_item: int
    """`current`, `next_item`: next position and point; -1 if complete."""
    instruction: str
    values: tuple[JudgedValue, ...]
    verdict: AcceptanceVerdict | None
    """Verdict if finished now; None until complete."""
    retests_left: int
    needs_temperature: bool
    """The temperature is required before the next point."""
    refusals: tuple[str, ...]
    void_reasons: tuple[str, ...]
    finished: bool
    abandoned: bool = False
    """`finished`, `abandoned`: ended with or without a verdict."""
