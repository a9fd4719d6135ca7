"""Results of tracking for every frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ocmm_core.geometry import Float, Int, RigidTransform

INTERRUPTION_NS = 50_000_000
"""Longer pauses between two frames invalidate all history, labels and path of the ball: a camera
may have been restarted.
"""


class FrameStatus(IntEnum):
    """Whether a frame has a tip position, and if not why."""

    OK = 0
    LOST = 1
    """Fewer than three targets were seen by two cameras, or they are nearly collinear."""
    UNIDENTIFIED = 2
    """Targets are visible, but their labels are ambiguous."""
    DOUBTFUL = 3
    """The spots do not fit the probe body (chi-square), or its orientation rules."""
    REFERENCE_LOST = 4
    """The pose of the reference body is unknown, so no relative position is available."""


@dataclass(frozen=True, slots=True)
class ReferenceHome:
    """Pose of the reference body at the start of the job, which defines the job's world."""

    spots: Float
    """(C, R, 2), px: mean spots by its LED number, NaN if unseen."""
    n_frames: int
    T_rig_from_reference: RigidTransform


@dataclass(frozen=True, slots=True)
class TrackBlock:
    """Tracked frames; tip and pose of a frame whose status is not OK are NaN."""

    counter: Int
    time_ns: Int
    flags: NDArray[np.uint32]
    """`counter`, `time_ns`, `flags`: (n,): as in `FrameBlock`."""
    status: NDArray[np.uint8]
    """(n,) uint8: `FrameStatus`."""
    tip_world: Float
    """(n, 3), mm: ball centre."""
    tip_covariance: Float
    """(n, 3, 3), mm^2: due to spot noise of one frame only."""
    rotation_world_from_probe: Float
    """(n, 3, 3)."""
    origin_world: Float
    """(n, 3), mm: origin of the probe frame."""
    chi2: Float
    """(n,): sum of squared residuals over the variance of the spot noise."""
    dof: Int
    """(n,) int64: its degrees of freedom."""
    seen: NDArray[np.uint64]
    """(n, C) uint64: bit l is set if the camera saw LED l."""
    uv: Float
    """(n, C, L, 2), px: spots ordered by LED number, NaN if unseen."""
    reference: ReferenceTrack | None = None
    """View of the reference body, or None. With one, "world" is the calibration frame of the
    cameras at their pose relative to the reference at the start of the job."""

    def __len__(self) -> int:
        return len(self.counter)


@dataclass(frozen=True, slots=True)
class ReferenceTrack:
    """Tracks in the cameras' present frame ("rig"), before transformation to the job's world."""

    probe: TrackBlock
    """The probe without reference: its own status, poses in the rig frame."""
    body: TrackBlock
    """The reference body, tracked like a probe with the middle of its LEDs as ball; single-frame
    poses."""
    covariance: Float
    """(n, 6, 6): of single-frame poses, for the increments of `pose.reprojection`, rig frame."""
    home: ReferenceHome | None
    """None until determined."""


def interruptions(time_ns: Int, before_ns: int) -> list[int]:
    """Return the indices of frames preceded by an interruption.

    Frames later than `INTERRUPTION_NS` after the previous one, or not after it at all because the
    bus clock was reset. ``before_ns`` is the bus time before them; 0 if these are the first.
    """
    steps = np.diff(time_ns, prepend=before_ns or time_ns[:1] - 1)
    return np.flatnonzero((steps <= 0) | (steps > INTERRUPTION_NS)).tolist()


def in_rig(track: TrackBlock) -> TrackBlock:
    """Return the probe as seen by the cameras, without the reference body."""
    return track if track.reference is None else track.reference.probe


def join(pieces: Sequence[TrackBlock]) -> TrackBlock:
    """Return consecutive blocks as one."""
    if len(pieces) == 1:
        return pieces[0]
    references = [piece.reference for piece in pieces if piece.reference is not None]
    reference = None
    if references:
        reference = ReferenceTrack(
            probe=join([item.probe for item in references]),
            body=join([item.body for item in references]),
            covariance=np.concatenate([item.covariance for item in references]),
            home=references[-1].home,
        )
    arrays = {name: np.concatenate([getattr(piece, name) for piece in pieces]) for name in ARRAYS}
    return TrackBlock(**arrays, reference=reference)


def cut(block: TrackBlock, start: int, stop: int) -> TrackBlock:
    return pick(block, slice(start, stop))


def pick(block: TrackBlock, frames: slice | Int | NDArray[np.bool_]) -> TrackBlock:
    """Return some frames of a block."""
    seen = block.reference
    reference = None
    if seen is not None:
        reference = ReferenceTrack(
            probe=pick(seen.probe, frames),
            body=pick(seen.body, frames),
            covariance=seen.covariance[frames],
            home=seen.home,
        )
    arrays = {name: getattr(block, name)[frames] for name in ARRAYS}
    return TrackBlock(**arrays, reference=reference)


ARRAYS = tuple(item.name for item in fields(TrackBlock) if item.name != "reference")
"""Fields of a `TrackBlock` with a row for every frame."""
