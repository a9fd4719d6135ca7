"""Gauge repeatability and reproducibility by analysis of variance (after AIAG MSA, 4th edition).

p parts x o operators x r trials, crossed and balanced, random effects:

    SS_P = o r sum(m_i.. - m)^2,  SS_O = p r sum(m_.j. - m)^2,
    SS_PO = r sum(m_ij. - m)^2 - SS_P - SS_O,  SS_E = the rest,

with p-1, o-1, (p-1)(o-1) and p o (r-1) degrees of freedom. An interaction that is not significant
(p-value of F = MS_PO / MS_E above a level) is pooled into the error. Components follow from the
expected mean squares; negative ones are set to zero. The interval of the gauge's variance is
modified large-sample (Graybill and Wang 1980; Burdick, Borror and Montgomery 2003): the variance is
sum c_q MS_q with positive c_q, and

    lower = v - sqrt(sum (G_q c_q MS_q)^2),  G_q = 1 - n_q / chi2(1 - a/2; n_q),
    upper = v + sqrt(sum (H_q c_q MS_q)^2),  H_q = n_q / chi2(a/2; n_q) - 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float

AIAG_LEVEL = 0.25
"""p-value of the interaction above which it is pooled. Minitab's default is 0.05."""

LEAST_PARTS, LEAST_OPERATORS, LEAST_TRIALS = 5, 2, 2
GOOD_PERCENT, BAD_PERCENT, LEAST_NDC = 10.0, 30.0, 5
_NDC = 1.41
"""sqrt(2), as rounded in the manual."""


@dataclass(frozen=True, slots=True)
class SourceRow:
    """One line of the table: a source of variation."""

    name: str
    df: int
    ss: float
    ms: float
    """`name`, `df`, `ss`, `ms`: Degrees of freedom, sum of squares and mean square."""
    f: float | None = None
    p_value: float | None = None
    """`f`, `p_value`: None for the error and the total."""


@dataclass(frozen=True, slots=True)
class GaugeStudy:
    """Study of one characteristic; standard deviations in its unit."""

    parts: int
    operators: int
    trials: int
    """`parts`, `operators`, `trials`: p, o, r."""
    table: tuple[SourceRow, ...]
    """Table of variance as judged; with the interaction unless pooled."""
    interaction_f: float
    interaction_p: float
    """`interaction_f`, `interaction_p`: Before pooling."""
    pooled: bool
    level: float
    """`pooled`, `level`: Whether the interaction was pooled, and the deciding level."""
    var_repeat: float
    var_operator: float
    var_interaction: float
    var_part: float
    """`var_repeat`, `var_operator`, `var_interaction`, `var_part`: Components, not negative."""
    ev: float
    av: float
    grr: float
    pv: float
    tv: float
    """`ev`, `av`, `grr`, `pv`, `tv`: Equipment, appraiser, both, parts, and total variation."""
    grr_low: float
    grr_high: float
    confidence: float
    """`grr_low`, `grr_high`, `confidence`: Interval of ``grr``."""
    study_percent: float
    contribution_percent: float
    """`study_percent`, `contribution_percent`: 100 GRR / TV, and 100 GRR^2 / TV^2."""
    tolerance_percent: float | None
    """600 GRR / T, or the one-sided equivalent; None without a tolerance."""
    ndc: int
    """Number of distinct categories."""

    @property
    def word(self) -> str:
        """Return good, conditional or not acceptable, by the worse percentage and ndc."""
        worst = max(self.study_percent, self.tolerance_percent or 0.0)
        if worst > BAD_PERCENT:
            return "not acceptable"
        return "good" if worst <= GOOD_PERCENT and self.ndc >= LEAST_NDC else "conditional"


_CONFIDENCE = 0.90


