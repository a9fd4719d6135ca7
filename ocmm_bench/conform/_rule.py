from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ocmm_bench.conform._bench import Bench
from ocmm_bench.conform._findings import RuleFindings


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule."""

    code: str
    """Identifier in reports; never reused."""
    section: str
    title: str
    """Requirement, one sentence."""
    run: Callable[[Bench, RuleFindings], None]
    """Tests the rule; may leave the camera in any state."""
