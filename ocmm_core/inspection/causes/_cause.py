"""Possible causes of NOT CONFORM or NOT PROVEN, in the words of the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from ocmm_core.tolerances.decisions import Verdict


class Cause(Enum):
    """Cause that the evidence supports."""

    OUTLIER = "outlier"
    BURR = "burr"
    SIDE = "probe side"
    COVERAGE = "weak coverage"
    NOISE = "scatter of the points"
    TIP = "tip"
    TEMPERATURE = "temperature"
    DATUM = "datum"
    ALIGNMENT = "alignment"
    UNCERTAINTY = "uncertainty"
    DOUBT = "measurement in doubt"
    PART = "the part"


@dataclass(frozen=True, slots=True)
class CauseFinding:
    """A cause with its evidence."""

    cause: Cause
    features: tuple[str, ...]
    points: tuple[int, ...]
    """Numbers of the points that drive the value, the strongest first."""
    suggestion: str
    """What to do, one sentence."""
    evidence: str = ""
    """One sentence; may be empty."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """Why one characteristic is not CONFORM, and what to do."""

    characteristic: str
    verdict: Verdict
    unit: str
    beyond: float | None
    """Distance beyond the nearer limit, in ``unit``; negative inside, None without a value."""
    uncertainty: float | None
    """U (95 %); None together with ``beyond``."""
    why: str
    """The amount next to U, in one or two sentences."""
    finding: CauseFinding

    @property
    def cause(self) -> Cause:
        return self.finding.cause

    @property
    def points(self) -> tuple[int, ...]:
        return self.finding.points

    @property
    def suggestion(self) -> str:
        return self.finding.suggestion


def points_words(numbers: Sequence[int]) -> str:
    """Return numbers in words: "point 3", "points 3, 4 and 5"."""
    if len(numbers) == 1:
        return f"point {numbers[0]}"
    return f"points {', '.join(str(n) for n in numbers[:-1])} and {numbers[-1]}"
