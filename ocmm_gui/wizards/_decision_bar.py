"""Question in the window whether to accept or keep, with a reason for the history."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout

from ocmm_gui.kit import NarrowButton, OwnKeysField, PlainLabel, later, text_font, tr

_WELCOME, _NEEDED = later("Reason, for the history"), later("A reason is required")


class DecisionBar(QFrame):
    """One line: question, reason, Yes, No; non-modal."""

    decided = Signal(bool, str)

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self.setAccessibleName(tr("Decision"))
        self._accepts = False
        self._needs_reason = False
        self._question = PlainLabel()
        self._question.setAccessibleName(tr("Decision"))
        self._question.setFont(text_font(17, bold=True))
        self._reason = OwnKeysField()
        self._reason.setObjectName("reason")
        self._reason.setAccessibleName(tr("Reason"))
        self._reason.setFont(text_font(16))
        self._yes = NarrowButton(tr("Yes  [Return]"))
        self._yes.setAccessibleName(tr("Yes"))
        self._yes.setProperty("role", "primary")
        self._no = NarrowButton(tr("No  [Esc]"))
        self._no.setAccessibleName(tr("No"))
        layout = QHBoxLayout(self)
        layout.setContentsMargins(14, 8, 10, 8)
        layout.setSpacing(10)
        layout.addWidget(self._question)
        layout.addWidget(self._reason, 1)
        for button in (self._yes, self._no):
            button.setFont(text_font(16, bold=True))
            button.setMinimumHeight(46)
            layout.addWidget(button)
        self._yes.clicked.connect(self._confirm)
        self._no.clicked.connect(self.hide)
        self._reason.returnPressed.connect(self._confirm)
        self._reason.left.connect(self.hide)
        self.hide()

    def ask(self, question: str, reason: str, *, accepts: bool, needs_reason: bool = False) -> None:
        """Ask, with a proposed reason; if one is required, Yes is disabled until then."""
        self._accepts, self._needs_reason = accepts, needs_reason
        self._reason.setPlaceholderText(tr(_NEEDED if needs_reason else _WELCOME))
        self._question.setText(question)
        self._reason.setText(reason)
        self.show()
        self._reason.setFocus()
        self._reason.selectAll()

    def question(self) -> str:
        return self._question.text()

    def _confirm(self) -> None:
        if self._needs_reason and not self._reason.text().strip():
            self._reason.setFocus()
            return
        self.hide()
        self.decided.emit(self._accepts, self._reason.text().strip())
