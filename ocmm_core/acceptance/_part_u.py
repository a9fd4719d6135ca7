"""Uncertainty of a measuring task from a calibrated workpiece (after ISO 15530-3).

x_i are results of one characteristic, over clamping, operators, shifts and temperatures: b =
mean(x) - x_cal, u_p = s(x), u_cal = U_cal / 2, u_b = |T - 20| u_alpha L, and U = 2 sqrt(u_cal^2 +
u_p^2 + u_w^2 + u_b^2) of a result corrected by b. For uncorrected results |b| is added. U holds for
similar parts only: see `dissimilar`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from ocmm_core.acceptance._procedure import PartTest
from ocmm_core.errors import InputError

LEAST_CYCLES, LEAST_RESULTS = 10, 20
_USUAL = PartTest(
    cycles=LEAST_CYCLES, results=LEAST_RESULTS, large=250.0, large_share=0.10, small=25.0,
    angle_deg=5.0,
)  # fmt: skip


class PartTask(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The measuring task; a U of the study holds for similar tasks."""

    dimension: float
    """mm."""
    angle_deg: float = 0.0
    points: int
    strategy: str
    stylus: str
    material: str
    clamping: str
    """`strategy`, `stylus`, `material`, `clamping`: texts, compared exactly but without case."""


@dataclass(frozen=True, slots=True)
class PartUncertainty:
    """Result of a study of one characteristic; mm."""

    bias: float
    scatter: float
    """`bias`, `scatter`: mean minus certified value, and s of the results."""
    u_cal: float
    u_workpiece: float
    u_expansion: float
    """`u_cal`, `u_workpiece`, `u_expansion`: of certificate, workpieces and expansion."""
    expanded: float
    """U (k = 2) of a bias-corrected result."""
    expanded_uncorrected: float
    """U + |b|, of an uncorrected result."""
    normalized: float | None
    """E_n = |b| / sqrt(U_model^2 + U_cal^2); None without a U of the model."""
    results: int


def part_uncertainty(
    results: Sequence[float],
    certified: float,
    expanded_cal: float,
    *,
    u_workpiece: float = 0.0,
    temperature_c: float = 20.0,
    u_expansion: float = 0.0,
    expanded_model: float | None = None,
) -> PartUncertainty:
    """Return the uncertainty from repeated results of a calibrated part.

    Parameters
    ----------
    results
        mm.
    certified, expanded_cal
        Value and U (k = 2) of the certificate, mm.
    u_workpiece
        Standard uncertainty from the workpieces' form, roughness and spread of expansion, mm.
    temperature_c, u_expansion
        Temperature of use, degrees Celsius; standard uncertainty of the expansion, 1/K.
    expanded_model
        U stated by OCMM for the characteristic, mm.

    Raises
    ------
    InputError
        Fewer than two results, or a number that is not finite.
    """
    values = np.asarray(results, dtype=np.float64)
    if len(values) < 2 or not np.all(np.isfinite(values)):
        raise InputError(
            "acceptance.part_results",
            f"A study of a calibrated part has {len(values)} usable results.",
            f"Give {LEAST_RESULTS} results from {LEAST_CYCLES} cycles.",
        )
    bias = float(values.mean()) - certified
    scatter = float(values.std(ddof=1))
    u_cal = 0.5 * expanded_cal
    u_b = abs(temperature_c - 20.0) * u_expansion * abs(certified)
    expanded = 2.0 * math.sqrt(u_cal**2 + scatter**2 + u_workpiece**2 + u_b**2)
    normalized = None
    if expanded_model is not None:
        normalized = abs(bias) / math.hypot(expanded_model, expanded_cal)
    return PartUncertainty(
        bias, scatter, u_cal, u_workpiece, u_b, expanded, expanded + abs(bias), normalized,
        len(values),
    )  # fmt: skip


def dissimilar(studied: PartTask, wanted: PartTask, numbers: PartTest = _USUAL) -> str:
    """Return why the U of a study does not hold for another task; empty if it does."""
    large = studied.dimension > numbers.large
    allowed = numbers.large_share * studied.dimension if large else numbers.small
    off = abs(wanted.dimension - studied.dimension)
    if off > allowed:
        return (
            f"The dimension is {wanted.dimension:g} mm and the study's {studied.dimension:g} mm: "
            f"they may differ by {allowed:g} mm."
        )
    turned = abs(wanted.angle_deg - studied.angle_deg)
    if turned > numbers.angle_deg:
        return f"The angle differs by {turned:g}°, and {numbers.angle_deg:g}° are allowed."
    if wanted.points != studied.points:
        return f"{wanted.points} points are probed, and the study probed {studied.points}."
    for field in ("strategy", "stylus", "material", "clamping"):
        one, other = getattr(studied, field), getattr(wanted, field)
        if one.strip().casefold() != other.strip().casefold():
            return f"The {field} is '{other}', and the study's '{one}'."
    return ""
