"""Possible causes of NOT CONFORM or NOT PROVEN, in the words of the report.

They depend on the distance of a value from its limits, with and without U.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.zones import Characteristic


def limits_of(item: Characteristic, result: CharacteristicResult) -> tuple[float, float]:
    """Return the limits of a value, its bonus included; the lower one may be infinite."""
    low = float("-inf") if spec_of(item.kind).one_sided else item.nominal + item.lower
    return low, item.nominal + item.upper + result.bonus


def is_low(item: Characteristic, result: CharacteristicResult) -> bool:
    low, high = limits_of(item, result)
    value = result.measured
    return value is not None and low - value > value - high


def way_to_good(item: Characteristic, result: CharacteristicResult) -> float | None:
    """Return the distance of a value from conformity, U included; None without a value."""
    beyond, uncertainty = beyond_limit(item, result), result.uncertainty
    return None if beyond is None or uncertainty is None else beyond + uncertainty


def beyond_limit(item: Characteristic, result: CharacteristicResult) -> float | None:
    """Return the distance beyond the nearer limit, negative inside; None without a value."""
    value = result.measured
    if value is None:
        return None
    low, high = limits_of(item, result)
    return max(low - value, value - high)


def amount_words(item: Characteristic, result: CharacteristicResult) -> str:
    """Return the excess of a value, or the required U or value, next to U, in words."""
    beyond, u, value = beyond_limit(item, result), result.uncertainty, result.measured
    if beyond is None or u is None or value is None:
        return result.note
    # Decided in place, so that a sentence is collected whole for each unit.
    turns = result.unit == "deg"
    low, high = limits_of(item, result)
    above = value - high >= low - value
    limit, word = (high, "upper") if above else (low, "lower")
    if result.verdict is Verdict.NOT_CONFORM:
        times = f" ({beyond / u:.1f} times U)" if u > 0.0 and beyond > 0.0 else ""
        return (
            f"{beyond:.4f}{'°' if turns else ' mm'} beyond the {word} limit "
            f"{limit:.4f}{'°' if turns else ' mm'}; U is {u:.4f}{'°' if turns else ' mm'}{times}."
        )
    if high - low < 2.0 * u and low > float("-inf"):
        return (
            f"U is {u:.4f}{'°' if turns else ' mm'}, but the tolerance is only "
            f"{high - low:.4f}{'°' if turns else ' mm'} wide: U would have to be below "
            f"{0.5 * (high - low):.4f}{'°' if turns else ' mm'}."
        )
    if abs(beyond) > u and result.note:
        # The number is clear of the limit: the reason is in the note.
        return f"Not because of U, which is {u:.4f}{'°' if turns else ' mm'}: {result.note}"
    edge = limit - u if above else limit + u
    if beyond > 0.0:
        return (
            f"{beyond:.4f}{'°' if turns else ' mm'} beyond the {word} limit "
            f"{limit:.4f}{'°' if turns else ' mm'}, less than U "
            f"({u:.4f}{'°' if turns else ' mm'}): neither conformance nor non-conformance is "
            "proven."
        )
    side = "above" if not above else "below"
    return (
        f"{-beyond:.4f}{'°' if turns else ' mm'} inside the {word} limit "
        f"{limit:.4f}{'°' if turns else ' mm'}, but U is {u:.4f}{'°' if turns else ' mm'}: U "
        f"would have to be below {-beyond:.4f}{'°' if turns else ' mm'}, or the value {side} "
        f"{edge:.4f}{'°' if turns else ' mm'}."
    )


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
