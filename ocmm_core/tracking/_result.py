"""What tracking says about every frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ocmm_core.geometry import Float, Int, RigidTransform

INTERRUPTION_NS = 50_000_000
"""After a longer pause between two frames nothing of before counts any more, neither which slot
follows which LED nor where the ball came from: a camera may have been restarted meanwhile."""


class FrameStatus(IntEnum):
    """Whether a frame has a tip position, and if not why."""

    OK = 0
    LOST = 1
    """Fewer than three targets were seen by two cameras, or they stand nearly in one line."""
    UNIDENTIFIED = 2
    """Targets are seen, but which is which is in doubt."""
    DOUBTFUL = 3
    """The spots do not fit the probe body (chi-square), or its orientation rules."""
    REFERENCE_LOST = 4
    """It is not known where the reference body is, so that nothing can be given relative to it."""


@dataclass(frozen=True, slots=True)
class ReferenceHome:
    """Where the reference body stood when the job began: what makes the world of a job."""

    spots: Float
    """(C, R, 2), px: mean spots by its LED number, NaN where not seen."""
    n_frames: int
    """Frames that were averaged."""
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
    """(n, 3, 3), mm^2: of the spot noise of one frame only."""
    rotation_world_from_probe: Float
    """(n, 3, 3)."""
    origin_world: Float
    """(n, 3), mm: origin of the probe frame."""
    chi2: Float
    """(n,): sum of squared residuals over the variance of the spot noise."""
    dof: Int
    """(n,) int64: its degrees of freedom."""
    seen: NDArray[np.uint64]
    """(n, C) uint64: bit l says that the camera saw LED l."""
    uv: Float
    """(n, C, L, 2), px: spots ordered by LED number, NaN where not seen."""
    reference: ReferenceTrack | None = None
    """How the reference body was seen; None where none is used. With one, "world" is the frame in
    which the cameras were calibrated as it stood to the reference when the job began."""

    def __len__(self) -> int:
        return len(self.counter)


@dataclass(frozen=True, slots=True)
class ReferenceTrack:
    """What the cameras saw, before it was brought into the world of the job.

    "Rig" is the frame of the cameras as they stand now.
    """

    probe: TrackBlock
    """The probe as if there were no reference: its own status, poses in the rig frame."""
    body: TrackBlock
    """The reference body, tracked like a probe whose ball is the middle of its LEDs; its poses are
    those of single frames."""
    covariance: Float
    """(n, 6, 6): of the pose of the reference body in one frame, for the increments of
    `pose.reprojection`, rig frame."""
    home: ReferenceHome | None
    """Where it stood when the job began; None before that is known."""


def interruptions(time_ns: Int, before_ns: int) -> list[int]:
    """Return before which frames the stream was interrupted.

    Parameters
    ----------
    time_ns
        (n,), bus time of consecutive frames.
    before_ns
        Of the last frame before them; 0 where these are the first.

    Returns
    -------
    list of int
        Indices of frames that come later than `INTERRUPTION_NS` after the one before, or not
        after it at all, because the bus clock was set anew.
    """
    steps = np.diff(time_ns, prepend=before_ns or time_ns[:1] - 1)
    return np.flatnonzero((steps <= 0) | (steps > INTERRUPTION_NS)).tolist()


def in_rig(track: TrackBlock) -> TrackBlock:
    """Return the probe as the cameras saw it, whatever a reference body says."""
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
    """Return the frames from ``start`` up to ``stop`` of a block."""
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
"""Names of the fields of a `TrackBlock` that have a row for every frame."""
