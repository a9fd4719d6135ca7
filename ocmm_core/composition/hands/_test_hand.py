"""The hands of an acceptance test: at the virtual rig, and that of a recording."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from ocmm_core.acceptance import AcceptanceProcedure
from ocmm_core.acquisition.frames import AcquisitionState, FrameBlock, FrameRing, read_status
from ocmm_core.composition.hands._hand import BLOCK, IDLE_S, Hand, Watcher
from ocmm_core.errors import CalibrationError, OcmmError


class Starting(Protocol):
    """What is started before frames come."""

    def start(self) -> object:
        """Let frames come."""


class Source(Protocol):
    """Where frames come from: a feed of the composition.

    A live one comes whether somebody reads it or not.
    """

    @property
    def ring(self) -> FrameRing:
        """Return the ring of the frames."""

    @property
    def acquisition(self) -> Starting:
        """Return what is started."""

    @property
    def live(self) -> bool:
        """Return whether they come by themselves."""

    def end(self) -> object:
        """End it."""


class TestHand(Hand):
    """A hand that touches what an acceptance test still wants.

    Parameters
    ----------
    make
        Opens the source of the frames, and says how many of them there are to show; infinite where
        the source ends by itself.
    procedure
        Says what is still wanted, and whether a touch waits to be taken.
    failed
        Told why no frames come any more.
    """

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
        """Time of the instrument that was shown, s."""

    def _play(self, source: Source, watcher: Watcher, frames: float) -> bool:
        """Show so many frames of a source that was started, and return whether it is over."""
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
            # The wire waits for nobody.
            while not source.live and self._procedure.ready and not self._stop.wait(IDLE_S):
                pass
            if len(self._procedure.view.test.positions) != plan:
                break
        return False

    def _wanted(self) -> bool:
        view = self._procedure.view
        return view.base.step.name == "measure" and view.test.current >= 0


class VirtualHand(TestHand):
    """The hand at the virtual rig: it goes where the test wants a point.

    Its source is made anew whenever something is wanted: it shows what is missing then.
    """

    @property
    def named(self) -> str:
        """Return what shows the frames, as the beginning of a sentence."""
        return "The virtual rig"

    def _show(self, watcher: Watcher) -> None:
        """Show what is still wanted from its beginning."""
        source, frames = self._make()
        try:
            source.acquisition.start()
            self._play(source, watcher, frames)
        finally:
            source.end()


class RecordedHand(TestHand):
    """A recording as the hand of a test: replayed once, and on from where it stands.

    A touch is shown once. What a test refused does not come again, and a retest gets the frames
    that come after those of the first run: nothing is measured twice with the same frames.
    """

    _source: Source | None = None
    _frames = np.inf

    @property
    def named(self) -> str:
        """Return what shows the frames, as the beginning of a sentence."""
        return "The recording"

    def close(self) -> None:
        """End the replay."""
        if self._source is not None:
            self._source.end()
            self._source = None

    def _show(self, watcher: Watcher) -> None:
        """Show what comes next in the recording."""
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
