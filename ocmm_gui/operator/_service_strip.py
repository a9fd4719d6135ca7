"""Strip of the server for measuring programs, on every page while it runs."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFrame, QPushButton, QSizePolicy

from ocmm_core.station import ServiceState
from ocmm_gui import kit
from ocmm_gui.kit import later, tr

_BUTTON_PX = 36
_WORDS = (
    ("done", later("Done"), later("Report the element as complete")),
    ("del", later("Delete last"), later("Delete your last point, here and in the program")),
    ("goto", later("Clearance"), later("Send the present position as a clearance point")),
    ("cancel", later("No touch"), later("Report that this point cannot be touched")),
)
"""Words of the operator, with the text and the tip of their buttons."""


class ServiceStrip(QFrame):
    """Address and program, last sentence, last command with its answer, and the operator's words.

    Hidden while no server runs.
    """

    pressed = Signal(str)
    """Emits a word of the operator."""
    stop_wanted = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("service")
        self.setAccessibleName(tr("Server for measuring programs"))
        self.status = kit.sentence_label(tr("Address and program"), 16)
        self.lines = kit.dressed(
            kit.PlainLabel(), tr("Last command and answer"), font=kit.text_font(13)
        )
        self.lines.setTextFormat(Qt.TextFormat.PlainText)
        for label in (self.status, self.lines):
            label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.buttons = {word: _button(tr(text), tr(tip)) for word, text, tip in _WORDS}
        for word, button in self.buttons.items():
            button.clicked.connect(lambda _checked=False, word=word: self.pressed.emit(word))
        self.stop_button = _button(
            tr("Stop server"), tr("Disconnect the program and end the server")
        )
        self.stop_button.clicked.connect(self.stop_wanted)
        row = kit.hbox(
            (self.lines, 1), *self.buttons.values(), self.stop_button, spacing=8, margins=0
        )
        kit.vbox(self.status, row, parent=self, spacing=2, margins=(14, 4, 14, 4))
        self.set_theme(kit.THEMES[kit.DEFAULT_THEME])
        self.hide()

    def show_state(self, state: ServiceState | None) -> None:
        self.setVisible(state is not None)
        if state is None:
            return
        where = tr("{title} at {address}.").format(title=state.title, address=state.address)
        program = tr("No program is connected.")
        if state.client:
            program = tr("Program at {client}.").format(client=state.client)
        self.status.setText(f"{where} {program} {kit.said(state.sentence)}".strip())
        self.lines.setText(f"{state.command}   →   {state.answer}" if state.command else "")
        self.lines.setToolTip(kit.literal(self.lines.text()))
        for button in self.buttons.values():
            button.setEnabled(bool(state.client))

    def set_theme(self, theme: kit.Theme) -> None:
        self.setStyleSheet(
            f"#service {{ background: {theme.panel}; border-bottom: 3px solid {theme.accent}; }}"
            f" #service QLabel {{ color: {theme.text}; }}"
        )


def _button(text: str, tip: str) -> QPushButton:
    button = kit.dressed(kit.NarrowButton(text), tip, font=kit.text_font(15, bold=True))
    button.setToolTip(kit.literal(tip))
    button.setMinimumHeight(_BUTTON_PX)
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    return button
