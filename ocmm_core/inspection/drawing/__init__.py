"""Tolerances of a model become characteristics of a plan, with an account of all of them.

In: a plan with features of a STEP model, and what the model says of tolerances. Out: the plan with
characteristics and an alignment, and for every item of the model what became of it, or why nothing.

Read `_account` (what comes out), `_surfaces` (faces to features), `_context` (the plan that grows,
and what each characteristic is checked against), then `_sizes` with their limits, `_frames`,
`_zones`, `_general`, and `_plan_of_model`, which joins them and stores the account in the
plan. The package is independent of files: `inspection.step` reads them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.inspection.drawing._account import GROUPS, NOT_IMPORTED, Account, AccountItem
    from ocmm_core.inspection.drawing._general import CLASSES, general_of
    from ocmm_core.inspection.drawing._plan_of_model import plan_with_tolerances, with_account
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
