"""The plan that is written, and those before it: every change can be taken back."""

from __future__ import annotations

from ocmm_core.inspection.plan import Plan


class PlanHistory:
    """One plan with its past and what was undone.

    Parameters
    ----------
    plan
        To begin with.
    """

    def __init__(self, plan: Plan) -> None:
        self._plans = [plan]
        self._at = 0
        self._saved = plan

    @property
    def plan(self) -> Plan:
        """Return the plan as it is now."""
        return self._plans[self._at]

    @property
    def is_saved(self) -> bool:
        """Return whether the plan is the one that was opened or saved last."""
        return self.plan == self._saved

    def did(self, plan: Plan) -> bool:
        """Take a changed plan over and say whether it is another one."""
        if plan == self.plan:
            return False
        self._plans = [*self._plans[: self._at + 1], plan]
        self._at += 1
        return True

    def undo(self) -> bool:
        """Go back one change and say whether there was one."""
        if not self._at:
            return False
        self._at -= 1
        return True

    def redo(self) -> bool:
        """Do again what was undone and say whether there was something."""
        if self._at + 1 >= len(self._plans):
            return False
        self._at += 1
        return True

    def saved(self) -> None:
        """Remember that the plan is in its file."""
        self._saved = self.plan
