"""The state of a guided procedure, as it follows from its session file.

Every event is one line of a chained file (`chain_file`) and is on the disk before the call that
made it returns. `GuidedProcedure` holds what all procedures have in common; a procedure says how
an event changes its state, and nothing else may change it, so that reading the file again gives
the same state.
"""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime
from typing import Generic, Protocol, TypeVar

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guided._procedure import (
    Live,
    ProcedureDecision,
    ProcedureKind,
    ProcedureView,
    Step,
)
from ocmm_core.calibration.guided._session_events import (
    Begun,
    CommonEvent,
    Decided,
    Dropped,
    E,
    Entered,
    Forced,
    SessionLine,
    Warmed,
    utc_text,
)
from ocmm_core.calibration.records import CalibrationStore, Finding, ProbeStore
from ocmm_core.camera import Rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError, OcmmError, StorageError

WARMTH_STEP_K = 0.5

O = TypeVar("O")  # noqa: E741 - an outcome, as T is a type


class Dated(Protocol):
    """Something that happened at a time, ISO 8601 text."""

    @property
    def utc(self) -> str:
        """Return when."""
        ...


class Store(Protocol):
    """Where accepted results go."""

    @property
    def events(self) -> Sequence[Dated]:
        """Return what happened, oldest first."""
        ...


TORN = (
    "The last entry was being written when the program stopped: it is not in the session. "
    "Take that observation again."
)