def gauge_study(
    values: Float,
    *,
    tolerance: float | None = None,
    one_sided: float | None = None,
    level: float = AIAG_LEVEL,
) -> GaugeStudy:
    """Return the study of values (parts, operators, trials).

    `one_sided`: the limit of a one-sided tolerance; its distance from the mean counts. `level`:
    above this p-value the interaction is pooled. InputError: too small a study, or not finite.
    """
    x = np.asarray(values, dtype=np.float64)
    _require(x)
    p, o, r = x.shape
    mean = float(x.mean())
    cells = x.mean(axis=2)
    ss_p = o * r * float(np.sum((x.mean(axis=(1, 2)) - mean) ** 2))
    ss_o = p * r * float(np.sum((x.mean(axis=(0, 2)) - mean) ** 2))
    # From effects, not by subtraction: a difference of large sums loses digits.
    effect = cells - x.mean(axis=(1, 2))[:, None] - x.mean(axis=(0, 2))[None] + mean
    ss_po = r * float(np.sum(effect**2))
    ss_e = float(np.sum((x - cells[:, :, None]) ** 2))
    df_p, df_o, df_po, df_e = p - 1, o - 1, (p - 1) * (o - 1), p * o * (r - 1)
    ms_po, ms_e = ss_po / df_po, ss_e / df_e
    f_po = ms_po / ms_e if ms_e > 0.0 else math.inf if ms_po > 0.0 else 0.0
    p_po = float(stats.f.sf(f_po, df_po, df_e))
    pooled = p_po > level
    if pooled:
        df_e, ss_e = df_e + df_po, ss_e + ss_po
        ms_e = ss_e / df_e
        below, df_below = ms_e, df_e
        v_po = 0.0
    else:
        below, df_below = ms_po, df_po
        v_po = max((ms_po - ms_e) / r, 0.0)
    ms_p, ms_o = ss_p / df_p, ss_o / df_o
    v_o = max((ms_o - below) / (p * r), 0.0)
    v_p = max((ms_p - below) / (o * r), 0.0)
    grr2 = ms_e + v_o + v_po
    low, high = _interval(
        [(1.0 / (p * r), ms_o, df_o), (1.0 - 1.0 / (p * r), ms_e, df_e)]
        if pooled
        else [
            (1.0 / (p * r), ms_o, df_o),
            ((p - 1) / (p * r), ms_po, df_po),
            ((r - 1) / r, ms_e, df_e),
        ],
        _CONFIDENCE,
    )
    grr, pv = math.sqrt(grr2), math.sqrt(v_p)
    tv = math.hypot(grr, pv)
    rows = [
        _row("Parts", df_p, ss_p, below, df_below),
        _row("Operators", df_o, ss_o, below, df_below),
    ]
    if not pooled:
        rows.append(SourceRow("Parts x operators", df_po, ss_po, ms_po, f_po, p_po))
    rows.append(SourceRow("Repeatability", df_e, ss_e, ms_e))
    total = float(np.sum((x - mean) ** 2))
    rows.append(SourceRow("Total", x.size - 1, total, total / (x.size - 1)))
    return GaugeStudy(
        parts=p, operators=o, trials=r, table=tuple(rows), interaction_f=f_po,
        interaction_p=p_po, pooled=pooled, level=level, var_repeat=ms_e, var_operator=v_o,
        var_interaction=v_po, var_part=v_p, ev=math.sqrt(ms_e), av=math.sqrt(v_o + v_po),
        grr=grr, pv=pv, tv=tv, grr_low=low, grr_high=high, confidence=_CONFIDENCE,
        study_percent=100.0 * grr / tv if tv > 0.0 else 0.0,
        contribution_percent=100.0 * grr2 / tv**2 if tv > 0.0 else 0.0,
        tolerance_percent=_of_tolerance(grr, mean, tolerance, one_sided),
        ndc=math.floor(_NDC * pv / grr) if grr > 0.0 else 0,
    )  # fmt: skip


def _row(name: str, df: int, ss: float, below: float, df_below: int) -> SourceRow:
    ms = ss / df
    f = ms / below if below > 0.0 else math.inf if ms > 0.0 else 0.0
    return SourceRow(name, df, ss, ms, f, float(stats.f.sf(f, df, df_below)))


def _interval(terms: list[tuple[float, float, int]], confidence: float) -> tuple[float, float]:
    """Return the modified large-sample interval of a standard deviation."""
    half = 0.5 * (1.0 - confidence)
    value = sum(c * ms for c, ms, _ in terms)
    down = up = 0.0
    for c, ms, df in terms:
        g = 1.0 - df / float(stats.chi2.ppf(1.0 - half, df))
        h = df / float(stats.chi2.ppf(half, df)) - 1.0
        down += (g * c * ms) ** 2
        up += (h * c * ms) ** 2
    return math.sqrt(max(value - math.sqrt(down), 0.0)), math.sqrt(value + math.sqrt(up))


def _of_tolerance(
    grr: float, mean: float, tolerance: float | None, one_sided: float | None
) -> float | None:
    if tolerance is not None and tolerance > 0.0:
        return 600.0 * grr / tolerance
    if one_sided is not None and one_sided != mean:
        return 300.0 * grr / abs(one_sided - mean)
    return None


def _require(x: Float) -> None:
    if x.ndim != 3 or not np.all(np.isfinite(x)):
        raise InputError(
            "msa.values",
            "A gauge study needs one finite value for every part, operator and trial.",
            "Measure what is missing.",
        )
    p, o, r = x.shape
    if p < LEAST_PARTS or o < LEAST_OPERATORS or r < LEAST_TRIALS:
        raise InputError(
            "msa.too_small",
            f"The study has {p} parts, {o} operators and {r} trials; {LEAST_PARTS}, "
            f"{LEAST_OPERATORS} and {LEAST_TRIALS} are the least.",
            "Plan a larger study: 10 parts, 3 operators, 3 trials are usual.",
        )
