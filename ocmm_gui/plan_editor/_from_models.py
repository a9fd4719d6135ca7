"""Import from models and tables: read, show, select, confirm, accept, in the editor's place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QHeaderView, QVBoxLayout, QWidget

from ocmm_cad.drawing import Account
from ocmm_cad.profiles import USUAL_BALL_RADIUS, with_model_fit
from ocmm_cad.step import Offer
from ocmm_core.alignment import ModelBestFit
from ocmm_core.errors import InputError
from ocmm_core.inspection.plan import FeatureTable, PartOfPlan, Plan
from ocmm_core.part_model import ModelFace, PartModel
from ocmm_core.tables import TableOptions, TablePreview
from ocmm_gui import kit
from ocmm_gui.kit import later, tr
from ocmm_gui.plan_editor._importing import ImportLine, ImportResult, InUse, LoadedModel, with_table
from ocmm_gui.plan_editor._part_choice import ChoiceLine, ChoiceWords, ModelChoice, PartChoice
from ocmm_gui.plan_editor._plan_checks import PlanDraft
from ocmm_gui.plan_editor._plan_items import ALIGNMENT, ItemKey

_STATUS = {"taken": later("✔ taken"), "partly": later("▲ in part"), "refused": later("✖ refused")}
_COLOURS = {"refused": "bad", "partly": "warn", "taken": "good"}
"""By status, in the order shown."""
_GROUPS = {
    "dimension": later("dimensions"),
    "tolerance": later("tolerances"),
    "datum reference": later("datum references"),
    "datum": later("datums"),
    "datum target": later("datum targets"),
    "annotation": later("labels and notes"),
    "general": later("others"),
}


class ToleranceAccount(QWidget):
    """Number of imported items, and each with its reason: refused ones first.

    Datum references and labels are counted; they follow their items. Return accepts features and
    tolerances, Esc nothing; a button the features alone.
    """

    agreed = Signal()
    """Accept the features with the imported tolerances."""
    without = Signal()
    """Accept the features alone."""
    declined = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Tolerances of the model"))
        self.summary = kit.sentence_label(tr("What became of the tolerances of the model"), 14)
        self.table = kit.DataTable(
            tr("Every item of the model"),
            (
                (tr("Status"), tr("Whether it is in the plan")),
                (tr("Label"), tr("Its name in the model")),
                (tr("Says"), tr("What the model says")),
                (tr("In the plan, or why not"), tr("Characteristics, datums, or the reason")),
            ),
        )
        self.table.setWordWrap(True)
        self.table.horizontalHeader().setSectionResizeMode(3, QHeaderView.ResizeMode.Stretch)
        for column, width in enumerate((110, 230, 300)):
            self.table.setColumnWidth(column, width)
        self.question = kit.AnswerPanel(tr("Take over the tolerances"), tr("Take over"))
        self.question.agreed.connect(self.agreed)
        self.question.declined.connect(self.declined)
        self.features_only = kit.NarrowButton(tr("Features only"))
        self.features_only.setAccessibleName(tr("Take over the features without tolerances"))
        self.features_only.clicked.connect(self.without)
        line = kit.hbox((self.question, 1), self.features_only)
        kit.vbox(self.summary, (self.table, 1), line, parent=self, margins=0)
        self.hide()

    def show_account(self, account: Account, characteristics: int) -> None:
        """Show an account, and ask whether to add its characteristics, given their number."""
        told = []
        for group, counts in account.counts().items():
            told.append(
                tr("{taken} of {count} {group}").format(
                    taken=counts["taken"], count=sum(counts.values()), group=tr(_GROUPS[group])
                )
            )
        taken = tr("Taken as a whole: {counts}.").format(counts=", ".join(told))
        self.summary.setText("\n".join((taken, *account.remarks)))
        order = list(_COLOURS)
        items = sorted(account.by_itself(), key=lambda item: order.index(item.status))
        self.table.setRowCount(len(items))
        for row, item in enumerate(items):
            became = ", ".join(item.became)
            words = "; ".join(
                part for part in (became, kit.said(item.why), kit.said(item.remark)) if part
            )
            cells = (tr(_STATUS[item.status]), item.name, item.kind, words)
            self.table.show_words(row, cells, {0: _COLOURS[item.status]})
        self.show()
        self.table.resizeRowsToContents()
        self.question.ask(
            tr(
                "%n characteristics will be added.",
                "1 characteristic will be added.",
                characteristics,
            )
        )

    def close_account(self) -> None:
        self.question.hide()
        self.hide()


class FaceChoice(PartChoice):
    """All faces with an exact surface; emits the selected `ModelFace`s, a tuple."""

    def __init__(self) -> None:
        self._faces: tuple[ModelFace, ...] = ()
        super().__init__(
            ChoiceWords(
                choice=tr("Faces to align by"),
                list=tr("Faces of the model"),
                take=tr("Align by these  [Return]"),
                take_long=tr("Align the part by a best fit to the chosen faces"),
                back_long=tr("Go back without faces"),
                about=tr("The selected face"),
            )
        )

    def show_faces(self, part: PartModel, plan: Plan) -> None:
        """Show the faces of a part; those of the plan's alignment are selected."""
        rule = plan.alignment
        before = {one.number for one in rule.faces} if isinstance(rule, ModelBestFit) else set()
        exact = [(place, face) for place, face in enumerate(part.faces) if face.spline is not None]
        self._faces = tuple(face for _, face in exact)
        self.show_lines(
            part,
            [
                ChoiceLine(face_words(face), (place,), face.number in before)
                for place, face in exact
            ],
        )

    def chosen(self) -> tuple[ModelFace, ...]:
        return tuple(self._faces[row] for row in self.chosen_rows())

    def said(self) -> str:
        """Return the number of selected faces, or the instruction."""
        if not self._faces:
            return tr("The model has no face with an exact surface.")
        count = len(self.chosen_rows())
        if not count:
            return tr("Choose faces that leave no motion of the part open.")
        words = tr("%n of {all} faces are chosen.", "1 of {all} faces is chosen.", count)
        return words.format(all=len(self._faces))

    def about(self, row: int) -> str:
        """Return the whole line: the list may cut it."""
        return face_words(self._faces[row])


