"""The tour of two minutes: one thing to do after another, each done by who takes it.

A step is over when what it asks for has been done, and not before; nothing is shown as done that
was not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import JobView
from ocmm_gui.kit import later, tr

_MOVED_MM = 40.0


@dataclass(frozen=True, slots=True)
class TourLook:
    """What the tour can see."""

    taken: bool
    """Whoever takes the tour holds the probe."""
    points: int
    tip_world: Float | None
    """(3,), mm; None while it is not known."""
    turn: tuple[float, float]
    """rad: how the probe is leaned."""
    page: str
    """Name of the page that is shown: ``"desk"``, ``"far"``, or another one."""
    job: JobView


@dataclass(frozen=True, slots=True)
class TourStep:
    """One thing to do: what is said, and whether it was done since ``begun``."""

    key: str
    sentence: str
    done: Callable[[TourLook, TourLook], bool]


def _moved(begun: TourLook, now: TourLook) -> bool:
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
"""In order."""


class Tour:
    """Where somebody is in the tour."""

    def __init__(self) -> None:
        self._place: int | None = None
        self._begun: TourLook | None = None

    @property
    def runs(self) -> bool:
        """Return whether somebody takes the tour."""
        return self._place is not None

    @property
    def step(self) -> TourStep | None:
        """Return what is to be done now."""
        return None if self._place is None else TOUR[self._place]

    @property
    def number(self) -> int:
        """Return which step it is, from 1; 0 where there is none."""
        return 0 if self._place is None else self._place + 1

    def begin(self) -> None:
        """Begin with the first step."""
        self._place, self._begun = 0, None

    def end(self) -> None:
        """End the tour."""
        self._place = None

    def skip(self) -> None:
        """Go to the next step though this one was not done."""
        if self._place is not None:
            self._place = self._place + 1 if self._place + 1 < len(TOUR) else None
            self._begun = None

    def look(self, now: TourLook) -> bool:
        """See whether the step was done; return whether another one begins, or the tour is over."""
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
        """Return what is said of the step; empty where there is none."""
        step = self.step
        return "" if step is None else tr(step.sentence).format(feature=feature)

    def _needs_new_start(self, now: TourLook) -> bool:
        """Return whether nothing was known of the ball when the step began."""
        begun = self._begun
        return begun is not None and begun.tip_world is None and now.tip_world is not None
