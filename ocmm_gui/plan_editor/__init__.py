"""A plan is written in the window: features, characteristics, alignment, pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.plan_editor._plan_sheet import PlanSheet
else:
    __getattr__ = door(
        __name__,
        _plan_sheet="PlanSheet",
    )

__all__ = [
    "PlanSheet",
]
