"""Outlier flags, and held points: stored and shown, but proving nothing until released.

Flags mark points of a feature that lie far from the others. If calibration or tip became suspect,
the points since the last good check may be wrong and are held. The events of the job file alone
determine which ones, so that they stay held when it is reopened. A whole job is withdrawn if its
results are unknown.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from enum import Enum

import numpy as np

from ocmm_core.documents import shortened
from ocmm_core.errors import FitError
from ocmm_core.features import measured
from ocmm_core.features.measured import outliers as outlier_rows
from ocmm_core.features.search import unambiguous
from ocmm_core.features.shapes import DIRECTION, Criterion, NominalFeature
from ocmm_core.inspection.evaluation._view import FeatureView, JobView
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobEvent, bad_event
from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict, not_proven

SMALLEST_MM = 0.02
"""mm: smaller distances from the element of the other points are form, not flagged."""
REMOVE = "Delete it, or touch the place again to confirm it."
"""Remedy for points that command a fit."""
USUAL_MM: tuple[float, ...] = tuple(0.015 * 2.0 ** (0.5 * k) for k in range(33))
"""Scatter to be expected of a feature, in steps: it depends on all others and changes with each of
their touches, on which no search of this feature shall wait."""


def outliers(feature: measured.ActualFeature) -> tuple[int, ...]:
    """Return the numbers of contradicted points, for flags only; see `features.outliers`."""
    if feature.raw is None or feature.touches is None:
        return ()
    fit, tips = feature.raw, feature.touches.tips
    if fit.criterion is not Criterion.LEAST_SQUARES:
        try:
            fit = unambiguous(measured.fit_shape(fit.shape, tips, direction_hint=fit.direction))
        except FitError:
            return ()
    rows = outlier_rows(fit, tips, smallest=SMALLEST_MM)
    return tuple(feature.numbers[row] for row in rows)


_Found = measured.ActualFeature | FitError


def scatter_of(one: _Found) -> float | None:
    """Return the rms of the residuals of a probed feature, mm; None if not fitted."""
    if isinstance(one, FitError) or one.raw is None:
        return None
    return float(np.sqrt(np.mean(one.raw.residuals**2)))


def is_examined(
    nominal: NominalFeature, scatters: Mapping[str, float], plane: _Found | None
) -> bool:
    """Return whether a feature may have commanding points: large rms, or no fit."""
    if nominal.projection and not isinstance(plane, measured.ActualFeature):
        return False
    # Otherwise nothing to refit, and independent of all other features.
    return scatters.get(nominal.name, np.inf) > SMALLEST_MM


class UsualScatter:
    """Scatter to be expected of each feature, by that of all."""

    def __init__(self, scatters: Mapping[str, float]) -> None:
        self._scatters, self._sorted = scatters, sorted(scatters.values())

    def lookup(self, name: str) -> float:
        """Return one of `USUAL_MM`: the median of the other features, rounded up."""
        sizes, own = self._sorted, self._scatters.get(name)
        # Without one's own: places from it on are one further.
        skipped = len(sizes) if own is None else bisect_left(sizes, own)
        count = len(sizes) - (own is not None)
        if not count:
            return USUAL_MM[0]
        low, high = (k + (k >= skipped) for k in ((count - 1) // 2, count // 2))
        middle = 0.5 * (sizes[low] + sizes[high])
        return next((step for step in USUAL_MM if step >= middle), USUAL_MM[-1])


def commanding(
    nominal: NominalFeature,
    points: Sequence[MeasuredPoint],
    actual: Mapping[str, measured.ActualFeature | FitError],
) -> measured.CommandingPoints | None:
    """Return the points of a probed feature that command its fit, or prevent it; or None.

    ``actual``, all features: the plane it is projected onto, and the scatter to be expected.
    """
    sizes = ((name, scatter_of(one)) for name, one in actual.items())
    scatters = {name: size for name, size in sizes if size is not None}
    plane = actual.get(nominal.projection)
    if not is_examined(nominal, scatters, plane):
        return None
    return commanding_among(nominal, points, plane, UsualScatter(scatters).lookup(nominal.name))


def commanding_among(
    nominal: NominalFeature, points: Sequence[MeasuredPoint], plane: _Found | None, usual: float
) -> measured.CommandingPoints | None:
    """Return the commanding points of a feature that `is_examined`, for a ``usual`` scatter."""
    normal = plane.fit.geometry[DIRECTION] if isinstance(plane, measured.ActualFeature) else None
    return measured.commanding_touches(nominal, points, normal, usual, SMALLEST_MM)


_NUMBERS = re.compile(r"[0-9]{1,10}(,[0-9]{1,10})*")
WITHDRAWN = "Result withdrawn."


class HoldReason(Enum):
    """Reason for holding points, and so the condition of their release.

    Each has its own kinds of events, with the text ``5,6,7: reason``: points, then the reason.
    """

    CAMERAS = (
        "points held back",
        "points released",
        "Verify the calibration. If it passes, the points count again; if not, re-probe them.",
    )
    TIP = (
        "points held back for the tip",
        "points released for the tip",
        "Run the quick tip check. If it passes, the points count again; if not, re-probe them.",
    )
    FAILED_TIP = (
        "points of a tip that failed",
        "points of a tip that failed, released",
        "Re-probe them.",
    )
    """Never released: the start of the tip's error is unknown."""
    CALIBRATION = (
        "points held back for the calibration",
        "points released for the calibration",
        "Verify the calibration. If it passes, the points count again; if not, recall the jobs.",
    )
    """By the history of the calibration; alarms of the monitor within the job are `CAMERAS`."""
    FAILED_CALIBRATION = (
        "points of a calibration that failed",
        "points of a calibration that failed, released",
        "Recall the jobs (ocmm recall) and re-probe the points it does not release.",
    )
    """Released by a recall only: the start of the cameras' error is unknown."""

    def __init__(self, held: str, released: str, remedy: str) -> None:
        self.held = held
        self.released = released
        self.remedy = remedy


