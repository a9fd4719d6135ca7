"""The job evaluated in a thread of its own, and no more often than somebody can look."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from ocmm_core.inspection.evaluation import JobView

_PAUSE_S = 0.04
"""Between two evaluations: whoever waits for the job meanwhile gets his turn."""


class Evaluator:
    """Evaluate the job after its changes; several changes at once make one evaluation.

    Parameters
    ----------
    evaluate
        Gives the job as it stands.
    tell
        Gets it, on this thread.
    failed
        Gets what was raised instead: what was told before is not true any more.
    """

    def __init__(
        self,
        evaluate: Callable[[], JobView],
        tell: Callable[[JobView], None],
        failed: Callable[[Exception], None],
    ) -> None:
        self._evaluate, self._tell, self._failed = evaluate, tell, failed
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
                self._tell(self._evaluate())
            except Exception as error:
                # Without a word the window would go on showing what it showed.
                if not self._stop.is_set():
                    self._failed(error)
            finally:
                self._since = None
            self._stop.wait(_PAUSE_S)
