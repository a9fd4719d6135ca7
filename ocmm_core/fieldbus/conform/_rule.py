"""One rule of the page about the objects, and how it is tried."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ocmm_core.fieldbus.conform._bench import Bench
from ocmm_core.fieldbus.conform._findings import Findings


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule."""

    code: str
    """For the report; never given to another rule."""
    section: str
    """What it is about, for people."""
    title: str
    """What must hold, one sentence."""
    run: Callable[[Bench, Findings], None]
    """Tries it; notes what it finds. It may leave the camera in any state."""
