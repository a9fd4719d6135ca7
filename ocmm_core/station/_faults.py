"""What a running station tells: signals, and what has failed inside it.

What measuring rests on makes the whole station FAILED, a state that stays until a new start: no
number is shown, no point is taken. What runs beside it (the stream to other programs, the
recording, listeners) is told, and measuring goes on.
"""

from __future__ import annotations

import logging
import threading
import time
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol

from psygnal import EmitLoopError, Signal, SignalInstance

from ocmm_core.errors import OcmmError
from ocmm_core.failure import REOPEN, contained, described
from ocmm_core.measuring import MeasuredPoint, Refusal
from ocmm_core.station.stream import ButtonChange

_log = logging.getLogger(__name__)

_LOG_S = 2.0
"""Whoever ends because of a fault waits so long at most for its log."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A part that has failed."""

    error: OcmmError
    """What is told of it."""
    part: str
    """What failed, as the beginning of a sentence."""
    at_s: float
    """When it became a state, `time.monotonic`."""


class Kept(Protocol):
    """What is not lost, whatever fails."""

    def what_is_safe(self) -> str:
        """Return it in a sentence."""
        ...


class StationFaults:
    """Keep the first fault of the measuring, and of each part beside it; for any thread.

    Parameters
    ----------
    halt
        Set when the measuring has failed, before that is told.
    kept
        Says what is not lost.
    """

    failed: ClassVar[Signal] = Signal(OcmmError)
    """Emitted once for every fault, and for a touch given up, on the thread that met it."""

    def __init__(self, halt: threading.Event, kept: Kept) -> None:
        self._halt, self._kept = halt, kept
        self._lock = threading.Lock()
        self._measuring: Fault | None = None
        self._logged = threading.Event()
        self._beside: dict[str, Fault] = {}

    @property
    def measuring(self) -> Fault | None:
        """Return why nothing is measured any more until a new start; None while it is."""
        return self._measuring

    def why_failed(self) -> OcmmError | None:
        """Return what to tell of `measuring`; waits a moment until it names its log."""
        if self._measuring is not None:
            self._logged.wait(_LOG_S)
        return None if self._measuring is None else self._measuring.error

    @property
    def beside(self) -> tuple[Fault, ...]:
        """Return what has failed beside the measuring, oldest first."""
        return tuple(self._beside.values())

    @property
    def reason(self) -> str:
        """Return in words why nothing is measured any more, and what is not lost."""
        fault = self._measuring
        if fault is None:
            return ""
        safe = self._kept.what_is_safe()
        return fault.error.what if safe in fault.error.what else f"{fault.error.what} {safe}"

    def fail(self, error: BaseException, part: str, *, tell: bool = True) -> OcmmError:
        """Measure no more because of an exception, and return what is told of it.

        Parameters
        ----------
        part
            What failed, as the beginning of a sentence.
        tell
            Where not, whoever called raises the answer and tells it so.
        """
        safe = self._kept.what_is_safe()
        with self._lock:
            known = self._measuring
            if known is None:
                # The state comes before the log: a disk may take its time.
                fault = Fault(described(error, part, remedy=REOPEN), part, time.monotonic())
                self._measuring = fault
        self._halt.set()
        if known is not None and known.part == part:
            # Asked for again, e.g. the results: once is enough, also for the log files.
            return known.error
        told = _with_words(contained(error, part, remedy=REOPEN), safe)
        if known is not None:
            return told
        with self._lock:
            self._measuring = replace(fault, error=told)
        self._logged.set()
        if tell:
            self.tell(told)
        return told

    def note(self, error: BaseException, part: str) -> None:
        """Keep and tell that something beside the measuring has failed; once for each part."""
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
        """Tell an error that is no fault of the station, e.g. a point that was not made durable."""
        try:
            self.failed.emit(error)
        except EmitLoopError as fault:
            # Nobody is left who could be told; the state says it.
            told = contained(fault, "A listener to 'failed'")
            _log.error("%s", told)


class StationEvents:
    """Signals of what changes; emitted on the thread that made the change.

    Parameters
    ----------
    faults
        Keeps that a listener has failed.
    """

    changed: ClassVar[Signal] = Signal()
    """Emitted without arguments after every change of the job."""
    point_taken: ClassVar[Signal] = Signal(MeasuredPoint)
    """Emitted after a point has become durable."""
    point_refused: ClassVar[Signal] = Signal(Refusal)
    """Emitted when a touch gave no point."""
    button: ClassVar[Signal] = Signal(ButtonChange)
    """Emitted when the button of the probe goes down or up, whatever comes of it."""

    def __init__(self, faults: StationFaults) -> None:
        self._faults = faults

    def emit(self, signal: SignalInstance, *arguments: object) -> None:
        """Tell who listens; a listener that fails is none of the measuring's business."""
        try:
            signal.emit(*arguments)
        except EmitLoopError as error:
            self._faults.note(error, f"A listener to '{signal.name}'")


def _with_words(error: OcmmError, words: str) -> OcmmError:
    """Return an error whose remedy begins with what is not lost, unless it says so already."""
    if words in error.what:
        return error
    return type(error)(error.code, error.what, f"{words} {error.remedy}".strip())
