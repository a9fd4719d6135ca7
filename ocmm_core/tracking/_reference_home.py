"""Home of a reference body, which defines the world of a job."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.tracking._body_tracker import spot_sigma_px
from ocmm_core.tracking._reference_body import ReferenceBody
from ocmm_core.tracking._result import INTERRUPTION_NS, FrameStatus, ReferenceHome, TrackBlock
from ocmm_core.tracking._sensitivity import pose_sensitivity

HOME_NS = 250_000_000
"""Bus time of the averaged home."""

HOME_WANDER_PX = 0.1
"""Largest wander of spots while the home is recorded, beyond noise: 50 um at one metre."""

_BATCHES = 10
_SIGMAS = 5.0


class HomeTaker:
    """Records the first place of rest of a reference body; for one thread."""

    def __init__(self, rig: Rig, reference: ReferenceBody) -> None:
        self.reason = "its position is being taken"
        """Why there is no home yet."""
        self._rig = rig
        self._reference = reference
        self._spots: list[Float] = []
        self._began_ns = self._before_ns = self._count = 0
        self._seen = np.zeros(0, dtype=np.uint64)

    def feed(self, body: TrackBlock) -> tuple[int, ReferenceHome] | None:
        """Add frames and return the home, with the index of the first frame after it."""
        for index in range(len(body)):
            now_ns = int(body.time_ns[index])
            good = body.status[index] == FrameStatus.OK
            gap = now_ns - self._before_ns > INTERRUPTION_NS or now_ns <= self._before_ns
            self._before_ns = now_ns
            more = np.bitwise_count(body.seen[index]).sum() > np.bitwise_count(self._seen).sum()
            if not good or gap or more:
                self._begin(body, index)
            if not good:
                continue
            self._count += 1
            # An LED may be dark in some frames: average those with most LEDs.
            if np.array_equal(body.seen[index], self._seen):
                self._spots.append(body.uv[index])
            if now_ns - self._began_ns < HOME_NS:
                continue
            spots = np.array(self._spots)
            enough = len(spots) >= max(2 * _BATCHES, self._count // 2)
            self._begin(body, index)
            if enough and self._rests(spots):
                return index + 1, home_of(
                    spots.mean(axis=0), len(spots), self._rig, self._reference
                )
            if enough:
                self.reason = "it is not at rest, so its position cannot be taken"
        return None

    def _begin(self, body: TrackBlock, index: int) -> None:
        self._spots.clear()
        self._count = 0
        self._began_ns, self._seen = int(body.time_ns[index]), body.seen[index]

    def _rests(self, spots: Float) -> bool:
        means = np.array([part.mean(axis=0) for part in np.array_split(spots, _BATCHES)])
        noise = _SIGMAS * spot_sigma_px(self._rig) / np.sqrt(len(spots) / _BATCHES)
        wander = float(np.nanmax(np.abs(means - means.mean(axis=0))))
        return wander < max(HOME_WANDER_PX, float(noise))


def home_of(spots: Float, n_frames: int, rig: Rig, reference: ReferenceBody) -> ReferenceHome:
    """Return the home from mean spots (C, R, 2), px; TrackingError without a pose."""
    pose = pose_sensitivity(spots, rig, reference.leds.leds_body)
    return ReferenceHome(spots, n_frames, RigidTransform(pose.rotation, pose.origin))
