"""The lines of a session file: what all guided procedures write; each adds its observations."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Generic, TypeAlias, TypeVar

import msgspec
import numpy as np

from ocmm_core import __version__
from ocmm_core.calibration.guided._procedure import ProcedureDecision, ProcedureKind
from ocmm_core.calibration.probe_design import require_temperature
from ocmm_core.camera import Rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.documents import decode_json, read_bytes
from ocmm_core.errors import CalibrationError, InputError
from ocmm_core.fieldbus.described import AllowedBy, load_device, refuse_unproven
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody

Spots: TypeAlias = tuple[tuple[tuple[float, float] | None, ...], ...]
"""Averaged spots (C, n) of all cameras, px; None where a spot was not seen."""


class SessionEvent(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """Base of all events."""

    utc: str
    """When, ISO 8601 text."""


class Begun(SessionEvent, frozen=True, kw_only=True):
    """First line: what is fixed for the whole session; each procedure adds its own."""

    rig: str
    rig_identity: str
    """`rig`, `rig_identity`: Name of the rig that the session starts from, and the hash of its
    document or record."""
    running: str
    """Hash of the calibration in force at the beginning; empty where there was none."""
    who: str
    """Who does it."""
    software: str
    """Version."""
    temperature_c: float | None
    """Of the surroundings; None where nobody measured it. InputError where it cannot be one."""

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

    decision: ProcedureDecision
    reason: str


CommonEvent: TypeAlias = Entered | Dropped | Forced | Warmed | Decided

E = TypeVar("E", bound=SessionEvent)
"""Union of the events that only one procedure has: its first line and its observations."""


class SessionLine(msgspec.Struct, Generic[E], frozen=True, forbid_unknown_fields=True):
    """One line of a session file."""

    event: E | CommonEvent


B = TypeVar("B", bound=Begun)


class SessionFormat(Generic[E, B]):
    """How the sessions of a procedure begin and go on, the same for all procedures.

    Parameters
    ----------
    lines
        Type of the lines.
    first
        Type of the first line.
    """

    def __init__(self, kind: ProcedureKind, lines: type[SessionLine[E]], first: type[B]) -> None:
        self._kind, self._lines, self._first = kind, lines, first

    def begin(
        self,
        folder: Path,
        rig: Rig,
        now: datetime,
        *,
        running: str,
        who: str,
        temperature_c: float | None,
        **own: object,
    ) -> tuple[ChainFile[SessionLine[E]], B]:
        """Return the file of a new session with its first line, which is on the disk.

        Parameters
        ----------
        own
            What only the first line of this procedure has.

        Raises
        ------
        InputError
            The cameras cannot prove the age or the order of their data, and the rig document does
            not allow that.
        StorageError
            The file cannot be written.
        """
        if rig.device:
            refuse_unproven(
                load_device(rig.device), allowed=rig.calibrate_unproven, by=AllowedBy.RIG
            )
        first: Callable[..., B] = self._first
        begun = first(
            utc=utc_text(now),
            rig=rig.name,
            rig_identity=rig.identity,
            running=running,
            who=who,
            software=__version__,
            temperature_c=temperature_c,
            **own,
        )
        chain = ChainFile(session_path(folder, self._kind, now), self._lines, remembered=True)
        line: SessionLine[Any] = SessionLine(begun)
        chain.append(line)
        return chain, begun

    def resume(self, path: Path) -> tuple[ChainFile[SessionLine[E]], B]:
        """Return the file of a session and its first line.

        Raises
        ------
        CalibrationError
            The file has no first line: the power went before it was on the disk.
        StorageError
            The file cannot be read, or is not as it was written.
        """
        chain = ChainFile(path, self._lines, remembered=True)
        begun = chain.items[0].event if chain.items else None
        if not isinstance(begun, self._first):
            raise CalibrationError(
                "session.empty", f"{path}: this session has no start entry.", "Start a new one."
            )
        return chain, begun


def require_probe(path: Path, begun_with: str, body: ProbeBody) -> None:
    """Refuse to go on with another probe than the one that a session was begun with.

    Parameters
    ----------
    begun_with
        Hash of the document of that probe.

    Raises
    ------
    CalibrationError
        It is another one.
    """
    if begun_with != body.identity:
        raise CalibrationError(
            "session.probe",
            f"{path}: this session was started with another probe.",
            "Continue it with that probe, or start a new one.",
        )


def utc_text(now: datetime) -> str:
    """Return a moment as it is written into sessions and records."""
    return now.astimezone(UTC).isoformat(timespec="microseconds")


def session_path(folder: Path, kind: ProcedureKind, now: datetime) -> Path:
    """Return the file of a session that begins now."""
    return folder / f"{kind.value}-{now.astimezone(UTC):%Y%m%dT%H%M%S%f}Z.jsonl"


def sessions(folder: Path, kind: ProcedureKind) -> tuple[Path, ...]:
    """Return the files of all sessions of a kind, the newest first."""
    return tuple(sorted(folder.glob(f"{kind.value}-*.jsonl"), reverse=True))


def is_ended(path: Path) -> bool:
    """Return whether the last whole line of a session file says that it was decided.

    What ended is never gone on with, so that whatever else it says needs no reading.
    """
    try:
        lines = read_bytes(path).rsplit(b"\n", 2)
        last = decode_json(lines[-2] if len(lines) > 1 else b"", dict[str, Any])
        return bool(last["item"]["event"]["type"] == Decided.__name__)
    except (InputError, msgspec.DecodeError, LookupError, TypeError):
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
