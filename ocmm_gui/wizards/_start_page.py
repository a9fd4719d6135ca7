"""Start page of a wizard: purpose, fields, and unfinished sessions."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtWidgets import QGridLayout, QLabel, QLineEdit, QListWidget, QListWidgetItem, QWidget

from ocmm_gui import kit
from ocmm_gui.kit import tr
from ocmm_gui.wizards._site import UnfinishedSession
from ocmm_gui.wizards.pages import Field, practice_title

_ROW_PX = 58


class WizardStart(kit.Themed, QWidget):
    """Fields of a new session on the left, unfinished sessions on the right."""

    begun = Signal(object)
    """Emits the fields, ``dict[str, str]``."""
    resumed = Signal(object)
    """Emits the `Path` of the session to resume."""
    left = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._offers: tuple[UnfinishedSession, ...] = ()
        self._title = kit.dressed(kit.PlainLabel(), tr("Wizard"), font=kit.text_font(28, bold=True))
        self._purpose = kit.sentence_label(tr("Purpose"), 18)
        self.trouble = kit.sentence_label(tr("Why it cannot start"), 17)
        self.fields: dict[str, QLineEdit | kit.ChoiceBox] = {}
        self._form = QGridLayout()
        self._form.setVerticalSpacing(5)
        self._form.setHorizontalSpacing(14)
        self.begin_button = kit.large_button(tr("Start  [Return]"), tr("Start a new session"))
        self.resume_button = kit.large_button(
            tr("Resume  [G]"), tr("Resume the selected session"), "G"
        )
        self.leave_button = kit.large_button(tr("Leave  [Esc]"), tr("Leave the wizard"), "Esc")
        self.begin_button.clicked.connect(self._begin)
        self.resume_button.clicked.connect(self._resume)
        self.leave_button.clicked.connect(self.left)
        self.list = kit.dressed(QListWidget(), tr("Unfinished sessions"), font=kit.text_font(16))
        self.list.setWordWrap(True)
        self.list.currentRowChanged.connect(self._show_choice)
        self.list.itemActivated.connect(self._resume)
        self._note = kit.sentence_label(tr("Details of the selected session"), 15)
        layout = kit.vbox(
            self._title, self._purpose, parent=self, spacing=12, margins=(18, 12, 18, 12)
        )
        middle = kit.hbox((self._new_session(), 1), (self._unfinished(), 1), spacing=12)
        kit.fill(layout, (middle, 1), self.trouble)
        row = kit.hbox(self.leave_button)
        row.addStretch(1)
        layout.addLayout(row)

    def ask(
        self, title: str, purpose: str, fields: Sequence[Field],
        offers: Sequence[UnfinishedSession], *, practice: bool = False,
    ) -> None:  # fmt: skip
        """Show fields and unfinished sessions, which are proposed first."""
        self._title.setText(practice_title(tr(title)) if practice else tr(title))
        self._purpose.setText(tr(purpose))
        self.show_trouble("")
        self._fill_form(fields)
        self._offers = tuple(offers)
        self.list.clear()
        for offer in offers:
            item = QListWidgetItem(f"{'▲ ' if offer.blocker else ''}{offer.title}", self.list)
            item.setSizeHint(QSize(100, _ROW_PX))
        self._offered.setVisible(bool(offers))
        if offers:
            self.list.setCurrentRow(0)
            self.list.setFocus()
        else:
            lines = [field for field in self.fields.values() if isinstance(field, QLineEdit)]
            empty = (field for field in lines if not field.text())
            next(empty, lines[0] if lines else self.leave_button).setFocus()
        self._show_choice()

    def show_trouble(self, text: str) -> None:
        """Show why a session could not be started or resumed; empty text hides it."""
        self.trouble.setText(text)
        self.trouble.setVisible(bool(text))
        self._paint()

    def _fill_form(self, fields: Sequence[Field]) -> None:
        while (item := self._form.takeAt(0)) is not None:
            widget = item.widget()
            if widget is not None:
                widget.hide()
                widget.deleteLater()
        self.fields = {}
        for one in fields:
            label = kit.dressed(kit.PlainLabel(tr(one.label)), font=kit.text_font(15), role="muted")
            field = self._choice(one) if one.choices else self._line(one)
            field.setObjectName(one.key)
            field.setAccessibleName(tr(one.label))
            field.setAccessibleDescription(tr(one.tip))
            field.setToolTip(kit.literal(tr(one.tip)))
            field.setFont(kit.text_font(16))
            field.setMinimumHeight(36)
            label.setBuddy(field)
            row = len(self.fields)
            self._form.addWidget(label, row, 0)
            self._form.addWidget(field, row, 1)
            # Only visible widgets can have the focus.
            label.show()
            field.show()
            self.fields[one.key] = field

    def _line(self, one: Field) -> QLineEdit:
        field = kit.HintField(one.proposal)
        field.setPlaceholderText(tr(one.tip))
        field.returnPressed.connect(self._begin)
        field.textEdited.connect(lambda _text: self.show_trouble(""))
        return field

    def _choice(self, one: Field) -> kit.ChoiceBox:
        words = dict(one.choices)
        field = kit.ChoiceBox(
            tr(one.label), tr(one.tip), tuple(words), lambda value: tr(words[value])
        )
        field.set_theme(self._theme)
        return field

    def _new_session(self) -> QWidget:
        column = kit.vbox(_heading(tr("New session")), self._form, spacing=8)
        column.addStretch(1)
        column.addWidget(self.begin_button)
        return kit.panel(column)

    def _unfinished(self) -> QWidget:
        column = kit.vbox(
            _heading(tr("Not finished")), (self.list, 1), self._note, self.resume_button, spacing=8
        )
        self._offered = kit.panel(column)
        return self._offered

    def _show_choice(self, _row: int = 0) -> None:
        offer = self._offer()
        self.resume_button.setEnabled(offer is not None and not offer.blocker)
        self._note.setText(
            "" if offer is None else kit.said(offer.blocker) or tr("Nothing was lost.")
        )
        new = offer is None or bool(offer.blocker)
        for button, primary in ((self.begin_button, new), (self.resume_button, not new)):
            kit.use_role(button, "primary" if primary else "plain")
        self._paint()

    def _offer(self) -> UnfinishedSession | None:
        row = self.list.currentRow()
        return self._offers[row] if 0 <= row < len(self._offers) else None

    def values(self) -> dict[str, str]:
        return {
            key: field.text() if isinstance(field, QLineEdit) else field.choice()
            for key, field in self.fields.items()
        }

    def _begin(self) -> None:
        self.begun.emit(self.values())

    def _resume(self) -> None:
        offer = self._offer()
        if offer is not None and not offer.blocker:
            self.resumed.emit(offer.path)

    def _paint(self) -> None:
        offer = self._offer()
        warned = offer is not None and bool(offer.blocker)
        self._note.setStyleSheet(f"color: {self._theme.warn if warned else self._theme.muted};")
        self.trouble.setStyleSheet(f"color: {self._theme.bad}; font-weight: bold;")


def _heading(text: str) -> QLabel:
    label = kit.PlainLabel(text)
    label.setFont(kit.text_font(18, bold=True))
    label.setAlignment(Qt.AlignmentFlag.AlignLeft)
    return label
