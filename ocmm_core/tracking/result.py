"""What tracking says about every frame."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ocmm_core.geometry import Float, Int

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


@dataclass(frozen=True, slots=True)
class TrackBlock:
    """Tracked frames; tip and pose of a frame whose status is not OK are NaN.

    Attributes
    ----------
    counter, time_ns, flags
        (n,): as in `FrameBlock`.
    status
        (n,) uint8: `FrameStatus`.
    tip_world
        (n, 3), mm: ball centre.
    tip_covariance
        (n, 3, 3), mm^2: of the spot noise of one frame only.
    rotation_world_from_probe
        (n, 3, 3).
    origin_world
        (n, 3), mm: origin of the probe frame.
    chi2
        (n,): sum of squared residuals over the variance of the spot noise.
    dof
        (n,) int64: its degrees of freedom.
    seen
        (n, C) uint16: bit l says that the camera saw LED l.
    uv
        (n, C, L, 2), px: spots ordered by LED number, NaN where not seen.
    """

    counter: Int
    time_ns: Int
    flags: NDArray[np.uint32]
    status: NDArray[np.uint8]
    tip_world: Float
    tip_covariance: Float
    rotation_world_from_probe: Float
    origin_world: Float
    chi2: Float
    dof: Int
    seen: NDArray[np.uint16]
    uv: Float

    def __len__(self) -> int:
        return len(self.counter)


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


def join(pieces: list[TrackBlock]) -> TrackBlock:
    """Return consecutive blocks as one."""
    if len(pieces) == 1:
        return pieces[0]
    return TrackBlock(
        *(
            np.concatenate([getattr(piece, name) for piece in pieces])
            for name in TrackBlock.__dataclass_fields__
        )
    )


def cut(block: TrackBlock, start: int, stop: int) -> TrackBlock:
    """Return the frames from ``start`` up to ``stop`` of a block."""
    return TrackBlock(
        *(getattr(block, name)[start:stop] for name in TrackBlock.__dataclass_fields__)
    )
