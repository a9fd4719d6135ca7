"""Where frames come from: one small protocol, served by bus, virtual rig and replay alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from ocmm_core.acquisition.frames._frames import Cycle
from ocmm_core.camera import USUAL_SLOTS


@dataclass(frozen=True, slots=True)
class SourceDescription:
    """What a source says about itself before it is opened."""

    name: str
    """For people, e.g. ``"simulated (recommended, seed 1)"``."""
    camera_serials: tuple[int, ...]
    """Serial number of each camera, in the order of the frames."""
    frame_period_ns: int
    """Time between two exposures, ns."""
    cycle_period_ns: int
    """Time between two reads, ns."""
    live: bool
    """Frames come whether or not anybody reads; a source that is not live waits for the reader."""
    simulated: bool
    """The frames are computed: no real camera saw a real part. What is measured says so."""
    stretched: bool = False
    """A live source whose time waits for a busy computer; never one of real cameras."""
    n_slots: int = USUAL_SLOTS
    """Slots of every camera."""


@runtime_checkable
class FrameSource(Protocol):
    """A source of frames, owned and called by one thread only.

    ``read`` blocks at most about 0.2 s, so that the owner can stop in bounded time.
    """

    @property
    def description(self) -> SourceDescription:
        """Return what the source says about itself."""
        ...

    def open(self) -> None:
        """Make ready to read; raise OcmmError with the remedy if that cannot be done."""
        ...

    def read(self) -> Cycle:
        """Return the next cycle, with its verdict."""
        ...

    def close(self) -> None:
        """Give everything back; may be called twice, and after a failed open."""
        ...
