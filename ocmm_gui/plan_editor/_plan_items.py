"""List of a plan's items, the feature drawn for one, its forms, and teaching of nominals."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from PySide6.QtCore import QSize, Signal
from PySide6.QtWidgets import QListWidget, QListWidgetItem, QWidget

from ocmm_core.alignment import Alignment
from ocmm_core.features.measured import Construction, nominal_geometries
from ocmm_core.features.shapes import NominalFeature, Shape, nominal_of
from ocmm_core.inspection.evaluation import checked_features
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.inspection.plan import HEAD_FIELDS, Plan, taught_plan, usual_points
from ocmm_core.measuring import reported_points
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.zones import Characteristic
from ocmm_gui.kit import (
    PathPanel,
    WorkBar,
    hbox,
    later,
    literal,
    panel,
    said_word,
    text_font,
    tr,
    tr_all,
    vbox,
)
from ocmm_gui.plan_editor._field_labels import choice_word
from ocmm_gui.plan_editor._item_form import ItemForm
from ocmm_gui.work import SideProcess, Tell

LISTS = ("features", "constructions", "characteristics")
"""Lists of a plan, in the order shown."""

_ROW_PX = 34


class ItemKey(NamedTuple):
    """A part of the plan, and a name if the part is a list."""

    group: str
    name: str = ""


HEAD = ItemKey("plan")
"""The plan as a whole."""
ALIGNMENT = ItemKey("alignment")


class PlanItems(QListWidget):
    """The plan itself, its alignment, features, constructions and characteristics."""

    item_chosen = Signal(object)
    """Emits the selected `ItemKey`."""

    def __init__(self) -> None:
        super().__init__()
        self._keys: list[ItemKey] = []
        self.setAccessibleName(tr("Items of the plan"))
        self.setAccessibleDescription(tr("Up and down select an item"))
        self.setFont(text_font(15))
        self.currentRowChanged.connect(self._on_row)

    def show_plan(self, plan: Plan, chosen: ItemKey) -> None:
        """Show the items of a plan; ``chosen`` is selected if it exists."""
        self.blockSignals(True)
        self.clear()
        self._keys = []
        self._add(tr("Plan {name}").format(name=plan.name), HEAD)
        rule = plan.alignment
        self._add(
            tr("Alignment   {rule}").format(
                rule=tr("none") if rule is None else choice_word(_tag(rule))
            ),
            ALIGNMENT,
        )
        for feature in plan.features:
            points = tr("%n points", "1 point", feature.points)
            self._add(
                f"{feature.name}   {said_word(feature.shape.value)}, {points}",
                ItemKey("features", feature.name),
            )
        shapes = plan.shapes
        for item in plan.constructions:
            self._add(
                f"=  {item.name}   {choice_word(_tag(item))}: {said_word(shapes[item.name].value)}",
                ItemKey("constructions", item.name),
            )
        for wanted in plan.characteristics:
            self._add(
                f"±  {wanted.name}   {said_word(str(wanted.kind))}",
                ItemKey("characteristics", wanted.name),
            )
        self.choose(chosen)
        self.blockSignals(False)

    def choose(self, key: ItemKey) -> None:
        """Select an item, or the plan if it does not exist."""
        self.setCurrentRow(self._keys.index(key) if key in self._keys else 0)

    def chosen(self) -> ItemKey:
        row = self.currentRow()
        return self._keys[row] if 0 <= row < len(self._keys) else HEAD

    def _add(self, text: str, key: ItemKey) -> None:
        item = QListWidgetItem(text, self)
        item.setSizeHint(QSize(180, _ROW_PX))
        item.setToolTip(literal(text))
        self._keys.append(key)

    def _on_row(self, row: int) -> None:
        if row >= 0:
            self.item_chosen.emit(self.chosen())


def item_of(plan: Plan, key: ItemKey) -> Any:
    """Return an item of a plan, or the plan; KeyError if unknown."""
    if key == HEAD:
        return plan
    if key == ALIGNMENT:
        return plan.alignment
    return getattr(plan, key.group)[place_of(plan, key)]


def place_of(plan: Plan, key: ItemKey) -> int:
    """Return the index of an item in its list; KeyError if unknown."""
    for index, item in enumerate(getattr(plan, key.group) if key.group in LISTS else ()):
        if item.name == key.name:
            return index
    raise KeyError(key)


def _tag(item: msgspec.Struct) -> str:
    return str(item.__struct_config__.tag)


def drawn_of(plan: Plan, key: ItemKey) -> NominalFeature | None:
    """Return the feature drawn for an item: itself, or the first that it is about; or None."""
    name = key.name
    if key.group == "characteristics":
        name = item_of(plan, key).features[0]
    elif key.group not in ("features", "constructions"):
        return None
    for feature in plan.features:
        if feature.name == name:
            return feature
    geometry = nominal_geometries(plan.features, plan.constructions).get(name)
    if geometry is None:
        return None
    shape = plan.shapes[name]
    return nominal_of(name, shape, geometry, usual_points(shape))


def item_forms() -> dict[str, ItemForm]:
    left_out = tuple(name for name in Plan.__struct_fields__ if name not in HEAD_FIELDS)
    return {
        HEAD.group: ItemForm(tr("Plan settings"), Plan, left_out),
        ALIGNMENT.group: ItemForm(tr("Alignment"), Alignment | None),
        "features": ItemForm(
            tr("Feature"), NominalFeature, (), "shape", lambda word: Shape(word).spec.unused
        ),
        "constructions": ItemForm(tr("Construction"), Construction),
        "characteristics": ItemForm(
            tr("Characteristic"), Characteristic, (), "kind", lambda kind: spec_of(kind).unused
        ),
    }


_PANELS = (
    (later("Write the plan into the file"), later("File of the plan"), later("Write")),
    (later("Import the features or frame from the file"), later("File of the features or frame"),
     later("Import")),
    (later("Attach the picture from the file"), later("File of the picture"), later("Attach")),
    (later("Open the plan from the file"), later("File of the plan"), later("Open")),
    (later("Write all requirements into the file (.xlsx, .csv)"),
     later("File of the inspection plan"), later("Write")),
)  # fmt: skip


def path_panels() -> tuple[PathPanel, ...]:
    """Return the questions for files of plan, import, picture, other plan, inspection plan."""
    return tuple(PathPanel(*tr_all(texts)) for texts in _PANELS)


def lay_out(
    editor: QWidget, items: QWidget, form: QWidget, right: Sequence[tuple[QWidget, int]]
) -> None:
    """Lay out list, form and, stacked by their shares, the right column."""
    middle, column = panel(vbox(form)), panel(vbox(*right))
    hbox((items, 32), (middle, 40), (column, 28), parent=editor, spacing=10, margins=0)


class TeachProgress(WorkBar):
    """Progress of teaching."""

    taught = Signal(object)
    """Emits the `Plan` with its new nominals."""
    failed = Signal(object)
    """Emits an `OcmmError`."""

    def __init__(self) -> None:
        super().__init__(tr("Progress of teaching"))
        self._process = SideProcess(self, self._on_finished, self._on_failed, self.advance)

    def toggle(self, job: Path, plan: Plan) -> None:
        """Start with the part of a job, or cancel."""
        if self._process.is_running():
            self.cancel()
            return
        self.start("%p%")
        self._process.start(partial(taught_of_file, job, plan))

    def cancel(self) -> None:
        self._process.cancel()
        self.hide()

    def _on_finished(self, found: object) -> None:
        self.hide()
        self.taught.emit(found)

    def _on_failed(self, error: object) -> None:
        self.hide()
        self.failed.emit(error)


def taught_of_file(path: Path, plan: Plan, tell: Tell) -> Plan:
    """Return a plan with nominals measured in a job, in its part frame; or raise OcmmError."""
    tell(later("Reading the job"), 0.2)
    job = reopen_job(path)
    tell(later("Rounding the nominals"), 0.8)
    actual = checked_features(job.plan, reported_points(job.points, job.climate.part), job.options)
    return taught_plan(plan, actual, job.T_part_from_world)
