"""Deviation picture: one coloured whisker for each touched place.

The class of a whisker is decided only here. A place is within its limits if its deviation from the
middle of the zone is at most half the tolerance. It is shown as accepted only if the worst verdict
on its feature is CONFORM; otherwise as within, but not accepted.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.tolerances.decisions._verdict import (
    WORST_FIRST,
    CharacteristicResult,
    Verdict,
    summarise,
)

_LONGEST = 0.1
"""Drawn length of the longer of limit and greatest deviation, relative to the size of the part."""
_STEPS = (1.0, 2.0, 3.0, 5.0)


class DeviationClass(Enum):
    MORE = "too much material"
    WITHIN = "within, accepted"
    WITHIN_ONLY = "within, not accepted"
    LESS = "too little material"
    HELD = "held back"


@dataclass(frozen=True, slots=True, eq=False)
class Whisker:
    """The deviation of one touched place."""

    feature: str
    number: int
    characteristic: str
    """Source of the limits: of all that include this place, the one with the worst verdict."""
    base_world: Float
    end_world: Float
    """`base_world`, `end_world`: (3,), mm: on true geometry, and end of the magnified deviation."""
    deviation: float
    """mm, from the middle of the zone; positive for too much material."""
    share: float
    """Relative to half the tolerance: outside beyond 1."""
    kind: DeviationClass


@dataclass(frozen=True, slots=True)
class DeviationPicture:
    """All whiskers of a job."""

    whiskers: tuple[Whisker, ...]
    """Those outside last, so that they are drawn above."""
    factor: float
    """Magnification of the drawing."""
    limit: float | None
    """mm: half the tolerance, if common to all; None: the scale ends at the limits of each."""

    def count(self, kind: DeviationClass) -> int:
        return sum(whisker.kind is kind for whisker in self.whiskers)

    @property
    def worst(self) -> Whisker | None:
        """Return the whisker with the largest share of its tolerance, or None."""
        return max(self.whiskers, key=lambda item: abs(item.share), default=None)


NO_DEVIATIONS = DeviationPicture((), 1.0, None)


def deviation_picture(
    results: Sequence[CharacteristicResult], held: Collection[int] = ()
) -> DeviationPicture:
    """Return the deviations of a job as whiskers.

    None without tolerance, and for NOT MEASURED or PROVISIONAL ones. Pass all results: a whisker is
    never better than the worst on its feature. ``held`` are numbers of points held back.
    """
    shown: dict[tuple[str, int], tuple[CharacteristicResult, int]] = {}
    order = {verdict: place for place, verdict in enumerate(WORST_FIRST)}
    for result in sorted(results, key=lambda item: order[item.verdict]):
        seen = result.seen
        if seen is None or result.stated is None or not _half(result) > 0.0:
            continue
        for row, key in enumerate(zip(seen.features, seen.numbers, strict=True)):
            if np.isfinite(seen.deviations[row]):
                shown.setdefault(key, (result, row))
    if not shown:
        return NO_DEVIATIONS
    verdicts = {
        name: summarise([item for item in results if name in item.features], name).verdict
        for name in {name for name, _ in shown}
    }
    factor = _factor(list(shown.values()))
    whiskers = []
    for (name, number), (result, row) in shown.items():
        seen = result.seen
        if seen is None:
            continue
        off, share = float(seen.deviations[row]), float(seen.deviations[row]) / _half(result)
        base = seen.points[row] - off * seen.outward[row]
        whiskers.append(
            Whisker(
                name, number, result.name, base, base + factor * off * seen.outward[row], off,
                share, _kind(share, verdicts[name], result, held=number in held),
            )
        )  # fmt: skip
    whiskers.sort(key=lambda item: abs(item.share))
    limits = {round(_half(result), 9) for result, _ in shown.values()}
    return DeviationPicture(tuple(whiskers), factor, limits.pop() if len(limits) == 1 else None)


def _half(result: CharacteristicResult) -> float:
    return 0.5 * (result.upper - result.lower + result.bonus)


def _kind(
    share: float, verdict: Verdict | None, result: CharacteristicResult, *, held: bool
) -> DeviationClass:
    if held:
        return DeviationClass.HELD
    if not abs(share) <= 1.0:
        return DeviationClass.MORE if share > 0.0 else DeviationClass.LESS
    accepted = verdict is Verdict.CONFORM and result.verdict is Verdict.CONFORM
    return DeviationClass.WITHIN if accepted else DeviationClass.WITHIN_ONLY


def _factor(shown: Sequence[tuple[CharacteristicResult, int]]) -> float:
    """Return a round magnification that makes the deviations of a part comparable."""
    rows = [
        (result.seen.points[row], abs(float(result.seen.deviations[row])), _half(result))
        for result, row in shown
        if result.seen is not None
    ]
    points = np.array([point for point, _, _ in rows])
    size = max(float(np.linalg.norm(np.ptp(points, axis=0))), 10.0)
    longest = max(max(off, half) for _, off, half in rows)
    wanted = _LONGEST * size / max(longest, 1e-6)
    power = 10.0 ** np.floor(np.log10(wanted))
    step = max(step for step in _STEPS if step * power <= wanted * (1.0 + 1e-9))
    return float(max(step * power, 1.0))
