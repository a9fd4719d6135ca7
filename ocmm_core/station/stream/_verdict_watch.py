"""Verdict for the live stream on its own thread (seconds); bursts become one evaluation."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

from ocmm_core.failure import contained
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.station.stream._messages import no_verdict_line, verdict_line

PAUSE_S = 0.1
"""Minimum pause between two evaluations, so that the stream never takes a whole processor."""


@dataclass(frozen=True, slots=True)
class ToldVerdict:
    """Latest line, and the count of lines so far."""

    count: int = 0
    line: bytes = b""


class VerdictWatch:
    """Evaluate a job on request.

    `last_seq` returns the number of the latest message that an evaluation now would include; `made`
    is called on the thread of the watch when there is a new line.
    """

    def __init__(
        self,
        evaluate: Callable[[], JobView],
        job: Callable[[], str],
        last_seq: Callable[[], int],
        made: Callable[[], None],
    ) -> None:
        self._evaluate, self._job = evaluate, job
        self._last_seq, self._made = last_seq, made
        self._asked = threading.Event()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ocmm-stream-verdict")
        self.latest = ToldVerdict()

    def start(self) -> None:
        self._thread.start()

    def ask(self) -> None:
        """Request an evaluation; returns at once."""
        self._asked.set()

    def close(self, timeout_s: float) -> bool:
        """Stop, finishing a running evaluation, and return whether the thread ended in time."""
        self._stopping.set()
        self._asked.set()
        if self._thread.ident is not None:
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while True:
            self._asked.wait()
            if self._stopping.is_set():
                return
            self._asked.clear()
            self.latest = ToldVerdict(self.latest.count + 1, self._line())
            self._made()
            self._stopping.wait(PAUSE_S)

    def _line(self) -> bytes:
        # Read first: the view fetched next contains everything up to this number.
        after = self._last_seq()
        try:
            return verdict_line(self._evaluate(), after)
        except Exception as error:
            # Without this the previous verdict would stand, which may not hold any more.
            told = contained(error, "The verdict for the stream")
            return no_verdict_line(self._job(), after, f"{told.what} {told.remedy}")
