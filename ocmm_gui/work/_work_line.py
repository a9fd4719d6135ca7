"""Progress of background work, and the key that cancels it, in one line."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QHBoxLayout, QProgressBar

from ocmm_gui.kit import PlainLabel, text_font, tr

_BAR_PX = 220
_PARTS = 1000


class WorkLine(QFrame):
    """Step, progress bar, and cancel key; takes no focus, and no room while hidden.

    `name`: accessible name.
    """

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._label = PlainLabel()
        self._label.setTextFormat(Qt.TextFormat.PlainText)
        self._label.setAccessibleName(tr("{name}: progress").format(name=name))
        self._label.setFont(text_font(14))
        self._key = PlainLabel()
        self._key.setFont(text_font(14))
        self._key.setProperty("role", "muted")
        self._bar = QProgressBar()
        self._bar.setAccessibleName(tr("{name}: progress").format(name=name))
        self._bar.setTextVisible(False)
        self._bar.setFixedSize(_BAR_PX, 12)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(14, 3, 14, 3)
        layout.setSpacing(12)
        layout.addWidget(self._bar)
        layout.addWidget(self._label)
        layout.addWidget(self._key)
        layout.addStretch(1)
        self.hide()

    def begin(self, what: str, key: str = "") -> None:
        """Show the start of work; ``key`` describes its cancellation, if possible."""
        self._bar.setRange(0, 0)
        self._label.setText(what)
        self._key.setText(key)
        self.show()

    def advance(self, what: str, share: float) -> None:
        """Show the next step, and the share done."""
        self._bar.setRange(0, _PARTS)
        self._bar.setValue(round(_PARTS * share))
        self._label.setText(what)
        self._bar.setAccessibleDescription(f"{what}: {share:.0%}")

    def end(self) -> None:
        self.hide()

    def words(self) -> str:
        """Return step and cancel key; empty while idle."""
        if self.isHidden():
            return ""
        return f"{self._label.text()} {self._key.text()}".rstrip()
