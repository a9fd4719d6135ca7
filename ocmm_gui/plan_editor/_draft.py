from __future__ import annotations

from pathlib import Path

from ocmm_core.inspection.plan import Plan, carry_model, carry_pictures, save_plan
from ocmm_gui.kit import tr


class PlanDraft:
    """One plan with undo. `path`: None if it has no file yet."""

    def __init__(self, plan: Plan, path: Path | None) -> None:
        self._plans = [plan]
        self._at = 0
        self._saved = plan
        self.path = path

    @property
    def plan(self) -> Plan:
        return self._plans[self._at]

    @property
    def is_saved(self) -> bool:
        return self.plan == self._saved

    @property
    def folder(self) -> Path | None:
        """Return the folder of the plan's pictures; None without a file."""
        return None if self.path is None else self.path.absolute().parent

    @property
    def words(self) -> str:
        """Return name, file and saved state in words."""
        where = tr("no file yet") if self.path is None else self.path.name
        saved = tr("saved") if self.is_saved else tr("not saved yet")
        return f"{self.plan.name}, {where}, {saved}."

    def did(self, plan: Plan) -> bool:
        """Accept a changed plan; return whether it differs."""
        if plan == self.plan:
            return False
        self._plans = [*self._plans[: self._at + 1], plan]
        self._at += 1
        return True

    def undo(self) -> bool:
        """Undo one change; return whether there was one."""
        if not self._at:
            return False
        self._at -= 1
        return True

    def redo(self) -> bool:
        """Redo one change; return whether there was one."""
        if self._at + 1 >= len(self._plans):
            return False
        self._at += 1
        return True

    def save(self, path: Path) -> Path:
        """Write the plan with its pictures and model, read it back and compare.

        Raises OcmmError as `save_plan`, `carry_pictures` and `carry_model`.
        """
        save_plan(self.plan, path)
        before, self.path = self.folder, path
        self._saved = self.plan
        if before is not None:
            carry_pictures(self.plan, before, path.absolute().parent)
            carry_model(self.plan, before, path.absolute().parent)
        return path
