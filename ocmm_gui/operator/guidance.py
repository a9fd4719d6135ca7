"""Guidance: what to do next, and why the last touch gave no point."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QLabel, QSizePolicy, QVBoxLayout

from ocmm_core.inspection.view import JobView, LiveView
from ocmm_gui.theme import DEFAULT_THEME, THEMES, Theme
from ocmm_gui.words import next_step, trouble


class Guidance(QFrame):
    """Two sentences: the next step, and under it what stands in the way.

    Parameters
    ----------
    pixels
        Size of the type.
    """

    def __init__(self, pixels: int = 16) -> None:
        super().__init__()
        self._pixels = pixels
        self._theme = THEMES[DEFAULT_THEME]
        self._job: JobView | None = None
        self._live: LiveView | None = None
        self._step = _sentence("Next step")
        self._trouble = _sentence("What stands in the way")
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        layout.addWidget(self._step)
        layout.addWidget(self._trouble, 1)
        self._paint()

    def show_job(self, job: JobView) -> None:
        """Show the next step and the refusal of the last touch."""
        self._job = job
        self._step.setText(next_step(job))
        self._show_trouble()

    def show_live(self, live: LiveView) -> None:
        """Show why the machine is not ready."""
        self._live = live
        self._show_trouble()

    def step(self) -> str:
        """Return the sentence that says what to do."""
        return self._step.text()

    def trouble(self) -> str:
        """Return what stands in the way, or an empty text."""
        return self._trouble.text()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self._paint()

    def _show_trouble(self) -> None:
        text = "\n".join(trouble(self._live, self._job))
        if text != self._trouble.text():
            self._trouble.setText(text)

    def _paint(self) -> None:
        size = f"font-size: {self._pixels}px;"
        self._step.setStyleSheet(f"{size} font-weight: bold; color: {self._theme.text};")
        self._trouble.setStyleSheet(f"{size} color: {self._theme.bad};")


def _sentence(name: str) -> QLabel:
    label = QLabel()
    label.setTextFormat(Qt.TextFormat.PlainText)
    label.setWordWrap(True)
    label.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop)
    label.setAccessibleName(name)
    label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)
    return label
