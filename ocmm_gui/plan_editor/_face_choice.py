"""Faces of the model that a part is aligned by: chosen on the part or in the list, by name."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QListWidgetItem,
    QVBoxLayout,
)

from ocmm_core.alignment import ModelBestFit
from ocmm_core.inspection.plan import Plan
from ocmm_core.part_model import ModelFace, PartModel
from ocmm_gui.kit import DEFAULT_THEME, THEMES, NarrowButton, PlainLabel, Theme, text_font, tr
from ocmm_gui.plan_editor._model_choice import ChoiceList
from ocmm_gui.views import PartPicture

_LIST_PX = 430


class FaceChoice(QFrame):
    """The part with the chosen faces in colour, and a list of all that have an exact surface.

    A click on a face chooses it or takes the choice back, as Space does in the list. Return takes
    the chosen ones over, Esc goes back without.
    """

    taken = Signal(object)
    """Emits the chosen `ModelFace`s, a tuple."""
    declined = Signal()
    """Nothing is taken."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Faces to align by"))
        self._theme = THEMES[DEFAULT_THEME]
        self._faces: tuple[ModelFace, ...] = ()
        self._places: tuple[int, ...] = ()
        self.picture = PartPicture()
        self.list = ChoiceList(tr("Faces of the model"))
        self._told = PlainLabel()
        self._told.setAccessibleName(tr("What is chosen"))
        self._told.setWordWrap(True)
        self._told.setFont(text_font(14))
        self._take = NarrowButton(tr("Align by these  [Return]"))
        self._back = NarrowButton(tr("Back  [Esc]"))
        self._take.setAccessibleName(tr("Align the part by a best fit to the chosen faces"))
        self._back.setAccessibleName(tr("Go back without faces"))
        self._take.setProperty("role", "primary")
        self._take.clicked.connect(self._emit_taken)
        self._back.clicked.connect(self.declined)
        self.list.taken.connect(self._emit_taken)
        self.list.declined.connect(self.declined)
        self.list.itemChanged.connect(lambda _item: self._show_choice())
        self.list.currentRowChanged.connect(lambda _row: self._show_choice())
        self.picture.face_clicked.connect(self._on_face)
        self._lay_out()
        self.hide()

    def show_faces(self, part: PartModel, plan: Plan) -> None:
        """Show the faces of a part; those that the plan is aligned by are chosen."""
        rule = plan.alignment
        before = {one.number for one in rule.faces} if isinstance(rule, ModelBestFit) else set()
        exact = [place for place, face in enumerate(part.faces) if face.spline is not None]
        self._places = tuple(exact)
        self._faces = tuple(part.faces[place] for place in exact)
        self.list.blockSignals(True)
        self.list.clear()
        for face in self._faces:
            item = QListWidgetItem(face_words(face), self.list)
            item.setFlags(item.flags() | Qt.ItemFlag.ItemIsUserCheckable)
            chosen = face.number in before
            item.setCheckState(Qt.CheckState.Checked if chosen else Qt.CheckState.Unchecked)
        self.list.setCurrentRow(0)
        self.list.blockSignals(False)
        self.picture.show_part(part)
        self._show_choice()
        self.show()
        self.list.setFocus()

    def chosen(self) -> tuple[ModelFace, ...]:
        """Return the chosen faces, in the order of the model."""
        return tuple(face for row, face in enumerate(self._faces) if self._is_chosen(row))

    def words(self) -> str:
        """Return what is said of the choice."""
        return self._told.text()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self.list.set_theme(theme)
        self._show_choice()

    def _is_chosen(self, row: int) -> bool:
        return self.list.item(row).checkState() is Qt.CheckState.Checked

    def _emit_taken(self) -> None:
        if chosen := self.chosen():
            self.taken.emit(chosen)

    def _on_face(self, place: int) -> None:
        """Choose a face, or take the choice back; the places count from 0."""
        if place not in self._places:
            return
        row = self._places.index(place)
        self.list.setCurrentRow(row)
        other = Qt.CheckState.Unchecked if self._is_chosen(row) else Qt.CheckState.Checked
        self.list.item(row).setCheckState(other)

    def _show_choice(self) -> None:
        if not self._faces:
            self._told.setText(tr("The model has no face with an exact surface."))
            self._take.setEnabled(False)
            return
        rows = [row for row in range(len(self._faces)) if self._is_chosen(row)]
        marked = {self._places[row]: self._theme.good for row in rows}
        marked[self._places[max(self.list.currentRow(), 0)]] = self._theme.accent
        self.picture.highlight(marked)
        self._take.setEnabled(bool(rows))
        words = tr("{count} of {all} faces are chosen.")
        if not rows:
            words = tr("Choose faces that leave no motion of the part open.")
        self._told.setText(words.format(count=len(rows), all=len(self._faces)))

    def _lay_out(self) -> None:
        keys = QHBoxLayout()
        keys.addWidget(self._take, 2)
        keys.addWidget(self._back, 1)
        side = QVBoxLayout()
        side.setSpacing(8)
        side.addWidget(self._told)
        side.addWidget(self.list, 1)
        side.addLayout(keys)
        row = QHBoxLayout(self)
        row.setSpacing(10)
        row.addWidget(self.picture, 1)
        row.addLayout(side)
        self.list.setFixedWidth(_LIST_PX)


def face_words(face: ModelFace) -> str:
    """Return a line: what the model or the import calls a face, its number, its kind."""
    number = tr("face {number}").format(number=face.number)
    named = face.name or face.feature
    kind = {
        "Plane": tr("Plane"), "Cylinder": tr("Cylinder"), "Cone": tr("Cone"),
        "Sphere": tr("Sphere"), "Torus": tr("Torus"),
    }.get(face.kind, tr("Free form"))  # fmt: skip
    return f"{named}   {number}   {kind}" if named else f"{number}   {kind}"
