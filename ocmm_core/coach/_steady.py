"""A hint that does not flicker: it waits before it comes, before it goes, and before it turns."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.coach._advice import Advice, Hint

WAIT_S = 0.6
"""What holds for less is a movement of the hand, and nobody can follow it."""
KEPT_SHARE = 0.07
"""A hint that is shown stays until less than this is left of it: half of what made it come."""
_MUCH_BETTER = 0.12
"""Another way must take so much more off U before it is said instead."""
_OTHER_DEG, _OTHER_U = 10, 0.1
"""A hint that is shown is worded anew where it is so much another one."""


@dataclass(slots=True)
class SteadyHint:
    """Keep what is shown; fed with the advice of every moment."""

    shown: Hint | None = None
    """What stands on the screen; None where nothing does."""
    _coming: Hint | None = None
    _changing: bool = False
    _since_s: float = 0.0
    _worded_s: float = float("-inf")

    def feed(self, advice: Advice | None, time_s: float) -> Hint | None:
        """Take in the advice of a moment, None where there is none, and return what is shown."""
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
        # Two turns at once are only looked for where no single one is worth it.
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
    """Return whether two hints say the same way."""
    if one is None or other is None:
        return one is other
    return one.ways == other.ways
