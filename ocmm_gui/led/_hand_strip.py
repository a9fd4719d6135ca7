"""Strip with the holder of the virtual probe, and the next action."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QFrame, QHBoxLayout, QPushButton, QSizePolicy

from ocmm_gui.kit import DEFAULT_THEME, THEMES, Theme, make_button, sentence_label, text_font, tr

_BUTTON_PX = 40


class HandStrip(QFrame):
    """One sentence with its buttons; hidden for real probes."""

    def __init__(self, hand: QAction, tour: QAction) -> None:
        super().__init__()
        self.setObjectName("hand")
        self.setAccessibleName(tr("Who holds the probe"))
        self._theme = THEMES[DEFAULT_THEME]
        self._step = self._words = ""
        self._practises = False
        self._said = ""
        self.text = sentence_label(tr("What to do"), 17)
        self.text.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        self.text.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.hand_button = _button(make_button(hand, primary=True))
        self.tour_button = _button(make_button(tour))
        self.skip_button = _button(QPushButton(tr("Skip step")))
        self.skip_button.setAccessibleName(tr("Skip this step of the tour"))
        self._hand, self._tour = hand, tour
        layout = QHBoxLayout(self)
        layout.setContentsMargins(14, 5, 14, 5)
        layout.setSpacing(10)
        layout.addWidget(self.text, 1)
        for button in (self.skip_button, self.hand_button, self.tour_button):
            layout.addWidget(button)
        self.skip_button.hide()
        self.hide()

    def show_waiting(self) -> None:
        """Show that nothing is measured, while a job is only viewed."""
        self._said = tr("SIMULATED: a virtual part. The probe rests until you measure.")
        self._show(self._words or self._said)

    def show_hand(self, *, taken: bool) -> None:
        """Show the holder of the probe, unless the tour runs."""
        words = tr("Hand back") if taken else tr("Take over")
        if self._hand.text() != words:
            self._hand.setText(words)
            self.hand_button.setText(f"{words}  [{self._hand.shortcut().toString()}]")
            self.hand_button.setAccessibleName(words)
        if taken:
            said = tr(
                "SIMULATED: you measure. Move the mouse over the part and click to touch. "
                "Wheel: nearer. Arrow keys: tilt the probe. Right button: turn the view."
            )
        else:
            said = tr(
                "SIMULATED: a robot hand measures a virtual part. Take over to do it yourself."
            )
        self._said = said
        self._show(self._words or said)

    def show_step(self, sentence: str, number: int, count: int) -> None:
        """Show a step of the tour; an empty sentence ends it."""
        self._step = sentence
        self.skip_button.setVisible(bool(sentence) and not self._practises)
        words = tr("End tour") if sentence else tr("Tour")
        if self._tour.text() != words:
            self._tour.setText(words)
            self.tour_button.setText(f"{words}  [{self._tour.shortcut().toString()}]")
            self.tour_button.setAccessibleName(words)
        self._words = (
            tr("Tour {number}/{count}. {sentence}").format(
                number=number, count=count, sentence=sentence
            )
            if sentence
            else ""
        )
        self._show(self._words or self._said)

    def show_practice(self, *, practises: bool) -> None:
        """Show only that practice does not count."""
        self._practises = practises
        for button in (self.hand_button, self.tour_button):
            button.setVisible(not practises)
        self.skip_button.setVisible(bool(self._step) and not practises)
        self._show(self._words or self._said)

    def set_theme(self, theme: Theme) -> None:
        self._theme = theme
        self.setStyleSheet(
            f"#hand {{ background: {theme.panel}; border-bottom: 3px solid {theme.accent}; }}"
            f" #hand QLabel {{ color: {theme.text}; font-weight: bold; }}"
        )

    def _show(self, text: str) -> None:
        if self._practises:
            text = tr(
                "PRACTICE: a virtual hand does what each step asks. Nothing of it is valid for "
                "measuring."
            )
        if self.text.text() != text:
            self.text.setText(text)


def _button(button: QPushButton) -> QPushButton:
    button.setMinimumHeight(_BUTTON_PX)
    button.setFont(text_font(15, bold=True))
    return button
