"""Distribution of a value about the true one: noise, few points, form, budget.

In: the gradient of a value and the joint covariance of the points.
Out: U and its contributions.

Read `_spread` (from an evaluation to its distribution, noise floor), `_first_order` (validity of
linearity, and correction), `_sampling` (form between few points), `_interval` (form and lengths,
which are not normal), `_fit_uncertainty` (a fit from points alone), `_budget` (the table). The
package is independent of kinds of characteristics and verdicts.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.tolerances.uncertainty._budget import Budget, BudgetRow, budget_of
    from ocmm_core.tolerances.uncertainty._first_order import NOT_DETERMINED, WHAT_TO_DO
    from ocmm_core.tolerances.uncertainty._fit_uncertainty import (
        FitUncertainty, Stated, fit_uncertainty,
    )  # fmt: skip
    from ocmm_core.tolerances.uncertainty._interval import (
        ONE_SIDED, TWO_SIDED, Normal, Spread, expanded,
    )  # fmt: skip
    from ocmm_core.tolerances.uncertainty._sampling import (
        FormSample, form_samples, sample_of, widened,
    )  # fmt: skip
    from ocmm_core.tolerances.uncertainty._spread import (
        Spreads, gradients_of, noise_floor, of_own_form, spreads_of,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "NOT_DETERMINED", "ONE_SIDED", "TWO_SIDED", "WHAT_TO_DO", "Budget", "BudgetRow",
    "FitUncertainty", "FormSample", "Normal", "Spread", "Spreads", "Stated", "budget_of",
    "expanded", "fit_uncertainty", "form_samples", "gradients_of", "noise_floor", "of_own_form",
    "sample_of", "spreads_of", "widened",
]  # fmt: skip
