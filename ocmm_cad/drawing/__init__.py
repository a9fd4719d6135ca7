"""Import of a model's tolerances as characteristics of a plan, with a complete account.

In: a plan with features of a STEP model, and the tolerances in the model.
Out: the plan with characteristics and an alignment, and for every item of the model its result, or
why it has none.

Read `_context` (results, faces to features, the growing plan and its checks), then `_sizes` with
their limits and general tolerances, `_frames`, `_zones`, and `_plan_of_model`, which joins them and
stores the account in the plan. The package does not read files: `inspection.step` does.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cad.drawing._context import GROUPS, NOT_IMPORTED, Account, AccountItem
    from ocmm_cad.drawing._plan_of_model import plan_with_tolerances, with_account
    from ocmm_cad.drawing._sizes import CLASSES, general_of
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CLASSES", "GROUPS", "NOT_IMPORTED", "Account", "AccountItem", "general_of",
    "plan_with_tolerances", "with_account",
]  # fmt: skip
