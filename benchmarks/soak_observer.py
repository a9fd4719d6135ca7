"""Looks at every frame that the station of a soak takes out of the ring."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from PySide6.QtWidgets import QApplication

from ocmm_core.acquisition.frames import FrameBlock, FrameRing, quantise
from ocmm_core.station import MeasuringStation
from ocmm_gui.bridge import StationBridge
from ocmm_sim.slave import CameraFrames

SAMPLE, SAMPLED_FRAMES = 50, 16
"""One block in this number is sampled, with this number of frames compared with the rig."""


@dataclass(slots=True)
class Observer:
    """What the station took out of the ring.

    Attributes
    ----------
    provider
        What the cameras show, where that is known to the exposure; else no pixels are looked at.
    period_ns
        Of the frames.
    frames, blocks
        Taken.
    gaps, stale, untimely
        Exposures missing between two frames; frames that are no later than the one before; frames
        whose time is not one period after the one before for each exposure between them.
    compared, differing
        Frames whose pixels were looked at, and those that are not of their exposure.
    """

    provider: CameraFrames | None
    period_ns: int
    frames: int = 0
    blocks: int = 0
    gaps: int = 0
    stale: int = 0
    untimely: int = 0
    compared: int = 0
    differing: int = 0
    counter: int = -1
    time_ns: int = 0

    def take(self, block: FrameBlock) -> None:
        """Examine a block."""
        counter, time_ns = block.counter, block.time_ns
        if self.counter >= 0:
            counter = np.concatenate([[self.counter], counter])
            time_ns = np.concatenate([[self.time_ns], time_ns])
        steps = np.diff(counter)
        self.stale += int(np.count_nonzero(steps <= 0))
        self.gaps += int(np.sum(np.maximum(steps - 1, 0)))
        self.untimely += int(np.count_nonzero(np.diff(time_ns) != steps * self.period_ns))
        self.counter, self.time_ns = int(counter[-1]), int(time_ns[-1])
        self.frames += len(block)
        self.blocks += 1
        if self.blocks % SAMPLE == 0:
            self._compare(block)

    def clear(self) -> None:
        """Begin to count."""
        self.frames = self.blocks = self.gaps = self.stale = self.untimely = 0
        self.compared = self.differing = 0

    def _compare(self, block: FrameBlock) -> None:
        if self.provider is None:
            return
        first, count = int(block.counter[0]), min(SAMPLED_FRAMES, len(block))
        if int(block.counter[count - 1]) != first + count - 1:
            return
        for camera in range(block.uv.shape[1]):
            valid, _, uv = self.provider.camera_frames(camera, first, count)
            slots = min(uv.shape[1], block.uv.shape[2])
            same = (block.valid[:count, camera] == valid) & np.all(
                (block.uv[:count, camera, :slots] == quantise(uv[:, :slots]))
                | (np.isnan(uv[:, :slots]) & np.isnan(block.uv[:count, camera, :slots])),
                axis=(1, 2),
            )
            self.compared += count
            self.differing += int(np.count_nonzero(~same))


@contextlib.contextmanager
def observed(observer: Observer) -> Iterator[None]:
    """Let the observer see all ring reads of this process."""
    read = FrameRing.read

    def observing(self: FrameRing, limit: int) -> FrameBlock | None:
        block = read(self, limit)
        if block is not None:
            observer.take(block)
        return block

    FrameRing.read = observing  # type: ignore[method-assign]
    try:
        yield
    finally:
        FrameRing.read = read  # type: ignore[method-assign]


def run_observed(
    app: QApplication, bridge: StationBridge, station: MeasuringStation, observer: Observer
) -> None:
    """Let a window measure until it is closed, with an observer of the station's frames."""
    with observed(observer):
        try:
            bridge.start()
            app.exec()
        finally:
            bridge.close()
            station.close()
