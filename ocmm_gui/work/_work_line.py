"""How far something is that takes a while, and the key that gives it up, in one line."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QHBoxLayout, QProgressBar

from ocmm_gui.kit import PlainLabel, text_font, tr

_BAR_PX = 220
_PARTS = 1000


class WorkLine(QFrame):
    """What is done, a bar, and the key that ends it; takes no keyboard and no place while hidden.

    Parameters
    ----------
    name
        Accessible name.
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
        """Show that something has begun; ``key`` says how it is given up, if it can be."""
        self._bar.setRange(0, 0)
        self._label.setText(what)
        self._key.setText(key)
        self.show()

    def advance(self, what: str, share: float) -> None:
        """Show what is done next, and the share that is done."""
        self._bar.setRange(0, _PARTS)
        self._bar.setValue(round(_PARTS * share))
        self._label.setText(what)
        self._bar.setAccessibleDescription(f"{what}: {share:.0%}")

    def end(self) -> None:
        """Go away."""
        self.hide()

    def words(self) -> str:
        """Return what is done, and how it is given up; empty while nothing is."""
        if self.isHidden():
            return ""
        return f"{self._label.text()} {self._key.text()}".rstrip()