def event_text(numbers: Collection[int], reason: str) -> str:
    return f"{','.join(str(number) for number in sorted(numbers))}: {reason}"


def held_back(
    events: Sequence[JobEvent], hold_reason: HoldReason = HoldReason.CAMERAS
) -> dict[int, str]:
    """Return the held points after these events, oldest first, and the reason of each."""
    held: dict[int, str] = {}
    for event in events:
        if event.kind not in (hold_reason.held, hold_reason.released):
            continue
        names, _, reason = event.text.partition(": ")
        if not _NUMBERS.fullmatch(names):
            raise bad_event(event.kind, f"{shortened(names)} are no points")
        for name in names.split(","):
            if event.kind == hold_reason.held:
                held[int(name)] = reason
            else:
                held.pop(int(name), None)
    return held


def notes_of(held: Mapping[HoldReason, Mapping[int, str]]) -> dict[int, str]:
    """Return reason and remedy of every held point."""
    notes: dict[int, str] = {}
    # Permanent reasons first.
    for hold_reason in reversed(HoldReason):
        for number, reason in held[hold_reason].items():
            notes.setdefault(number, f"{reason} {hold_reason.remedy}")
    return notes


def notes_on(
    points: Mapping[str, Sequence[MeasuredPoint]], held: Mapping[int, str]
) -> dict[str, str]:
    """Return by feature why its points prove nothing, and the remedy, if any are held."""
    notes: dict[str, str] = {}
    for name, own in points.items() if held else ():
        found = [point.number for point in own if point.number in held]
        if found:
            notes[name] = _note(name, found, held[found[0]])
    return notes


def _note(feature: str, numbers: Sequence[int], why: str) -> str:
    count = "1 point" if len(numbers) == 1 else f"{len(numbers)} points"
    return f"{count} of {feature} held back. {why}"


def held_below(result: CharacteristicResult, plan: Plan, view: JobView) -> tuple[int, ...]:
    """Return the numbers of the held points that a result depends on."""
    item = next((item for item in plan.characteristics if item.name == result.name), None)
    names = result.features if item is None else plan.rests_on(item)
    return tuple(
        point.number
        for feature in view.features
        if feature.name in names
        for point in feature.points
        if point.number in view.held
    )


def with_doubt(
    result: CharacteristicResult, features: Sequence[str], notes: Mapping[str, str]
) -> CharacteristicResult:
    """Return a result, NOT PROVEN if one of its features has a note."""
    why = next((notes[name] for name in features if name in notes), "")
    return not_proven(result, why) if why else result


def withdrawn(job: JobView, why: str) -> JobView:
    """Return a job with its points and without any computed number."""
    return replace(
        job,
        features=tuple(map(_without_fit, job.features)),
        constructed=tuple(map(_without_fit, job.constructed)),
        characteristics=tuple(map(_without_value, job.characteristics)),
        unproven=why,
        target=None,
    )


def _without_fit(feature: FeatureView) -> FeatureView:
    return replace(
        feature, fit=None, note=WITHDRAWN, outliers=(), commanding=None, coverage=None, targets=()
    )


def _without_value(result: CharacteristicResult) -> CharacteristicResult:
    return replace(
        result,
        measured=None,
        deviation=None,
        uncertainty=None,
        verdict=Verdict.NOT_MEASURED,
        note=WITHDRAWN,
        rule="",
        tur=None,
        leaning="",
        interval=None,
        floor=None,
        bonus=0.0,
    )
