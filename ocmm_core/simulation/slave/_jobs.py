"""Work of a software camera that takes longer than its master waits for an answer."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from ocmm_core.errors import OcmmError
from ocmm_core.failure import contained

T = TypeVar("T")


class BackgroundJob(Generic[T]):
    """One piece of work on a thread of its own, which ends by itself.

    Parameters
    ----------
    name
        Of the thread.
    work
        What to do.

    Attributes
    ----------
    result
        What it returned, once it is done.
    error
        Why it failed.
    """

    def __init__(self, name: str, work: Callable[[], T]) -> None:
        self.result: T | None = None
        self.error: OcmmError | None = None
        self._work = work
        self._thread = threading.Thread(target=self._run, name=name)
        self._thread.start()

    def finished(self) -> bool:
        """Return whether it is done, well or not."""
        if self._thread.is_alive():
            return False
        self._thread.join()
        return True

    def _run(self) -> None:
        _lower_priority()
        try:
            self.result = self._work()
        except Exception as error:
            self.error = contained(error, "The work of a software camera")


def _lower_priority() -> None:
    """Leave the real-time priority that this thread got from the one that answers the master."""
    if hasattr(os, "sched_setscheduler"):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
