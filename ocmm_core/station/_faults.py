"""What has failed inside a running station: a state that stays until a new start.

What measuring rests on makes the whole station FAILED: no number is shown, no point is taken. What
runs beside it (the stream to other programs, the recording, listeners) is told, and measuring goes
on.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from ocmm_core.errors import OcmmError
from ocmm_core.failure import contained, described

_LOG_S = 2.0
"""Whoever ends because of a fault waits so long at most for its log."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A part that has failed.

    Attributes
    ----------
    error
        What is told of it.
    part
        What failed, as the beginning of a sentence.
    at_s
        When it became a state, `time.monotonic`.
    """

    error: OcmmError
    part: str
    at_s: float


class Faults:
    """Keep the first fault of the measuring, and of each part beside it; for any thread.

    Parameters
    ----------
    tell
        Gets the error of every fault, once, on the thread that met it.
    stop
        Called when the measuring has failed, before that is told.
    safe
        Returns the sentence that says what is not lost.
    """

    def __init__(
        self,
        tell: Callable[[OcmmError], None],
        stop: Callable[[], None],
        safe: Callable[[], str],
    ) -> None:
        self._tell, self._stop, self._safe = tell, stop, safe
        self._lock = threading.Lock()
        self._measuring: Fault | None = None
        self._logged = threading.Event()
        self._beside: dict[str, Fault] = {}

    @property
    def measuring(self) -> Fault | None:
        """Return why nothing is measured any more; None while it is."""
        return self._measuring

    def with_log(self) -> Fault | None:
        """Return `measuring` once its log is written, or after a moment without."""
        if self._measuring is not None:
            self._logged.wait(_LOG_S)
        return self._measuring

    @property
    def beside(self) -> tuple[Fault, ...]:
        """Return what has failed beside the measuring, oldest first."""
        return tuple(self._beside.values())

    @property
    def reason(self) -> str:
        """Return in words why nothing is measured any more, and what is not lost."""
        fault = self._measuring
        return "" if fault is None else f"{fault.error.what} {self._safe()}"

    def fail(self, error: BaseException, part: str, *, tell: bool = True) -> OcmmError:
        """Measure no more because of an exception, and return what is told of it.

        Parameters
        ----------
        tell
            Where not, whoever called raises the answer and tells it so.
        """
        safe = self._safe()
        with self._lock:
            known = self._measuring
            if known is None:
                # The state comes before the log: a disk may take its time.
                fault = Fault(described(error, part), part, time.monotonic())
                self._measuring = fault
        self._stop()
        if known is not None and known.part == part:
            # Asked for again, e.g. the results: once is enough, also for the log files.
            return known.error
        told = _with_words(contained(error, part), safe)
        if known is not None:
            return told
        with self._lock:
            self._measuring = replace(fault, error=told)
        self._logged.set()
        if tell:
            self._tell(told)
        return told

    def note(self, error: BaseException, part: str) -> None:
        """Keep and tell that something beside the measuring has failed; once for each part."""
        with self._lock:
            if part in self._beside:
                return
            self._beside[part] = Fault(described(error, part), part, time.monotonic())
        told = _with_words(contained(error, part), "Measuring goes on.")
        with self._lock:
            self._beside[part] = replace(self._beside[part], error=told)
        self._tell(told)


def _with_words(error: OcmmError, words: str) -> OcmmError:
    """Return an error whose remedy begins with what is not lost."""
    return type(error)(error.code, error.what, f"{words} {error.remedy}".strip())
