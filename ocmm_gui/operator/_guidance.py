"""Guidance: next step, instruction, and reason for the last refused touch."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QLabel, QSizePolicy, QVBoxLayout

from ocmm_core.inspection.evaluation import JobView, LiveView
from ocmm_gui.kit import (
    DEFAULT_THEME,
    THEMES,
    PlainLabel,
    Theme,
    approach_words,
    has_failed,
    mode_words,
    next_step,
    step_text,
    tr,
    trouble,
)


class Guidance(QFrame):
    """Next step, plan text, distance to the next point, and trouble."""

    def __init__(self, pixels: int = 16) -> None:
        super().__init__()
        self._pixels = pixels
        self._theme = THEMES[DEFAULT_THEME]
        self._job: JobView | None = None
        self._live: LiveView | None = None
        self._step = _sentence(tr("Next step"))
        self._words = _sentence(tr("Instruction of the plan"))
        self._mode = _sentence(tr("Probing order and probe side"))
        self._approach = _sentence(tr("Approach to the next point"))
        self._trouble = _sentence(tr("Blocking reason"))
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(3)
        for widget in (self._step, self._words, self._approach, self._mode):
            layout.addWidget(widget)
        layout.addWidget(self._trouble, 1)
        self._paint()

    def show_job(self, job: JobView) -> None:
        self._job = job
        self._show_step()
        self._words.setText(step_text(job))
        self._words.setVisible(bool(self._words.text()))
        self._mode.setText(mode_words(job))
        self._show_approach()
        self._show_trouble()

    def show_live(self, live: LiveView) -> None:
        self._live = live
        self._show_step()
        self._show_approach()
        self._show_trouble()

    def step(self) -> str:
        return self._step.text()

    def mode(self) -> str:
        return self._mode.text()

    def trouble(self) -> str:
        return self._trouble.text()

    def set_theme(self, theme: Theme) -> None:
        self._theme = theme
        self._paint()

    def _show_step(self) -> None:
        text = "" if self._job is None else next_step(self._job, self._live)
        if text != self._step.text():
            self._step.setText(text)

    def _show_approach(self) -> None:
        text = approach_words(self._job, self._live)
        if text != self._approach.text():
            self._approach.setText(text)
        self._approach.setVisible(bool(text))

    def _show_trouble(self) -> None:
        # The reason of a failure is long and shown above, instead of the digits.
        live = None if has_failed(self._live) else self._live
        text = "\n".join(trouble(live, self._job))
        if text != self._trouble.text():
            self._trouble.setText(text)

    def _paint(self) -> None:
        size = f"font-size: {self._pixels}px;"
        small = f"font-size: {round(0.85 * self._pixels)}px;"
        self._step.setStyleSheet(f"{size} font-weight: bold; color: {self._theme.text};")
        self._words.setStyleSheet(f"{size} color: {self._theme.text};")
        self._approach.setStyleSheet(f"{size} color: {self._theme.accent};")
        self._mode.setStyleSheet(f"{small} color: {self._theme.muted};")
        self._trouble.setStyleSheet(f"{size} color: {self._theme.bad};")


def _sentence(name: str) -> QLabel:
    label = PlainLabel()
    label.setTextFormat(Qt.TextFormat.PlainText)
    label.setWordWrap(True)
    label.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop)
    label.setAccessibleName(name)
    label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)
    return label
