"""Start of a test: procedure, artefact, person, or an unfinished test."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QSize, Signal
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import QHeaderView, QLineEdit, QListWidget, QListWidgetItem, QWidget

from ocmm_core.acceptance import ArtefactOffer, OpenTest, ProcedureOffer, UsedArtefact
from ocmm_gui import kit
from ocmm_gui.kit import later, tr
from ocmm_gui.wizards.pages import THERMOMETER

ROW_PX = 34
KIND_WORDS = {
    "sphere": later("sphere"), "bar": later("bar"), "gauge block": later("gauge block"),
    "part": later("part"), "plate": later("plate"), "dumbbell": later("dumbbell"),
    "cone": later("cone"),
}  # fmt: skip
"""Displayed kinds of artefacts and roles in a test."""


def kind_word(kind: str) -> str:
    return tr(KIND_WORDS[kind]) if kind in KIND_WORDS else kind


def limits_text(offer: ProcedureOffer) -> str:
    one = offer.procedure
    limits = ", ".join(
        kit.localised(f"{kit.said_word(key)} {limit.describe()}")
        for key, limit in one.limits.items()
    )
    return tr("{wording}; rule: {rule}; limits: {limits}").format(
        wording=kit.said(one.wording), rule=kit.said_word(one.rule), limits=limits
    )


def choice_list(name: str) -> QListWidget:
    """Return an empty list with its name."""
    # Fields below it keep their height.
    found = kit.dressed(QListWidget(), name, font=kit.text_font(15), high=ROW_PX + 6)
    found.setWordWrap(True)
    return found


def named_field(key: str, label: str, tip: str, proposal: str = "") -> kit.FormField:
    """Return a field of a form; its label and explanation are not translated yet."""
    return kit.dressed(kit.form_field(tr(label), tr(tip), proposal), key=key)


def add_line(where: QListWidget, text: str) -> None:
    """Add a line, with a tool tip in case it is cut."""
    item = QListWidgetItem(text, where)
    item.setToolTip(kit.literal(text))
    item.setSizeHint(QSize(100, ROW_PX))


_COLUMNS = (
    (later("Procedure"), later("Title of the procedure")),
    (later("Standard"), later("Standard and edition that it is modelled on")),
    (later("Needs"), later("Artefact that it needs")),
    (later("Min"), later("Minutes for a trained person")),
)
_FIELDS = (
    ("who", later("Done by"), later("Your name, for the record")),
    ("temperature", later("Room, °C"), later("Temperature of the room, as measured")),
    (THERMOMETER.key, THERMOMETER.label, THERMOMETER.tip),
    ("place", later("Place"), later("Where; may be empty")),
    ("customer", later("Customer"), later("For whom; may be empty")),
)
_AIR = (
    ("humidity", later("Humidity, %"), later("optional")),
    ("pressure", later("Pressure, hPa"), later("optional")),
)
_CONDITIONS = ((later("as found"), "as found"), (later("after adjustment"), "after adjustment"))
_SIDE_PX = 424


class AcceptanceStart(QWidget):
    """Procedures on the left; artefacts, conditions and unfinished tests on the right."""

    chosen = Signal(int)
    """Emits the row of the selected procedure, to list its artefacts."""
    begun = Signal()
    resumed = Signal(object)
    """Emits the `Path` of the session to resume."""
    left = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._offers: tuple[ArtefactOffer, ...] = ()
        self._open: tuple[OpenTest, ...] = ()
        title = kit.dressed(
            kit.PlainLabel(tr("Acceptance test")), font=kit.text_font(24, bold=True)
        )
        self.table = kit.NumberTable(
            tr("Procedures"), kit.tr_all(_COLUMNS), whole=False, font=kit.text_font(15)
        )
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        for column, width in ((1, 200), (2, 120), (3, 52)):
            self.table.setColumnWidth(column, width)
        self.table.setWordWrap(True)
        self.table.verticalHeader().setMinimumSectionSize(ROW_PX)
        self.table.itemSelectionChanged.connect(self._choose)
        self.limits = kit.sentence_label(tr("Limits of the procedure"), 14, role="muted")
        self.artefacts = choice_list(tr("Artefacts"))
        self.artefacts.currentRowChanged.connect(self._show_artefact)
        self.note = kit.sentence_label(tr("About the artefact"), 14)
        self.fields: dict[str, QLineEdit] = {}
        self.condition = kit.ChoiceBox(
            tr("Condition"), tr("State of the machine"), [tr(one) for one, _ in _CONDITIONS]
        )
        self.unfinished = choice_list(tr("Unfinished tests"))
        self.unfinished.currentRowChanged.connect(self._show_open)
        self.trouble = kit.sentence_label(tr("Why it cannot start"), 16, role="bad")
        self.begin_button = kit.large_button(tr("Start  [Return]"), tr("Start the test"), "Return")
        self.begin_button.clicked.connect(self.begun)
        QShortcut(QKeySequence("Enter"), self).activated.connect(self.begin_button.click)
        self.resume_button = kit.large_button(
            tr("Resume  [G]"), tr("Resume the selected test"), "G"
        )
        self.resume_button.clicked.connect(self._resume)
        self.leave_button = kit.large_button(tr("Leave  [Esc]"), tr("Back to Maintain"), "Esc")
        self.leave_button.clicked.connect(self.left)
        self._lay_out(title)

    def ask(
        self, procedures: Sequence[ProcedureOffer], proposals: dict[str, str], first: str = ""
    ) -> None:
        """Show the procedures before `show_unfinished`; ``first`` is the proposed id."""
        self.table.blockSignals(True)
        self.table.setRowCount(len(procedures))
        row = 0
        for index, one in enumerate(procedures):
            known = one.procedure
            needs = ", ".join(kind_word(role) for role in one.roles) or tr("nothing")
            words = (
                kit.said(known.title),
                kit.said(known.source),
                needs,
                kit.localised(f"{known.minutes:g}"),
            )
            self.table.show_words(index, words)
            title = self.table.item(index, 0)
            if title is not None:
                title.setToolTip(kit.literal(f"{known.id}: {kit.said(known.title)}"))
            if known.id == first:
                row = index
        self.table.resizeRowsToContents()
        self.table.blockSignals(False)
        for key, text in proposals.items():
            if not self.fields[key].text():
                self.fields[key].setText(text)
        self._show_reading_open()
        if procedures:
            self.table.selectRow(row)
            self._choose()
        # Procedures may come late: whoever types already keeps the keyboard.
        if not any(field.hasFocus() for field in self.fields.values()):
            self.table.setFocus()

    def show_unfinished(self, open_tests: Sequence[OpenTest]) -> None:
        """Show the unfinished tests; the focus stays."""
        self._open = tuple(open_tests)
        self.unfinished.clear()
        for test in self._open:
            text = tr(
                "{title}, {who}: {done} of %n points",
                "{title}, {who}: {done} of 1 point",
                test.wanted,
            ).format(title=kit.said(test.title), who=test.who, done=test.done)
            add_line(
                self.unfinished,
                f"▲ {kit.said(test.title)}: {kit.said(test.blocker)}" if test.blocker else text,
            )
        self._unfinished.setVisible(bool(self._open))
        if self._open:
            self.unfinished.setCurrentRow(0)
        self._show_open()

    def _show_reading_open(self) -> None:
        self._open = ()
        self.unfinished.clear()
        add_line(self.unfinished, tr("Reading unfinished tests"))
        self._unfinished.show()
        self._show_open()

    def show_waiting(self) -> None:
        """Show that the procedures are being read; nothing can start."""
        self._show_reading_open()
        self.table.blockSignals(True)
        self.table.setRowCount(0)
        self.table.blockSignals(False)
        self.show_trouble("")
        self.show_reading(tr("Reading the procedures"))

    def show_reading(self, limits: str) -> None:
        """Show that the artefacts of the selected procedure are being read."""
        self._offers = ()
        self.limits.setText(limits)
        self.artefacts.blockSignals(True)
        self.artefacts.clear()
        self.artefacts.blockSignals(False)
        self.note.setText(tr("Reading the artefacts"))
        self.begin_button.setEnabled(False)

    def show_artefacts(self, offers: Sequence[ArtefactOffer], limits: str) -> None:
        """Show the artefacts of the selected procedure, with reasons for refused ones."""
        self.begin_button.setEnabled(True)
        self._offers = tuple(offers)
        self.limits.setText(limits)
        self.artefacts.blockSignals(True)
        self.artefacts.clear()
        for one in self._offers:
            use = one.used.use
            due = kit.day_words(use.due_utc)
            text = tr("{name}, {serial}, due {due}").format(
                name=use.name, serial=use.serial, due=due
            )
            add_line(self.artefacts, f"▲ {text}" if one.refusal else text)
        self.artefacts.blockSignals(False)
        if self._offers:
            self.artefacts.setCurrentRow(0)
        self._show_artefact()

    def artefact(self) -> ArtefactOffer | None:
        row = self.artefacts.currentRow()
        return self._offers[row] if 0 <= row < len(self._offers) else None

    def used(self, roles: Sequence[str]) -> tuple[UsedArtefact, ...]:
        """Return the selected artefact, and the first usable one of each other role."""
        first = self.artefact()
        offers = (() if first is None else (first,)) + self._offers
        usable = [one.used for one in offers if not one.refusal]
        found = (next((one for one in usable if one.role == role), None) for role in roles)
        return tuple(one for one in found if one is not None)

    def row(self) -> int:
        return self.table.currentRow()

    def value(self, key: str) -> str:
        return self.fields[key].text().strip()

    def chosen_condition(self) -> str:
        """Return the condition of the machine in record form."""
        return _CONDITIONS[self.condition.currentIndex()][1]

    def show_starting(self, text: str) -> None:
        """Show that a test is being prepared; empty text ends it."""
        # The list keeps the focus, so that Escape always works.
        self.begin_button.setEnabled(not text)
        if text:
            self.resume_button.setEnabled(False)
            self.note.setText(text)
        else:
            self._show_artefact()
            self._show_open()

    def show_trouble(self, text: str) -> None:
        """Show why a test could not be started or resumed; empty text hides it."""
        self.trouble.tell(text)

    def _choose(self) -> None:
        self.show_trouble("")
        if self.table.currentRow() >= 0:
            self.chosen.emit(self.table.currentRow())

    def _show_artefact(self, _row: int = 0) -> None:
        one = self.artefact()
        if one is None:
            self.note.setText(tr("No artefact in the register suits. Add one: F9 in Maintain."))
        else:
            u = tr("U {um:.2f} µm (k = 2)").format(um=1e3 * one.used.expanded)
            self.note.setText(kit.said(one.refusal) or " ".join((u, *map(kit.said, one.warnings))))
        kit.use_role(self.note, "warn" if one is None or one.refusal else "muted")

    def _show_open(self, _row: int = 0) -> None:
        row = self.unfinished.currentRow()
        there = 0 <= row < len(self._open) and not self._open[row].blocker
        self.resume_button.setEnabled(there)

    def _resume(self) -> None:
        row = self.unfinished.currentRow()
        if 0 <= row < len(self._open) and not self._open[row].blocker:
            path: Path = self._open[row].path
            self.resumed.emit(path)

    def _field(self, key: str, label: str, tip: str) -> kit.HintField:
        font = kit.text_font(15)
        field = kit.dressed(kit.HintField(), tr(label), tr(tip), font=font, key=key)
        field.setPlaceholderText(tr(tip))
        field.textEdited.connect(lambda _text: self.show_trouble(""))
        self.fields[key] = field
        return field

    def _lay_out(self, title: QWidget) -> None:
        left = kit.vbox((self.table, 1), self.limits, spacing=6)
        form = kit.form_grid(self._field(*line) for line in _FIELDS)
        form.setHorizontalSpacing(12)
        form.setVerticalSpacing(6)
        # In one row: rarely used, and the list of artefacts needs the room.
        air = kit.hbox(spacing=8)
        (first, named, first_tip), (second, other, second_tip) = _AIR
        humidity = self._field(first, named, first_tip)
        air.addWidget(humidity)
        pressure = self._field(second, other, second_tip)
        kit.fill(air, kit.caption(tr(other), pressure), pressure)
        form.addWidget(kit.caption(tr(named), humidity), len(_FIELDS), 0)
        form.addLayout(air, len(_FIELDS), 1)
        form.addWidget(kit.caption(tr("Condition"), self.condition), len(_FIELDS) + 1, 0)
        form.addWidget(self.condition, len(_FIELDS) + 1, 1)
        right = kit.vbox(
            kit.caption(tr("Artefact"), self.artefacts),
            (self.artefacts, 2),
            self.note,
            form,
            spacing=6,
        )
        again = kit.vbox(
            kit.caption(tr("Not finished"), self.unfinished),
            (self.unfinished, 1),
            self.resume_button,
        )
        self._unfinished = kit.panel(again)
        holder = QWidget()
        kit.vbox((kit.panel(right), 3), (self._unfinished, 2), parent=holder, spacing=8, margins=0)
        holder.setFixedWidth(_SIDE_PX)
        middle = kit.hbox((kit.panel(left), 1), holder, spacing=10)
        row_of_buttons = kit.hbox((self.leave_button, 1), (self.begin_button, 2))
        kit.vbox(
            title, (middle, 1), self.trouble, row_of_buttons, parent=self, spacing=8,
            margins=(14, 8, 14, 10),
        )  # fmt: skip
