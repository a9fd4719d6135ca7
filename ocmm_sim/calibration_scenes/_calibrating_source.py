from __future__ import annotations

import time

from ocmm_core.acquisition.frames import Cycle, CycleVerdict, SourceDescription
from ocmm_sim.calibration_scenes._calibrating import CalibrationScenesRig

BLOCK_NS = 10_000_000


class CalibratingSource:
    """A `FrameSource` that shows the scenes once and ends; rig time waits for slow readers."""

    def __init__(self, rig: CalibrationScenesRig, speed: float = 0.0) -> None:
        self._rig = rig
        self._speed = speed
        self._block = max(1, BLOCK_NS // rig.frame_period_ns)
        self._next = 0
        self._due_s = 0.0

    @property
    def description(self) -> SourceDescription:
        rig = self._rig
        return SourceDescription(
            name=f"simulated calibration ({rig.rig.name}, seed {rig.seed})",
            camera_serials=tuple(camera.serial for camera in rig.rig.cameras),
            frame_period_ns=rig.frame_period_ns,
            cycle_period_ns=self._block * rig.frame_period_ns,
            live=False,
            simulated=True,
            n_slots=rig.world.n_slots,
        )

    def open(self) -> None:
        self._next = 0
        self._due_s = time.monotonic()

    def read(self) -> Cycle:
        count = min(self._block, self._rig.n_frames - self._next)
        frames = self._rig.frames(self._next, count) if count > 0 else None
        self._next += max(count, 0)
        if self._speed:
            self._due_s += count * self._rig.frame_period_ns * 1e-9 / self._speed
            time.sleep(max(0.0, self._due_s - time.monotonic()))
        finished = self._next >= self._rig.n_frames
        return Cycle(CycleVerdict.GOOD, frames=frames, finished=finished)

    def close(self) -> None:
        """Do nothing: the source holds no resources."""
