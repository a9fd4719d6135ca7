"""Strip with the holder of the virtual probe, and the tour.

Each step of the two-minute tour ends only when the user has performed its action.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QFrame, QPushButton

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import JobView
from ocmm_gui.kit import Themed, dressed, hbox, later, make_button, sentence_label, text_font, tr

_BUTTON_PX = 40


class HandStrip(Themed, QFrame):
    """One sentence with its buttons; hidden for real probes."""

    def __init__(self, hand: QAction, tour: QAction) -> None:
        super().__init__()
        self.setObjectName("hand")
        self.setAccessibleName(tr("Who holds the probe"))
        self._step = self._words = ""
        self._practises = False
        self._said = ""
        self.text = sentence_label(tr("What to do"), 17, middle=True)
        self.hand_button = make_button(hand, primary=True)
        self.tour_button = make_button(tour)
        self.skip_button = dressed(QPushButton(tr("Skip step")), tr("Skip this step of the tour"))
        self._hand, self._tour = hand, tour
        buttons = (self.skip_button, self.hand_button, self.tour_button)
        for button in buttons:
            dressed(button, font=text_font(15, bold=True), high=_BUTTON_PX)
        hbox((self.text, 1), *buttons, parent=self, spacing=10, margins=(14, 5, 14, 5))
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

    def _paint(self) -> None:
        theme = self._theme
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


_MOVED_MM = 40.0


@dataclass(frozen=True, slots=True)
class TourInputs:
    taken: bool
    points: int
    tip_world: Float | None
    """(3,), mm; None if unknown."""
    turn: tuple[float, float]
    """rad: lean of the probe."""
    page: str
    """Current page: ``"desk"``, ``"far"``, or another one."""
    job: JobView


@dataclass(frozen=True, slots=True)
class TourStep:
    """One step: sentence, and condition since ``begun``."""

    key: str
    sentence: str
    done: Callable[[TourInputs, TourInputs], bool]


def _moved(begun: TourInputs, now: TourInputs) -> bool:
    if begun.tip_world is None or now.tip_world is None:
        return False
    return float(np.linalg.norm(now.tip_world - begun.tip_world)) >= _MOVED_MM


TOUR = (
    TourStep(
        "take", later("Press Take over: the robot gives you the probe."),
        lambda _begun, now: now.taken,
    ),
    TourStep(
        "move", later("Move the mouse over the part: the ball follows."),
        lambda begun, now: now.taken and _moved(begun, now),
    ),
    TourStep(
        "touch", later("Click on {feature}: the ball touches, and a point is taken."),
        lambda begun, now: now.points > begun.points,
    ),
    TourStep(
        "more", later("Take two more points on {feature}, well apart."),
        lambda begun, now: now.points >= begun.points + 2,
    ),
    TourStep(
        "undo", later("Press Backspace: the last point is undone, not lost."),
        lambda begun, now: now.points < begun.points,
    ),
    TourStep(
        "lean", later("Press an arrow key: the probe tilts. The cameras must see its LEDs."),
        lambda begun, now: now.turn != begun.turn,
    ),
    TourStep(
        "results", later("Press F3: the results, and how sure they are."),
        lambda _begun, now: now.page not in ("desk", "far"),
    ),
    TourStep(
        "return", later("Press Esc: back to the part."),
        lambda _begun, now: now.page in ("desk", "far"),
    ),
    TourStep(
        "back", later("Press Hand back: the robot goes on. Ctrl+K finds everything else."),
        lambda _begun, now: not now.taken,
    ),
)  # fmt: skip


class Tour:
    """Progress of the tour."""

    def __init__(self) -> None:
        self._place: int | None = None
        self._begun: TourInputs | None = None

    @property
    def runs(self) -> bool:
        return self._place is not None

    @property
    def step(self) -> TourStep | None:
        return None if self._place is None else TOUR[self._place]

    @property
    def number(self) -> int:
        """Return the step number, from 1; 0 if not running."""
        return 0 if self._place is None else self._place + 1

    def start(self) -> None:
        self._place, self._begun = 0, None

    def end(self) -> None:
        self._place = None

    def skip(self) -> None:
        if self._place is not None:
            self._place = self._place + 1 if self._place + 1 < len(TOUR) else None
            self._begun = None

    def poll(self, now: TourInputs) -> bool:
        """Check the step; return whether the next one starts or the tour ends."""
        step = self.step
        if step is None:
            return False
        if self._begun is None or self._needs_new_start(now):
            self._begun = now
        if not step.done(self._begun, now):
            return False
        self.skip()
        self._begun = now if self.runs else None
        return True

    def sentence(self, feature: str) -> str:
        """Return the sentence of the step; empty if not running."""
        step = self.step
        return "" if step is None else tr(step.sentence).format(feature=feature)

    def _needs_new_start(self, now: TourInputs) -> bool:
        """Return whether the ball was unknown when the step started."""
        begun = self._begun
        return begun is not None and begun.tip_world is None and now.tip_world is not None