class GuidedProcedure(ABC, Generic[E, O]):
    """What all procedures do; see `procedure.Procedure`.

    Parameters
    ----------
    chain
        The session file with at least its first line.
    begun
        That line.
    rig
        What the session starts from.
    store
        Where what is accepted will be.

    Raises
    ------
    CalibrationError
        The session was begun with another rig.
    """

    kind: ProcedureKind
    step_names: tuple[str, ...]

    def __init__(
        self, chain: ChainFile[SessionLine[E]], begun: Begun, rig: Rig, store: Store
    ) -> None:
        if begun.rig_identity != rig.identity:
            raise CalibrationError(
                "session.rig",
                f"{chain.path}: this session was started with rig '{begun.rig}', whose document "
                "or calibration has changed since.",
                "Start a new session.",
            )
        self.rig = rig
        self._accepted = store
        self._chain = chain
        self._torn = TORN if chain.torn else ""
        self._lost = ""
        # With the rest of a line that a crash cut off, which the next line replaces.
        self._size = chain.path.stat().st_size
        self._first = begun
        self._lock = threading.RLock()
        self._step = self.step_names[0]
        self._decided: Decided | None = None
        self._forced = False
        self._sensors_c: tuple[float, ...] = ()
        self._version = 0
        self._outcome: O | None = None
        self._error: Finding | None = None
        self._kept_steps: tuple[object, tuple[Step, ...]] | None = None

    # What a procedure says about itself.

    @abstractmethod
    def _steps(self) -> tuple[Step, ...]:
        """Return the steps with their gates, as things are."""

    def _steps_rest_on(self) -> object:
        """Return what the steps rest on beside what was taken; None where on what is seen now."""
        return None

    @abstractmethod
    def _seen(self) -> Live:
        """Return what is seen now."""

    @abstractmethod
    def _wants(self) -> bool:
        """Return whether the current step takes another observation."""

    @abstractmethod
    def _observation(self, utc: str) -> E:
        """Return what is seen now as an event; only called when `Live.ready` and `_wants`."""

    @abstractmethod
    def _observe(self, event: E) -> None:
        """Take an observation into the state."""

    @abstractmethod
    def _has_observation(self, step: str) -> bool:
        """Return whether something was taken in a step."""

    @abstractmethod
    def _undo(self, step: str) -> None:
        """Take the last observation of a step out of the state."""

    @abstractmethod
    def _calculation(self) -> Callable[[], O]:
        """Return what calculates the result of the observations so far, apart from the state."""

    @abstractmethod
    def _put(self, outcome: O, decided: Decided) -> None:
        """Put an accepted result into the store."""

    @abstractmethod
    def _in_force(self) -> str:
        """Return the hash of what an accepted result would replace; empty where there is none."""

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
                steps=self._steps_now(),
                current=self.step_names.index(self._step),
                live=self._live(),
                decision=ProcedureDecision.OPEN
                if self._decided is None
                else self._decided.decision,
                stored=self._is_stored(),
                error=self._error,
                torn=self._torn,
            )

    def _steps_now(self) -> tuple[Step, ...]:
        """Return the steps; who shows them asks many times between two observations."""
        others = self._steps_rest_on()
        if others is None:
            return self._steps()
        rest_on = self._version, others
        if self._kept_steps is None or self._kept_steps[0] != rest_on:
            self._kept_steps = rest_on, self._steps()
        return self._kept_steps[1]

    def _live(self) -> Live:
        seen = self._seen()
        if self._lost:
            return replace(seen, ready=False, hint=self._lost)
        if self._decided is not None or not self._wants():
            return replace(seen, ready=False, hint="Nothing to take in this step.")
        return seen

    def require_name(self) -> None:
        """Raise StorageError if the file is lost; see `procedure.Procedure.require_name`."""
        try:
            self._chain.require_name()
        except StorageError as error:
            self._lost = error.what
            raise

    def take(self, now: datetime) -> None:
        """Take what is seen now; see `procedure.Procedure.take`."""
        with self._lock:
            live = self._live()
            if not live.ready:
                raise CalibrationError("session.not_ready", live.hint, "Then repeat it.")
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
            gate = self._steps_now()[index].gate
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

    def force(self, now: datetime, reason: str) -> None:
        """Overrule the guards that question how the observations were taken; see `guards`."""
        with self._lock:
            self._append(Forced(utc=utc_text(now), reason=reason))

    def record_temperature(self, now: datetime, sensors_c: Sequence[float | None]) -> None:
        """Keep how warm the cameras' sensors are while observations are taken.

        A change of less than `WARMTH_STEP_K` is no news; once there is a result, it stays as it
        is.

        Parameters
        ----------
        sensors_c
            Degrees Celsius, camera by camera; nothing is kept where one is not known.
        """
        known = tuple(value for value in sensors_c if value is not None)
        with self._lock:
            open_ = self._decided is None and self._outcome is None
            if not open_ or len(known) != len(self.rig.cameras):
                return
            pairs = zip(known, self._sensors_c, strict=False)
            if not self._sensors_c or any(abs(a - b) >= WARMTH_STEP_K for a, b in pairs):
                self._append(Warmed(utc=utc_text(now), sensors_c=known))

    def compute(self, elsewhere: Callable[[], O] | None = None) -> None:
        """Calculate the result of the observations so far; see `procedure.Procedure.compute`.

        ``elsewhere`` returns what another process calculated that resumed the same session.
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
            # What was taken meanwhile makes the result one of other observations.
            if version == self._version:
                self._outcome, self._error = outcome, None

    def accept(self, now: datetime, reason: str) -> None:
        """Store the result and end the procedure; see `procedure.Procedure.accept`."""
        with self._lock:
            if self._outcome is None:
                raise CalibrationError("session.no_result", "No result yet.", "Calculate it first.")
            self._check(self._outcome)
            decided = self._decide(ProcedureDecision.ACCEPTED, now, reason)
            if not self._is_stored():
                self._put(self._outcome, decided)

    def keep(self, now: datetime, reason: str) -> None:
        """End the procedure and leave everything as it was."""
        with self._lock:
            self._decide(ProcedureDecision.KEPT, now, reason)

    def _check(self, outcome: O) -> None:
        """Raise CalibrationError where a result may not be stored as things are."""
        if self._first.running != self._in_force() and not self._is_stored():
            raise CalibrationError(
                "session.overtaken",
                "Another calibration has been activated since this session was started.",
                "Start a new session.",
            )

    def _is_stored(self) -> bool:
        decided = self._decided
        return decided is not None and any(one.utc == decided.utc for one in self._accepted.events)

    def _decide(self, decision: ProcedureDecision, now: datetime, reason: str) -> Decided:
        if self._decided is not None:
            if self._decided.decision is not decision:
                raise self._ended(self._decided)
            return self._decided
        decided = Decided(utc=utc_text(now), decision=decision, reason=reason)
        self._append(decided)
        return decided

    def _fold(self) -> None:
        """Bring the state to where the session file ends; the last act of a constructor."""
        for line in self._chain.items[1:]:
            self._change(line.event)

    def _refuse_older(self, which: str) -> None:
        """Refuse to go on with a session that an earlier version began and that lacks something.

        Parameters
        ----------
        which
            What that version did not do, as a relative clause; without it nobody could tell
            whether something moved meanwhile. A session that has ended may still be looked at.
        """
        if self._decided is None:
            raise CalibrationError(
                "session.older",
                f"{self._chain.path}: this session was started by an earlier version, which "
                f"{which}: movement in the meantime could go unnoticed.",
                "Start a new session.",
            )

    def _append(self, event: E | CommonEvent) -> None:
        if self._decided is not None:
            raise self._ended(self._decided)
        self.require_name()
        if self._size != self._chain.path.stat().st_size:
            # Appending would write over what somebody else has taken meanwhile.
            raise CalibrationError(
                "session.elsewhere",
                f"{self._chain.path}: another program is using this session.",
                "Close the other one, then open the session again.",
            )
        self._chain.append(SessionLine(event))
        self._size = self._chain.path.stat().st_size
        self._change(event)

    def _change(self, event: E | CommonEvent) -> None:
        if isinstance(event, Decided):
            self._decided = event
        elif isinstance(event, Entered):
            self._step = event.step
        else:
            if isinstance(event, Dropped):
                self._undo(event.step)
            elif isinstance(event, Forced):
                self._forced = True
            elif isinstance(event, Warmed):
                self._sensors_c = event.sensors_c
            else:
                self._observe(event)
            self._version += 1
            self._outcome, self._error = None, None

    def _ended(self, decided: Decided) -> CalibrationError:
        return CalibrationError(
            "session.ended",
            f"{self._chain.path}: this session has ended: {decided.decision.value}.",
            "Start a new session.",
        )


class CameraProcedure(GuidedProcedure[E, O]):
    """A procedure about the cameras of a rig; see `GuidedProcedure`."""

    def __init__(
        self, chain: ChainFile[SessionLine[E]], begun: Begun, rig: Rig, store: CalibrationStore
    ) -> None:
        super().__init__(chain, begun, rig, store)
        self._store = store

    def _in_force(self) -> str:
        return self._store.active_hash or ""


class ProbeProcedure(GuidedProcedure[E, O]):
    """A procedure about a probe with one of its tips; see `GuidedProcedure`.

    Parameters
    ----------
    store
        Records of the probe.
    tip
        Name of the tip.
    """

    def __init__(
        self, chain: ChainFile[SessionLine[E]], begun: Begun, rig: Rig, store: ProbeStore, tip: str
    ) -> None:
        super().__init__(chain, begun, rig, store)
        self._store = store
        self.tip = tip

    def _in_force(self) -> str:
        return self._store.active_hash(self.tip) or ""
