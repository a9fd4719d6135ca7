"""Import of a model's tolerances as characteristics of a plan, with a complete account.

In: a plan with features of a STEP model, and the tolerances in the model. Out: the plan with
characteristics and an alignment, and for every item of the model its result, or why it has none.

Read `_account` (results), `_surfaces` (faces to features), `_context` (the growing plan and its
checks), then `_sizes` with their limits, `_frames`, `_zones`, `_general`, and `_plan_of_model`,
which joins them and stores the account in the plan. The package does not read files:
`inspection.step` does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_cad.drawing._account import GROUPS, NOT_IMPORTED, Account, AccountItem
    from ocmm_cad.drawing._general import CLASSES, general_of
    from ocmm_cad.drawing._plan_of_model import plan_with_tolerances, with_account
else:
    __getattr__ = door(
        __name__,
        _account="Account AccountItem GROUPS NOT_IMPORTED",
        _general="CLASSES general_of",
        _plan_of_model="plan_with_tolerances with_account",
    )

__all__ = [
    "CLASSES", "GROUPS", "NOT_IMPORTED", "Account", "AccountItem", "general_of",
    "plan_with_tolerances", "with_account",
]  # fmt: skip
