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
    """A snapshot for any screen.

    Attributes
    ----------
    title, wording
        Of the procedure.
    positions, done
        The plan with retests, and how many points of each were taken.
    current, next_item
        Which position and point come next; -1 where all were taken.
    instruction
        One sentence.
    values
        Judged so far.
    verdict
        If it were finished now; None before all is complete.
    retests_left
        How many are allowed still.
    needs_temperature
        The temperature is to be noted before the next point.
    refusals, void_reasons
        Sentences.
    finished, abandoned
        Whether the verdict was given, or the test was ended without one.
    """

    title: str
    wording: str
    positions: tuple[PlannedPosition, ...]
    done: tuple[int, ...]
    current: int
    next_item: int
    instruction: str
    values: tuple[JudgedValue, ...]
    verdict: Verdict | None
    retests_left: int
    needs_temperature: bool
    refusals: tuple[str, ...]
    void_reasons: tuple[str, ...]
    finished: bool
    abandoned: bool = False
