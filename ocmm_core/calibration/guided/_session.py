"""State of a guided procedure, folded from its session file.

Every event is one line of a chained file (`chain_file`), on disk before its call returns; nothing
else may change the state. `GuidedProcedure` is the common base.
"""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime, timedelta
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
    CommonEvent,
    Decided,
    Dropped,
    E,
    Entered,
    Forced,
    Reread,
    SessionHeader,
    SessionLine,
    Warmed,
    reread,
    utc_text,
)
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import CalibrationStore, Finding, ProbeStore
from ocmm_core.camera import Rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError, OcmmError, StorageError

WARMTH_STEP_K = 0.5
REREAD_AFTER = timedelta(minutes=30)
"""Age of a typed temperature from which observations need a new reading."""

O = TypeVar("O")  # noqa: E741 - an outcome, as T is a type


class Dated(Protocol):
    """Anything with a time, ISO 8601 text."""

    @property
    def utc(self) -> str: ...


class Store(Protocol):
    """Destination of accepted results."""

    @property
    def events(self) -> Sequence[Dated]: ...


TORN = (
    "The last entry was being written when the program stopped: it is not in the session. "
    "Take that observation again."
)


def require_fresh_temperature(read: datetime | None, now: datetime) -> None:
    """Raise CalibrationError if a temperature was read too long ago; None if never."""
    if read is not None and now - read > REREAD_AFTER:
        raise CalibrationError(
            "session.temperature_old",
            f"The temperature was read {(now - read).total_seconds() / 60.0:.0f} min ago.",
            "Read the thermometer again, and enter it when you resume this session.",
        )


