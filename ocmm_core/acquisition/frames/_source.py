"""Frame source protocol, implemented by bus, virtual rig and replay."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from ocmm_core.acquisition.frames._frames import Cycle
from ocmm_core.camera import USUAL_SLOTS


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
