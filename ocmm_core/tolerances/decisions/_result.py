"""Result of one characteristic."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

from ocmm_core.tolerances.zones import Seen

U_LABEL = "U (95 %)"
"""Heading of U; no factor, because few points widen U beyond 2 u."""

U_WORDS = "U (expanded uncertainty): in 95 of 100 cases the true value lies within U of the value"

LOW_TUR, LOWEST_TUR = 4.0, 1.0
"""Tolerance over twice U below which a result has a warning, and below which none conforms."""


class Verdict(Enum):
    """Decision, in the inspector's words."""

    CONFORM = "CONFORM"
    NOT_CONFORM = "NOT CONFORM"
    NOT_PROVEN = "NOT PROVEN"
    NOT_MEASURED = "NOT MEASURED"
    PROVISIONAL = "PROVISIONAL"
    """A feature involved is still being probed; a value may be available."""


@dataclass(frozen=True, slots=True)
class CharacteristicResult:
    """One characteristic with its value, uncertainty and verdict; in ``unit``."""

    name: str
    kind: str
    features: tuple[str, ...]
    nominal: float
    lower: float
    upper: float
    """`nominal`, `lower`, `upper`: Nominal value and the limits of the deviation."""
    measured: float | None
    deviation: float | None
    """`measured`, `deviation`: None without a trustworthy value."""
    uncertainty: float | None
    """Expanded uncertainty U; None together with ``measured``. 2 u, or more for few points or
    nonnegative values, so that value ± U covers the true value in 95 of 100 cases.
    """
    verdict: Verdict
    note: str = ""
    """Reason for a missing value, or a note on it; may be empty."""
    rule: str = ""
    """Decision rule with its version, from `decision.rule_id`; empty without a decision."""
    tur: float | None = None
    """Tolerance divided by twice U; None without a value or a tolerance."""
    leaning: Literal["", "in", "out"] = ""
    """Side of the limit: ``"in"`` (ILAC-G8 conditional pass), ``"out"`` (fail) or ""."""
    interval: tuple[float, float] | None = None
    """95 % interval of the true value; None together with ``measured``."""
    association: str = ""
    frame: str = ""
    floor: float | None = None
    """Value of a perfect form due to noise alone; None if not applicable."""
    bonus: float = 0.0
    """Addition to the tolerance by a material modifier."""
    unit: Literal["mm", "deg"] = "mm"
    seen: Seen | None = field(default=None, compare=False, repr=False)
    """Deviations of the touched places that make up the value, for pictures, or None."""

    @property
    def stated(self) -> tuple[float, float, float] | None:
        """Return value, deviation, U for reports; None if not measured, or provisional."""
        if (
            self.verdict in (Verdict.NOT_MEASURED, Verdict.PROVISIONAL)
            or self.measured is None
            or self.deviation is None
            or self.uncertainty is None
        ):
            return None
        return self.measured, self.deviation, self.uncertainty

    @property
    def caution(self) -> str:
        """Return the warning on a large uncertainty relative to the tolerance, or empty text."""
        if self.tur is None or self.tur >= LOW_TUR:
            return ""
        return (
            f"The tolerance is only {self.tur:.1f} times twice the uncertainty; "
            f"{LOW_TUR:.0f} times is usual."
        )
