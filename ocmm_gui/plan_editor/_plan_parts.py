from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from ocmm_core.alignment import Alignment
from ocmm_core.features.measured import Construction
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan import HEAD_FIELDS, Plan
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.zones import Characteristic
from ocmm_gui.kit import PathPanel, panel, tr
from ocmm_gui.plan_editor._plan_items import ALIGNMENT, HEAD
from ocmm_gui.plan_editor.form import ItemForm


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


def path_panels() -> tuple[PathPanel, PathPanel, PathPanel, PathPanel, PathPanel]:
    """Return the questions for files of plan, import, picture, other plan, inspection plan."""
    return (
        PathPanel(tr("Write the plan into the file"), tr("File of the plan"), tr("Write")),
        PathPanel(
            tr("Import the features or frame from the file"),
            tr("File of the features or frame"),
            tr("Import"),
        ),
        PathPanel(tr("Attach the picture from the file"), tr("File of the picture"), tr("Attach")),
        PathPanel(tr("Open the plan from the file"), tr("File of the plan"), tr("Open")),
        PathPanel(
            tr("Write all requirements into the file (.xlsx, .csv)"),
            tr("File of the inspection plan"),
            tr("Write"),
        ),
    )


def lay_out(
    editor: QWidget, items: QWidget, form: QWidget, right: Sequence[tuple[QWidget, int]]
) -> None:
    """Lay out list, form and, stacked by their shares, the right column."""
    middle, column = QVBoxLayout(), QVBoxLayout()
    middle.addWidget(form)
    for widget, share in right:
        column.addWidget(widget, share)
    row = QHBoxLayout(editor)
    row.setContentsMargins(0, 0, 0, 0)
    row.setSpacing(10)
    row.addWidget(items, 32)
    row.addWidget(panel(middle), 40)
    row.addWidget(panel(column), 28)
