"""State of a guided calibration, folded from its session file; `GuidedProcedure` is the base."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Generic, Protocol, Self, TypeVar

from ocmm_core.calibration.guided import _procedure as procedure
from ocmm_core.calibration.guided._session_events import (
    B,
    CommonEvent,
    Decided,
    Dropped,
    E,
    Entered,
    Forced,
    Reread,
    SessionFormat,
    SessionLine,
    SessionSite,
    TipSetup,
    Warmed,
    X,
    reread,
    utc_text,
)
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import CalibrationStore, ProbeStore
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError

WARMTH_STEP_K = 0.5

O = TypeVar("O")  # noqa: E741 - an outcome, as T is a type


T = TypeVar("T", bound=TipSetup)


class Dated(Protocol):
    """Anything with a time, ISO 8601 text."""

    @property
    def utc(self) -> str: ...


class Store(Protocol):
    """Destination of accepted results."""

    @property
    def events(self) -> Sequence[Dated]: ...

    def refresh(self) -> None: ...


class GuidedProcedure(procedure.Procedure, Generic[E, O, B, X]):
    """Base of all calibrations.

    ``chain`` has at least its first line, ``begun``; the store gets the accepted result.
    CalibrationError if the session was started with another rig, or with a tracker and the
    procedure is `for_cameras` only, or the reverse.
    """

    kind: procedure.ProcedureKind
    for_cameras = True
    for_trackers = False
    sessions: SessionFormat[E, B]
    _store: Store
    _outcome: O | None
    step_names: tuple[str, ...]

    def __init__(self, site: SessionSite, chain: ChainFile[SessionLine[E]], begun: B) -> None:
        rig = site.rig
        if rig.markers is not None and not self.for_trackers:
            raise CalibrationError(
                "session.tracker",
                f"'{rig.name}' is a tracker: this procedure is for cameras and does not apply.",
                "Give the rig of the cameras. How to measure with a tracker: manual, Optical "
                "trackers.",
            )
        if rig.markers is None and not self.for_cameras:
            raise CalibrationError(
                "session.cameras",
                f"'{rig.name}' is a rig of cameras: this procedure is for trackers.",
                "Give the document of the tracker (schema ocmm.tracker/1) as the rig.",
            )
        if begun.rig_identity != rig.identity:
            raise CalibrationError(
                "session.rig",
                f"{chain.path}: this session was started with rig '{begun.rig}', whose document "
                "or calibration has changed since.",
                "Start a new session.",
            )
        super().__init__(procedure.SessionLog(chain, SessionLine))
        self.rig = rig
        # Including a line cut off by a crash, which the next line replaces.
        self._size = chain.path.stat().st_size
        self._begun = self._typed = begun
        self._readings: list[Reread] = []
        self._step = self.step_names[0]
        self._decided: Decided | None = None
        self._forced = False
        self._sensors_c: tuple[float, ...] = ()
        self._kept_steps: tuple[object, tuple[procedure.Step, ...]] | None = None

    @classmethod
    def start(cls, site: SessionSite, setup: X, now: datetime) -> Self:
        """Start a session: its first line is on disk.

        CalibrationError if the setup does not suit the site, or an artefact may not be used;
        StorageError if the file cannot be written.
        """
        own = cls._first_line(site, setup, now)
        return cls(site, *cls.sessions.start(site, setup, now, cls._running(site, setup), own))

    @classmethod
    def resume(cls, site: SessionSite, path: Path) -> Self:
        """Continue the session of a file.

        StorageError if it was changed; CalibrationError if empty, of another rig, probe or
        calibration, or an open session of a version that lacks a step.
        """
        return cls(site, *cls.sessions.resume(path))

    # Implemented by each procedure.

    @classmethod
    @abstractmethod
    def _first_line(cls, site: SessionSite, setup: X, now: datetime) -> dict[str, object]:
        """Return the fields of the first line that are its own; errors as `start`."""

    @classmethod
    @abstractmethod
    def _running(cls, site: SessionSite, setup: X) -> str:
        """Return the hash of the record in force, or empty."""

    @abstractmethod
    def _steps(self) -> tuple[procedure.Step, ...]:
        """Return the steps with their current gates."""

    def _steps_rest_on(self) -> object:
        """Return a key of further inputs of the steps; None disables caching of the steps."""
        return None

    @abstractmethod
    def _seen(self) -> procedure.Live:
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
    def _put(self, outcome: O, decided: Decided) -> None:
        """Put an accepted result into the store."""

    @abstractmethod
    def _in_force(self) -> str:
        """Return the hash of the record that an accepted result would replace, or empty."""

    # Common to all procedures.

    @property
    def _started(self) -> tuple[str, str, str]:
        return self._begun.rig, self._begun.utc, self._begun.who

    @property
    def _current(self) -> int:
        return self.step_names.index(self._step)

    @property
    def _ended_as(self) -> procedure.ProcedureDecision:
        return procedure.ProcedureDecision.OPEN if self._decided is None else self._decided.decision

    def _steps_now(self) -> tuple[procedure.Step, ...]:
        """Return the steps, cached because views poll them between observations."""
        others = self._steps_rest_on()
        if others is None:
            return self._steps()
        rest_on = self._version, others
        if self._kept_steps is None or self._kept_steps[0] != rest_on:
            self._kept_steps = rest_on, self._steps()
        return self._kept_steps[1]

    def _live(self) -> procedure.Live:
        if self._decided is not None or not self._wants():
            return replace(self._seen(), ready=False, hint="Nothing to take in this step.")
        return self._seen()

    def _store_observation(self, now: datetime) -> None:
        self._append(self._observation(utc_text(now)))

    def drop(self, now: datetime) -> None:
        with self._lock:
            if self._has_observation(self._step):
                self._append(Dropped(utc=utc_text(now), step=self._step))

    def _enter(self, step: int, now: datetime) -> None:
        self._append(Entered(utc=utc_text(now), step=self.step_names[step]))

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

    def accept(self, now: datetime, reason: str) -> None:
        """Store the result and end the procedure."""
        with self._lock:
            if self._outcome is None:
                raise CalibrationError("session.no_result", "No result yet.", "Calculate it first.")
            self._check(self._outcome)
            decided = self._decide(procedure.ProcedureDecision.ACCEPTED, now, reason)
            if not self._is_stored():
                self._put(self._outcome, decided)

    def keep(self, now: datetime, reason: str) -> None:
        with self._lock:
            self._decide(procedure.ProcedureDecision.KEPT, now, reason)

    def _check(self, outcome: O) -> None:
        """Raise CalibrationError if a result may not be stored now."""
        # Another process may have put other records in force.
        self._store.refresh()
        if self._begun.running != self._in_force() and not self._is_stored():
            raise CalibrationError(
                "session.overtaken",
                "Another calibration has been activated since this session was started.",
                "Start a new session.",
            )

    def _is_stored(self) -> bool:
        decided = self._decided
        return decided is not None and any(one.utc == decided.utc for one in self._store.events)

    def _decide(self, decision: procedure.ProcedureDecision, now: datetime, reason: str) -> Decided:
        if self._decided is not None:
            if self._decided.decision is not decision:
                raise self._ended(self._decided)
            return self._decided
        decided = Decided(utc=utc_text(now), decision=decision, reason=reason)
        self._append(decided)
        return decided

    def _fold(self) -> None:
        self._log.replay(self._change)

    def _refuse_older(self, which: str) -> None:
        """Refuse to resume a session of an older version, which lacks ``which``."""
        if self._decided is None:
            raise CalibrationError(
                "session.older",
                f"{self._log.path}: this session was started by an earlier version, which "
                f"{which}: movement in the meantime could go unnoticed.",
                "Start a new session.",
            )

    def _append(self, event: E | CommonEvent) -> None:
        if self._decided is not None:
            raise self._ended(self._decided)
        self.require_name()
        if self._size != self._log.path.stat().st_size:
            # Appending would overwrite lines of another program.
            raise CalibrationError(
                "session.elsewhere",
                f"{self._log.path}: another program is using this session.",
                "Close the other one, then open the session again.",
            )
        self._log.append(event, self._change)
        self._size = self._log.path.stat().st_size

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
                self._begun = reread(self._typed, self._readings)
                state = getattr(self, "_state", None)
                if state is not None:
                    state.begun = self._begun
            else:
                self._observe(event)
            self._outdate()

    def _ended(self, decided: Decided) -> CalibrationError:
        return CalibrationError(
            "session.ended",
            f"{self._log.path}: this session has ended: {decided.decision.value}.",
            "Start a new session.",
        )


class CameraProcedure(GuidedProcedure[E, O, B, X]):
    """Base of procedures for the cameras of a rig; see `GuidedProcedure`."""

    _store: CalibrationStore

    def __init__(self, site: SessionSite, chain: ChainFile[SessionLine[E]], begun: B) -> None:
        self._store = CalibrationStore(site.records)
        super().__init__(site, chain, begun)

    @classmethod
    def _running(cls, site: SessionSite, setup: X) -> str:
        return CalibrationStore(site.records).active_hash or ""

    def _in_force(self) -> str:
        return self._store.active_hash or ""


class ProbeProcedure(GuidedProcedure[E, O, B, T]):
    """Base of procedures for a probe with one of its tips; see `GuidedProcedure`."""

    for_trackers = True
    _store: ProbeStore
    tip: str

    def __init__(self, site: SessionSite, chain: ChainFile[SessionLine[E]], begun: B) -> None:
        self._store = ProbeStore(site.records)
        super().__init__(site, chain, begun)

    @classmethod
    def _running(cls, site: SessionSite, setup: T) -> str:
        return ProbeStore(site.records).active_hash(setup.tip) or ""

    def _in_force(self) -> str:
        return self._store.active_hash(self.tip) or ""
