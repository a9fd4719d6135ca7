"""The plan editor: a list of what is in the plan, a form, and what is wrong with it in words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QStackedWidget, QVBoxLayout, QWidget

from ocmm_core.alignment import Alignment
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.features.measured import Construction
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.inspection.drawing import Account
from ocmm_core.inspection.plan import (
    EDITED,
    HEAD_FIELDS,
    USUAL_BALL_RADIUS,
    PartOfPlan,
    Plan,
    add_characteristic,
    add_construction,
    add_feature,
    check_plan,
    load_plan,
    move_item,
    remove_item,
    replace_item,
    with_alignment,
    with_head,
    with_model_fit,
    with_picture,
)
from ocmm_core.inspection.step import Offer
from ocmm_core.part_model import ModelFace
from ocmm_core.settings import is_shipped
from ocmm_core.tolerances.zones import Characteristic
from ocmm_gui.kit import ActionInfo, PathPanel, Sheet, later, panel, tr
from ocmm_gui.plan_editor._draft import PlanDraft
from ocmm_gui.plan_editor._drawn import drawn_of
from ocmm_gui.plan_editor._face_choice import FaceChoice
from ocmm_gui.plan_editor._importing import (
    Imported,
    Importing,
    InUse,
    ReadModel,
    what_is_missing,
)
from ocmm_gui.plan_editor._item_form import ItemForm
from ocmm_gui.plan_editor._model_choice import ModelChoice
from ocmm_gui.plan_editor._plan_checks import PlanChecks, faulty_field
from ocmm_gui.plan_editor._plan_items import (
    ALIGNMENT,
    HEAD,
    LISTS,
    ItemKey,
    PlanItems,
    item_of,
    place_of,
)
from ocmm_gui.plan_editor._proposals import (
    fresh_plan,
    new_characteristic,
    new_construction,
    new_feature,
)
from ocmm_gui.plan_editor._teaching import Teaching
from ocmm_gui.plan_editor._tolerance_account import ToleranceAccount
from ocmm_gui.views import StepPicture, read_picture

_END_S = 1.0
"""So long at most the window waits for a file that is still being read."""
_KEYS = (
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
    ActionInfo("import", later("Import"),
    later("Import features from CSV or STEP, or a frame document for "
                                   "the alignment"), ("Shift+F9",)),
    ActionInfo("new", later("New"), later("Start a new plan"), ("Ctrl+F10",)),
    ActionInfo("open", later("Open"), later("Open another plan file"), ("Ctrl+F8",)),
    ActionInfo("save", later("Save"), later("Write the plan to a file"), ("F8",)),
    ActionInfo("measure", later("Measure"), later("Start a job with this plan"), ("Shift+F8",)),
)  # fmt: skip


class PlanSheet(Sheet):
    """List on the left, form in the middle, picture and checks on the right.

    Parameters
    ----------
    plan, path
        The plan that is measured, and its file where that is known.
    job_path
        Gives the file of the running job, whose part can be the master.
    in_use
        Gives the cameras and the probe that models are imported for.
    """

    saved = Signal(object)
    """Emits the `Path` that the plan was written to."""
    measure_wanted = Signal(object)
    """Emits the `Path` of a plan that a job is to be begun by."""

    def __init__(
        self,
        plan: Plan,
        path: Path | None,
        job_path: Callable[[], Path],
        in_use: Callable[[], InUse] | None = None,
    ) -> None:
        super().__init__(tr("Plan"), _KEYS)
        self._job_path = job_path
        self.draft = PlanDraft(plan, path)
        self.items = PlanItems()
        left_out = tuple(name for name in Plan.__struct_fields__ if name not in HEAD_FIELDS)
        self.forms = {
            HEAD.group: ItemForm(tr("Plan settings"), Plan, left_out),
            ALIGNMENT.group: ItemForm(tr("Alignment"), Alignment | None),
            "features": ItemForm(tr("Feature"), NominalFeature),
            "constructions": ItemForm(tr("Construction"), Construction),
            "characteristics": ItemForm(tr("Characteristic"), Characteristic),
        }
        self._editor = QWidget()
        self._stack = QStackedWidget()
        for form in self.forms.values():
            self._stack.addWidget(form)
            form.edited.connect(self._take)
            form.left.connect(self.left)
        self.picture = StepPicture()
        self.checks = PlanChecks()
        self._teaching = Teaching()
        self._teaching.taught.connect(self._on_taught)
        self._teaching.failed.connect(self.failed)
        self.file = PathPanel(
            tr("Write the plan into the file"), tr("File of the plan"), tr("Write")
        )
        self.source = PathPanel(
            tr("Import the features or frame from the file"),
            tr("File of the features or frame"),
            tr("Import"),
        )
        self.image = PathPanel(
            tr("Attach the picture from the file"), tr("File of the picture"), tr("Attach")
        )
        self.other = PathPanel(
            tr("Open the plan from the file"), tr("File of the plan"), tr("Open")
        )
        self.file.given.connect(self.save_as)
        self.source.given.connect(self.import_file)
        self.importing = Importing(in_use)
        self.importing.imported.connect(self._on_imported)
        self.importing.offered.connect(self._on_offered)
        self.importing.failed.connect(self.failed)
        self.choice = ModelChoice()
        self.choice.taken.connect(self._take_offers)
        self.choice.declined.connect(self._show_editor)
        self.choice.up_changed.connect(self._read_again)
        self._read: ReadModel | None = None
        self.faces = FaceChoice()
        self.faces.taken.connect(self._take_faces)
        self.faces.declined.connect(self._show_editor)
        self.importing.part_read.connect(self._on_part)
        self._in_use = in_use
        self.tolerances = ToleranceAccount()
        self._asked: Imported | None = None
        self.tolerances.agreed.connect(lambda: self._answer_tolerances("all"))
        self.tolerances.without.connect(lambda: self._answer_tolerances("features"))
        self.tolerances.declined.connect(lambda: self._answer_tolerances("nothing"))
        self.image.given.connect(self.attach_picture)
        self.other.given.connect(self.open_file)
        self._lay_out()
        self.items.item_chosen.connect(lambda _key: self._show_item())
        self.use_keys(
            {
                "add": self.add_feature,
                "construct": self.add_construction,
                "tolerance": self.add_characteristic,
                "align": self.align,
                "faces": self.choose_faces,
                "remove": self.remove,
                "earlier": lambda: self._move(-1),
                "later": lambda: self._move(1),
                "undo": self.undo,
                "redo": self.redo,
                "picture": lambda: self.image.ask(self._folder()),
                "teach": self.teach,
                "import": self.ask_import,
                "new": lambda: self._change_to(fresh_plan, None),
                "open": lambda: self.other.ask(self._folder()),
                "save": self.save,
                "measure": self.measure,
            },
            primary="save",
        )
        self._refresh(HEAD)

    def open(self) -> None:
        """Go on writing where it was left."""
        self._show_editor()
        self._refresh(self.items.chosen())
        self.items.setFocus()

    def use_plan(self, plan: Plan, path: Path | None) -> None:
        """Show the plan that is measured now, unless another one has changes that are not saved."""
        if self.draft.is_saved:
            self._show_other(plan, path)

    def add_feature(self) -> None:
        """Add a feature like the chosen one, under a name of its own."""
        plan, chosen = self.draft.plan, self.items.chosen()
        feature = new_feature(plan, chosen)
        place = self._place_after("features")
        self._add(lambda: add_feature(plan, feature, place), ItemKey("features", feature.name))

    def add_construction(self) -> None:
        """Add a construction from the chosen feature, or one like the chosen construction."""
        plan = self.draft.plan
        item = new_construction(plan, self.items.chosen())
        place = self._place_after("constructions")
        if item is None:
            self.told.emit(tr("Add the features to construct from first."))
        else:
            key = ItemKey("constructions", item.name)
            self._add(lambda: add_construction(plan, item, place), key)

    def add_characteristic(self) -> None:
        """Add a characteristic of the chosen feature."""
        plan = self.draft.plan
        item = new_characteristic(plan, self.items.chosen())
        if item is None:
            self.told.emit(tr("Select the feature to tolerance first."))
        else:
            key = ItemKey("characteristics", item.name)
            self._add(lambda: add_characteristic(plan, item), key)

    def align(self) -> None:
        """Show the alignment with the keyboard in its form."""
        self.items.choose(ALIGNMENT)
        self.form().focus_first()

    def choose_faces(self) -> None:
        """Show the faces of the plan's model, to align the part by those that are chosen."""
        plan = self.draft.plan
        if plan.model is None or self.draft.folder is None:
            self.told.emit(tr("No CAD model in this plan. Save it (F8), import one (Shift+F9)."))
        else:
            self.items.choose(ALIGNMENT)
            self.importing.read_part(plan, self.draft.folder)

    def _on_part(self, found: PartOfPlan) -> None:
        if found.model is None:
            if found.doubt is not None:
                self.failed.emit(found.doubt)
            return
        self._editor.hide()
        self.faces.show_faces(found.model, self.draft.plan)

    def _take_faces(self, faces: tuple[ModelFace, ...]) -> None:
        """Align by the chosen faces; what cannot be done is said, and the choice stays."""
        plan = self.draft.plan
        radius = USUAL_BALL_RADIUS if self._in_use is None else self._in_use()[1].tip_radius
        before = len(plan.features)
        if self._did(lambda: with_model_fit(plan, faces, ball_radius=radius), ALIGNMENT):
            self._show_editor()
            count = len(self.draft.plan.features) - before
            self.told.emit(
                tr("Aligned by {faces} faces; {count} points added. F10 undoes this.").format(
                    faces=len(faces), count=count
                )
            )

    def remove(self) -> None:
        """Remove the chosen item; one that others need stays, and they are named."""
        plan, key = self.draft.plan, self.items.chosen()
        if key == ALIGNMENT:
            self._did(lambda: with_alignment(plan, None), key)
        elif key.group in LISTS:
            self._did(lambda: remove_item(plan, key.name, key.group), HEAD)

    def undo(self) -> None:
        """Take the last change back."""
        if not self.draft.undo():
            self.told.emit(tr("Nothing to undo."))
        self._refresh(self.items.chosen())

    def redo(self) -> None:
        """Do again what was taken back."""
        if not self.draft.redo():
            self.told.emit(tr("Nothing to redo."))
        self._refresh(self.items.chosen())

    def teach(self) -> None:
        """Take the nominals of all measured features from the part of the running job."""
        self._teaching.toggle(self._job_path(), self.draft.plan)

    def ask_import(self) -> None:
        """Ask for a file to import, or give up the one that is being read."""
        if not self.importing.give_up():
            self.source.ask(self._folder())
            if missing := what_is_missing():
                self.told.emit(missing)

    def import_file(self, path: Path) -> None:
        """Add the features of a table or of a model, or take the frame of a document."""
        relocate = self.forms[ALIGNMENT.group].choice() == "relocation"
        self.importing.read(self.draft.plan, path, relocate=relocate)
        self.items.setFocus()

    def _on_offered(self, read: ReadModel) -> None:
        """Show what a model offers in the place of the editor."""
        self._read = read
        self._editor.hide()
        self.choice.show_model(read.model.part, read.offers, read.up)
        if read.model.remark:
            self.told.emit(read.model.remark)

    def _read_again(self, up: str) -> None:
        if self._read is not None:
            self.importing.read(self.draft.plan, self._read.path, relocate=False, up=up)

    def _take_offers(self, taken: tuple[Offer, ...]) -> None:
        if self._read is not None:
            self.importing.take(
                self.draft.plan, self._read, taken, self.draft.path, self.choice.zone_mm()
            )
            self._show_editor()

    def _show_editor(self) -> None:
        self._read = None
        self.choice.hide()
        self.faces.hide()
        self._editor.show()
        self.items.setFocus()

    def _on_imported(self, found: Imported) -> None:
        if found.before is not self.draft.plan:
            self.failed.emit(
                InputError(
                    "plan.changed",
                    "The plan was changed while the file was read.",
                    "Import the file again.",
                )
            )
        elif found.account is not None:
            self._ask_tolerances(found, found.account)
        elif self._did(lambda: found.plan, found.chosen):
            self.told.emit(found.words)
            self.items.setFocus()

    def _ask_tolerances(self, found: Imported, account: Account) -> None:
        """Show what became of the tolerances of a model before they are taken over."""
        self._asked = found
        count = len(found.plan.characteristics) - len(found.before.characteristics)
        self._editor.hide()
        self.tolerances.show_account(account, count)

    def _answer_tolerances(self, answer: Literal["all", "features", "nothing"]) -> None:
        found, self._asked = self._asked, None
        self.tolerances.close_account()
        self._editor.show()
        self.items.setFocus()
        if found is None or answer == "nothing":
            self.told.emit(tr("Nothing was imported."))
            return
        bare = found.without_tolerances()
        self._on_imported(bare if answer == "features" else replace(found, account=None))

    def attach_picture(self, path: Path) -> None:
        """Attach a picture to the step of the chosen feature; it is copied beside the plan."""
        plan, key = self.draft.plan, self.items.chosen()

        def changed() -> Plan:
            name = key.name if key.group == "features" else ""
            if path.is_file() and read_picture(path) is None:
                raise InputError(
                    "plan.no_picture",
                    f"{path}: not a readable picture.",
                    "Choose a PNG or JPEG file.",
                )
            return with_picture(plan, self.draft.path, name, path)

        if self._did(changed, key):
            self.items.setFocus()

    def save(self) -> None:
        """Ask for the file; the one of this plan is proposed."""
        path = self.draft.path
        if path is None or is_shipped(path):
            # What is shipped with the program stays as it is.
            path = Path.home() / f"{self.draft.plan.name}.toml"
        self.file.ask(path)

    def save_as(self, path: Path) -> None:
        """Write the plan, read it back and compare; its pictures go with it."""
        if self.attempt(lambda: self.draft.save(path)) is not None:
            self.saved.emit(path)
            self.items.setFocus()
        self._refresh(self.items.chosen())

    def open_file(self, path: Path) -> None:
        """Change the plan of another file from now on."""
        self._change_to(lambda: load_plan(path), path)

    def measure(self) -> None:
        """Ask for a job by this plan."""
        if self.draft.path is None or not self.draft.is_saved:
            self.told.emit(tr("Save the plan first (F8): a job starts from its file."))
        else:
            self.measure_wanted.emit(self.draft.path)

    def close_work(self) -> None:
        """Give up what is calculated; call it before the window goes."""
        self._teaching.cancel()
        self.importing.close_work(_END_S)

    def form(self) -> ItemForm:
        """Return the form of the chosen item."""
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
        self._refresh(HEAD)

    def _show_item(self) -> None:
        form = self.form()
        self._stack.setCurrentWidget(form)
        form.show_item(item_of(self.draft.plan, self.items.chosen()))
        self._show_picture()
        self._check()

    def _show_picture(self) -> None:
        plan, key = self.draft.plan, self.items.chosen()
        drawn = drawn_of(plan, key)
        self.picture.setVisible(drawn is not None)
        self.picture.show_step(drawn, self.draft.folder)

    def _take(self) -> None:
        """Take what is filled in over into the plan, or say why not."""
        plan, key = self.draft.plan, self.items.chosen()
        try:
            item = self.form().item()
            if key == HEAD:
                changed = with_head(plan, item)
            elif key == ALIGNMENT:
                changed = with_alignment(plan, item)
            else:
                changed = replace_item(plan, key.name, item)
                key = ItemKey(key.group, item.name)
        except OcmmError as error:
            self._say_fault(error)
            return
        if self.draft.did(changed):
            self._refresh(key)
        else:
            self._check()

    def _add(self, change: Callable[[], Plan], key: ItemKey) -> None:
        if self._did(change, key):
            self.form().focus_first()

    def _did(self, change: Callable[[], Plan], chosen: ItemKey) -> bool:
        """Make a change of the plan and say whether it could be made."""
        changed = self.attempt(change)
        if changed is None:
            return False
        self.draft.did(changed)
        self._refresh(chosen)
        return True

    def _place_after(self, group: str) -> int | None:
        """Return the place after the chosen item of a list; None for its end."""
        key = self.items.chosen()
        return place_of(self.draft.plan, key) + 1 if key.group == group else None

    def _move(self, way: int) -> None:
        plan, key = self.draft.plan, self.items.chosen()
        if key.group in LISTS and (place := place_of(plan, key) + way) >= 0:
            self._did(lambda: move_item(plan, key.name, place, key.group), key)

    def _refresh(self, chosen: ItemKey) -> None:
        self.items.show_plan(self.draft.plan, chosen)
        self.say(self.draft.words)
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

    def _lay_out(self) -> None:
        for line in (self.file, self.source, self.image, self.other):
            self.body.addWidget(line)
        middle, right = QVBoxLayout(), QVBoxLayout()
        middle.addWidget(self._stack)
        right.addWidget(self.picture, 3)
        right.addWidget(self.checks, 2)
        right.addWidget(self._teaching)
        row = QHBoxLayout(self._editor)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(10)
        row.addWidget(self.items, 32)
        row.addWidget(panel(middle), 40)
        row.addWidget(panel(right), 28)
        self.body.addWidget(self._editor, 1)
        self.body.addWidget(self.choice, 1)
        self.body.addWidget(self.faces, 1)
        self.body.addWidget(self.tolerances, 1)
        self.body.addWidget(self.importing)
