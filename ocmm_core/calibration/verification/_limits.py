"""Permissible errors of a verification, for commands to show before loading it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from ocmm_core.calibration.records import Check

Rule = Literal["guarded", "simple"]
"""Whether the uncertainty of the artefact is taken off the limit, or only stated."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Permissible errors."""

    constant: float = 0.040
    per_length: float = 5e-5
    largest: float = 0.080
    """E(L) = min(`constant` + `per_length` L, `largest`), mm, for lengths."""
    diameter: float = 0.040
    """For the diameter of a sphere (P_Size), mm."""
    rule: Rule = "guarded"
    """How they are applied."""
    form: float = 0.080
    """For the form of a sphere, largest less smallest radius of 25 points (P_Form), mm. Twice the
    constant part of a length: one point may be so far outside as another one is inside. The noise
    of the points alone gives 3.7 of their standard deviations, 4.9 in one of twenty tests."""

    def of_length(self, length: float) -> float:
        """Return the permissible error of a length, mm."""
        return min(self.constant + self.per_length * length, self.largest)

    def passes(self, check: Check) -> bool:
        guard = check.expanded_mm if self.rule == "guarded" else 0.0
        return abs(check.error_mm) + guard <= check.limit_mm

    def failing(self, checks: Sequence[Check]) -> tuple[int, ...]:
        """Return the indices of the checks that do not pass."""
        return tuple(i for i, check in enumerate(checks) if not self.passes(check))

    def describe(self) -> str:
        """Return the rule in words, for records and reports."""
        guard = ", expanded uncertainty (k = 2) of the artefact taken off the limit"
        return (
            f"modelled on VDI/VDE 2634-1: |E| <= min({1e3 * self.constant:g} µm + "
            f"{1e6 * self.per_length:g} µm/m L, {1e3 * self.largest:g} µm) for lengths, "
            f"|E| <= {1e3 * self.diameter:g} µm for diameters, form <= {1e3 * self.form:g} µm"
            f"{guard if self.rule == 'guarded' else ', uncertainty stated'}"
        )
