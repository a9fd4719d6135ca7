"""The reconstruction thread: frames from the ring, tracked, with the touches that they hold."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Protocol

from ocmm_core.acquisition.frames import (
    AcquisitionState,
    FrameBlock,
    FrameRing,
    RingHeaderField,
    read_status,
)
from ocmm_core.acquisition.recording import FrameHistory
from ocmm_core.camera import Rig
from ocmm_core.errors import OcmmError
from ocmm_core.measuring import PointOptions, Touch, TouchCollector
from ocmm_core.station._faults import StationFaults
from ocmm_core.tracking import (
    ProbeBody,
    ReferenceBody,
    ReferenceHome,
    TrackBlock,
    TrackingOptions,
    TrackingPipeline,
)

_BATCH = 800
"""Most frames that are tracked at once; 10 ms at 8 kHz come to 80."""
_IDLE_S = 0.002


RECORDING = "The recording"


class FrameSink(Protocol):
    """Takes the raw frames as they come, e.g. a recorder."""

    def append(self, block: FrameBlock) -> None:
        """Keep a block of frames."""
        ...

    def check_name(self) -> OcmmError | None:
        """Return why its file is not on the disk under its name; None if it is. Any thread."""
        ...

    def close(self) -> None:
        """Make everything durable and end."""
        ...


@dataclass(frozen=True, slots=True)
class Tracked:
    """A block of frames and what became of it."""

    block: FrameBlock
    track: TrackBlock
    """`block`, `track`: As they came, and tracked."""
    touches: Sequence[Touch]
    """That ended in them."""
    collecting: bool
    pipeline: TrackingPipeline
    """What tracked them; for the labels and the reference body."""


class MeasureStep(Protocol):
    """What a tracked block goes to; on the thread of the loop, and never during `between`."""

    @property
    def awaits_pull(self) -> bool:
        """Return whether the ball is followed while it is pulled away after a touch."""
        ...

    def measure(self, tracked: Tracked) -> None:
        """Make points of the touches, and show the rest to whoever watches."""
        ...


class FrameLoop:
    """Give tracked frames to whoever measures, on a thread of its own.

    Parameters
    ----------
    ring
        Where the frames come from; somebody else owns it.
    rig, body, reference
        What is tracked with.
    tracking, point
        How frames are tracked, and what a touch is.
    home
        Where the reference body stood when the job began; None before that is known.
    step
        What every tracked block goes to next.
    faults
        Keeps why the loop had to give up, and why the recorder gets no more.
    halt
        Ends the loop when it is set, by whomever.
    recorder
        Gets every raw frame.
    history
        Keeps the last of them in memory.
    """

    def __init__(
        self,
        ring: FrameRing,
        rig: Rig,
        body: ProbeBody,
        reference: ReferenceBody | None,
        tracking: TrackingOptions,
        point: PointOptions,
        *,
        home: ReferenceHome | None,
        step: MeasureStep,
        faults: StationFaults,
        halt: threading.Event,
        recorder: FrameSink | None = None,
        history: FrameHistory | None = None,
    ) -> None:
        self._ring, self._history = ring, history
        self._rig, self._body, self._reference = rig, body, reference
        self._tracking, self._point = tracking, point
        self._step, self._faults, self._recorder = step, faults, recorder
        self._pipeline = self.pipeline_from(home)
        self._collector: TouchCollector | None = None
        self._exclusive = threading.RLock()
        self._take = threading.Event()
        self._stop = halt
        self._drained = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ocmm-reconstruction")

    def start(self) -> None:
        """Begin; once."""
        self._thread.start()

    def arm(self) -> None:
        """Take a point at the next block, as if it was triggered."""
        self._take.set()

    def exclusive(self) -> AbstractContextManager[bool]:
        """Return what keeps blocks from being measured while it is held."""
        return self._exclusive

    def pipeline_from(self, home: ReferenceHome | None) -> TrackingPipeline:
        """Return what tracks relative to a first place of the reference body; see `track_by`."""
        return TrackingPipeline(self._rig, self._body, self._tracking, self._reference, home)

    def track_by(self, pipeline: TrackingPipeline) -> None:
        """Track by another pipeline, to another first place of the reference body, from now on.

        Labels are sought anew, and a touch that has begun is dropped: it belongs to neither place.
        """
        with self._exclusive:
            self._pipeline, self._collector = pipeline, None

    def request_stop(self) -> None:
        """Ask it to end; returns at once."""
        self._stop.set()

    def join(self, timeout_s: float) -> bool:
        """Wait for the end, and say whether it came; it has where the loop was never started."""
        if self._thread.ident is None:
            return True
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def wait_drained(self, timeout_s: float) -> bool:
        """Wait until the source has ended and all its frames are measured; say whether so."""
        return self._drained.wait(timeout_s)

    def _run(self) -> None:
        try:
            while not self._stop.is_set():
                status = read_status(self._ring)
                ended = status.state is AcquisitionState.STOPPED
                # What is written before the source says that it ended is read after that.
                block = self._ring.read(_BATCH)
                if block is not None:
                    with self._exclusive:
                        self._feed(block)
                elif ended:
                    if status.internal:
                        raise status.error("acquisition.failed", "")
                    return
                else:
                    self._stop.wait(_IDLE_S)
        except Exception as error:
            # Whatever it is: without this thread the last number would stand for good.
            self._faults.fail(error, "The reconstruction")
        finally:
            self._drained.set()

    def _feed(self, block: FrameBlock) -> None:
        if self._history is not None:
            self._history.append(block)
        if self._recorder is not None:
            try:
                self._recorder.append(block)
            except Exception as error:
                lost, self._recorder = self._recorder.check_name() is not None, None
                (self._faults.fail if lost else self._faults.note)(error, RECORDING)
        track = self._pipeline.process(block)
        collector = self._collector
        if collector is None:
            period_s = self._ring.word(RingHeaderField.FRAME_PERIOD_NS) * 1e-9
            collector = self._collector = TouchCollector(period_s, self._point)
        if self._take.is_set():
            self._take.clear()
            collector.arm()
        collector.pulled = self._step.awaits_pull
        touches = collector.feed(track)
        self._step.measure(Tracked(block, track, touches, collector.collecting, self._pipeline))