def face_words(face: ModelFace) -> str:
    """Return a line: name in model or import, number, kind."""
    number = tr("face {number}").format(number=face.number)
    named = face.name or face.feature
    kind = {
        "Plane": tr("Plane"), "Cylinder": tr("Cylinder"), "Cone": tr("Cone"),
        "Sphere": tr("Sphere"), "Torus": tr("Torus"),
    }.get(face.kind, tr("Free form"))  # fmt: skip
    return f"{named}   {number}   {kind}" if named else f"{number}   {kind}"


Did = Callable[[Callable[[], Plan], ItemKey], bool]
"""Makes a change of the plan; returns whether it succeeded."""


class ModelImport(QObject):
    """Importing; `draft` returns the edited plan, `in_use` the cameras and the probe."""

    opened = Signal()
    """A selection starts: the editor makes room."""
    closed = Signal()
    """The editor comes back."""
    told = Signal(str)
    warned = Signal(str)
    """As `told`, but not as good news."""
    failed = Signal(object)

    def __init__(
        self, draft: Callable[[], PlanDraft], did: Did, in_use: Callable[[], InUse] | None
    ) -> None:
        super().__init__()
        self._draft, self._did, self._in_use = draft, did, in_use
        self._read: LoadedModel | None = None
        self._asked: ImportResult | None = None
        self.importing = ImportLine(in_use)
        self.importing.imported.connect(self._on_imported)
        self.importing.offered.connect(self._on_offered)
        self.importing.part_read.connect(self._on_part)
        self.importing.failed.connect(self.failed)
        self.choice = ModelChoice()
        self.choice.taken.connect(self._take_offers)
        self.choice.declined.connect(self.close)
        self.choice.up_changed.connect(self._read_again)
        self.faces = FaceChoice()
        self.faces.taken.connect(self._take_faces)
        self.faces.declined.connect(self.close)
        self.table = kit.TableImport("name,shape,x,y,z,-")
        self.table.changed.connect(self._read_table)
        self.table.taken.connect(self._take_table)
        self.table.declined.connect(self.close)
        self.importing.previewed.connect(self._on_previewed)
        self.tolerances = ToleranceAccount()
        self.tolerances.agreed.connect(lambda: self._answer_tolerances("all"))
        self.tolerances.without.connect(lambda: self._answer_tolerances("features"))
        self.tolerances.declined.connect(lambda: self._answer_tolerances("nothing"))

    def add_to(self, body: QVBoxLayout) -> None:
        for widget in (self.choice, self.faces, self.table, self.tolerances):
            body.addWidget(widget, 1)
        body.addWidget(self.importing)

    def read(self, path: Path, *, relocate: bool) -> None:
        self.table.open_table(path)
        self.importing.read(self._draft().plan, path, relocate=relocate)

    def choose_faces(self) -> bool:
        """Read the part of the plan, to align it by its faces; report if it has none."""
        draft = self._draft()
        if draft.plan.model is None or draft.folder is None:
            self.told.emit(tr("No CAD model in this plan. Save it (F8), import one (Shift+F9)."))
            return False
        self.importing.read_part(draft.plan, draft.folder)
        return True

    def close(self) -> None:
        self._read = None
        self.choice.hide()
        self.faces.hide()
        self.table.hide()
        self.closed.emit()

    def _read_table(self, path: Path, options: TableOptions) -> None:
        self.importing.read(self._draft().plan, path, relocate=False, options=options)

    def _on_previewed(self, found: TablePreview[FeatureTable]) -> None:
        """Show a table in the place of the editor for confirmation."""
        self.opened.emit()
        self.table.show_preview(found)

    def _take_table(self, table: FeatureTable) -> None:
        try:
            found = with_table(self._draft().plan, table)
        except InputError as error:
            self.failed.emit(error)
            return
        self.close()
        self._on_imported(found)

    def _on_part(self, found: PartOfPlan) -> None:
        if found.model is None:
            if found.doubt is not None:
                self.failed.emit(found.doubt)
            return
        self.opened.emit()
        self.faces.show_faces(found.model, self._draft().plan)

    def _take_faces(self, faces: tuple[ModelFace, ...]) -> None:
        """Align by the selected faces; on failure the selection stays."""
        plan = self._draft().plan
        radius = USUAL_BALL_RADIUS if self._in_use is None else self._in_use()[1].tip_radius
        before = len(plan.features)
        if self._did(lambda: with_model_fit(plan, faces, ball_radius=radius), ALIGNMENT):
            self.close()
            count = len(self._draft().plan.features) - before
            words = tr(
                "Aligned by %n faces; {count} points added. F10 undoes this.",
                "Aligned by 1 face; {count} points added. F10 undoes this.",
                len(faces),
            )
            self.told.emit(words.format(count=count))

    def _on_offered(self, read: LoadedModel) -> None:
        self._read = read
        self.opened.emit()
        self.choice.show_model(read)
        if read.model.remark:
            self.told.emit(kit.said(read.model.remark))

    def _read_again(self, up: str) -> None:
        if self._read is not None:
            self.importing.read(self._draft().plan, self._read.path, relocate=False, up=up)

    def _take_offers(self, taken: tuple[Offer, ...]) -> None:
        if self._read is not None:
            draft = self._draft()
            self.importing.import_selection(
                draft.plan, self._read, taken, draft.path, self.choice.zone_mm()
            )
            self.close()

    def _on_imported(self, found: ImportResult) -> None:
        if found.before is not self._draft().plan:
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
            # Omissions are no good news, and remain displayed.
            (self.warned if found.is_doubtful else self.told).emit(found.words)
            self.closed.emit()

    def _ask_tolerances(self, found: ImportResult, account: Account) -> None:
        self._asked = found
        count = len(found.plan.characteristics) - len(found.before.characteristics)
        self.opened.emit()
        self.tolerances.show_account(account, count)

    def _answer_tolerances(self, answer: Literal["all", "features", "nothing"]) -> None:
        found, self._asked = self._asked, None
        self.tolerances.close_account()
        self.closed.emit()
        if found is None or answer == "nothing":
            self.told.emit(tr("Nothing was imported."))
            return
        bare = found.without_tolerances()
        self._on_imported(bare if answer == "features" else replace(found, account=None))
