"""What is said about one characteristic."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

from ocmm_core.tolerances.zones import Seen

U_LABEL = "U (95 %)"
"""Heading of U wherever it stands; no factor, because few points widen U beyond 2 u."""

U_WORDS = "U (expanded uncertainty): in 95 of 100 cases the true value lies within U of the value"

LOW_TUR, LOWEST_TUR = 4.0, 1.0
"""Tolerance against twice U below which a result is warned of, and below which none conforms."""


class Verdict(Enum):
    """The decision, in the word that the inspector reads."""

    CONFORM = "CONFORM"
    NOT_CONFORM = "NOT CONFORM"
    NOT_PROVEN = "NOT PROVEN"
    NOT_MEASURED = "NOT MEASURED"
    PROVISIONAL = "PROVISIONAL"
    """Something that it rests on is still being probed; there may be a value to look at."""


@dataclass(frozen=True, slots=True)
class CharacteristicResult:
    """One characteristic with its value, uncertainty and verdict; in ``unit``."""

    name: str
    kind: str
    features: tuple[str, ...]
    """`name`, `kind`, `features`: As in the plan."""
    nominal: float
    lower: float
    upper: float
    """`nominal`, `lower`, `upper`: Nominal value and the limits of the deviation."""
    measured: float | None
    deviation: float | None
    """`measured`, `deviation`: None where there is no trustworthy value."""
    uncertainty: float | None
    """Expanded uncertainty U; None together with ``measured``. It is 2 u, and more where something
    is known from few points only, or the value cannot be negative, so that value ± U still holds
    the truth in 95 of 100 cases."""
    verdict: Verdict
    note: str = ""
    """Why there is no value, or what to know about it; may be empty."""
    rule: str = ""
    """Decision rule with its version, as `decision.rule_id` gives it; empty where nothing was
    decided."""
    tur: float | None = None
    """Tolerance divided by twice U; None without a value or a tolerance."""
    leaning: Literal["", "in", "out"] = ""
    """Which side of the limit the value of a result that is not proven lies on: ``"in"`` (a
    conditional pass in the words of ILAC-G8), ``"out"`` (a conditional fail), or empty."""
    interval: tuple[float, float] | None = None
    """95 % interval of the true value; None together with ``measured``."""
    association: str = ""
    """How the elements were associated with their points."""
    frame: str = ""
    """Name of the frame that the value is stated in; empty where it depends on none."""
    floor: float | None = None
    """The value that noise alone lets a perfect form show; None for what has none."""
    bonus: float = 0.0
    """What a modifier of material has added to the tolerance."""
    unit: Literal["mm", "deg"] = "mm"
    seen: Seen | None = field(default=None, compare=False, repr=False)
    """The deviations of the touched places that the value is made of, for pictures; None without a
    value, and for kinds that have none."""

    @property
    def stated(self) -> tuple[float, float, float] | None:
        """Return value, deviation and U as they may be reported.

        None where nothing was measured, and where the value is provisional: a screen may show that
        one as such, a report or a statistic may not.
        """
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
        """Return what to know of the uncertainty beside the tolerance; empty where it is small."""
        if self.tur is None or self.tur >= LOW_TUR:
            return ""
        return (
            f"The tolerance is only {self.tur:.1f} times twice the uncertainty; "
            f"{LOW_TUR:.0f} times is usual."
        )
