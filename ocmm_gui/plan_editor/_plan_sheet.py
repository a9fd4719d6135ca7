"""The plan editor: a list of the plan's items, a form, and errors in words."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QStackedWidget, QWidget

from ocmm_core.errors import OcmmError
from ocmm_core.export.report import write_account
from ocmm_core.inspection.plan import EDITED, Plan, check_plan, load_plan
from ocmm_core.names import file_stem
from ocmm_gui.kit import ActionInfo, Sheet, dressed, fill, is_shipped, later, make_button, tr
from ocmm_gui.plan_editor import _plan_checks as plan_checks
from ocmm_gui.plan_editor import _plan_items as plan_items
from ocmm_gui.plan_editor._from_models import ModelImport
from ocmm_gui.plan_editor._importing import InUse, what_is_missing
from ocmm_gui.plan_editor._item_form import ItemForm
from ocmm_gui.plan_editor._plan_checks import PlanChecks, PlanDraft, faulty_field
from ocmm_gui.views import StepPicture

KEYS = (
    ActionInfo("add", later("Feature"), later("Add a feature after the selected one"), ("F6",)),
    ActionInfo(
        "construct", later("Construct"),
        later("Add a construction from the selected feature"), ("Shift+F6",),
    ),
    ActionInfo(
        "tolerance", later("Tolerance"),
        later("Add a characteristic of the selected feature"), ("F7",),
    ),
    ActionInfo("align", later("Alignment"), later("Define the part alignment"), ("F5",)),
    ActionInfo("faces", later("Faces"),
               later("Align by a best fit to faces of the model"), ("Shift+F5",)),
    ActionInfo("remove", later("Remove"), later("Remove the selected item"), ("F9",)),
    ActionInfo("earlier", later("Earlier"), later("Move the selected item up"), ("Ctrl+F6",)),
    ActionInfo("later", later("Later"), later("Move the selected item down"), ("Ctrl+F7",)),
    ActionInfo("undo", later("Undo"), later("Undo the last change"), ("F10",)),
    ActionInfo("redo", later("Redo"), later("Redo the last undone change"), ("Shift+F10",)),
    ActionInfo("picture", later("Picture"), later("Attach a picture to the selected feature"),
               ("Shift+F7",)),
    ActionInfo("teach", later("Teach"), later("Take the nominals from the current part"),
               ("Ctrl+F9",)),
    ActionInfo(
        "import", later("Import"),
        later("Import features from CSV or STEP, or a frame document for the alignment"),
        ("Shift+F9",),
    ),
    ActionInfo("new", later("New"), later("Start a new plan"), ("Ctrl+F10",)),
    ActionInfo("open", later("Open"), later("Open another plan file"), ("Ctrl+F8",)),
    ActionInfo("save", later("Save"), later("Write the plan to a file"), ("F8",)),
    ActionInfo(
        "requirements", later("Requirements"),
        later("Write the inspection plan: all requirements with balloon numbers"),
        ("Ctrl+F5",),
    ),
    ActionInfo("measure", later("Measure"), later("Start a job with this plan"), ("Shift+F8",)),
)  # fmt: skip


_END_S = 1.0
"""s: maximum wait for a file that is still being read."""


class PlanSheet(Sheet):
    """List on the left, form in the middle, picture and checks on the right.

    ``plan``, ``path``: of the station, its file if known; ``job_path`` returns the running job,
    whose part can be the master; ``in_use``: cameras and probe for imported models.
    """

    warned = Signal(str)
    """Emits a result that differs from the request."""
    saved = Signal(object)
    """Emits the `Path` that the plan was written to."""
    measure_wanted = Signal(object)
    """Emits the `Path` of a plan for a new job."""

    def __init__(
        self,
        plan: Plan,
        path: Path | None,
        job_path: Callable[[], Path],
        in_use: Callable[[], InUse] | None = None,
    ) -> None:
        super().__init__(tr("Plan"), KEYS)
        self._job_path = job_path
        self.draft = PlanDraft(plan, path)
        self.items = plan_items.PlanItems()
        self.forms = plan_items.item_forms()
        self._editor = QWidget()
        self._stack = QStackedWidget()
        for form in self.forms.values():
            self._stack.addWidget(form)
            form.edited.connect(self._apply)
            form.left.connect(self.left)
        self.picture = StepPicture()
        self.checks = PlanChecks()
        self._teaching = plan_items.TeachProgress()
        self._teaching.taught.connect(self._on_taught)
        self._teaching.failed.connect(self.failed)
        panels = plan_items.path_panels()
        self.file, self.source, self.image, self.other, self.listing = panels
        self.file.given.connect(self.save_as)
        self.source.given.connect(self.import_file)
        self.models = ModelImport(lambda: self.draft, self._did, in_use)
        self.models.opened.connect(self._editor.hide)
        self.models.closed.connect(self._show_editor)
        self.models.told.connect(self.told)
        self.models.warned.connect(self.warned)
        self.models.failed.connect(self.failed)
        self.image.given.connect(self.attach_picture)
        self.other.given.connect(self.open_file)
        self.listing.given.connect(self.write_requirements)
        fill(self.body, *panels, (self._editor, 1))
        self.models.add_to(self.body)
        self.items.item_chosen.connect(lambda _key: self._show_item())
        self.use_keys(
            {
                "add": self.add_feature,
                "construct": self.add_construction,
                "tolerance": self.add_characteristic,
                "align": self.align,
                "faces": self.choose_faces,
                "remove": self.remove,
                "earlier": lambda: self._change(
                    plan_checks.moved(self.draft.plan, self.items.chosen(), -1)
                ),
                "later": lambda: self._change(
                    plan_checks.moved(self.draft.plan, self.items.chosen(), 1)
                ),
                "undo": self.undo,
                "redo": self.redo,
                "picture": lambda: self.image.ask(self._folder()),
                "teach": self.teach,
                "import": self.ask_import,
                "new": lambda: self._change_to(plan_checks.fresh_plan, None),
                "open": lambda: self.other.ask(self._folder()),
                "save": self.save,
                "measure": self.measure,
                "requirements": self.ask_requirements,
            },
            primary="save",
            aside="requirements",
        )
        listing = dressed(make_button(self.keys["requirements"]), high=42)
        right = ((self.picture, 3), (self.checks, 2), (listing, 0), (self._teaching, 0))
        plan_items.lay_out(self._editor, self.items, self._stack, right)
        self._refresh(plan_items.HEAD)

    def open(self) -> None:
        self.models.close()
        self._refresh(self.items.chosen())

    def use_plan(self, plan: Plan, path: Path | None) -> None:
        """Show the plan now measured, unless another one has unsaved changes."""
        if self.draft.is_saved:
            self._show_other(plan, path)

    def add_feature(self) -> None:
        """Add a feature like the selected one, under a unique name."""
        self._add(plan_checks.with_feature(self.draft.plan, self.items.chosen()))

    def add_construction(self) -> None:
        """Add a construction from the selected feature, or one like the selected construction."""
        made = plan_checks.with_construction(self.draft.plan, self.items.chosen())
        self._add(made, tr("Add the features to construct from first."))

    def add_characteristic(self) -> None:
        made = plan_checks.with_characteristic(self.draft.plan, self.items.chosen())
        self._add(made, tr("Select the feature to tolerance first."))

    def align(self) -> None:
        self.items.choose(plan_items.ALIGNMENT)
        self.form().focus_first()

    def choose_faces(self) -> None:
        """Show the faces of the plan's model, to select those to align by."""
        if self.models.choose_faces():
            self.items.choose(plan_items.ALIGNMENT)

    def remove(self) -> None:
        """Remove the selected item; if others need it, it stays and they are named."""
        self._change(plan_checks.without(self.draft.plan, self.items.chosen()))

    def undo(self) -> None:
        if not self.draft.undo():
            self.told.emit(tr("Nothing to undo."))
        self._refresh(self.items.chosen())

    def redo(self) -> None:
        if not self.draft.redo():
            self.told.emit(tr("Nothing to redo."))
        self._refresh(self.items.chosen())

    def teach(self) -> None:
        """Teach the nominals of all measured features from the part of the running job."""
        self._teaching.toggle(self._job_path(), self.draft.plan)

    def ask_import(self) -> None:
        """Ask for a file to import, or cancel the current reading."""
        if not self.models.importing.give_up():
            self.source.ask(self._folder())
            if missing := what_is_missing():
                self.told.emit(missing)

    def import_file(self, path: Path) -> None:
        """Add the features of a table or a model, or use the frame of a document."""
        relocate = self.forms[plan_items.ALIGNMENT.group].choice() == "relocation"
        self.models.read(path, relocate=relocate)
        self.items.setFocus()

    def _show_editor(self) -> None:
        self._editor.show()
        self.items.setFocus()

    def attach_picture(self, path: Path) -> None:
        """Attach a picture to the selected feature; it is copied next to the plan."""
        plan, key = self.draft.plan, self.items.chosen()

        if self._did(lambda: plan_checks.with_picture_of(plan, self.draft.path, key, path), key):
            self.items.setFocus()

    def save(self) -> None:
        """Ask for the file, proposing the current one."""
        path = self.draft.path
        if path is None or is_shipped(path):
            # Shipped files are never overwritten.
            path = Path.home() / f"{file_stem(self.draft.plan.name)}.toml"
        self.file.ask(path)

    def save_as(self, path: Path) -> None:
        """Write the plan with its pictures, read it back and compare."""
        if self.attempt(lambda: self.draft.save(path)) is not None:
            self.saved.emit(path)
            self.items.setFocus()
        self._refresh(self.items.chosen())

    def open_file(self, path: Path) -> None:
        self._change_to(lambda: load_plan(path), path)

    def ask_requirements(self) -> None:
        path, stem = self.draft.path, file_stem(self.draft.plan.name)
        own = Path.home() if path is None or is_shipped(path) else path.parent
        self.listing.ask(own / f"{stem}_requirements.xlsx")

    def write_requirements(self, path: Path) -> None:
        """Write the requirements of the plan with their account."""
        plan = self.draft.plan
        if self.attempt(lambda: write_account(plan, path)) is not None:
            self.told.emit(tr("Requirements written to {path}.").format(path=path))
            self.items.setFocus()

    def measure(self) -> None:
        if self.draft.path is None or not self.draft.is_saved:
            self.told.emit(tr("Save the plan first (F8): a job starts from its file."))
        else:
            self.measure_wanted.emit(self.draft.path)

    def close_work(self) -> None:
        self._teaching.cancel()
        self.models.importing.close_work(_END_S)

    def form(self) -> ItemForm:
        return self.forms[self.items.chosen().group]

    def _folder(self) -> Path:
        return self.draft.folder or Path.home()

    def _change_to(self, give: Callable[[], Plan], path: Path | None) -> None:
        if not self.draft.is_saved:
            self.told.emit(tr("This plan has unsaved changes: save it (F8) or undo them."))
            return
        plan = self.attempt(give)
        if plan is not None:
            self._show_other(plan, path)
            self.items.setFocus()

    def _show_other(self, plan: Plan, path: Path | None) -> None:
        self.draft = PlanDraft(plan, path)
        self._refresh(plan_items.HEAD)

    def _show_item(self) -> None:
        form = self.form()
        self._stack.setCurrentWidget(form)
        form.show_item(plan_items.item_of(self.draft.plan, self.items.chosen()))
        self._show_picture()
        self._check()

    def _show_picture(self) -> None:
        plan, key = self.draft.plan, self.items.chosen()
        drawn = plan_items.drawn_of(plan, key)
        self.picture.setVisible(drawn is not None)
        self.picture.show_step(drawn, self.draft.folder)

    def _apply(self) -> None:
        """Apply the form to the plan, or show why not."""
        try:
            made = plan_checks.with_item(self.draft.plan, self.items.chosen(), self.form().item())
            changed = made.make()
        except OcmmError as error:
            self._say_fault(error)
            return
        if self.draft.did(changed):
            self._refresh(made.chosen)
        else:
            self._check()

    def _add(self, made: plan_checks.PlanChange | None, why_not: str = "") -> None:
        if made is None:
            self.told.emit(why_not)
        elif self._did(made.make, made.chosen):
            self.form().focus_first()

    def _change(self, made: plan_checks.PlanChange | None) -> None:
        if made is not None:
            self._did(made.make, made.chosen)

    def _did(self, change: Callable[[], Plan], chosen: plan_items.ItemKey) -> bool:
        changed = self.attempt(change)
        if changed is None:
            return False
        self.draft.did(changed)
        self._refresh(chosen)
        return True

    def _refresh(self, chosen: plan_items.ItemKey) -> None:
        self.items.show_plan(self.draft.plan, chosen)
        self.show_message(self.draft.status)
        self._show_item()

    def _check(self) -> None:
        try:
            check_plan(EDITED, self.draft.plan)
        except OcmmError as error:
            self._say_fault(error)
        else:
            self.form().mark("")
            self.checks.show_good(self.draft)

    def _say_fault(self, fault: OcmmError) -> None:
        self.form().mark(faulty_field(fault, self.draft.plan, self.items.chosen()))
        self.checks.show_fault(fault)

    def _on_taught(self, found: object) -> None:
        if isinstance(found, Plan):
            changed = self.draft.did(found)
            self._refresh(self.items.chosen())
            what = tr("The nominals now match the part.") if changed else tr("Nothing has changed.")
            self.told.emit(tr("{what} F10 undoes this.").format(what=what))
