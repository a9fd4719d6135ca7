"""Guided procedures: steps with gates, seen as immutable snapshots.

Push frames, record or drop observations, enter the next step. Screens poll the snapshot `view`
(`_procedure_views`). Every event is one line of a chained session file (`chain_file`), on disk
before the call returns; the state is a pure fold over these lines, so `resume` restores a killed
procedure. Calibrations (`_session`) and acceptance tests extend `Procedure`.

The procedures, each with ``start`` and ``resume`` (see their modules):

- `cameras.KnownPointsProcedure`: ``prepare``, ``collect``, ``result``
- `relocation.RelocationProcedure`: ``prepare``, ``seats``, ``wave``, ``bar``, ``world``, ``again``,
  ``result``
- `verification.VerificationProcedure`: ``prepare``, ``seats``, ``lines``, ``spheres``, ``again``,
  ``result``
- `cameras.TrackerProcedure`: ``prepare``, ``rest``, ``places``, ``result``
- `sweeping.PivotProcedure`: ``prepare``, ``first``, ``second``, ``again``, ``result``

``start`` writes what is fixed for the session (rig, artefacts, people, temperature). `compute` may
take seconds; call it from a separate thread or process. Its result is not stored: the same
observations reproduce it.
"""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from enum import StrEnum
from pathlib import Path
from typing import Any

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import Finding
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError, OcmmError, StorageError
from ocmm_core.geometry import Int, Pixels

REREAD_AFTER = timedelta(minutes=30)
"""Age of a typed temperature from which observations need a new reading."""


class ProcedureKind(StrEnum):
    """Kind of procedure; session files start with this name."""

    KNOWN_POINTS = "known-points"
    RELOCATION = "relocation"
    VERIFICATION = "verification"
    PIVOT = "pivot"
    QUALIFICATION = "qualification"
    TIP_CHECK = "tip-check"
    TRACKER = "tracker"


class ProcedureDecision(StrEnum):
    """How a procedure ended."""

    OPEN = "open"
    ACCEPTED = "accepted"
    KEPT = "kept the old one"


@dataclass(frozen=True, slots=True)
class Gate:
    """Permission to enter the next step."""

    open: bool
    reason: str = ""
    remedy: str = ""
    """`reason`, `remedy`: Why it is closed, and what to do; one sentence each, empty if open."""


OPEN = Gate(True)
LAST_OF_CALIBRATION = Gate(
    False, "This is the last step.", "Accept the new calibration, or keep the old one."
)


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a procedure."""

    name: str
    title: str
    instruction: str
    """`title`, `instruction`: User text: a few words, and the present task."""
    gate: Gate
    """Leads out of this step."""
    done: int = 0
    wanted: int = 0
    """`done`, `wanted`: Observations of this step; zero wanted if not counted."""


@dataclass(frozen=True, slots=True)
class CameraLive:
    """Current spots of one camera."""

    name: str
    uv: Pixels
    """(k, 2), px: its spots in the latest frame."""
    labels: Int
    """(k,): LED number of each spot, -1 if unknown."""


@dataclass(frozen=True, slots=True)
class Live:
    """Current view, and whether it can be recorded."""

    cameras: tuple[CameraLive, ...] = ()
    """One for each camera; empty before the first frame."""
    ready: bool = False
    """`record` would store it now."""
    hint: str = "No frames yet."
    """Why not, or the next task, in one sentence."""
    frames: int = 0
    wanted: int = 0
    """`frames`, `wanted`: Frames in the current average, and the number that completes it."""
    motion_px: float = float("nan")
    """Motion of the spots during the average, px; NaN without an average."""


@dataclass(frozen=True, slots=True)
class ProcedureView:
    """Common part of the snapshots of all procedures."""

    kind: StrEnum
    """One of `ProcedureKind`, or of another package's enumeration."""
    session: Path
    rig: str
    begun_utc: str
    who: str
    """`begun_utc`, `who`: ISO 8601 text, and the operator."""
    steps: tuple[Step, ...]
    current: int
    live: Live
    decision: ProcedureDecision
    """Outcome; `ProcedureDecision.OPEN` until it has ended."""
    stored: bool
    """The accepted result is in the store; if not, `compute` and `accept` put it there."""
    error: Finding | None
    """Objection of the last calculation, or None."""
    torn: str = ""
    """Message about an entry being written when the program stopped, or empty."""

    @property
    def step(self) -> Step:
        return self.steps[self.current]


def require_fresh_temperature(read: datetime | None, now: datetime) -> None:
    """Raise CalibrationError if a temperature was read too long ago; None if never."""
    if read is not None and now - read > REREAD_AFTER:
        raise CalibrationError(
            "session.temperature_old",
            f"The temperature was read {(now - read).total_seconds() / 60.0:.0f} min ago.",
            "Read the thermometer again, and enter it when you resume this session.",
        )


class SessionLog:
    """Events of a session file; ``change`` adds one to the state. ``lock`` guards both."""

    def __init__(self, chain: ChainFile[Any], line: Callable[[Any], Any]) -> None:
        self.chain, self._line = chain, line
        self.lock = threading.RLock()
        self.torn = chain.torn
        """An incomplete last line was dropped when the file was opened."""
        self.lost = ""
        """Why the file is lost, or empty."""

    @property
    def path(self) -> Path:
        return self.chain.path

    def replay(self, change: Callable[[Any], None]) -> None:
        """Add all events after the first line to the state."""
        for line in self.chain.items[1:]:
            change(line.event)

    def append(self, event: object, change: Callable[[Any], None]) -> None:
        """Store an event, then add it to the state; StorageError if not stored."""
        self.chain.append(self._line(event))
        change(event)

    def require_name(self) -> None:
        """Raise StorageError if the session file is not on the disk under its name."""
        try:
            self.chain.require_name()
        except StorageError as error:
            self.lost = error.what
            raise


