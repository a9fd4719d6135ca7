"""The edited plan with undo, and its errors at their fields."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal

from PySide6.QtWidgets import QWidget

from ocmm_core.errors import OcmmError
from ocmm_core.inspection.plan import (
    Plan,
    carry_model,
    carry_pictures,
    plan_findings,
    requirement_count,
    save_plan,
    without_file,
)
from ocmm_gui.kit import Theme, Themed, said, sentence_label, tr, vbox
from ocmm_gui.plan_editor._plan_items import ALIGNMENT, HEAD, LISTS, ItemKey, place_of


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


Tone = Literal["good", "warn", "bad"]

_MOST_SHOWN = 3
"""Errors come first; the others follow once these are corrected."""

_FIELD = re.compile(r"field '(\w+)(?:\[(\d+)\])?\.?([^'\[]*)")
"""Part of the plan, index in its list, and field, in a sentence of the core."""


class PlanChecks(Themed, QWidget):
    """Valid, or the error and its remedy."""

    def __init__(self) -> None:
        super().__init__()
        self._tone: Tone = "good"
        self._label = sentence_label(tr("Checks"), 15)
        vbox(self._label, parent=self, margins=0)

    def text(self) -> str:
        return self._label.text()

    def show_fault(self, fault: OcmmError) -> None:
        """Show why something is not applied."""
        self._say(
            tr("✖  Not applied: {what} {remedy}").format(
                what=said(fault.what), remedy=said(fault.remedy)
            ),
            "bad",
        )

    def show_good(self, draft: PlanDraft) -> None:
        """Show the contradictions of the plan, or that it is valid; and missing pictures."""
        words = tr("✔  The plan is valid and can be measured.")
        tone: Tone = "good"
        found = plan_findings(draft.plan)
        shown = [f"{said(one.what)} {said(one.remedy)}" for one in found[:_MOST_SHOWN]]
        count = requirement_count(draft.plan)
        if count is not None and not count.is_whole:
            shown.insert(0, f"{said(count.words)}.")
        elif count is not None:
            words += f" {said(count.words)}."
        if found and found[0].is_error:
            tone = "bad"
            words = tr("✖  The plan is not valid: no job can be started by it. {errors}")
        elif shown:
            tone = "warn"
            words = tr("▲  The plan can be measured. {doubts}")
        listed = "\n".join(shown)
        words = words.format(doubts=listed, errors=listed)
        missing = without_file(draft.plan, draft.folder)
        if missing:
            drawn = tr(
                "Picture of {names} not found beside the plan: the feature is drawn instead."
            )
            words += f" {drawn.format(names=', '.join(missing))}"
        self._say(words, tone)

    def set_theme(self, theme: Theme) -> None:
        self._theme = theme
        self._say(self.text(), self._tone)

    def _say(self, words: str, tone: Tone) -> None:
        self._tone = tone
        colours: dict[Tone, str] = {
            "good": self._theme.good, "warn": self._theme.warn, "bad": self._theme.bad,
        }  # fmt: skip
        self._label.setText(words)
        self._label.setStyleSheet(f"color: {colours[tone]};")


def faulty_field(fault: OcmmError, plan: Plan, key: ItemKey) -> str:
    """Return the field of an item that a fault is about; empty if about another item."""
    if fault.code.startswith("plan.form."):
        return fault.code.removeprefix("plan.form.")
    found = _FIELD.search(fault.what)
    if found is None:
        return ""
    group, place, field = found.groups()
    if key == HEAD:
        return f"{group}.{field}" if field else str(group)
    if group != key.group:
        return ""
    there = key == ALIGNMENT or (key.group in LISTS and place == str(place_of(plan, key)))
    return str(field) if there else ""
