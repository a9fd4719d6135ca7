"""Hands of guided procedures: threads that show frames while a watcher is attached.

In: a source of frames, opened on demand, and a procedure that requests touches.
Out: frames for a watcher, until everything is shown or the watcher leaves.

It must not import rigs, scenes or stations: the composition passes what to show.
"""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Protocol

import numpy as np

from ocmm_core.acceptance import AcceptanceProcedure
from ocmm_core.acquisition.frames import AcquisitionState, FrameBlock, FrameRing, read_status
from ocmm_core.errors import CalibrationError, OcmmError
from ocmm_core.failure import REOPEN, contained

Watcher = Callable[[FrameBlock], None]

BLOCK = 80
"""Frames shown at once: 10 ms at 8 kHz."""
IDLE_S = 0.002
"""Poll interval for whether a shown touch was recorded."""


class Hand(ABC):
    """A thread that makes requested touches and waits until each counts.

    Call it with a watcher to show frames, with None to stop. Subclasses implement `_show` and
    `_wanted`. `failed`: called with the reason when frames end. `safe`: what a failure does not
    lose, as for `contained`. `idle_s`: poll interval for requested touches, s.
    """

    def __init__(
        self, failed: Callable[[OcmmError], None], *, thread: str, safe: str, idle_s: float
    ) -> None:
        self._failed = failed
        self._named_thread, self._safe, self._idle_s = thread, safe, idle_s
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def __call__(self, watcher: Watcher | None) -> None:
        """Start showing frames, or stop and wait for the thread."""
        if self._thread is not None:
            self._stop.set()
            self._thread.join()
            self._thread = None
        if watcher is not None:
            self._stop.clear()
            self._thread = threading.Thread(
                target=self._run, args=(watcher,), name=self._named_thread
            )
            self._thread.start()

    def close(self) -> None:
        """End what the hand shows from, if it keeps it open."""
        return

    @property
    @abstractmethod
    def named(self) -> str:
        """Return the hand's name as the start of a sentence."""

    @abstractmethod
    def _wanted(self) -> bool:
        """Return whether a touch is requested now."""

    @abstractmethod
    def _show(self, watcher: Watcher) -> None:
        """Show frames until the requested touch was shown or is withdrawn."""

    def _run(self, watcher: Watcher) -> None:
        try:
            while not self._stop.wait(self._idle_s):
                if self._wanted():
                    self._show(watcher)
        except Exception as error:
            self._failed(contained(error, self.named, self._safe, remedy=REOPEN))
        finally:
            self.close()


class Starting(Protocol):
    """Start of an acquisition."""

    def start(self) -> object:
        """Let frames come."""


class Source(Protocol):
    """Source of frames: a feed of the composition. Live sources deliver whether read or not."""

    @property
    def ring(self) -> FrameRing:
        """Return the ring of the frames."""

    @property
    def acquisition(self) -> Starting:
        """Return the acquisition."""

    @property
    def live(self) -> bool:
        """Return whether frames arrive in real time."""

    def end(self) -> object:
        """End it."""


class TestHand(Hand):
    """Make the remaining touches; `make` returns a source and its frames (may be infinite)."""

    __test__ = False

    def __init__(
        self,
        make: Callable[[], tuple[Source, float]],
        procedure: AcceptanceProcedure,
        failed: Callable[[OcmmError], None],
    ) -> None:
        super().__init__(
            failed, thread="ocmm-hand-of-a-test", safe="All points so far are stored.",
            idle_s=IDLE_S,
        )  # fmt: skip
        self._make, self._procedure = make, procedure
        self.shown_s = 0.0

    def _play(self, source: Source, watcher: Watcher, frames: float) -> bool:
        """Show frames of a started source; return whether it ended."""
        plan, seen = len(self._procedure.view.test.positions), 0
        while not self._stop.is_set() and seen < frames and self._wanted():
            stopped = read_status(source.ring).state is AcquisitionState.STOPPED
            block = source.ring.read(BLOCK)
            if block is None:
                if stopped:
                    return True
                self._stop.wait(IDLE_S)
                continue
            seen += len(block)
            self.shown_s += len(block) / _rate_hz(block)
            watcher(block)
            # Live sources do not wait.
            while not source.live and self._procedure.ready and not self._stop.wait(IDLE_S):
                pass
            if len(self._procedure.view.test.positions) != plan:
                break
        return False

    def _wanted(self) -> bool:
        view = self._procedure.view
        return view.base.step.name == "measure" and view.test.current >= 0


class VirtualHand(TestHand):
    """Hand at the virtual rig; its source is remade per request, with the missing touches."""

    @property
    def named(self) -> str:
        """Return the hand's name as the start of a sentence."""
        return "The virtual rig"

    def _show(self, watcher: Watcher) -> None:
        source, frames = self._make()
        try:
            source.acquisition.start()
            self._play(source, watcher, frames)
        finally:
            source.end()


class RecordedHand(TestHand):
    """Replay a recording once: touches come once, retests use later frames."""

    _source: Source | None = None
    _frames = np.inf

    @property
    def named(self) -> str:
        """Return the hand's name as the start of a sentence."""
        return "The recording"

    def close(self) -> None:
        """End the recording."""
        if self._source is not None:
            self._source.end()
            self._source = None

    def _show(self, watcher: Watcher) -> None:
        if self._source is None:
            self._source, self._frames = self._make()
            self._source.acquisition.start()
        if self._play(self._source, watcher, self._frames):
            instruction = self._procedure.view.test.instruction
            self._stop.set()
            self._failed(
                CalibrationError(
                    "acceptance.source_ended",
                    f"The recording ended before the last point. {instruction}",
                    "End this test, and begin one with a recording of the whole test.",
                )
            )


def _rate_hz(block: FrameBlock) -> float:
    if len(block) < 2:
        return np.inf
    span = int(block.time_ns[-1]) - int(block.time_ns[0])
    return float(1e9 * (len(block) - 1) / span)
