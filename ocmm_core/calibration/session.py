"""The session of a guided procedure: events on the disk, and the state that follows from them.

Every event is one line of a chained file (`chain_file`) and is on the disk before the call that
made it returns. `GuidedProcedure` holds what all procedures have in common; a procedure says how
an event changes its state, and nothing else may change it, so that reading the file again gives
the same state.
"""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from datetime import UTC, datetime
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guards import Finding
from ocmm_core.calibration.history import CalibrationStore
from ocmm_core.calibration.procedure import Decision, Kind, Live, ProcedureView, Step
from ocmm_core.camera.rig import Rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError, OcmmError


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
        Of the surroundings; None where nobody measured it.
    """

    rig: str
    rig_identity: str
    running: str
    who: str
    software: str
    temperature_c: float | None


class Entered(SessionEvent, frozen=True, kw_only=True):
    """A step became the current one."""

    step: str


class Dropped(SessionEvent, frozen=True, kw_only=True):
    """The last observation of a step was taken back."""

    step: str


class Decided(SessionEvent, frozen=True, kw_only=True):
    """The procedure ended."""

    decision: Decision
    reason: str


E = TypeVar("E", bound=SessionEvent)
"""Union of the events that only one procedure has: its first line and its observations."""


class SessionLine(msgspec.Struct, Generic[E], frozen=True, forbid_unknown_fields=True):
    """One line of a session file."""

    event: E | Entered | Dropped | Decided


def utc_text(now: datetime) -> str:
    """Return a moment as it is written into sessions and records."""
    return now.astimezone(UTC).isoformat(timespec="microseconds")


def session_path(folder: Path, kind: Kind, now: datetime) -> Path:
    """Return the file of a session that begins now."""
    return folder / f"{kind.value}-{now.astimezone(UTC):%Y%m%dT%H%M%S%f}Z.jsonl"


def sessions(folder: Path, kind: Kind) -> tuple[Path, ...]:
    """Return the files of all sessions of a kind, the newest first."""
    return tuple(sorted(folder.glob(f"{kind.value}-*.jsonl"), reverse=True))


class GuidedProcedure(ABC, Generic[E]):
    """What all procedures do; see `procedure.Procedure`.

    Parameters
    ----------
    chain
        The session file with at least its first line.
    rig
        What the session starts from.
    store
        Takes what is accepted.

    Raises
    ------
    CalibrationError
        The session was begun with another rig.
    """

    kind: Kind
    step_names: tuple[str, ...]

    def __init__(
        self, chain: ChainFile[SessionLine[E]], begun: Begun, rig: Rig, store: CalibrationStore
    ) -> None:
        if begun.rig_identity != rig.identity:
            raise CalibrationError(
                "session.rig",
                f"{chain.path}: this session was begun with rig '{begun.rig}' as it was then, and "
                f"its document or calibration was changed since.",
                "Begin a new session.",
            )
        self.rig = rig
        self._store = store
        self._chain = chain
        self._first = begun
        self._lock = threading.RLock()
        self._step = self.step_names[0]
        self._decided: Decided | None = None
        self._error: Finding | None = None

    # What a procedure says about itself.

    @abstractmethod
    def _steps(self) -> tuple[Step, ...]:
        """Return the steps with their gates, as things are."""

    @abstractmethod
    def _live(self) -> Live:
        """Return what is seen now."""

    @abstractmethod
    def _observe(self, event: E) -> None:
        """Take an observation into the state."""

    @abstractmethod
    def _undo(self, step: str) -> None:
        """Take the last observation of a step out of the state."""

    @abstractmethod
    def _observation(self, utc: str) -> E:
        """Return what is seen now as an event; only called when `Live.ready`."""

    @abstractmethod
    def _forget(self) -> None:
        """Throw away results that rest on other observations."""

    @abstractmethod
    def _store_result(self, decided: Decided) -> None:
        """Put the result into the store, unless it is there."""

    @abstractmethod
    def watch(self, block: FrameBlock) -> None:
        """Look at frames; see `procedure.Procedure.watch`."""

    # What all of them do.

    @property
    def base(self) -> ProcedureView:
        """Return the part of the snapshot that all procedures have."""
        with self._lock:
            return ProcedureView(
                kind=self.kind,
                session=self._chain.path,
                rig=self._first.rig,
                begun_utc=self._first.utc,
                who=self._first.who,
                steps=self._steps(),
                current=self.step_names.index(self._step),
                live=self._live(),
                decision=Decision.OPEN if self._decided is None else self._decided.decision,
                error=self._error,
            )

    def take(self, now: datetime) -> None:
        """Take what is seen now; see `procedure.Procedure.take`."""
        with self._lock:
            live = self._live()
            if not live.ready:
                raise CalibrationError("session.not_ready", live.hint, "Then take it again.")
            self._append(self._observation(utc_text(now)))

    def drop(self, now: datetime) -> None:
        """Take back the last observation of the current step; without one, do nothing."""
        with self._lock:
            if self._has_observation(self._step):
                self._append(Dropped(utc=utc_text(now), step=self._step))

    def advance(self, now: datetime) -> None:
        """Enter the next step; raise CalibrationError where the gate is closed."""
        with self._lock:
            index = self.step_names.index(self._step)
            gate = self._steps()[index].gate
            if not gate.open:
                raise CalibrationError("session.gate", gate.reason, gate.remedy)
            if index + 1 < len(self.step_names):
                self._append(Entered(utc=utc_text(now), step=self.step_names[index + 1]))

    def back(self, now: datetime) -> None:
        """Return to the step before; observations are kept."""
        with self._lock:
            index = self.step_names.index(self._step)
            if index:
                self._append(Entered(utc=utc_text(now), step=self.step_names[index - 1]))

    def keep(self, now: datetime, reason: str) -> None:
        """End the procedure and leave everything as it was."""
        with self._lock:
            self._decide(Decision.KEPT, now, reason)

    def accept(self, now: datetime, reason: str) -> None:
        """Store the result and end the procedure; see `procedure.Procedure.accept`."""
        with self._lock:
            self._require_result()
            self._decide(Decision.ACCEPTED, now, reason)
            assert self._decided is not None  # noqa: S101 - what _decide has just set
            self._store_result(self._decided)

    @abstractmethod
    def _require_result(self) -> None:
        """Raise CalibrationError where there is nothing to be accepted."""

    @abstractmethod
    def _has_observation(self, step: str) -> bool:
        """Return whether something was taken in a step."""

    def _decide(self, decision: Decision, now: datetime, reason: str) -> None:
        if self._decided is None:
            self._append(Decided(utc=utc_text(now), decision=decision, reason=reason))
        elif self._decided.decision is not decision:
            raise _ended(self._decided)

    def _fold(self) -> None:
        """Bring the state to where the session file ends; the last act of a constructor."""
        for line in self._chain.items[1:]:
            self._change(line.event)

    def _append(self, event: E | Entered | Dropped | Decided) -> None:
        if self._decided is not None:
            raise _ended(self._decided)
        self._chain.append(SessionLine(event))
        self._change(event)

    def _change(self, event: E | Entered | Dropped | Decided) -> None:
        if isinstance(event, Decided):
            self._decided = event
        elif isinstance(event, Entered):
            self._step = event.step
        elif isinstance(event, Dropped):
            self._undo(event.step)
            self._forget()
        else:
            self._observe(event)
            self._forget()

    def _failed(self, error: OcmmError) -> None:
        """Keep what a calculation said against the observations."""
        self._error = Finding(error.code, error.what, error.remedy, refuses=True)


def first_line(chain: ChainFile[SessionLine[E]]) -> E:
    """Return the first event of a session.

    Raises
    ------
    CalibrationError
        The file holds nothing: the power went before the first line was on the disk.
    """
    event = chain.items[0].event if chain.items else None
    if event is None or isinstance(event, Entered | Dropped | Decided):
        raise CalibrationError(
            "session.empty", f"{chain.path}: this session has no beginning.", "Begin a new one."
        )
    return event


def _ended(decided: Decided) -> CalibrationError:
    return CalibrationError(
        "session.ended",
        f"This session has ended: {decided.decision.value}.",
        "Begin a new session.",
    )
