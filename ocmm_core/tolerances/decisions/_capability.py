"""Control chart and capability of one characteristic over several parts.

Individuals and moving ranges, as parts come one at a time. Sources: W. Shewhart's chart in the form
of ISO 7870-2 for individuals (limits at 2.66 mean moving ranges), the four run rules of the Western
Electric Statistical Quality Control Handbook (1956), the trend of L. Nelson, Journal of Quality
Technology 16 (1984), the indices of ISO 22514-2, and the confidence interval of Cpk of A. Bissell,
Applied Statistics 39 (1990), with the degrees of freedom of moving ranges. The scatter of the
values includes that of the measurement, so a capability is never overestimated. The share of the
measurement is reported with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float

MEAN_RANGE_OF_TWO = 1.128379167
"""Expected range of two standard normal variables, 2 / sqrt(pi)."""

FEWEST_VALUES = 5
"""Below it a scatter is uncertain by more than a factor of two: no index, no limits."""

CUSTOMARY_VALUES = 25
"""Number of values from which control limits usually count as settled."""

RUN = 8
"""Values in a row on one side of the centre line, improbable by chance."""

EFFICIENCY_OF_RANGES = 0.605
"""Degrees of freedom of a standard deviation from moving ranges, relative to the usual one."""

NORMAL_975 = 1.959964
"""97.5 % point of the normal distribution."""


TREND = 6
"""Monotonic values in a row: five steps (Nelson's third rule)."""


class Signal(Enum):
    """Why a value of a control chart needs attention, with the name of the rule."""

    BEYOND = "beyond a control limit"
    TWO_OF_THREE = "the second of three beyond two sigma on one side"
    FOUR_OF_FIVE = "the fourth of five beyond one sigma on one side"
    RUN = "eight in a row on one side"
    TREND = "six in a row rising or falling"

    @property
    def rule(self) -> str:
        """Return the source of the rule."""
        return {
            Signal.BEYOND: "Western Electric 1",
            Signal.TWO_OF_THREE: "Western Electric 2",
            Signal.FOUR_OF_FIVE: "Western Electric 3",
            Signal.RUN: "Western Electric 4",
            Signal.TREND: "Nelson 3",
        }[self]


@dataclass(frozen=True, slots=True)
class ControlChart:
    """Control chart for individual values, in order."""

    values: Float
    """(n,)."""
    centre: float
    low: float
    high: float
    """`centre`, `low`, `high`: Centre line and control limits, from the values themselves."""
    signals: tuple[tuple[int, Signal], ...]
    """(index, reason) of every value that needs attention."""
    settled: bool
    """Enough values for settled limits."""


@dataclass(frozen=True, slots=True)
class ProcessCapability:
    """Capability of a process for one characteristic."""

    count: int
    mean: float
    sigma_within: float
    sigma_overall: float
    """`mean`, `sigma_within`, `sigma_overall`: mean; s from moving ranges; s over all values."""
    cp: float | None
    cpk: float
    """`cp`, `cpk`: From ``sigma_within``; ``cp`` is None for one-sided limits."""
    pp: float | None
    ppk: float
    """`pp`, `ppk`: The same from ``sigma_overall``."""
    cpk_low: float
    cpk_high: float
    """`cpk_low`, `cpk_high`: 95 % confidence interval of ``cpk``."""
    measurement_share: float
    """Part of the overall variance explained by the stated uncertainty, at most one."""

    @property
    def summary(self) -> str:
        """Return the indices with their count in a sentence."""
        both = f"Cp {self.cp:.2f}, " if self.cp is not None else ""
        text = (
            f"{both}Cpk {self.cpk:.2f} (95 %: {self.cpk_low:.2f} to {self.cpk_high:.2f}) "
            f"from {self.count} parts."
        )
        if self.count < CUSTOMARY_VALUES:
            text += f" Fewer than {CUSTOMARY_VALUES}: indicative only."
        if self.measurement_share > 0.1:
            text += f" Measurement: {100.0 * self.measurement_share:.0f} % of the variance."
        return text


def control_chart(values: Float) -> ControlChart:
    """Return the chart of ``values`` (n,) in order; InputError if too few or not finite."""
    values = _checked(values)
    centre = float(values.mean())
    half = 3.0 * _sigma_within(values)
    low, high = centre - half, centre + half
    signals = [
        (index, Signal.BEYOND) for index, value in enumerate(values) if not low <= value <= high
    ]
    signals += _run_signals(values - centre, half / 3.0)
    return ControlChart(
        values,
        centre,
        low,
        high,
        tuple(sorted(signals, key=lambda item: item[0])),
        len(values) >= CUSTOMARY_VALUES,
    )


def _run_signals(off: Float, sigma: float) -> list[tuple[int, Signal]]:
    """Return the signals of runs of ``off`` (n,) from the centre line, ``sigma`` of the limits."""
    found = []
    for side in (1.0, -1.0):
        for signal, needed, among, beyond in (
            (Signal.TWO_OF_THREE, 2, 3, 2.0 * sigma),
            (Signal.FOUR_OF_FIVE, 4, 5, sigma),
            (Signal.RUN, RUN, RUN, 0.0),
        ):
            out = side * off > beyond
            found += [
                (end - 1, signal)
                for end in range(needed, len(off) + 1)
                # The value itself must be out: otherwise one run would be reported repeatedly.
                if out[end - 1] and int(out[max(0, end - among) : end].sum()) >= needed
            ]
        rising = side * np.diff(off) > 0.0
        found += [
            (end, Signal.TREND)
            for end in range(TREND - 1, len(off))
            if bool(rising[end - TREND + 1 : end].all())
        ]
    return found


def capability(
    values: Float, low: float, high: float, standard_uncertainty: float
) -> ProcessCapability:
    """Return the capability of a process from the values of its parts.

    Parameters
    ----------
    values
        (n,), in order of production.
    low, high
        Limits of the value; infinite for none.
    standard_uncertainty
        u of a typical value.

    Raises
    ------
    InputError
        Too few values, a non-finite one, no limit, or all values equal.
    """
    values = _checked(values)
    if not (math.isfinite(low) or math.isfinite(high)):
        raise InputError(
            "capability.no_limits",
            "Capability needs at least one limit.",
            "Add limits to the characteristic.",
        )
    mean = float(values.mean())
    within, overall = _sigma_within(values), float(values.std(ddof=1))
    if within <= 0.0 or overall <= 0.0:
        raise InputError(
            "capability.no_scatter",
            f"All {len(values)} values are identical, which no real process gives.",
            "Check that every job is a different part.",
        )
    cp, cpk = _indices(mean, within, low, high)
    pp, ppk = _indices(mean, overall, low, high)
    count = len(values)
    freedom = EFFICIENCY_OF_RANGES * (count - 1)
    half = NORMAL_975 * math.sqrt(1.0 / (9.0 * count) + cpk * cpk / (2.0 * freedom))
    share = min(1.0, (standard_uncertainty / overall) ** 2)
    return ProcessCapability(
        count, mean, within, overall, cp, cpk, pp, ppk, cpk - half, cpk + half, share
    )


def _indices(mean: float, sigma: float, low: float, high: float) -> tuple[float | None, float]:
    both = math.isfinite(low) and math.isfinite(high)
    return (
        (high - low) / (6.0 * sigma) if both else None,
        min(high - mean, mean - low) / (3.0 * sigma),
    )


def _sigma_within(values: Float) -> float:
    return float(np.abs(np.diff(values)).mean()) / MEAN_RANGE_OF_TWO


def _checked(values: Float) -> Float:
    values = np.asarray(values, dtype=np.float64)
    if len(values) < FEWEST_VALUES:
        raise InputError(
            "capability.too_few",
            f"{len(values)} values; a scatter needs at least {FEWEST_VALUES}.",
            f"Measure {FEWEST_VALUES - len(values)} more parts.",
        )
    if not np.isfinite(values).all():
        raise InputError(
            "capability.not_finite",
            "One of the values is not a finite number.",
            "Leave out the part without a value.",
        )
    return values
