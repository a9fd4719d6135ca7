"""The edited plan: its changes by the editor's keys, undo, and errors at their fields.

A change names the item that is selected afterwards.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
from PySide6.QtWidgets import QWidget

from ocmm_core.errors import InputError, OcmmError
from ocmm_core.features.measured import Construction, PartOf
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection import plan as plans
from ocmm_core.tolerances.zones import Characteristic
from ocmm_gui.kit import Themed, said, sentence_label, tr, vbox
from ocmm_gui.plan_editor._plan_items import ALIGNMENT, HEAD, LISTS, ItemKey, item_of, place_of
from ocmm_gui.views import read_picture


class PlanDraft:
    """One plan with undo. `path`: None if it has no file yet."""

    def __init__(self, plan: plans.Plan, path: Path | None) -> None:
        self._plans = [plan]
        self._at = 0
        self._saved = plan
        self.path = path

    @property
    def plan(self) -> plans.Plan:
        return self._plans[self._at]

    @property
    def is_saved(self) -> bool:
        return self.plan == self._saved

    @property
    def folder(self) -> Path | None:
        """Return the folder of the plan's pictures; None without a file."""
        return None if self.path is None else self.path.absolute().parent

    @property
    def status(self) -> str:
        """Return name, file and saved state in words."""
        where = tr("no file yet") if self.path is None else self.path.name
        saved = tr("saved") if self.is_saved else tr("not saved yet")
        return f"{self.plan.name}, {where}, {saved}."

    def did(self, plan: plans.Plan) -> bool:
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
        plans.save_plan(self.plan, path)
        before, self.path = self.folder, path
        self._saved = self.plan
        if before is not None:
            plans.carry_pictures(self.plan, before, path.absolute().parent)
            plans.carry_model(self.plan, before, path.absolute().parent)
        return path


_MOST_SHOWN = 3
"""Errors come first; the others follow once these are corrected."""

_FIELD = re.compile(r"field '(\w+)(?:\[(\d+)\])?\.?([^'\[]*)")
"""Part of the plan, index in its list, and field, in a sentence of the core."""


class PlanChecks(Themed, QWidget):
    """Valid, or the error and its remedy."""

    def __init__(self) -> None:
        super().__init__()
        self._tone = "good"
        self._label = sentence_label(tr("Checks"), 15)
        vbox(self._label, parent=self, margins=0)

    def text(self) -> str:
        return self._label.text()

    def show_fault(self, fault: OcmmError) -> None:
        """Show why something is not applied."""
        self._show_message(
            tr("✖  Not applied: {what} {remedy}").format(
                what=said(fault.what), remedy=said(fault.remedy)
            ),
            "bad",
        )

    def show_good(self, draft: PlanDraft) -> None:
        """Show the contradictions of the plan, or that it is valid; and missing pictures."""
        words = tr("✔  The plan is valid and can be measured.")
        tone = "good"
        found = plans.plan_findings(draft.plan)
        shown = [f"{said(one.what)} {said(one.remedy)}" for one in found[:_MOST_SHOWN]]
        count = plans.requirement_count(draft.plan)
        if count is not None and not count.is_whole:
            shown.insert(0, f"{said(count.sentence)}.")
        elif count is not None:
            words += f" {said(count.sentence)}."
        if found and found[0].is_error:
            tone = "bad"
            words = tr("✖  The plan is not valid: no job can be started by it. {errors}")
        elif shown:
            tone = "warn"
            words = tr("▲  The plan can be measured. {doubts}")
        listed = "\n".join(shown)
        words = words.format(doubts=listed, errors=listed)
        missing = plans.without_file(draft.plan, draft.folder)
        if missing:
            drawn = tr(
                "Picture of {names} not found beside the plan: the feature is drawn instead."
            )
            words += f" {drawn.format(names=', '.join(missing))}"
        self._show_message(words, tone)

    def _paint(self) -> None:
        self._label.setStyleSheet(f"color: {self._theme.colour(self._tone)};")

    def _show_message(self, words: str, tone: str) -> None:
        self._tone = tone
        self._label.setText(words)
        self._paint()


def faulty_field(fault: OcmmError, plan: plans.Plan, key: ItemKey) -> str:
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


def fresh_plan() -> plans.Plan:
    """Return a plan with one feature, to start with."""
    empty = plans.new_plan(tr("PLAN"), tr("PART"))
    return plans.add_feature(empty, new_feature(empty, ItemKey("plan")))


def new_feature(plan: plans.Plan, chosen: ItemKey) -> NominalFeature:
    """Return a feature like the selected one, or a plane, under a free name."""
    if chosen.group == "features":
        feature: NominalFeature = item_of(plan, chosen)
        return msgspec.structs.replace(
            feature, name=_free_name(plan, feature.name), text="", picture=""
        )
    return NominalFeature(
        name=_free_name(plan, tr("FEATURE")),
        shape=Shape.PLANE,
        points=plans.usual_points(Shape.PLANE),
        point=(0.0, 0.0, 0.0),
    )


