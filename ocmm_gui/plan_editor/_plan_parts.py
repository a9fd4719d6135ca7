"""Forms, path questions, layout of the plan editor, and teaching of nominals from a job file."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QProgressBar, QVBoxLayout, QWidget

from ocmm_core.alignment import Alignment
from ocmm_core.features.measured import Construction
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.archive import reopen_job
from ocmm_core.inspection.evaluation import checked_features
from ocmm_core.inspection.plan import HEAD_FIELDS, Plan, taught_plan
from ocmm_core.measuring import reported_points
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.zones import Characteristic
from ocmm_gui.kit import PathPanel, hbox, later, panel, tr
from ocmm_gui.plan_editor._item_form import ItemForm
from ocmm_gui.plan_editor._plan_items import ALIGNMENT, HEAD
from ocmm_gui.work import SideProcess, Tell


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
    hbox(
        (items, 32), (panel(middle), 40), (panel(column), 28), parent=editor, spacing=10, margins=0
    )


class TeachProgress(QProgressBar):
    """Progress of teaching; hidden otherwise."""

    taught = Signal(object)
    """Emits the `Plan` with its new nominals."""
    failed = Signal(object)
    """Emits an `OcmmError`."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Progress of teaching"))
        self.hide()
        self._process = SideProcess(self)
        self._process.finished.connect(self._on_finished)
        self._process.failed.connect(self._on_failed)
        self._process.advanced.connect(self._on_advanced)

    def toggle(self, job: Path, plan: Plan) -> None:
        """Start with the part of a job, or cancel."""
        if self._process.is_running():
            self.cancel()
            return
        self.setValue(0)
        self.show()
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

    def _on_advanced(self, what: str, share: float) -> None:
        self.setFormat(what)
        self.setValue(round(100.0 * share))


def taught_of_file(path: Path, plan: Plan, tell: Tell) -> Plan:
    """Return a plan with nominals measured in a job, in its part frame; or raise OcmmError."""
    tell(later("Reading the job"), 0.2)
    job = reopen_job(path)
    tell(later("Rounding the nominals"), 0.8)
    points = reported_points(job.points, job.climate.part)
    actual = checked_features(job.plan, points, job.options)
    return taught_plan(plan, actual, job.T_part_from_world)
