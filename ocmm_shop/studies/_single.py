"""Studies of one reference: type 1 (Cg, Cgk), linearity, suitability (Q), and stated U.

Type 1: one calibrated part near the middle of the tolerance T, measured n times by one operator:
Cg = K T / (L s) with K = 0.2 and L = 6, Cgk = (K T / 2 - |b|) / (L s / 2). Suitability after
ISO 22514-7 / VDA 5: Q = 2 U / T.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float

LEAST_TYPE1, USUAL_TYPE1 = 25, 50
LEAST_CG = 1.33
_K, _L = 0.2, 6.0
Q_MS_PERCENT, Q_MP_PERCENT = 15.0, 30.0
LEAST_REFERENCES, LEAST_PER_REFERENCE = 5, 10


@dataclass(frozen=True, slots=True)
class Type1Study:
    """Repeated measurements of one calibrated part."""

    results: int
    mean: float
    bias: float
    scatter: float
    """`results`, `mean`, `bias`, `scatter`: N, mean, mean less reference, s."""
    cg: float
    cgk: float
    """`cg`, `cgk`: Capability of the gauge, and with its bias."""
    cg_low: float
    cg_high: float
    """`cg_low`, `cg_high`: 95 % interval of Cg, from that of s."""
    t: float
    p_value: float
    biased: bool
    """`t`, `p_value`, `biased`: Of the bias; whether it is significant at 5 %."""
    var_percent: float
    var_bias_percent: float
    """`var_percent`, `var_bias_percent`: 100 K / Cg and Cgk, K = 0.2; infinite if Cgk <= 0."""
    least_tolerance: float
    """Smallest tolerance that meets both, without a bias."""
    capable: bool
    """Both are at least 1.33."""


def type1_study(results: Sequence[float] | Float, reference: float, tolerance: float) -> Type1Study:
    """Return the type-1 study of results.

    `reference`, `tolerance`: certified value and the whole width T.
    InputError: there are fewer than 25 results, they do not scatter, or T is not above zero.
    """
    x = np.asarray(results, dtype=np.float64)
    if len(x) < LEAST_TYPE1 or not np.all(np.isfinite(x)):
        raise InputError(
            "msa.type1_count",
            f"A type-1 study has {len(x)} results; {LEAST_TYPE1} are the least.",
            f"Take the part away and set it back {USUAL_TYPE1} times.",
        )
    s, n = float(x.std(ddof=1)), len(x)
    if not tolerance > 0.0 or not s > 0.0:
        raise InputError(
            "msa.type1_width",
            f"The tolerance is {tolerance:g} and the scatter {s:g}: both must be above zero.",
            "Give the tolerance; results that do not scatter come from a readout too coarse.",
        )
    bias = float(x.mean()) - reference
    cg = _K * tolerance / (_L * s)
    cgk = (0.5 * _K * tolerance - abs(bias)) / (0.5 * _L * s)
    t = abs(bias) * math.sqrt(n) / s
    p = 2.0 * float(stats.t.sf(t, n - 1))
    low, high = (math.sqrt(float(stats.chi2.ppf(q, n - 1)) / (n - 1)) for q in (0.025, 0.975))
    return Type1Study(
        results=n, mean=float(x.mean()), bias=bias, scatter=s, cg=cg, cgk=cgk, cg_low=cg * low,
        cg_high=cg * high, t=t, p_value=p, biased=p < 0.05, var_percent=100.0 * _K / cg,
        var_bias_percent=100.0 * _K / cgk if cgk > 0.0 else math.inf,
        least_tolerance=LEAST_CG * _L * s / _K,
        capable=cg >= LEAST_CG and cgk >= LEAST_CG,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class LinearityStudy:
    """Bias over the range: bias = intercept + slope x."""

    intercept: float
    slope: float
    sigma: float
    """`intercept`, `slope`, `sigma`: Of the line, and the standard deviation of the residuals."""
    references: Float
    biases: Float
    """`references`, `biases`: Mean bias of each reference."""
    p_intercept: float
    p_slope: float
    """`p_intercept`, `p_slope`: p-values of zero."""
    bands: Float
    """Half width of the 95 % band of the line at the references."""
    linear: bool
    """The zero line is inside the band everywhere between them."""


def linearity_study(
    references: Sequence[float], results: Sequence[Sequence[float] | Float]
) -> LinearityStudy:
    """Return the bias over the range; InputError below 5 references, or 10 results of each."""
    least = min((len(one) for one in results), default=0)
    if (
        len(references) != len(results)
        or len(set(references)) < LEAST_REFERENCES
        or least < LEAST_PER_REFERENCE
    ):
        raise InputError(
            "msa.linearity",
            f"A linearity study has {len(set(references))} references with at least {least} "
            f"results; {LEAST_REFERENCES} with {LEAST_PER_REFERENCE} are the least.",
            "Measure more parts over the range.",
        )
    x = np.concatenate([np.full(len(r), ref) for ref, r in zip(references, results, strict=True)])
    y = np.concatenate([np.asarray(r, dtype=np.float64) for r in results]) - x
    n, centre = len(x), float(x.mean())
    sxx = float(np.sum((x - centre) ** 2))
    slope = float(np.sum((x - centre) * y)) / sxx
    intercept = float(y.mean()) - slope * centre
    sigma = math.sqrt(float(np.sum((y - intercept - slope * x) ** 2)) / (n - 2))
    t = float(stats.t.ppf(0.975, n - 2))

    def band(at: Float) -> Float:
        width: Float = t * sigma * np.sqrt(1.0 / n + (at - centre) ** 2 / sxx)
        return width

    at = np.linspace(x.min(), x.max(), 201)
    refs = np.asarray(references, dtype=np.float64)
    s_slope, s_cut = sigma / math.sqrt(sxx), sigma * math.sqrt(1.0 / n + centre**2 / sxx)
    return LinearityStudy(
        intercept, slope, sigma, refs, np.array([y[x == ref].mean() for ref in refs]),
        _p_value(intercept, s_cut, n - 2), _p_value(slope, s_slope, n - 2), band(refs),
        bool(np.all(np.abs(intercept + slope * at) <= band(at))),
    )  # fmt: skip


def _p_value(value: float, sigma: float, df: int) -> float:
    if sigma == 0.0:
        return 1.0 if value == 0.0 else 0.0
    return 2.0 * float(stats.t.sf(abs(value) / sigma, df))


@dataclass(frozen=True, slots=True)
class Suitability:
    """Q of the measuring system and of the process (ISO 22514-7, VDA 5)."""

    u_ms: float
    u_mp: float
    """`u_ms`, `u_mp`: Standard uncertainties."""
    q_ms: float
    q_mp: float
    """`q_ms`, `q_mp`: 100 x 2 U / T, per cent."""
    suitable: bool
    """At most 15 % and 30 %."""
    least_tolerance: float
    """Smallest tolerance that meets both."""


def suitability(u_ms: float, u_mp: float, tolerance: float) -> Suitability:
    """Return Q of standard uncertainties, U = 2 u, for the whole width of a tolerance."""
    if not tolerance > 0.0:
        raise InputError("msa.tolerance", "The tolerance is not above zero.", "Give its width.")
    q_ms, q_mp = 400.0 * u_ms / tolerance, 400.0 * u_mp / tolerance
    return Suitability(
        u_ms, u_mp, q_ms, q_mp, q_ms <= Q_MS_PERCENT and q_mp <= Q_MP_PERCENT,
        max(400.0 * u_ms / Q_MS_PERCENT, 400.0 * u_mp / Q_MP_PERCENT),
    )  # fmt: skip


def process_uncertainty(
    u_ms: float, reproducibility: float, interaction: float, u_part: float, u_temperature: float
) -> float:
    """Return u_MP: the system, operators, their interaction, the part and the temperature."""
    return math.sqrt(u_ms**2 + reproducibility**2 + interaction**2 + u_part**2 + u_temperature**2)


@dataclass(frozen=True, slots=True)
class StatedScatter:
    """Stated uncertainty of repeats compared with their observed scatter."""

    ratios: Float
    """s / u of every cell."""
    low: float
    high: float
    """`low`, `high`: Band that contains all ratios with a joint probability of 99 %."""
    outside: tuple[int, ...]
    """Indices of cells beyond the band."""
    pooled: float
    """sqrt(mean s^2 / mean u^2) of all cells."""
    pooled_low: float
    pooled_high: float
    """`pooled_low`, `pooled_high`: Its band, 99 %."""
    message: str
    """A sentence; empty if they agree."""


_JOINT = 0.99


def compare_stated(values: Float, stated: Float) -> StatedScatter:
    """Return whether repeats scatter as stated by their standard uncertainty.

    `values`: (cells, r): repeats. `stated`: (cells,): standard uncertainty of one result, without
    contributions common to all repeats. InputError: no repeat, or no positive uncertainty.
    """
    x, u = np.asarray(values, dtype=np.float64), np.asarray(stated, dtype=np.float64)
    if x.ndim != 2 or x.shape[1] < 2 or not np.all(u > 0.0):
        raise InputError(
            "msa.stated", "Repeats and their stated uncertainty are needed.", "Measure them."
        )
    cells, df = x.shape[0], x.shape[1] - 1
    ratios = x.std(axis=1, ddof=1) / u
    half = 0.5 * (1.0 - _JOINT)
    low, high = _band(half / cells, df)
    pooled = float(np.sqrt(np.mean(ratios**2)))
    pooled_low, pooled_high = _band(half, cells * df)
    outside = tuple(int(i) for i in np.nonzero((ratios < low) | (ratios > high))[0])
    message = ""
    if pooled > pooled_high or any(ratios[i] > high for i in outside):
        message = (
            f"The results scatter {max(pooled, ratios.max() if outside else 0.0):.1f} times as "
            "much as the stated uncertainty says: the stated U is too small. Find what the budget "
            "lacks before U is used."
        )
    elif pooled < pooled_low or outside:
        message = (
            f"The results scatter {pooled:.2f} times as much as the stated uncertainty says: the "
            "stated U is larger than needed, or holds what all repeats share."
        )
    return StatedScatter(ratios, low, high, outside, pooled, pooled_low, pooled_high, message)


def _band(tail: float, df: int) -> tuple[float, float]:
    low, high = (math.sqrt(float(stats.chi2.ppf(q, df)) / df) for q in (tail, 1.0 - tail))
    return low, high
