"""The station as read by the stream, which does not know it: interfaces, and the verdict.

The verdict is evaluated on its own thread (seconds); bursts become one evaluation.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from psygnal import SignalInstance

from ocmm_core.failure import contained
from ocmm_core.inspection.evaluation import JobView, LiveView
from ocmm_core.station.stream._messages import no_verdict_line, verdict_line
from ocmm_core.storage import JobStep


class StreamedEvents(Protocol):
    @property
    def changed(self) -> SignalInstance:
        """Emitted after every change of the job."""
        ...

    @property
    def button(self) -> SignalInstance:
        """Emitted with a `ButtonChange` when the button of the probe goes down or up."""
        ...


class StreamedJob(Protocol):
    """The current job."""

    @property
    def path(self) -> Path: ...

    def view(self) -> JobView:
        """Return the current job; takes up to some seconds."""
        ...

    def steps_since(self, job: Path | None, after: int) -> tuple[Path, list[JobStep]]:
        """Return job and steps after an audit row, from 0 if another; empty only if no more."""
        ...


class StreamedLooks(Protocol):
    def live(self) -> LiveView: ...


class StreamedInstruments(Protocol):
    @property
    def simulated(self) -> bool:
        """Return whether the frames come from a virtual rig, as far as is known by now."""
        ...


class StreamSource(Protocol):
    """Source of the stream, e.g. the measuring station."""

    @property
    def events(self) -> StreamedEvents: ...

    @property
    def job(self) -> StreamedJob: ...

    @property
    def looks(self) -> StreamedLooks: ...

    @property
    def instruments(self) -> StreamedInstruments: ...


class StepReader:
    """Read every step of the jobs of a station once, in order; for one thread at a time."""

    def __init__(self, job: StreamedJob) -> None:
        self._source = job
        self.path: Path | None = None
        """Current job; None before the first read."""
        self._after = 0

    def read(self) -> Iterator[tuple[str, JobStep]]:
        """Yield new steps with the name of their job; after an error, a step comes again."""
        while True:
            path, steps = self._source.steps_since(self.path, self._after)
            if path != self.path:
                # Rows of another job are numbered separately.
                self.path, self._after = path, 0
            if not steps:
                return
            for step in steps:
                yield path.stem, step
                self._after = step.sequence


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

    def request(self) -> None:
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
