"""Engine of guided procedures: durable events, steps with gates, and the common snapshot.

Every event is one line of a chained file (`chain_file`), on disk before its call returns, and then
part of the state: a pure fold over these lines. Calibrations (`_session`) and acceptance tests
extend it.
"""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime, timedelta
from enum import StrEnum
from pathlib import Path
from typing import Any, Generic, TypeVar

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guided._procedure import Live, ProcedureDecision, ProcedureView, Step
from ocmm_core.calibration.records import Finding
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError, OcmmError, StorageError

REREAD_AFTER = timedelta(minutes=30)
"""Age of a typed temperature from which observations need a new reading."""

O = TypeVar("O")  # noqa: E741 - an outcome, as T is a type


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


class GuidedSteps(ABC, Generic[O]):
    """Steps, recording and result of a session; thread-safe. See `procedure.Procedure`."""

    kind: StrEnum
    gate_code = "session.gate"
    torn = (
        "The last entry was being written when the program stopped: it is not in the session. "
        "Take that observation again."
    )

    def __init__(self, log: SessionLog) -> None:
        self._log, self._lock = log, log.lock
        self._outcome: O | None = None
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
    def _calculation(self) -> Callable[[], O]:
        """Return the calculation for the present observations, independent of the state."""

    @property
    @abstractmethod
    def _ended_as(self) -> ProcedureDecision:
        pass

    @abstractmethod
    def _is_stored(self) -> bool:
        pass

    @abstractmethod
    def watch(self, block: FrameBlock) -> None:
        """Process frames; see `procedure.Procedure.watch`."""

    # Common to all.

    @property
    def base(self) -> ProcedureView:
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
        """Raise StorageError if the file is lost; see `procedure.Procedure.require_name`."""
        self._log.require_name()

    def take(self, now: datetime) -> None:
        """Record the current observation; see `procedure.Procedure.take`."""
        with self._lock:
            live = self._seen_now()
            if not live.ready:
                raise self._not_ready(live.hint)
            require_fresh_temperature(self._read_at(), now)
            self._store_observation(now)

    def advance(self, now: datetime) -> None:
        """Enter the next step; raise CalibrationError if the gate is closed."""
        with self._lock:
            steps, index = self._steps_now(), self._current
            gate = steps[index].gate
            if not gate.open:
                raise CalibrationError(self.gate_code, gate.reason, gate.remedy)
            if index + 1 < len(steps):
                self._enter(index + 1, now)

    def back(self, now: datetime) -> None:
        with self._lock:
            if self._current:
                self._enter(self._current - 1, now)

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

    def _not_ready(self, hint: str) -> CalibrationError:
        return CalibrationError("session.not_ready", hint, "Then repeat it.")

    def _outdate(self) -> None:
        """Drop a result whose observations have changed."""
        self._version += 1
        self._outcome, self._error = None, None
