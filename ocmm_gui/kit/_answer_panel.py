"""Question with two keys, as part of the window: non-modal."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QResizeEvent
from PySide6.QtWidgets import QApplication, QFrame, QHBoxLayout, QSizePolicy, QWidget

from ocmm_gui.kit._narrow import NarrowButton
from ocmm_gui.kit._texts import PlainLabel, tr
from ocmm_gui.kit._theme import DEFAULT_THEME, THEMES, Theme, text_font

_YES = (Qt.Key.Key_Return, Qt.Key.Key_Enter)
_FAR_SHARE, _DESK_PX = 34.0 / 1080.0, 16.0
"""Type size: relative to the window height, and in pixels."""


class AnswerPanel(QFrame):
    """One line: the question, and the keys to agree and decline; other keys act as before."""

    agreed = Signal()
    declined = Signal()

    def __init__(self, name: str, verb: str) -> None:
        super().__init__()
        self.setObjectName("answer")
        self.setAccessibleName(name)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self._theme = THEMES[DEFAULT_THEME]
        self._before: QWidget | None = None
        self._far = False
        self._label = PlainLabel()
        self._label.setAccessibleName(tr("Question"))
        self._label.setTextFormat(Qt.TextFormat.PlainText)
        self._label.setWordWrap(True)
        self._label.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self._yes, self._no = (
            NarrowButton(tr("{verb}  [Return]").format(verb=verb)),
            NarrowButton(tr("Back  [Esc]")),
        )
        self._yes.setAccessibleName(tr("{verb} anyway").format(verb=verb))
        self._no.setAccessibleName(tr("Cancel and go back"))
        layout = QHBoxLayout(self)
        layout.setContentsMargins(14, 6, 8, 6)
        layout.setSpacing(8)
        layout.addWidget(self._label, 1)
        for button in (self._yes, self._no):
            # The panel keeps the focus, so that Return answers wherever the mouse was.
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            layout.addWidget(button)
        self._yes.clicked.connect(self.agree)
        self._no.clicked.connect(self.decline)
        self.hide()

    def ask(self, question: str, *, far: bool = False) -> None:
        """Show a question, in a type for near or far reading."""
        self._far = far
        self._set_fonts()
        self._label.setText(question)
        self.setAccessibleDescription(question)
        self._paint()
        if not self.isVisible():
            self._before = QApplication.focusWidget()
        self.show()
        self.setFocus()

    def question(self) -> str:
        return self._label.text()

    def agree(self) -> None:
        self._leave()
        self.agreed.emit()

    def decline(self) -> None:
        self._leave()
        self.declined.emit()

    def set_theme(self, theme: Theme) -> None:
        self._theme = theme
        self._paint()

    def minimumSizeHint(self) -> QSize:
        """Return a size that widens no window: the text wraps."""
        return QSize(300, super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._set_fonts()

    def event(self, event: QEvent) -> bool:
        """Keep Return and Esc from the shortcuts of the window."""
        if (
            event.type() is QEvent.Type.ShortcutOverride
            and isinstance(event, QKeyEvent)
            and event.key() in (*_YES, Qt.Key.Key_Escape)
        ):
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in _YES:
            self.agree()
        elif event.key() == Qt.Key.Key_Escape:
            self.decline()
        else:
            super().keyPressEvent(event)

    def _leave(self) -> None:
        had_keyboard = self.hasFocus()
        self.hide()
        if had_keyboard and self._before is not None and self._before.isVisible():
            self._before.setFocus()

    def _set_fonts(self) -> None:
        pixels = max(_FAR_SHARE * self.window().height(), _DESK_PX) if self._far else _DESK_PX
        self._label.setFont(text_font(pixels, bold=True))
        for button in (self._yes, self._no):
            button.setFont(text_font(0.7 * pixels if self._far else pixels, bold=True))

    def _paint(self) -> None:
        colour = self._theme.warn
        self.setStyleSheet(
            f"#answer {{ background: {self._theme.panel}; border: 2px solid {colour};"
            f" border-radius: 6px; }} #answer QLabel {{ color: {colour}; }}"
        )