class Procedure(ABC):
    """A guided procedure; thread-safe. Times come from the caller, for tests."""

    kind: StrEnum
    gate_code = "session.gate"
    torn = (
        "The last entry was being written when the program stopped: it is not in the session. "
        "Take that observation again."
    )

    def __init__(self, log: SessionLog) -> None:
        self._log, self._lock = log, log.lock
        self._outcome: Any = None
        self._error: Finding | None = None
        self._version = 0
        """Counts changes of the observations."""

    # Implemented by each kind of session.

    @property
    @abstractmethod
    def _started(self) -> tuple[str, str, str]:
        """Return rig, time (ISO 8601 text) and operator of the first line."""

    @abstractmethod
    def _steps_now(self) -> tuple[Step, ...]:
        """Return the steps with their current gates."""

    @property
    @abstractmethod
    def _current(self) -> int:
        """Return the index of the current step."""

    @abstractmethod
    def _enter(self, step: int, now: datetime) -> None:
        """Make a step the current one."""

    @abstractmethod
    def _live(self) -> Live:
        """Return the current view while the file is not lost."""

    @abstractmethod
    def _store_observation(self, now: datetime) -> None:
        """Store the current view as the next observation; only called if `Live.ready`."""

    @abstractmethod
    def _read_at(self) -> datetime | None:
        """Return the time of the last thermometer reading; None without a temperature."""

    @abstractmethod
    def _calculation(self) -> Callable[[], Any]:
        """Return the calculation for the present observations, independent of the state."""

    @property
    @abstractmethod
    def _ended_as(self) -> ProcedureDecision:
        pass

    @abstractmethod
    def _is_stored(self) -> bool:
        pass

    @property
    @abstractmethod
    def view(self) -> Any:
        """Return the snapshot of the procedure, with `base`."""

    @abstractmethod
    def watch(self, block: FrameBlock) -> None:
        """Process frames in the order of exposure; never records anything."""

    @abstractmethod
    def drop(self, now: datetime) -> None:
        """Remove the last observation of the current step, if any."""

    @abstractmethod
    def record_temperature(self, now: datetime, sensors_c: Sequence[float | None]) -> None:
        """Record the sensor temperatures, degrees Celsius, camera by camera; None: unknown."""

    @abstractmethod
    def note_temperature(self, now: datetime, temperature: Temperature) -> None:
        """Record a new reading of the thermometer in the room; InputError if not certified."""

    @abstractmethod
    def accept(self, now: datetime, reason: str) -> None:
        """Store the result in the rig's calibrations and end the procedure.

        A calibration is then in force, and SUSPECT until a verification passes. The verdict of a
        verification is stored in any case. Repeat the call if it was interrupted. CalibrationError
        without a result, or after another decision.
        """

    @abstractmethod
    def keep(self, now: datetime, reason: str) -> None:
        """End the procedure without changes to the store."""

    # Common to all.

    @property
    def base(self) -> ProcedureView:
        """Return the common part of the snapshot."""
        with self._lock:
            rig, begun_utc, who = self._started
            return ProcedureView(
                kind=self.kind, session=self._log.path, rig=rig, begun_utc=begun_utc, who=who,
                steps=self._steps_now(), current=self._current, live=self._seen_now(),
                decision=self._ended_as, stored=self._is_stored(), error=self._error,
                torn=self.torn if self._log.torn else "",
            )  # fmt: skip

    def _seen_now(self) -> Live:
        lost = self._log.lost
        return replace(self._live(), ready=False, hint=lost) if lost else self._live()

    def require_name(self) -> None:
        """Raise StorageError if the session file lost its name, and stop recording. Cheap."""
        self._log.require_name()

    def record(self, now: datetime) -> None:
        """Record the current view as the next observation of the current step.

        CalibrationError, with the reason, unless `Live.ready`; StorageError if not stored.
        """
        with self._lock:
            live = self._seen_now()
            if not live.ready:
                raise self._not_ready(live.hint)
            require_fresh_temperature(self._read_at(), now)
            self._store_observation(now)

    def advance(self, now: datetime) -> None:
        """Enter the next step; CalibrationError, with reason and remedy, if the gate is closed."""
        with self._lock:
            steps, index = self._steps_now(), self._current
            gate = steps[index].gate
            if not gate.open:
                raise CalibrationError(self.gate_code, gate.reason, gate.remedy)
            if index + 1 < len(steps):
                self._enter(index + 1, now)

    def back(self, now: datetime) -> None:
        """Return to the previous step; observations are kept."""
        with self._lock:
            if self._current:
                self._enter(self._current - 1, now)

    def compute(self, elsewhere: Callable[[], Any] | None = None) -> None:
        """Calculate the result, up to some seconds; CalibrationError, also in the snapshot.

        ``elsewhere``: result of another process for this session.
        """
        with self._lock:
            calculate, version = elsewhere or self._calculation(), self._version
        try:
            outcome = calculate()
        except OcmmError as error:
            with self._lock:
                if version == self._version:
                    self._error = Finding(error.code, error.what, error.remedy, refuses=True)
            raise
        with self._lock:
            if version == self._version:
                self._outcome, self._error = outcome, None

    def _not_ready(self, hint: str) -> CalibrationError:
        return CalibrationError("session.not_ready", hint, "Then repeat it.")

    def _outdate(self) -> None:
        """Drop a result whose observations have changed."""
        self._version += 1
        self._outcome, self._error = None, None
