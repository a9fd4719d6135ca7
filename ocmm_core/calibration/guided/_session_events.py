"""Lines of a session file common to all guided procedures, and shocks of the probe."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Generic, TypeAlias, TypeVar

import msgspec
import numpy as np

from ocmm_core.acquisition.frames import FrameBlock, FrameFlag
from ocmm_core.build import build_version
from ocmm_core.calibration.guided._procedure import ProcedureDecision, ProcedureKind
from ocmm_core.calibration.probe_design import UNMEASURED_K, Temperature, require_temperature
from ocmm_core.calibration.records import MONITOR, ProbeStore, TipEventKind
from ocmm_core.camera import Rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.documents import decode_json, files_of_folder, read_bytes
from ocmm_core.errors import CalibrationError, InputError
from ocmm_core.fieldbus.described import AllowedBy, load_device, refuse_unproven
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking import ProbeBody

Spots: TypeAlias = tuple[tuple[tuple[float, float] | None, ...], ...]
"""Averaged spots (C, n) of all cameras, px; None for an unseen spot."""


class SessionEvent(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag=True):
    """Base of all events."""

    utc: str
    """ISO 8601 text."""


class SessionHeader(SessionEvent, frozen=True, kw_only=True):
    """First line: data fixed for the whole session; procedures extend it."""

    rig: str
    rig_identity: str
    """`rig`, `rig_identity`: Name of the initial rig, and the hash of its document or record."""
    running: str
    """Hash of the calibration in force at the start, or empty."""
    who: str
    software: str
    temperature_c: float | None
    """Ambient; None if not measured. InputError if implausible."""
    temperature_u: float | None = None
    """Expanded uncertainty (k = 2) of the thermometer, K."""
    thermometer: str = ""
    """Its name, or empty."""

    def __post_init__(self) -> None:
        """Refuse an implausible temperature; lengths of artefacts depend on it."""
        if self.temperature_c is not None:
            require_temperature("surroundings", self.temperature_c)

    @property
    def temperature(self) -> Temperature | None:
        """Return the temperature; None if not measured. Earlier versions stated no uncertainty."""
        if self.temperature_c is None:
            return None
        sigma_k = UNMEASURED_K if self.temperature_u is None else 0.5 * self.temperature_u
        return Temperature(self.temperature_c, sigma_k, self.thermometer)

    def require_certified(self) -> None:
        """Raise InputError if a certificate of the session does not cover the temperature."""
        artefacts = [getattr(self, name, None) for name in ("bar", "sphere")]
        for one in (*artefacts, *getattr(self, "spheres", ())):
            if one is not None:
                one.artefact.at(0.0, self.temperature)


def _of_temperature(temperature: Temperature | None) -> dict[str, object]:
    if temperature is None:
        return {"temperature_c": None}
    return {
        "temperature_c": temperature.celsius,
        "temperature_u": 2.0 * temperature.sigma_k,
        "thermometer": temperature.origin,
    }


class Reread(SessionEvent, frozen=True, kw_only=True):
    """The thermometer was read again during the session."""

    celsius: float
    expanded_k: float
    thermometer: str = ""


class Entered(SessionEvent, frozen=True, kw_only=True):
    """A step became the current one."""

    step: str


class Dropped(SessionEvent, frozen=True, kw_only=True):
    """The last observation of a step was removed."""

    step: str


class Forced(SessionEvent, frozen=True, kw_only=True):
    """The user overrules the guards that question how observations were recorded."""

    reason: str


class Warmed(SessionEvent, frozen=True, kw_only=True):
    """Sensor temperatures reported by the cameras, degrees Celsius, camera by camera."""

    sensors_c: tuple[float, ...]


class Decided(SessionEvent, frozen=True, kw_only=True):
    """The procedure ended."""

    decision: ProcedureDecision
    reason: str


CommonEvent: TypeAlias = Entered | Dropped | Forced | Warmed | Reread | Decided

E = TypeVar("E", bound=SessionEvent)
"""Union of the events specific to one procedure: its first line and observations."""


class SessionLine(msgspec.Struct, Generic[E], frozen=True, forbid_unknown_fields=True):
    """One line of a session file."""

    event: E | CommonEvent


B = TypeVar("B", bound=SessionHeader)


def reread(begun: B, readings: Sequence[Reread]) -> B:
    """Return the first line with the mean temperature; the range of readings adds to its U."""
    if begun.temperature_c is None or not readings:
        return begun
    all_c = [begun.temperature_c, *(one.celsius for one in readings)]
    stated = [2.0 * UNMEASURED_K if begun.temperature_u is None else begun.temperature_u]
    stated += [one.expanded_k for one in readings]
    half = 0.5 * (max(all_c) - min(all_c))
    return msgspec.structs.replace(
        begun,
        temperature_c=0.5 * (max(all_c) + min(all_c)),
        temperature_u=float(np.hypot(max(stated), 2.0 * half / np.sqrt(3.0))),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionSetup:
    """What a person states at the start of a session; each procedure has its own."""

    who: str
    temperature: Temperature | None = None
    """Of the room; None if not measured."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TipSetup(SessionSetup):
    """Setup of a procedure for one tip of a probe."""

    tip: str


X = TypeVar("X", bound=SessionSetup)


@dataclass(frozen=True, slots=True)
class SessionSite:
    """Instrument and folders of a session; plain data, so that another process can resume it."""

    sessions: Path
    rig: Rig
    """With the calibration in force, if any."""
    body: ProbeBody
    records: Path
    """Calibrations of the rig, or records of the probe."""
    cameras: Path | None = None
    """Calibrations of the rig for procedures of the probe, to warn of shared artefacts."""
    hold_s: float = 0.0
    """Additional rest of the ball."""


