"""The lines of a session file: what all guided procedures write; each adds its observations."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Generic, TypeAlias, TypeVar

import msgspec
import numpy as np

from ocmm_core.calibration.guided._procedure import Decision, Kind
from ocmm_core.calibration.probe_design import require_temperature
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float

Spots: TypeAlias = tuple[tuple[tuple[float, float] | None, ...], ...]
"""Averaged spots (C, n) of all cameras, px; None where a spot was not seen."""


class SessionEvent(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """Base of all events.

    Attributes
    ----------
    utc
        When, ISO 8601 text.
    """

    utc: str


class Begun(SessionEvent, frozen=True, kw_only=True):
    """First line: what is fixed for the whole session; each procedure adds its own.

    Attributes
    ----------
    rig, rig_identity
        Name of the rig that the session starts from, and the hash of its document or record.
    running
        Hash of the calibration in force at the beginning; empty where there was none.
    who
        Who does it.
    software
        Version.
    temperature_c
        Of the surroundings; None where nobody measured it. InputError where it cannot be one.
    """

    rig: str
    rig_identity: str
    running: str
    who: str
    software: str
    temperature_c: float | None

    def __post_init__(self) -> None:
        """Refuse a temperature that nobody measures at; lengths of artefacts rest on it."""
        if self.temperature_c is not None:
            require_temperature("surroundings", self.temperature_c)


class Entered(SessionEvent, frozen=True, kw_only=True):
    """A step became the current one."""

    step: str


class Dropped(SessionEvent, frozen=True, kw_only=True):
    """The last observation of a step was taken back."""

    step: str


class Forced(SessionEvent, frozen=True, kw_only=True):
    """A person overrules the guards that question how the observations were taken."""

    reason: str


class Warmed(SessionEvent, frozen=True, kw_only=True):
    """The cameras told how warm their sensors are, degrees Celsius, camera by camera."""

    sensors_c: tuple[float, ...]


class Decided(SessionEvent, frozen=True, kw_only=True):
    """The procedure ended."""

    decision: Decision
    reason: str


CommonEvent: TypeAlias = Entered | Dropped | Forced | Warmed | Decided

E = TypeVar("E", bound=SessionEvent)
"""Union of the events that only one procedure has: its first line and its observations."""


class SessionLine(msgspec.Struct, Generic[E], frozen=True, forbid_unknown_fields=True):
    """One line of a session file."""

    event: E | CommonEvent


def first_line(chain: ChainFile[SessionLine[E]]) -> E:
    """Return the first event of a session.

    Raises
    ------
    CalibrationError
        The file holds nothing: the power went before the first line was on the disk.
    """
    event = chain.items[0].event if chain.items else None
    if event is None or isinstance(event, CommonEvent):
        raise CalibrationError(
            "session.empty", f"{chain.path}: this session has no beginning.", "Begin a new one."
        )
    return event


def utc_text(now: datetime) -> str:
    """Return a moment as it is written into sessions and records."""
    return now.astimezone(UTC).isoformat(timespec="microseconds")


def session_path(folder: Path, kind: Kind, now: datetime) -> Path:
    """Return the file of a session that begins now."""
    return folder / f"{kind.value}-{now.astimezone(UTC):%Y%m%dT%H%M%S%f}Z.jsonl"


def sessions(folder: Path, kind: Kind) -> tuple[Path, ...]:
    """Return the files of all sessions of a kind, the newest first."""
    return tuple(sorted(folder.glob(f"{kind.value}-*.jsonl"), reverse=True))


def is_ended(path: Path) -> bool:
    """Return whether the last whole line of a session file says that it was decided.

    What ended is never gone on with, so that whatever else it says needs no reading.
    """
    try:
        lines = path.read_bytes().rsplit(b"\n", 2)
        last = msgspec.json.decode(lines[-2] if len(lines) > 1 else b"")
        return bool(last["item"]["event"]["type"] == Decided.__name__)
    except (OSError, msgspec.DecodeError, LookupError, TypeError):
        return False


def to_spots(uv: Float) -> Spots:
    """Return averaged spots (C, n, 2), NaN where not seen, as they are written."""
    return tuple(
        tuple((u, v) if np.isfinite(u) and np.isfinite(v) else None for u, v in of_camera)
        for of_camera in uv.tolist()
    )


def from_spots(spots: Spots) -> Float:
    """Return spots as an array (C, n, 2), NaN where not seen."""
    nothing = (np.nan, np.nan)
    return np.array([[nothing if one is None else one for one in camera] for camera in spots])
