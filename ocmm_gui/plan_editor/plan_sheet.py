"""The plan editor: a list of what is in the plan, a form, and what is wrong with it in words."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QProgressBar, QStackedWidget, QVBoxLayout

from ocmm_core.errors import OcmmError
from ocmm_core.features.nominal import NominalFeature
from ocmm_core.inspection.plan import Plan, check_plan
from ocmm_core.inspection.plan_csv import features_from_csv
from ocmm_core.inspection.plan_edit import (
    EDITED,
    add_characteristic,
    add_feature,
    move_item,
    remove_item,
    replace_item,
)
from ocmm_core.inspection.plan_file import save_plan
from ocmm_core.inspection.plan_step import features_from_step
from ocmm_core.tolerances.characteristic import Characteristic
from ocmm_gui.actions import ActionInfo
from ocmm_gui.maintain.parts import panel, sentence_label
from ocmm_gui.maintain.side_process import SideProcess
from ocmm_gui.operator.path_panel import PathPanel
from ocmm_gui.operator.step_picture import StepPicture
from ocmm_gui.plan_editor.forms import (
    CHARACTERISTIC_LINES,
    FEATURE_LINES,
    HEAD_LINES,
    PlanHead,
    head_of,
    with_head,
)
from ocmm_gui.plan_editor.history import PlanHistory
from ocmm_gui.plan_editor.item_form import ItemForm
from ocmm_gui.plan_editor.plan_items import HEAD, PlanItems, new_characteristic, new_feature
from ocmm_gui.plan_editor.teaching import taught_of_file
from ocmm_gui.sheet import Sheet
from ocmm_gui.theme import DEFAULT_THEME, THEMES, Theme

_KEYS = (
    ActionInfo("add", "Feature", "Add a feature after the chosen one", ("F6",)),
    ActionInfo("tolerance", "Tolerance", "Add a characteristic of the chosen feature", ("F7",)),
    ActionInfo("remove", "Remove", "Remove the chosen item", ("F9",)),
    ActionInfo("earlier", "Earlier", "Move the chosen item up", ("F2",)),
    ActionInfo("later", "Later", "Move the chosen item down", ("F3",)),
    ActionInfo("undo", "Undo", "Take the last change back", ("F10",)),
    ActionInfo("teach", "Teach", "Take the nominals from the part that is measured now", ("F11",)),
    ActionInfo("import", "Import", "Add the features of a CSV or STEP file", ("F12",)),
    ActionInfo("save", "Save", "Write the plan to a file", ("F8",)),
)
_FIELD = re.compile(r"field '[^']*?\.?(\w+)'")


class PlanSheet(Sheet):
    """List on the left, form in the middle, picture and checks on the right.

    Parameters
    ----------
    plan, path
        The plan that is measured, and its file where that is known.
    job_path
        Gives the file of the running job, whose part can be the master.
    """

    saved = Signal(object)
    """Emits the `Path` that the plan was written to."""

    def __init__(self, plan: Plan, path: Path | None, job_path: Callable[[], Path]) -> None:
        super().__init__("Plan", _KEYS)
        self._theme = THEMES[DEFAULT_THEME]
        self._path, self._job_path = path, job_path
        self._fault: OcmmError | None = None
        self.history = PlanHistory(plan)
        self.items = PlanItems()
        self.features = ItemForm("Feature", NominalFeature, FEATURE_LINES)
        self.characteristics = ItemForm("Characteristic", Characteristic, CHARACTERISTIC_LINES)
        self.head = ItemForm("Plan as a whole", PlanHead, HEAD_LINES)
        self._forms: tuple[ItemForm[Any], ...] = (self.head, self.features, self.characteristics)
        self._stack = QStackedWidget()
        for form in self._forms:
            self._stack.addWidget(form)
            form.edited.connect(self._take)
            form.left.connect(self.left)
        self.picture = StepPicture()
        self.checks = sentence_label("Checks", 15)
        self.progress = QProgressBar()
        self.progress.setAccessibleName("Progress of the teaching")
        self.progress.hide()
        self._teacher = SideProcess(self)
        self._teacher.finished.connect(self._on_taught)
        self._teacher.failed.connect(self._on_failed)
        self._teacher.advanced.connect(self._on_advanced)
        self.file = PathPanel("plan", "file")
        self.source = PathPanel("features", "file", "Import")
        self.file.given.connect(self.save_as)
        self.source.given.connect(self.import_file)
        self._lay_out()
        self.items.item_chosen.connect(lambda _name: self._show_item())
        self.use_keys(
            {
                "add": self.add_feature,
                "tolerance": self.add_characteristic,
                "remove": self.remove,
                "earlier": lambda: self._move(-1),
                "later": lambda: self._move(1),
                "undo": self.undo,
                "teach": self.teach,
                "import": lambda: self.source.ask(Path.home()),
                "save": self.save,
            },
            primary="save",
        )
        self._refresh(HEAD)

    def open(self) -> None:
        """Go on writing where it was left."""
        self._refresh(self.items.chosen())
        self.items.setFocus()

    def add_feature(self) -> None:
        """Add a feature like the chosen one, under a name of its own."""
        plan, chosen = self.history.plan, self.items.chosen()
        feature = new_feature(plan, chosen)
        place = self.items.place_after(plan, chosen)
        if self._did(lambda: add_feature(plan, feature, place), feature.name):
            self.features.focus_first()

    def add_characteristic(self) -> None:
        """Add a characteristic of the chosen feature."""
        plan = self.history.plan
        item = new_characteristic(plan, self.items.chosen())
        if item is None:
            self.told.emit("Choose the feature that is to be toleranced first.")
        elif self._did(lambda: add_characteristic(plan, item), item.name):
            self.characteristics.focus_first()

    def remove(self) -> None:
        """Remove the chosen item; one that others need stays, and they are named."""
        plan, name = self.history.plan, self.items.chosen()
        if name != HEAD:
            self._did(lambda: remove_item(plan, name), HEAD)

    def undo(self) -> None:
        """Take the last change back."""
        if not self.history.undo():
            self.told.emit("There is nothing to take back.")
        self._refresh(self.items.chosen())

    def teach(self) -> None:
        """Take the nominals of all measured features from the part of the running job."""
        if self._teacher.is_running():
            self._teacher.cancel()
            self.progress.hide()
            return
        self.progress.setValue(0)
        self.progress.show()
        self._teacher.start(partial(taught_of_file, self._job_path(), self.history.plan))

    def import_file(self, path: Path) -> None:
        """Add the features of a table or of a model."""
        read = features_from_step if path.suffix.lower() in (".step", ".stp") else features_from_csv
        found = self.attempt(lambda: read(path))
        if not found:
            return
        plan = self.history.plan

        def with_all() -> Plan:
            grown = plan
            for feature in found:
                grown = add_feature(grown, feature)
            return grown

        if self._did(with_all, found[0].name):
            self.told.emit(f"{len(found)} features were added from {path.name}.")
            self.items.setFocus()

    def save(self) -> None:
        """Ask for the file; the one of this plan is proposed."""
        self.file.ask(self._path or Path.home() / f"{self.history.plan.name}.toml")

    def save_as(self, path: Path) -> None:
        """Write the plan, read it back and compare."""
        def write() -> Path:
            save_plan(self.history.plan, path)
            return path

        if self.attempt(write) is not None:
            self._path = path
            self.history.saved()
            self._refresh(self.items.chosen())
            self.saved.emit(path)
            self.items.setFocus()

    def close_work(self) -> None:
        """Give up what is calculated; call it before the window goes."""
        self._teacher.cancel()
        self.progress.hide()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self._paint_checks()

    def form(self) -> ItemForm[Any]:
        """Return the form of the chosen item."""
        return self._forms[self.items.group(self.history.plan)]

    def _show_item(self) -> None:
        plan, name = self.history.plan, self.items.chosen()
        form = self.form()
        self._stack.setCurrentWidget(form)
        form.show_item(head_of(plan) if name == HEAD else self.items.named(plan, name))
        self._show_picture()
        self._check()

    def _show_picture(self) -> None:
        names = [feature.name for feature in self.history.plan.features]
        name = self.items.chosen()
        nominal = self.history.plan.features[names.index(name)] if name in names else None
        self.picture.show_step(nominal, None if self._path is None else self._path.parent)

    def _take(self) -> None:
        """Take what is filled in over into the plan, or say why not."""
        plan, name, form = self.history.plan, self.items.chosen(), self.form()
        try:
            item = form.item()
            if isinstance(item, PlanHead):
                changed = with_head(plan, item)
                check_plan(EDITED, changed)
            else:
                changed = replace_item(plan, name, item)
        except OcmmError as error:
            self._say_fault(error)
            return
        if self.history.did(changed):
            self._refresh(HEAD if isinstance(item, PlanHead) else str(item.name))
        else:
            self._check()

    def _did(self, change: Callable[[], Plan], chosen: str) -> bool:
        """Make a change of the plan and say whether it could be made."""
        changed = self.attempt(change)
        if changed is None:
            return False
        self.history.did(changed)
        self._refresh(chosen)
        return True

    def _move(self, way: int) -> None:
        plan, name = self.history.plan, self.items.chosen()
        place = self.items.place_after(plan, name) - 1 + way
        if name != HEAD and place >= 0:
            self._did(lambda: move_item(plan, name, place), name)

    def _refresh(self, chosen: str) -> None:
        self.items.show_plan(self.history.plan, chosen)
        state = "saved" if self.history.is_saved else "not saved yet"
        where = "no file yet" if self._path is None else self._path.name
        self.say(f"{self.history.plan.name}, {where}, {state}.")
        self._show_item()

    def _check(self) -> None:
        self._fault = None
        try:
            check_plan(EDITED, self.history.plan)
        except OcmmError as error:
            self._fault = error
        self._paint_checks()

    def _say_fault(self, error: OcmmError) -> None:
        self._fault = error
        self._paint_checks()

    def _paint_checks(self) -> None:
        fault = self._fault
        if fault is None:
            self.form().mark("")
            self.checks.setText("✔  In order: the plan can be measured.")
            self.checks.setStyleSheet(f"color: {self._theme.good};")
            return
        found = _FIELD.search(fault.what)
        key = fault.code.rpartition(".")[2] if fault.code.startswith("plan.form.") else ""
        self.form().mark(found.group(1) if found else key)
        self.checks.setText(f"✖  Not taken over: {fault.what} {fault.remedy}")
        self.checks.setStyleSheet(f"color: {self._theme.bad};")

    def _on_taught(self, found: object) -> None:
        self.progress.hide()
        if isinstance(found, Plan):
            changed = self.history.did(found)
            self._refresh(self.items.chosen())
            what = "The nominals are those of the part now." if changed else "Nothing has changed."
            self.told.emit(f"{what} F10 takes that back.")

    def _on_failed(self, error: object) -> None:
        self.progress.hide()
        self.failed.emit(error)

    def _on_advanced(self, what: str, share: float) -> None:
        self.progress.setFormat(what)
        self.progress.setValue(round(100.0 * share))

    def _lay_out(self) -> None:
        for line in (self.file, self.source):
            self.body.addWidget(line)
        middle, right = QVBoxLayout(), QVBoxLayout()
        middle.addWidget(self._stack)
        right.addWidget(self.picture, 3)
        right.addWidget(self.checks, 2)
        right.addWidget(self.progress)
        row = QHBoxLayout()
        row.setSpacing(10)
        row.addWidget(self.items, 30)
        row.addWidget(panel(middle), 40)
        row.addWidget(panel(right), 30)
        self.body.addLayout(row, 1)
