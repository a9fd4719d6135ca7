"""Frames of all cameras at one exposure time, in consecutive blocks, and their source.

The protocol of a source is implemented by bus, virtual rig and replay.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntFlag
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import USUAL_SLOTS
from ocmm_core.geometry import Float, Int

SUBPIXEL = 1.0 / 65536.0
"""Resolution of a spot on the wire, px (fixed point with 16 fractional bits)."""


class FrameFlag(IntFlag):
    """Bits of a frame."""

    BUTTON = 1
    OVERRUN = 2
    """The camera's own buffer lost frames just before this one."""
    SATURATED = 4
    DROPPED = 8
    """The probe sensed a shock; set for a second, so that lost frames do not hide it."""


class CycleVerdict(Enum):
    """Outcome of a cycle; exactly one per cycle."""

    GOOD = "good"
    LATE = "late"
    LOST = "lost"
    BAD = "bad"


@dataclass(frozen=True, slots=True)
class FrameBlock:
    """Consecutive frames of all cameras, joined by exposure time."""

    counter: Int
    """(n,) int64: exposure number common to all cameras; gaps only if frames were lost."""
    time_ns: Int
    """(n,) int64: exposure time on the bus clock, ns."""
    flags: NDArray[np.uint32]
    """(n,) uint32: bits of `FrameFlag`."""
    valid: NDArray[np.uint64]
    """(n, C) uint64: bit s: slot s of the camera holds a spot."""
    uv: Float
    """(n, C, S, 2) float64, px: spot of every slot, NaN if invalid."""

    def __len__(self) -> int:
        return len(self.counter)

    def part(self, frames: slice | NDArray[np.bool_]) -> FrameBlock:
        """Return some frames of the block."""
        return FrameBlock(
            self.counter[frames], self.time_ns[frames], self.flags[frames], self.valid[frames],
            self.uv[frames],
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Cycle:
    """Result of one read of a source."""

    verdict: CycleVerdict
    reason: str = ""
    """`verdict`, `reason`: outcome, and the reason unless good."""
    frames: FrameBlock | None = None
    """New frames; None if the cycle brought none."""
    elapsed: int = 1
    """Number of bus cycles of this read (more than one if the host was late)."""
    frames_lost: int = 0
    """Frames lost just before these, by the exposure counter."""
    finished: bool = False
    """End of a recording or script."""
    skipped: CycleVerdict = CycleVerdict.LATE
    """Verdict of the other cycles of this read."""


def frame_dtype(n_cameras: int, n_slots: int = USUAL_SLOTS) -> np.dtype[np.void]:
    """Return the layout of a frame in ring and recordings; to 16 slots that of the first ones."""
    return np.dtype(
        [
            ("counter", "<i8"),
            ("time_ns", "<i8"),
            ("flags", "<u4"),
            ("valid", "<u2" if n_slots <= 16 else "<u8", (n_cameras,)),
            ("uv", "<f8", (n_cameras, n_slots, 2)),
        ]
    )


def to_records(block: FrameBlock) -> NDArray[np.void]:
    """Return the block as an array (n,) of `frame_dtype`."""
    records = np.empty(len(block), frame_dtype(*block.uv.shape[1:3]))
    records["counter"] = block.counter
    records["time_ns"] = block.time_ns
    records["flags"] = block.flags
    records["valid"] = block.valid
    records["uv"] = block.uv
    return records


def from_records(records: NDArray[np.void]) -> FrameBlock:
    """Return the block in an array (n,) of `frame_dtype`; copies the data."""
    return FrameBlock(
        counter=np.array(records["counter"], dtype=np.int64),
        time_ns=np.array(records["time_ns"], dtype=np.int64),
        flags=np.array(records["flags"], dtype=np.uint32),
        valid=np.array(records["valid"], dtype=np.uint64),
        uv=np.array(records["uv"], dtype=np.float64),
    )


def quantise(uv: Float) -> Float:
    """Return spots (..., 2), px, rounded to the resolution of the wire; for tests."""
    return np.round(uv / SUBPIXEL) * SUBPIXEL


@dataclass(frozen=True, slots=True)
class SourceDescription:
    """Properties of a source before it is opened."""

    name: str
    """For people, such as ``"simulated (recommended, seed 1)"``."""
    camera_serials: tuple[int, ...]
    frame_period_ns: int
    cycle_period_ns: int
    live: bool
    """Frames arrive whether or not they are read; other sources wait for the reader."""
    simulated: bool
    """Computed frames, without real cameras; results are marked accordingly."""
    stretched: bool = False
    """A live source whose time waits for a busy computer; never real cameras."""
    n_slots: int = USUAL_SLOTS
    skew_ns: int = 0
    """Largest difference of the exposure times in a frame; 0 for one schedule of all cameras."""
    untimed: bool = False
    """Nothing proves that the cameras expose at the same time: their skew is measured."""


@runtime_checkable
class FrameSource(Protocol):
    """Source of frames of one thread; ``read`` blocks for 0.2 s at most, so that it can stop."""

    @property
    def description(self) -> SourceDescription: ...

    def open(self) -> None:
        """Prepare for reading; raise OcmmError with the remedy on failure."""
        ...

    def read(self) -> Cycle:
        """Return the next cycle, with its verdict."""
        ...

    def close(self) -> None:
        """Release everything; idempotent, also after a failed open."""
        ...
