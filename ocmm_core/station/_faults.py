"""Signals and faults of a running station.

Of the measuring chain: FAILED until restart. Of stream, recording, listeners: reported only.
"""

from __future__ import annotations

import logging
import threading
import time
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol

from psygnal import EmitLoopError, Signal, SignalInstance

from ocmm_core.errors import InternalError, OcmmError
from ocmm_core.failure import REOPEN, contained, described
from ocmm_core.measuring import MeasuredPoint, Refusal
from ocmm_core.station.stream import ButtonChange

_log = logging.getLogger(__name__)

_LOG_S = 2.0
"""s: maximum wait for the log of a fault."""


@dataclass(frozen=True, slots=True)
class Fault:
    error: OcmmError
    part: str
    """Failed part, as the beginning of a sentence."""
    at_s: float
    """Time of the state, `time.monotonic`."""


class Kept(Protocol):
    """State that survives any fault."""

    def what_is_safe(self) -> str:
        """Return it in a sentence."""
        ...

    def has_points(self) -> bool:
        """Return whether there are points to lose."""
        ...


class StationFaults:
    """The first fault of measuring, and of each other part; thread-safe.

    `halt`: set when measuring has failed, before the report. `kept`: states what is not lost.
    """

    failed: ClassVar[Signal] = Signal(OcmmError)
    """Emitted once per fault, and for an abandoned touch, on the thread of the error."""

    def __init__(self, halt: threading.Event, kept: Kept) -> None:
        self._halt, self._kept = halt, kept
        self._lock = threading.Lock()
        self._measuring: Fault | None = None
        self._logged = threading.Event()
        self._beside: dict[str, Fault] = {}

    @property
    def measuring(self) -> Fault | None:
        """Return the fault that stopped measuring until restart; None if running."""
        return self._measuring

    def why_failed(self) -> OcmmError | None:
        """Return the error of `measuring`; waits briefly until it names its log."""
        if self._measuring is not None:
            self._logged.wait(_LOG_S)
        return None if self._measuring is None else self._measuring.error

    @property
    def beside(self) -> tuple[Fault, ...]:
        """Return the faults of other parts, oldest first."""
        return tuple(self._beside.values())

    @property
    def reason(self) -> str:
        """Return why measuring has stopped, and what is not lost, in words."""
        fault = self._measuring
        if fault is None:
            return ""
        safe = self._safe(fault.error)
        return fault.error.what if safe in fault.error.what else f"{fault.error.what} {safe}"

    def fail(self, error: BaseException, part: str, *, tell: bool = True) -> OcmmError:
        """Stop measuring because of an exception, and return the reported error.

        `part`: begins a sentence. `tell`: False if the caller raises the result.
        """
        safe = self._safe(error)
        with self._lock:
            known = fault = self._measuring
            if fault is None:
                # The state precedes the log: a disk may be slow.
                fault = Fault(described(error, part, remedy=REOPEN), part, time.monotonic())
                self._measuring = fault
        self._halt.set()
        if known is not None and known.part == part and not _continues(error, known.error):
            # Repeated queries, e.g. of results, must not repeat logs.
            return known.error
        told = _with_words(contained(error, part, remedy=REOPEN), safe)
        if known is not None and known.part != part:
            return told
        with self._lock:
            self._measuring = replace(fault, error=told)
        self._logged.set()
        if tell:
            self.tell(told)
        return told

    def _safe(self, error: BaseException) -> str:
        """Return what is not lost, empty where a source was refused before the first point."""
        refused = isinstance(error, OcmmError) and not isinstance(error, InternalError)
        return "" if refused and not self._kept.has_points() else self._kept.what_is_safe()

    def note(self, error: BaseException, part: str) -> None:
        """Store and report the fault of another part, once per part."""
        with self._lock:
            if part in self._beside:
                return
            self._beside[part] = Fault(
                described(error, part, remedy=REOPEN), part, time.monotonic()
            )
        told = _with_words(contained(error, part, remedy=REOPEN), "Measuring continues.")
        with self._lock:
            self._beside[part] = replace(self._beside[part], error=told)
        self.tell(told)

    def tell(self, error: OcmmError) -> None:
        """Report an error that is no fault of the station, e.g. a point not made durable."""
        try:
            self.failed.emit(error)
        except EmitLoopError as fault:
            # No listeners are left; the state has the fault.
            _log.error("%s", contained(fault, "A listener to 'failed'"))


class StationEvents:
    """Signals of changes, emitted on the changing thread; `faults` stores listener failures."""

    changed: ClassVar[Signal] = Signal()
    """Emitted without arguments after every change of the job."""
    point_taken: ClassVar[Signal] = Signal(MeasuredPoint)
    """Emitted after a point has become durable."""
    point_refused: ClassVar[Signal] = Signal(Refusal)
    """Emitted when a touch gave no point."""
    button: ClassVar[Signal] = Signal(ButtonChange)
    """Emitted when the button of the probe goes down or up, with any result."""

    def __init__(self, faults: StationFaults) -> None:
        self._faults = faults

    def emit(self, signal: SignalInstance, *arguments: object) -> None:
        """Emit a signal; a failing listener does not affect measuring."""
        try:
            signal.emit(*arguments)
        except EmitLoopError as error:
            self._faults.note(error, f"A listener to '{signal.name}'")


def _continues(error: BaseException, known: OcmmError) -> bool:
    """Return whether an error reports more of a known one, e.g. where lost points are saved."""
    return (
        isinstance(error, OcmmError)
        and error.code == known.code
        and error.what.startswith(known.what)
        and not known.remedy.endswith(error.remedy)
    )


def _with_words(error: OcmmError, words: str) -> OcmmError:
    """Return an error whose remedy starts with what is not lost, unless already stated."""
    if words in error.what:
        return error
    return type(error)(error.code, error.what, f"{words} {error.remedy}".strip())
