"""A hint that does not flicker: it waits before appearing, vanishing and changing."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.coach._advice import Advice, Hint

WAIT_S = 0.6
"""Shorter changes are hand movements that nobody can follow."""
KEPT_SHARE = 0.07
"""A shown hint stays until its share falls below this: half of the share to appear."""
_MUCH_BETTER = 0.12
"""Additional reduction of U for another way to replace the hint."""
_OTHER_DEG, _OTHER_U = 10, 0.1
"""Changes of angle and, as a share, of U that update a shown hint."""


@dataclass(slots=True)
class SteadyHint:
    """Steady the hint shown, fed with each advice."""

    shown: Hint | None = None
    _coming: Hint | None = None
    _changing: bool = False
    _since_s: float = 0.0
    _worded_s: float = float("-inf")

    def feed(self, advice: Advice | None, time_s: float) -> Hint | None:
        """Take in an advice, or None, and return the hint to show."""
        wanted = self._wanted(advice)
        if _alike(wanted, self.shown):
            self._changing = False
            self._reword(wanted, time_s)
            return self.shown
        if not self._changing or not _alike(wanted, self._coming):
            self._since_s = time_s
        self._changing, self._coming = True, wanted
        if time_s - self._since_s >= WAIT_S:
            self.shown, self._changing, self._worded_s = wanted, False, time_s
        return self.shown

    def _wanted(self, advice: Advice | None) -> Hint | None:
        if advice is None:
            return None
        best = advice.best()
        if self.shown is None:
            return best
        # Pairs of turns are only tried if no single one suffices.
        kept = advice.along(self.shown.ways)
        if kept is None or kept.share < KEPT_SHARE:
            return best
        if best is not None and best.share >= kept.share + _MUCH_BETTER:
            return best
        return kept

    def _reword(self, wanted: Hint | None, time_s: float) -> None:
        if wanted is None or self.shown is None or time_s - self._worded_s < WAIT_S:
            return
        now = self.shown
        if (
            abs(wanted.degrees - now.degrees) >= _OTHER_DEG
            or abs(wanted.now_mm - now.now_mm) > _OTHER_U * now.now_mm
            or abs(wanted.then_mm - now.then_mm) > _OTHER_U * now.then_mm
        ):
            self.shown, self._worded_s = wanted, time_s


def _alike(one: Hint | None, other: Hint | None) -> bool:
    if one is None or other is None:
        return one is other
    return one.ways == other.ways
