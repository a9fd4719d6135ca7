"""What a model offers, beside its picture: which surfaces become features is chosen here."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QListWidget,
    QListWidgetItem,
    QVBoxLayout,
)

from ocmm_core.inspection.plan import number
from ocmm_core.inspection.step import Offer
from ocmm_core.part_model import PartModel
from ocmm_gui.kit import (
    DEFAULT_THEME,
    THEMES,
    ChoiceBox,
    NarrowButton,
    PlainLabel,
    Theme,
    caption,
    form_field,
    literal,
    millimetres,
    shape_word,
    split_unit,
    text_font,
    to_mm,
    tr,
    unit_word,
)
from ocmm_gui.views import PartPicture

UPS = ("+z", "-z", "+y", "-y", "+x", "-x")
_TAKE = (Qt.Key.Key_Return, Qt.Key.Key_Enter)
_LIST_PX = 430


class ModelChoice(QFrame):
    """The part with the chosen surfaces in colour, and a list of all that it offers.

    A click on a face chooses its surface or takes the choice back, as Space does in the list.
    Return takes the chosen ones over, Esc goes back without.
    """

    taken = Signal(object)
    """Emits the chosen `Offer`s, a tuple."""
    declined = Signal()
    """Nothing is taken."""
    up_changed = Signal(str)
    """Emits the axis of the model that is to point up: what is within reach changes with it."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Features of the model"))
        self._theme = THEMES[DEFAULT_THEME]
        self._offers: tuple[Offer, ...] = ()
        self._row_of: dict[int, int] = {}
        self.picture = PartPicture()
        self.list = ChoiceList(tr("Surfaces of the model"))
        self._told = PlainLabel()
        self._told.setAccessibleName(tr("What is chosen"))
        self._told.setWordWrap(True)
        self._told.setFont(text_font(14))
        self._about = PlainLabel()
        self._about.setAccessibleName(tr("Why the selected surface is not chosen"))
        self._about.setWordWrap(True)
        self._about.setFont(text_font(14))
        self._about.setMinimumHeight(44)
        self._up = ChoiceBox(tr("Axis that points up"), tr("How the part stands"), UPS)
        self.zone = form_field(
            tr("Profile of free forms, {unit}").format(unit=unit_word()),
            tr("Width of the zone"),
        )
        self._zone_words = caption(
            tr("Profile of free forms, {unit}").format(unit=unit_word()), self.zone
        )
        self.zone.textChanged.connect(lambda _text: self._show_choice())
        self._take = NarrowButton(tr("Take over  [Return]"))
        self._back = NarrowButton(tr("Back  [Esc]"))
        self._take.setAccessibleName(tr("Take the chosen surfaces over as features"))
        self._back.setAccessibleName(tr("Go back without features"))
        self._take.setProperty("role", "primary")
        self._take.clicked.connect(self._emit_taken)
        self._back.clicked.connect(self.declined)
        self.list.taken.connect(self._emit_taken)
        self.list.declined.connect(self.declined)
        self.list.itemChanged.connect(lambda _item: self._show_choice())
        self.list.currentRowChanged.connect(lambda _row: self._show_choice())
        self.picture.face_clicked.connect(self._on_face)
        self._up.textActivated.connect(self.up_changed)
        self._lay_out()
        self.hide()

    def show_model(self, part: PartModel | None, offers: Sequence[Offer], up: str) -> None:
        """Show a part and what it offers; what nothing stands against is chosen."""
        self._offers = tuple(offers)
        self._row_of = {
            number: row for row, offer in enumerate(self._offers) for number in offer.faces
        }
        self.list.blockSignals(True)
        self.list.clear()
        for offer in self._offers:
            item = QListWidgetItem(_words(offer), self.list)
            item.setFlags(item.flags() | Qt.ItemFlag.ItemIsUserCheckable)
            # Nobody but the drawing knows the zone of a free form.
            is_good = not offer.against and offer.free_form is None
            item.setCheckState(Qt.CheckState.Checked if is_good else Qt.CheckState.Unchecked)
            item.setToolTip(literal(offer.against))
        self.list.setCurrentRow(0)
        self.list.blockSignals(False)
        self._up.setCurrentText(up)
        has_free = any(offer.free_form is not None for offer in self._offers)
        self.zone.setVisible(has_free)
        self._zone_words.setVisible(has_free)
        self.picture.show_part(part)
        self._show_choice()
        self.show()
        self.list.setFocus()

    def chosen(self) -> tuple[Offer, ...]:
        """Return what is chosen, in the order of the model."""
        return tuple(offer for row, offer in enumerate(self._offers) if self._is_chosen(row))

    def zone_mm(self) -> float | None:
        """Return the zone of free forms; None where none is chosen, or no zone is given."""
        typed, unit = split_unit(self.zone.text())
        found = number(typed)
        value = None if found is None else to_mm(found, unit)
        has_free = any(offer.free_form is not None for offer in self.chosen())
        return value if has_free and value is not None and value > 0.0 else None

    def words(self) -> str:
        """Return what is said of the choice."""
        return f"{self._told.text()} {self._about.text()}".strip()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self.list.set_theme(theme)
        self._show_choice()

    def _is_chosen(self, row: int) -> bool:
        return self.list.item(row).checkState() is Qt.CheckState.Checked

    def _emit_taken(self) -> None:
        if self._can_be_taken():
            self.taken.emit(self.chosen())

    def _can_be_taken(self) -> bool:
        chosen = self.chosen()
        lacks_zone = self.zone_mm() is None and any(one.free_form is not None for one in chosen)
        return bool(chosen) and not lacks_zone

    def _on_face(self, place: int) -> None:
        """Choose the surface of a face, or take the choice back; the places count from 0."""
        row = self._row_of.get(place + 1)
        if row is None:
            return
        self.list.setCurrentRow(row)
        before = self._is_chosen(row)
        self.list.item(row).setCheckState(
            Qt.CheckState.Unchecked if before else Qt.CheckState.Checked
        )

    def _show_choice(self) -> None:
        """Colour what is chosen, and say what stands against the selected surface."""
        if not self._offers:
            return
        marked: dict[int, str] = {}
        for row, offer in enumerate(self._offers):
            if self._is_chosen(row):
                marked.update((number - 1, self._theme.good) for number in offer.faces)
        current = self._offers[max(self.list.currentRow(), 0)]
        marked.update((number - 1, self._theme.accent) for number in current.faces)
        self.picture.highlight(marked)
        count = len(self.chosen())
        self._told.setText(
            tr("{count} of {all} surfaces are chosen.").format(count=count, all=len(self._offers))
        )
        can = self._can_be_taken()
        if count and not can:
            said = tr("Enter the profile of free forms.")
            self._told.setText(f"{self._told.text()} {said}")
        self._take.setEnabled(can)
        about = tr("{name} can be touched.").format(name=current.feature.name)
        if current.free_form is not None:
            about = tr("{name}: points and their profile against the model.").format(
                name=current.feature.name
            )
        if current.against:
            about = tr("{name}: {why}.").format(name=current.feature.name, why=current.against)
        self._about.setText(about)

    def _lay_out(self) -> None:
        keys = QHBoxLayout()
        keys.addWidget(self._take, 2)
        keys.addWidget(self._back, 1)
        stands = QHBoxLayout()
        stands.addWidget(caption(tr("Up"), self._up))
        stands.addWidget(self._up, 1)
        zone = QHBoxLayout()
        zone.addWidget(self._zone_words)
        zone.addWidget(self.zone, 1)
        side = QVBoxLayout()
        side.setSpacing(8)
        side.addWidget(self._told)
        side.addWidget(self.list, 1)
        side.addWidget(self._about)
        side.addLayout(zone)
        side.addLayout(stands)
        side.addLayout(keys)
        row = QHBoxLayout(self)
        row.setSpacing(10)
        row.addWidget(self.picture, 1)
        row.addLayout(side)
        self.list.setFixedWidth(_LIST_PX)
        self._about.setFixedWidth(_LIST_PX)