class GuidedProcedure(ABC, Generic[E, O]):
    """Base of all procedures; see `procedure.Procedure`.

    ``chain`` has at least its first line, ``begun``; ``store`` gets the accepted result.
    CalibrationError if the session was started with another rig.
    """

    kind: ProcedureKind
    step_names: tuple[str, ...]

    def __init__(
        self, chain: ChainFile[SessionLine[E]], begun: SessionHeader, rig: Rig, store: Store
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
        # Including a line cut off by a crash, which the next line replaces.
        self._size = chain.path.stat().st_size
        self._first = self._typed = begun
        self._readings: list[Reread] = []
        self._lock = threading.RLock()
        self._step = self.step_names[0]
        self._decided: Decided | None = None
        self._forced = False
        self._sensors_c: tuple[float, ...] = ()
        self._version = 0
        self._outcome: O | None = None
        self._error: Finding | None = None
        self._kept_steps: tuple[object, tuple[Step, ...]] | None = None

    # Implemented by each procedure.

    @abstractmethod
    def _steps(self) -> tuple[Step, ...]:
        """Return the steps with their current gates."""

    def _steps_rest_on(self) -> object:
        """Return a key of further inputs of the steps; None disables caching of the steps."""
        return None

    @abstractmethod
    def _seen(self) -> Live:
        pass

    @abstractmethod
    def _wants(self) -> bool:
        """Return whether the current step accepts another observation."""

    @abstractmethod
    def _observation(self, utc: str) -> E:
        """Return the current view as an event; only called when `Live.ready` and `_wants`."""

    @abstractmethod
    def _observe(self, event: E) -> None:
        """Add an observation to the state."""

    @abstractmethod
    def _has_observation(self, step: str) -> bool:
        """Return whether a step has observations."""

    @abstractmethod
    def _undo(self, step: str) -> None:
        """Remove the last observation of a step from the state."""

    @abstractmethod
    def _calculation(self) -> Callable[[], O]:
        """Return the calculation for the present observations, independent of the state."""

    @abstractmethod
    def _put(self, outcome: O, decided: Decided) -> None:
        """Put an accepted result into the store."""

    @abstractmethod
    def _in_force(self) -> str:
        """Return the hash of the record that an accepted result would replace, or empty."""

    @abstractmethod
    def watch(self, block: FrameBlock) -> None:
        """Process frames; see `procedure.Procedure.watch`."""

    # Common to all procedures.

    @property
    def base(self) -> ProcedureView:
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
        """Return the steps, cached because views poll them between observations."""
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
        """Record the current observation; see `procedure.Procedure.take`."""
        with self._lock:
            live = self._live()
            if not live.ready:
                raise CalibrationError("session.not_ready", live.hint, "Then repeat it.")
            require_fresh_temperature(self._read_at(), now)
            self._append(self._observation(utc_text(now)))

    def drop(self, now: datetime) -> None:
        with self._lock:
            if self._has_observation(self._step):
                self._append(Dropped(utc=utc_text(now), step=self._step))

    def advance(self, now: datetime) -> None:
        """Enter the next step; raise CalibrationError if the gate is closed."""
        with self._lock:
            index = self.step_names.index(self._step)
            gate = self._steps_now()[index].gate
            if not gate.open:
                raise CalibrationError("session.gate", gate.reason, gate.remedy)
            if index + 1 < len(self.step_names):
                self._append(Entered(utc=utc_text(now), step=self.step_names[index + 1]))

    def back(self, now: datetime) -> None:
        with self._lock:
            index = self.step_names.index(self._step)
            if index:
                self._append(Entered(utc=utc_text(now), step=self.step_names[index - 1]))

    def force(self, now: datetime, reason: str) -> None:
        """Overrule the guards that question how the observations were taken; see `guards`."""
        with self._lock:
            self._append(Forced(utc=utc_text(now), reason=reason))

    def record_temperature(self, now: datetime, sensors_c: Sequence[float | None]) -> None:
        """Record sensor temperatures, °C, before a result; ignores steps below `WARMTH_STEP_K`."""
        known = tuple(value for value in sensors_c if value is not None)
        with self._lock:
            open_ = self._decided is None and self._outcome is None
            if not open_ or len(known) != len(self.rig.cameras):
                return
            pairs = zip(known, self._sensors_c, strict=False)
            if not self._sensors_c or any(abs(a - b) >= WARMTH_STEP_K for a, b in pairs):
                self._append(Warmed(utc=utc_text(now), sensors_c=known))

    def note_temperature(self, now: datetime, temperature: Temperature) -> None:
        """Record a room temperature, to count at the mean; InputError if not certified."""
        event = Reread(
            utc=utc_text(now), celsius=temperature.celsius,
            expanded_k=2.0 * temperature.sigma_k, thermometer=temperature.origin,
        )  # fmt: skip
        with self._lock:
            reread(self._typed, [*self._readings, event]).require_certified()
            self._append(event)

    def _read_at(self) -> datetime | None:
        """Return the time of the last thermometer reading; None without a temperature."""
        last = self._readings[-1] if self._readings else self._typed
        return None if self._typed.temperature_c is None else datetime.fromisoformat(last.utc)

    def compute(self, elsewhere: Callable[[], O] | None = None) -> None:
        """Calculate the result; ``elsewhere``: result of another process for this session."""
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
        with self._lock:
            self._decide(ProcedureDecision.KEPT, now, reason)

    def _check(self, outcome: O) -> None:
        """Raise CalibrationError if a result may not be stored now."""
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
        for line in self._chain.items[1:]:
            self._change(line.event)

    def _refuse_older(self, which: str) -> None:
        """Refuse to resume a session of an older version, which lacks ``which``."""
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
            # Appending would overwrite lines of another program.
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
            elif isinstance(event, Reread):
                self._readings.append(event)
                self._first = reread(self._typed, self._readings)
                # Procedures and their states keep the first line as their own type.
                for holder, name in ((self, "_begun"), (getattr(self, "_state", None), "begun")):
                    if hasattr(holder, name):
                        setattr(holder, name, self._first)
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
    """Base of procedures for the cameras of a rig; see `GuidedProcedure`."""

    def __init__(
        self,
        chain: ChainFile[SessionLine[E]],
        begun: SessionHeader,
        rig: Rig,
        store: CalibrationStore,
    ) -> None:
        super().__init__(chain, begun, rig, store)
        self._store = store

    def _in_force(self) -> str:
        return self._store.active_hash or ""


class ProbeProcedure(GuidedProcedure[E, O]):
    """Base of procedures for a probe with one of its tips; see `GuidedProcedure`."""

    def __init__(
        self,
        chain: ChainFile[SessionLine[E]],
        begun: SessionHeader,
        rig: Rig,
        store: ProbeStore,
        tip: str,
    ) -> None:
        super().__init__(chain, begun, rig, store)
        self._store = store
        self.tip = tip

    def _in_force(self) -> str:
        return self._store.active_hash(self.tip) or ""
