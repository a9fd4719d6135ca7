"""Selection of a part's faces, by mouse or keyboard, as features."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QFrame, QListWidget, QListWidgetItem, QVBoxLayout, QWidget

from ocmm_cad.step import Offer
from ocmm_core.part_model import PartModel
from ocmm_core.typed_numbers import ZONE
from ocmm_gui import kit
from ocmm_gui.kit import tr
from ocmm_gui.plan_editor._importing import LoadedModel
from ocmm_gui.views import PartPicture

_TAKE = (Qt.Key.Key_Return, Qt.Key.Key_Enter)
_LIST_PX = 430


@dataclass(frozen=True, slots=True)
class ChoiceLine:
    """A selectable item."""

    words: str
    """Text in the list."""
    places: tuple[int, ...]
    """Its faces in the part, from 0."""
    is_chosen: bool = False
    tip: str = ""
    """More words, as a tool tip."""


@dataclass(frozen=True, slots=True)
class ChoiceWords:
    """Names of a selection, for display and screen readers."""

    choice: str
    list: str
    take: str
    take_long: str
    back_long: str
    about: str


class PartChoice(kit.Themed, QFrame):
    """Selection of a part's faces; subclasses define their meaning.

    A click on a face toggles its line, as Space does; Return accepts, Esc discards.
    """

    taken = Signal(object)
    """Emits the selection, a tuple."""
    declined = Signal()

    def __init__(self, words: ChoiceWords) -> None:
        super().__init__()
        self.setAccessibleName(words.choice)
        self._lines: tuple[ChoiceLine, ...] = ()
        self._row_of: dict[int, int] = {}
        self.picture = PartPicture()
        self.list = ChoiceList(words.list)
        self._told = kit.dressed(kit.PlainLabel(), tr("What is chosen"))
        self._about = kit.dressed(kit.PlainLabel(), words.about, high=44)
        for label in (self._told, self._about):
            kit.dressed(label, font=kit.text_font(14)).setWordWrap(True)
            label.setFixedWidth(_LIST_PX)
        self._take = kit.dressed(kit.NarrowButton(words.take), words.take_long, role="primary")
        self._back = kit.dressed(kit.NarrowButton(tr("Back  [Esc]")), words.back_long)
        self._take.clicked.connect(self._emit_taken)
        self._back.clicked.connect(self.declined)
        self.list.taken.connect(self._emit_taken)
        self.list.declined.connect(self.declined)
        self.list.itemChanged.connect(lambda _item: self.show_choice())
        self.list.currentRowChanged.connect(lambda _row: self.show_choice())
        self.picture.face_clicked.connect(self._on_face)
        self._more = QVBoxLayout()
        self._lay_out()
        self.hide()

    def show_lines(self, part: PartModel | None, lines: Sequence[ChoiceLine]) -> None:
        """Show a part and its selectable items, with the focus on the first line."""
        self._lines = tuple(lines)
        self._row_of = {place: row for row, line in enumerate(lines) for place in line.places}
        self.list.blockSignals(True)
        self.list.clear()
        for line in self._lines:
            item = QListWidgetItem(line.words, self.list)
            item.setFlags(item.flags() | Qt.ItemFlag.ItemIsUserCheckable)
            item.setCheckState(Qt.CheckState.Checked if line.is_chosen else Qt.CheckState.Unchecked)
            item.setToolTip(kit.literal(line.tip or line.words))
        self.list.setCurrentRow(0)
        self.list.blockSignals(False)
        self.picture.show_part(part)
        self.show_choice()
        self.show()
        self.list.setFocus()

    def add_row(self, *widgets: QWidget) -> None:
        """Add widgets under the list in a row; the last one is the widest."""
        self._more.addLayout(kit.hbox(*widgets[:-1], (widgets[-1], 1)))

    def chosen_rows(self) -> list[int]:
        """Return the selected lines, from 0."""
        return [row for row in range(len(self._lines)) if self._is_chosen(row)]

    def message(self) -> str:
        """Return the message about the selection."""
        return f"{self._told.text()} {self._about.text()}".strip()

    def _paint(self) -> None:
        self.show_choice()

    def show_choice(self) -> None:
        """Show the selection in colour and words; call it after changes."""
        marked: dict[int, str] = {}
        for row in self.chosen_rows():
            marked.update(dict.fromkeys(self._lines[row].places, self._theme.good))
        row = max(self.list.currentRow(), 0)
        if row < len(self._lines):
            marked.update(dict.fromkeys(self._lines[row].places, self._theme.accent))
        self.picture.highlight(marked)
        self._take.setEnabled(self.can_be_taken())
        self._told.setText(self.said())
        self._about.setText(self.about(row) if row < len(self._lines) else "")

    def chosen(self) -> tuple[object, ...]:
        """Return the selection, in the order of the list."""
        raise NotImplementedError

    def can_be_taken(self) -> bool:
        """Return whether the selection is sufficient."""
        return bool(self.chosen_rows())

    def said(self) -> str:
        """Return the size of the selection, and what is missing."""
        raise NotImplementedError

    def about(self, row: int) -> str:
        """Return the message about the current line."""
        raise NotImplementedError

    def _is_chosen(self, row: int) -> bool:
        return self.list.item(row).checkState() is Qt.CheckState.Checked

    def _emit_taken(self) -> None:
        if self.can_be_taken():
            self.taken.emit(self.chosen())

    def _on_face(self, place: int) -> None:
        """Toggle the line of a face, from 0."""
        row = self._row_of.get(place)
        if row is None:
            return
        self.list.setCurrentRow(row)
        other = Qt.CheckState.Unchecked if self._is_chosen(row) else Qt.CheckState.Checked
        self.list.item(row).setCheckState(other)

    def _lay_out(self) -> None:
        keys = kit.hbox((self._take, 2), (self._back, 1))
        side = kit.vbox(self._told, (self.list, 1), self._about, self._more, keys, spacing=8)
        kit.hbox((self.picture, 1), side, parent=self, spacing=10)
        self.list.setFixedWidth(_LIST_PX)


class ChoiceList(QListWidget):
    """A line for each surface; handles Return and Esc. `name`: accessible name."""

    taken = Signal()
    declined = Signal()

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setAccessibleDescription(tr("Space chooses, Return takes over, Esc goes back"))
        self.setUniformItemSizes(True)
        self.setSpacing(2)
        self.setFont(kit.text_font(14))
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)

    def set_theme(self, theme: kit.Theme) -> None:
        # The style's own empty box is invisible on a dark panel.
        self.setStyleSheet(
            f"QListView::indicator {{ width: 14px; height: 14px; border: 1px solid {theme.muted};"
            f" border-radius: 3px; }} QListView::indicator:checked {{ background: {theme.good};"
            f" border-color: {theme.good}; }}"
        )

    def event(self, event: QEvent) -> bool:
        """Handle Return and Esc before the sheet does."""
        return kit.keeps_keys(event, (*_TAKE, Qt.Key.Key_Escape)) or super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in _TAKE:
            self.taken.emit()
        elif event.key() == Qt.Key.Key_Escape:
            self.declined.emit()
        else:
            super().keyPressEvent(event)


UPS = ("+z", "-z", "+y", "-y", "+x", "-x")


class ModelChoice(PartChoice):
    """All surfaces offered by a model; emits the selected `Offer`s, a tuple."""

    up_changed = Signal(str)
    """Emits the upward axis of the model, which changes reachability."""

    def __init__(self) -> None:
        self._read: LoadedModel | None = None
        self._offers: tuple[Offer, ...] = ()
        words = tr("Profile of free forms, {unit}").format(unit=kit.unit_word())
        self.zone = kit.form_field(words, tr("Width of the zone"))
        super().__init__(
            ChoiceWords(
                choice=tr("Features of the model"),
                list=tr("Surfaces of the model"),
                take=tr("Take over  [Return]"),
                take_long=tr("Take the chosen surfaces over as features"),
                back_long=tr("Go back without features"),
                about=tr("Why the selected surface is not chosen"),
            )
        )
        self._zone_words = kit.caption(words, self.zone)
        self._up = kit.ChoiceBox(tr("Axis that points up"), tr("How the part stands"), UPS)
        self.add_row(self._zone_words, self.zone)
        self.add_row(kit.caption(tr("Up"), self._up), self._up)
        self.zone.textChanged.connect(lambda _text: self.show_choice())
        self._up.textActivated.connect(self.up_changed)

    def show_model(self, read: LoadedModel) -> None:
        """Show a part and its offers; surfaces without a reason against them are selected."""
        self._read, self._offers = read, read.offers
        self._up.setCurrentText(read.up)
        has_free = any(offer.free_form is not None for offer in self._offers)
        self.zone.setVisible(has_free)
        self._zone_words.setVisible(has_free)
        # The zone of a free form is known only from the drawing.
        self.show_lines(
            read.model.part,
            [
                ChoiceLine(
                    _text(offer), tuple(face - 1 for face in offer.faces),
                    not offer.against and offer.free_form is None, offer.against,
                )
                for offer in self._offers
            ],
        )  # fmt: skip

    def chosen(self) -> tuple[Offer, ...]:
        """Return the selection, in the order of the model."""
        return tuple(self._offers[row] for row in self.chosen_rows())

    def zone_mm(self) -> float | None:
        """Return the zone of free forms; None without any, or without a zone."""
        typed, unit = kit.split_unit(self.zone.text())
        found = kit.typed_value(typed)
        value = None if found is None else kit.to_mm(found, unit)
        has_free = any(offer.free_form is not None for offer in self.chosen())
        return value if has_free and value is not None and value in ZONE.quantity else None

    def can_be_taken(self) -> bool:
        """Return whether something is selected, with its zone if needed."""
        chosen = self.chosen()
        lacks_zone = self.zone_mm() is None and any(one.free_form is not None for one in chosen)
        return bool(chosen) and not lacks_zone

    def said(self) -> str:
        """Return the number of selected surfaces, and whether a zone is missing."""
        count = len(self.chosen_rows())
        words = tr("%n of {all} surfaces are chosen.", "1 of {all} surfaces is chosen.", count)
        words = words.format(all=len(self._offers))
        if count and not self.can_be_taken():
            missing = tr("Enter the profile of free forms.")
            words = f"{words} {missing}"
        return words if self._read is None else f"{words}\n{self._faces(self._read)}"

    def _faces(self, read: LoadedModel) -> str:
        """Return the number of imported faces, and reasons against the others."""
        account = read.account(self.chosen())
        listed = {offer.against for offer in self._offers}
        others = [
            f"{kit.said(why)} ({count})"
            for why, count in account.left_out
            if why in read.model.not_measured and why not in listed
        ]
        sentences = (kit.said(account.sentence()), kit.said(account.recognised_sentence()))
        return "\n".join((" ".join(filter(None, sentences)), *others))

    def about(self, row: int) -> str:
        """Return the reason against a surface, or that there is none."""
        offer = self._offers[row]
        name = offer.feature.name
        if offer.against:
            return tr("{name}: {why}.").format(name=name, why=offer.against)
        if offer.free_form is not None:
            return tr("{name}: points and their profile against the model.").format(name=name)
        return tr("{name} can be touched.").format(name=name)


def _text(offer: Offer) -> str:
    """Return a line: name, shape, size, and reason against it."""
    feature = offer.feature
    size = f"\N{LATIN CAPITAL LETTER O WITH STROKE} {kit.millimetres(feature.diameter)}"
    if not feature.diameter:
        size = " \N{MULTIPLICATION SIGN} ".join(
            kit.millimetres(side, decimals=1) for side in (feature.length, feature.width)
        )
    shape = kit.shape_word(feature.shape) if offer.free_form is None else tr("Free form")
    words = f"{feature.name}   {shape}   {size}"
    return f"{words}   \N{EN DASH} {offer.against}" if offer.against else words
