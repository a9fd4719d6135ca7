"""What may be behind a result that is NOT CONFORM or NOT PROVEN, in the words of the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from ocmm_core.tolerances.decisions import Verdict


class Cause(Enum):
    """The cause that the evidence speaks for."""

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
    """A cause with what speaks for it."""

    cause: Cause
    """Which."""
    features: tuple[str, ...]
    """Names of the features to look at."""
    points: tuple[int, ...]
    """Numbers of the points that drive the value, the strongest first."""
    suggestion: str
    """What to do, one sentence."""
    evidence: str = ""
    """What speaks for it, one sentence; may be empty."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """Why one characteristic is not CONFORM, and what to do now."""

    characteristic: str
    verdict: Verdict
    unit: str
    """`characteristic`, `verdict`, `unit`: Of the result that is explained."""
    beyond: float | None
    """By how much the value lies beyond the nearer limit, in ``unit``; negative inside. None where
    there is no value."""
    uncertainty: float | None
    """U (95 %); None together with ``beyond``."""
    why: str
    """The amount beside U, in one or two sentences."""
    finding: CauseFinding
    """Cause, points and suggestion."""

    @property
    def cause(self) -> Cause:
        """Return the cause."""
        return self.finding.cause

    @property
    def points(self) -> tuple[int, ...]:
        """Return the numbers of the points that drive the value."""
        return self.finding.points

    @property
    def suggestion(self) -> str:
        """Return what to do."""
        return self.finding.suggestion


def points_words(numbers: Sequence[int]) -> str:
    """Return points by their numbers: "point 3", "points 3, 4 and 5"."""
    if len(numbers) == 1:
        return f"point {numbers[0]}"
    return f"points {', '.join(str(n) for n in numbers[:-1])} and {numbers[-1]}"
