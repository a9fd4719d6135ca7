"""The lines of a session file, and the snapshot that a screen shows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import msgspec

from ocmm_core.acceptance._procedure import Procedure
from ocmm_core.acceptance._result import (
    Climate,
    Instrument,
    JudgedValue,
    Observation,
    PlannedPosition,
    Refusal,
    RoomAir,
    UsedArtefact,
    Verdict,
)


class Begun(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """First line; see `AcceptanceRecord`. ``reserved`` are hashes of spots used before."""

    utc: str
    procedure: Procedure
    procedure_sha256: str
    instrument: Instrument
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
    """A point that counts."""


class PointRefused(Refusal, frozen=True, kw_only=True, tag=True):
    """A point that was refused."""


class PositionRedone(Refusal, frozen=True, kw_only=True, tag=True):
    """All points of a position were taken away, because it was placed wrongly."""


class RetestBegun(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """Positions are measured again."""

    utc: str
    positions: tuple[PlannedPosition, ...]


class ClimateNoted(Climate, frozen=True, kw_only=True, tag=True):
    """A temperature."""


class Finished(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """The verdict was given; nothing comes after it."""

    utc: str
    verdict: Verdict
    remark: str = ""


class Abandoned(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """The test was ended without a verdict; nothing comes after it."""

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
    """`title`, `wording`: Of the procedure."""
    positions: tuple[PlannedPosition, ...]
    done: tuple[int, ...]
    """`positions`, `done`: The plan with retests, and how many points of each were taken."""
    current: int
    next_item: int
    """`current`, `next_item`: Which position and point come next; -1 where all were taken."""
    instruction: str
    """One sentence."""
    values: tuple[JudgedValue, ...]
    """Judged so far."""
    verdict: Verdict | None
    """If it were finished now; None before all is complete."""
    retests_left: int
    """How many are allowed still."""
    needs_temperature: bool
    """The temperature is to be noted before the next point."""
    refusals: tuple[str, ...]
    void_reasons: tuple[str, ...]
    """`refusals`, `void_reasons`: Sentences."""
    finished: bool
    abandoned: bool = False
    """`finished`, `abandoned`: Whether the verdict was given, or the test was ended without one."""
