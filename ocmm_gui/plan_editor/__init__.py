"""A plan is written in the window: features, characteristics, alignment, pictures.

In: a plan, keys, tables, STEP files, a job to teach from. Out: a plan that is checked and saved.

Read `_plan_sheet` (the editor), `_draft` (the plan that is written, with its past), `_plan_items`
(the list); the form of one item is the room `form`.
`_plan_changes` and `_plan_parts` are what its keys do, and its parts.
`_from_models` is all that comes from a model or a table: `_importing` reads,
`_model_choice` chooses (a `_part_choice`), `_tolerance_account` is agreed to.
`_plan_checks`, `_proposals`, `_teaching` and `_drawn` do what their names say.
Rules of plans are in `inspection.plan`. It must not know the other sheets.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.plan_editor._plan_sheet import PlanSheet
else:
    __getattr__ = door(__name__, _plan_sheet="PlanSheet")

__all__ = ["PlanSheet"]
