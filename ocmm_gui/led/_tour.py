"""Two-minute tour: each step ends only when the user has performed its action."""

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
    """Inputs of the tour."""

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


class Tour:
    """Progress of the tour."""

    def __init__(self) -> None:
        self._place: int | None = None
        self._begun: TourLook | None = None

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

    def begin(self) -> None:
        self._place, self._begun = 0, None

    def end(self) -> None:
        self._place = None

    def skip(self) -> None:
        if self._place is not None:
            self._place = self._place + 1 if self._place + 1 < len(TOUR) else None
            self._begun = None

    def look(self, now: TourLook) -> bool:
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

    def _needs_new_start(self, now: TourLook) -> bool:
        """Return whether the ball was unknown when the step started."""
        begun = self._begun
        return begun is not None and begun.tip_world is None and now.tip_world is not None
