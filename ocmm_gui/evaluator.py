"""The job evaluated in a thread of its own, and no more often than somebody can look."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from ocmm_core.errors import OcmmError
from ocmm_core.inspection.view import JobView

_PAUSE_S = 0.04
"""Between two evaluations: whoever waits for the job meanwhile gets his turn."""

_log = logging.getLogger(__name__)


class Evaluator:
    """Evaluate the job after its changes; several changes at once make one evaluation.

    Parameters
    ----------
    evaluate
        Gives the job as it stands.
    tell
        Gets it, on this thread.
    """

    def __init__(self, evaluate: Callable[[], JobView], tell: Callable[[JobView], None]) -> None:
        self._evaluate, self._tell = evaluate, tell
        self._changed, self._stop = threading.Event(), threading.Event()
        self._since: float | None = None
        self._thread = threading.Thread(target=self._run, name="ocmm-evaluation", daemon=True)

    def start(self) -> None:
        """Begin to wait for changes."""
        if not self._thread.is_alive() and not self._stop.is_set():
            self._thread.start()

    def wake(self) -> None:
        """Evaluate soon; returns at once."""
        self._changed.set()

    def busy_s(self) -> float:
        """Return for how long the job has been evaluated by now, s; zero while it is not."""
        since = self._since
        return 0.0 if since is None else time.monotonic() - since

    def close(self, limit_s: float) -> None:
        """End, after what is being evaluated or after so long; idempotent."""
        self._stop.set()
        self._changed.set()
        if self._thread.is_alive():
            self._thread.join(max(limit_s, 0.0))

    def _run(self) -> None:
        while not self._stop.is_set():
            self._changed.wait()
            self._changed.clear()
            if self._stop.is_set():
                return
            self._since = time.monotonic()
            try:
                job = self._evaluate()
            except OcmmError:
                # A job that was closed meanwhile has nothing to show any more.
                _log.exception("The job could not be evaluated.")
                continue
            except Exception:
                # The window would go on showing what it showed, and nobody would know: it is
                # told, and the next point gets its evaluation.
                _log.exception("The results are not those of the last points.")
                continue
            finally:
                self._since = None
            self._tell(job)
            self._stop.wait(_PAUSE_S)
