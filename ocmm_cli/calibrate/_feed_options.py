"""Options about the frames of a procedure, as one parameter of commands."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class FeedOptions:
    """Options about the frames of a procedure."""

    seed: int
    move: int | None
    """`seed`, `move`: of a virtual rig."""
    speed: float
    record: Path | None
    force: bool