class SessionFormat(Generic[E, B]):
    """Session files of a procedure: creation and resumption."""

    def __init__(self, kind: ProcedureKind, lines: type[SessionLine[E]], first: type[B]) -> None:
        self._kind, self._lines, self._first = kind, lines, first

    def start(
        self, site: SessionSite, setup: SessionSetup, now: datetime, running: str,
        own: Mapping[str, object],
    ) -> tuple[ChainFile[SessionLine[E]], B]:  # fmt: skip
        """Create a session file with its first line on disk and return both.

        ``running``: hash of the record in force; ``own``: fields of the procedure's first line.
        InputError if the cameras cannot prove age or order of their data (unless the rig document
        allows that), StorageError if the file cannot be written.
        """
        rig = site.rig
        if rig.device:
            refuse_unproven(
                load_device(rig.device), allowed=rig.calibrate_unproven, by=AllowedBy.RIG
            )
        first: Callable[..., B] = self._first
        begun = first(
            utc=utc_text(now), rig=rig.name, rig_identity=rig.identity, running=running,
            who=setup.who, software=build_version(), **_of_temperature(setup.temperature), **own,
        )  # fmt: skip
        chain = ChainFile(
            session_path(site.sessions, self._kind, now), self._lines, remembered=True
        )
        line: SessionLine[Any] = SessionLine(begun)
        chain.append(line)
        return chain, begun

    def resume(self, path: Path) -> tuple[ChainFile[SessionLine[E]], B]:
        """Return a session file and its first line (CalibrationError if none); StorageError."""
        chain = ChainFile(path, self._lines, remembered=True)
        begun = chain.items[0].event if chain.items else None
        if not isinstance(begun, self._first):
            raise CalibrationError(
                "session.empty", f"{path}: this session has no start entry.", "Start a new one."
            )
        return chain, begun


def require_probe(path: Path, begun_with: str, body: ProbeBody) -> None:
    """Raise CalibrationError unless the document's hash is ``begun_with``."""
    if begun_with != body.identity:
        raise CalibrationError(
            "session.probe",
            f"{path}: this session was started with another probe.",
            "Continue it with that probe, or start a new one.",
        )


def utc_text(now: datetime) -> str:
    """Return a time as written into sessions and records."""
    return now.astimezone(UTC).isoformat(timespec="microseconds")


def session_path(folder: Path, kind: ProcedureKind, now: datetime) -> Path:
    """Return the path of a session that starts now."""
    return folder / f"{kind.value}-{now.astimezone(UTC):%Y%m%dT%H%M%S%f}Z.jsonl"


def sessions(folder: Path, kind: ProcedureKind) -> tuple[Path, ...]:
    """Return all session files of a kind, newest first."""
    found = files_of_folder(folder, ".jsonl")
    return tuple(path for path in reversed(found) if path.name.startswith(f"{kind.value}-"))


def is_ended(path: Path) -> bool:
    """Return whether the last complete line is a decision: ended sessions are never resumed."""
    try:
        lines = read_bytes(path).rsplit(b"\n", 2)
        last = decode_json(lines[-2] if len(lines) > 1 else b"", dict[str, Any])
        return bool(last["item"]["event"]["type"] == Decided.__name__)
    except (InputError, msgspec.DecodeError, LookupError, TypeError):
        return False


def to_spots(uv: Float) -> Spots:
    """Return averaged spots (C, n, 2), NaN if unseen, in file form."""
    return tuple(
        tuple((u, v) if np.isfinite(u) and np.isfinite(v) else None for u, v in of_camera)
        for of_camera in uv.tolist()
    )


def from_spots(spots: Spots) -> Float:
    """Return spots as an array (C, n, 2), NaN if unseen."""
    nothing = (np.nan, np.nan)
    return np.array([[nothing if one is None else one for one in camera] for camera in spots])


_AT_ONCE = timedelta(seconds=2)


@dataclass(slots=True)
class ShockDetector:
    """Finds the starts of shocks; each is reported by the frames of a second."""

    _felt: bool = False

    def push(self, block: FrameBlock) -> Int:
        """Return the indices (n,) of the frames in which a shock starts."""
        if not len(block):
            return np.empty(0, dtype=np.int64)
        felt = (block.flags & FrameFlag.DROPPED) != 0
        begun = np.flatnonzero(felt & ~np.concatenate([[self._felt], felt[:-1]]))
        self._felt = bool(felt[-1])
        return begun.astype(np.int64)


def record_shock(store: ProbeStore, now: datetime) -> None:
    """Record a shock unless the station has just done so; StorageError if impossible."""
    store.refresh()
    last = store.events[-1] if store.events else None
    written = last is not None and (last.kind, last.who) == (TipEventKind.DOUBTED, MONITOR)
    if last is None or not written or now - datetime.fromisoformat(last.utc) > _AT_ONCE:
        store.doubt(MONITOR, "Probe shock detected during the check.", now, now)


def require_no_doubt_since(store: ProbeStore, tip: str, begun: datetime) -> None:
    """Raise CalibrationError if the tip was suspected or mounted since a check started."""
    doubts = [
        one
        for one in store.events
        if one.tip == tip
        and one.kind in (TipEventKind.DOUBTED, TipEventKind.MOUNTED)
        and datetime.fromisoformat(one.utc) > begun
    ]
    if doubts:
        raise CalibrationError(
            "tip.doubt_meanwhile",
            f"The status of tip '{tip}' changed after this session was started "
            f"({doubts[-1].kind.value}: {doubts[-1].reason}).",
            "End it without storing and repeat it: earlier points prove nothing.",
        )