def new_construction(plan: plans.Plan, chosen: ItemKey) -> Construction | None:
    """Return a construction like the selected one, or the selected feature under another name.

    None if neither is selected and the plan has no feature.
    """
    if chosen.group == "constructions":
        like: Construction = item_of(plan, chosen)
        return msgspec.structs.replace(like, name=_free_name(plan, like.name))
    names = [feature.name for feature in plan.features]
    if not names:
        return None
    feature = chosen.name if chosen.group == "features" else names[0]
    return PartOf(name=_free_name(plan, tr("CONSTRUCTION")), features=(feature,))


def new_characteristic(plan: plans.Plan, chosen: ItemKey) -> Characteristic | None:
    """Return the usual characteristic of the selected feature; None without one.

    For a construction it is the distance from the first feature.
    """
    if chosen.group == "constructions":
        return _characteristic(plan, [plan.features[0].name, chosen.name], "distance", 0.0, -0.1)
    if chosen.group != "features":
        return None
    feature: NominalFeature = item_of(plan, chosen)
    if feature.shape.spec.is_radial:
        return _characteristic(plan, [feature.name], "diameter", feature.diameter, -0.1)
    return _characteristic(plan, [feature.name], "form", 0.0, 0.0)


def _characteristic(
    plan: plans.Plan, features: list[str], kind: str, nominal: float, lower: float
) -> Characteristic:
    return Characteristic(
        name=_free_name(plan, f"{features[-1]} {kind}"),
        kind=kind,
        features=features,
        nominal=nominal,
        lower=lower,
        upper=0.1,
        limits="proposed",
    )


def _free_name(plan: plans.Plan, name: str) -> str:
    taken = {item.name for item in (*plan.features, *plan.constructions, *plan.characteristics)}
    if name not in taken:
        return name
    stem = name.rstrip("0123456789")
    numbered = (f"{stem}{number}" for number in range(2, len(taken) + 3))
    return next(free for free in numbered if free not in taken)


@dataclass(frozen=True, slots=True)
class PlanChange:
    make: Callable[[], plans.Plan]
    """Returns the other plan; raises `OcmmError` if impossible."""
    chosen: ItemKey


def with_feature(plan: plans.Plan, chosen: ItemKey) -> PlanChange:
    """Return a change that adds a feature like the selected one, after it."""
    feature, place = new_feature(plan, chosen), _place_after(plan, chosen, "features")
    return PlanChange(
        lambda: plans.add_feature(plan, feature, place), ItemKey("features", feature.name)
    )  # fmt: skip


def with_construction(plan: plans.Plan, chosen: ItemKey) -> PlanChange | None:
    """Return a change that adds a construction of the selected feature; None without features."""
    item, place = new_construction(plan, chosen), _place_after(plan, chosen, "constructions")
    if item is None:
        return None
    return PlanChange(
        lambda: plans.add_construction(plan, item, place), ItemKey("constructions", item.name)
    )  # fmt: skip


def with_characteristic(plan: plans.Plan, chosen: ItemKey) -> PlanChange | None:
    """Return a change that adds a characteristic of the selected feature; None without one."""
    item = new_characteristic(plan, chosen)
    if item is None:
        return None
    return PlanChange(
        lambda: plans.add_characteristic(plan, item), ItemKey("characteristics", item.name)
    )


def with_item(plan: plans.Plan, chosen: ItemKey, item: Any) -> PlanChange:
    """Return a change of the selected item to the form's content."""
    if chosen == HEAD:
        return PlanChange(lambda: plans.with_head(plan, item), chosen)
    if chosen == ALIGNMENT:
        return PlanChange(lambda: plans.with_alignment(plan, item), chosen)
    return PlanChange(
        lambda: plans.replace_item(plan, chosen.name, item), ItemKey(chosen.group, item.name)
    )  # fmt: skip


def without(plan: plans.Plan, chosen: ItemKey) -> PlanChange | None:
    """Return a change that removes the selected item or alignment; None if neither."""
    if chosen == ALIGNMENT:
        return PlanChange(lambda: plans.with_alignment(plan, None), chosen)
    if chosen.group not in LISTS:
        return None
    return PlanChange(lambda: plans.remove_item(plan, chosen.name, chosen.group), HEAD)


def moved(plan: plans.Plan, chosen: ItemKey, way: int) -> PlanChange | None:
    """Return a change that moves the selected item up or down; None if impossible."""
    if chosen.group not in LISTS or (place := place_of(plan, chosen) + way) < 0:
        return None
    return PlanChange(lambda: plans.move_item(plan, chosen.name, place, chosen.group), chosen)


def with_picture_of(
    plan: plans.Plan, path: Path | None, chosen: ItemKey, picture: Path
) -> plans.Plan:
    """Return a plan with a picture for a feature; InputError if invalid, or unsaved plan."""
    if picture.is_file() and read_picture(picture) is None:
        raise InputError(
            "plan.no_picture", f"{picture}: not a readable picture.", "Choose a PNG or JPEG file."
        )
    name = chosen.name if chosen.group == "features" else ""
    return plans.with_picture(plan, path, name, picture)


def _place_after(plan: plans.Plan, chosen: ItemKey, group: str) -> int | None:
    """Return the index after the selected item of a list; None for its end."""
    return place_of(plan, chosen) + 1 if chosen.group == group else None
