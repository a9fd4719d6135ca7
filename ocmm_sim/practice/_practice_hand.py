"""Hand for practising a guided procedure at the virtual rig."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Protocol

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guided import ProcedureDecision
from ocmm_core.composition.hands import BLOCK, IDLE_S, Hand, Watcher
from ocmm_core.errors import OcmmError

_WAIT_S = 0.05


class ShownRig(Protocol):
    """A virtual rig with a finite sequence of frames."""

    @property
    def n_frames(self) -> int:
        """Return how many frames there are."""

    @property
    def frame_period_ns(self) -> int:
        """Return the time from frame to frame, ns."""

    def frames(self, first: int, count: int) -> FrameBlock:
        """Return `count` frames from `first`."""


class PracticeHand(Hand):
    """Hand at the virtual rig for the current step; `make`: a rig for its rest, None if done."""

    def __init__(
        self,
        make: Callable[[], ShownRig | None],
        procedure: Any,
        speed: float,
        failed: Callable[[OcmmError], None],
    ) -> None:
        super().__init__(
            failed, thread="ocmm-practice-hand", safe="All observations are stored.",
            idle_s=_WAIT_S,
        )  # fmt: skip
        self._make, self._procedure, self._speed = make, procedure, speed

    @property
    def named(self) -> str:
        """Return the hand's name as the start of a sentence."""
        return "The virtual hand"

    def _wanted(self) -> bool:
        return self._is_wanted(self._procedure.base.step.name)

    def _is_wanted(self, step: str) -> bool:
        base = self._procedure.base
        is_open = base.decision is ProcedureDecision.OPEN
        return is_open and base.step.name == step and not base.step.gate.open

    def _show(self, watcher: Watcher) -> None:
        step = self._procedure.base.step.name
        rig = self._make()
        if rig is None:
            return
        due = time.monotonic()
        for first in range(0, rig.n_frames, BLOCK):
            if self._stop.is_set() or not self._is_wanted(step):
                return
            block = rig.frames(first, min(BLOCK, rig.n_frames - first))
            watcher(block)
            # Stay in place until the touch is recorded.
            while self._procedure.base.live.ready and self._is_wanted(step):
                if self._stop.wait(IDLE_S):
                    return
                due = time.monotonic()
            if self._speed:
                due += len(block) * rig.frame_period_ns * 1e-9 / self._speed
                self._stop.wait(max(due - time.monotonic(), 0.0))