class ChoiceList(QListWidget):
    """A line for each surface; Return and Esc are its own.

    Parameters
    ----------
    name
        Accessible name.
    """

    taken = Signal()
    declined = Signal()

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setAccessibleDescription(tr("Space chooses, Return takes over, Esc goes back"))
        self.setUniformItemSizes(True)
        self.setSpacing(2)
        self.setFont(text_font(14))
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        # The style's own empty box cannot be seen on a dark panel.
        self.setStyleSheet(
            f"QListView::indicator {{ width: 14px; height: 14px; border: 1px solid {theme.muted};"
            f" border-radius: 3px; }} QListView::indicator:checked {{ background: {theme.good};"
            f" border-color: {theme.good}; }}"
        )

    def event(self, event: QEvent) -> bool:
        """Take Return and Esc before the sheet does."""
        is_mine = event.type() is QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent)
        if is_mine and isinstance(event, QKeyEvent) and event.key() in (*_TAKE, Qt.Key.Key_Escape):
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Take over with Return, go back with Esc."""
        if event.key() in _TAKE:
            self.taken.emit()
        elif event.key() == Qt.Key.Key_Escape:
            self.declined.emit()
        else:
            super().keyPressEvent(event)


def _words(offer: Offer) -> str:
    """Return a line: name, shape, size, and what stands against it."""
    feature = offer.feature
    size = f"\N{LATIN CAPITAL LETTER O WITH STROKE} {millimetres(feature.diameter)}"
    if not feature.diameter:
        size = " \N{MULTIPLICATION SIGN} ".join(
            millimetres(side, decimals=1) for side in (feature.length, feature.width)
        )
    shape = shape_word(feature.shape) if offer.free_form is None else tr("Free form")
    words = f"{feature.name}   {shape}   {size}"
    return f"{words}   \N{EN DASH} {offer.against}" if offer.against else words
