from __future__ import annotations

import re
from typing import Literal

from PySide6.QtWidgets import QVBoxLayout, QWidget

from ocmm_core.errors import OcmmError
from ocmm_core.inspection.plan import Plan, plan_findings, requirement_count, without_file
from ocmm_gui.kit import DEFAULT_THEME, THEMES, Theme, said, sentence_label, tr
from ocmm_gui.plan_editor._draft import PlanDraft
from ocmm_gui.plan_editor._plan_items import ALIGNMENT, HEAD, LISTS, ItemKey, place_of

Tone = Literal["good", "warn", "bad"]

_MOST_SHOWN = 3
"""Errors come first; the others follow once these are corrected."""

_FIELD = re.compile(r"field '(\w+)(?:\[(\d+)\])?\.?([^'\[]*)")
"""Part of the plan, index in its list, and field, in a sentence of the core."""


class PlanChecks(QWidget):
    """Valid, or the error and its remedy."""

    def __init__(self) -> None:
        super().__init__()
        self._theme = THEMES[DEFAULT_THEME]
        self._tone: Tone = "good"
        self._label = sentence_label(tr("Checks"), 15)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._label)

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
