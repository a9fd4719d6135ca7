"""The verdict for the live stream, computed on a thread of its own and at its own pace.

A verdict takes up to some seconds. Neither who takes points nor who serves clients waits for it: it
is asked for after a change, several changes become one, and the latest is kept.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

from ocmm_core.failure import contained
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.station.stream._messages import no_verdict_line, verdict_line

PAUSE_S = 0.1
"""At least so long between two evaluations, so that the stream never takes a whole processor."""


@dataclass(frozen=True, slots=True)
class ToldVerdict:
    """The latest line, and how many there have been."""

    count: int = 0
    line: bytes = b""


class VerdictWatch:
    """Evaluate a job whenever somebody asks.

    Parameters
    ----------
    evaluate
        Returns the job as it stands.
    job
        Name of the job.
    last_seq
        Number of the latest message that the job will hold when it is evaluated now.
    made
        Called on the thread of the watch when there is a new line.
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
        """Begin to wait."""
        self._thread.start()

    def ask(self) -> None:
        """Evaluate soon; returns at once."""
        self._asked.set()

    def close(self, timeout_s: float) -> bool:
        """End, and say whether the thread did in time; what is being evaluated is finished."""
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
        # Asked first: whatever has this number by now is in the view that comes.
        after = self._last_seq()
        try:
            return verdict_line(self._evaluate(), after)
        except Exception as error:
            # The verdict of before would stand, and it is not known to hold any more.
            told = contained(error, "The verdict for the stream")
            return no_verdict_line(self._job(), after, f"{told.what} {told.remedy}")
