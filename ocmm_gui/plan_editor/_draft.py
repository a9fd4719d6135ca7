"""The plan that is written: its file, its past and what was undone."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.inspection.plan import Plan, carry_model, carry_pictures, save_plan
from ocmm_gui.kit import tr


class PlanDraft:
    """One plan; every change can be taken back.

    Parameters
    ----------
    path
        Its file; None where it has none yet.
    """

    def __init__(self, plan: Plan, path: Path | None) -> None:
        self._plans = [plan]
        self._at = 0
        self._saved = plan
        self.path = path

    @property
    def plan(self) -> Plan:
        """Return the plan as it is now."""
        return self._plans[self._at]

    @property
    def is_saved(self) -> bool:
        """Return whether the plan is the one that was opened or saved last."""
        return self.plan == self._saved

    @property
    def folder(self) -> Path | None:
        """Return where the pictures of the plan are; None where it has no file."""
        return None if self.path is None else self.path.absolute().parent

    @property
    def words(self) -> str:
        """Return which plan it is and whether it is saved."""
        where = tr("no file yet") if self.path is None else self.path.name
        saved = tr("saved") if self.is_saved else tr("not saved yet")
        return f"{self.plan.name}, {where}, {saved}."

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

    def save(self, path: Path) -> Path:
        """Write the plan, read it back and compare; its pictures and its model go with it.

        Raises
        ------
        OcmmError
            As `save_plan`, `carry_pictures` and `carry_model`.
        """
        save_plan(self.plan, path)
        before, self.path = self.folder, path
        self._saved = self.plan
        if before is not None:
            carry_pictures(self.plan, before, path.absolute().parent)
            carry_model(self.plan, before, path.absolute().parent)
        return path
