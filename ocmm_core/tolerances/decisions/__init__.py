"""Verdicts from values and their uncertainties, and their combination.

In: evaluated characteristics with their spread, limits, a decision rule.
Out: results with U and verdict, the verdict of a feature and of the part, capability.

Read `_decision` (one value, its U, a verdict), `_results` (all of a plan, with their U), `_verdict`
(result of one characteristic, verdict of a feature and of the part), `_deviations` (picture of
touched places), `_capability` (several parts: control chart, Cp, Cpk). All screens and reports show
this verdict. The package is independent of `monte_carlo`.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.tolerances.decisions._capability import (
        ControlChart, ProcessCapability, Signal, capability, control_chart,
    )  # fmt: skip
    from ocmm_core.tolerances.decisions._decision import (
        RULES, Rule, decide, make_result, not_measured, not_proven, provisional, rule_id,
        rule_words,
    )  # fmt: skip
    from ocmm_core.tolerances.decisions._deviations import (
        NO_DEVIATIONS, DeviationClass, DeviationPicture, Whisker, deviation_picture,
    )  # fmt: skip
    from ocmm_core.tolerances.decisions._results import FeatureLookup, evaluate_all, evaluate_one
    from ocmm_core.tolerances.decisions._verdict import (
        LOWEST_TUR, NO_VERDICT, U_LABEL, U_WORDS, WORST_FIRST, CharacteristicResult, PartVerdict,
        PartWord, RequirementCount, Verdict, VerdictSummary, judge_part, summarise,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "LOWEST_TUR", "NO_DEVIATIONS", "NO_VERDICT", "RULES", "U_LABEL", "U_WORDS", "WORST_FIRST",
    "CharacteristicResult", "ControlChart", "DeviationClass", "DeviationPicture", "FeatureLookup",
    "PartVerdict", "PartWord", "ProcessCapability", "RequirementCount", "Rule", "Signal", "Verdict",
    "VerdictSummary", "Whisker", "capability", "control_chart", "decide", "deviation_picture",
    "evaluate_all", "evaluate_one", "judge_part", "make_result", "not_measured", "not_proven",
    "provisional", "rule_id", "rule_words", "summarise",
]  # fmt: skip
