"""Possible causes of a result, and queries to its job: evidence, and results under hypotheses.

Causes of NOT CONFORM or NOT PROVEN are in the words of the report. They depend on the distance of a
value from its limits, with and without U.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np

from ocmm_core.alignment import unknown_frame
from ocmm_core.errors import MeasuringError, OcmmError
from ocmm_core.geometry import Float
from ocmm_core.inspection.causes._common_causes import (
    Common,
    common_causes,
    scatter_of,
    scatter_ratio,
)
from ocmm_core.inspection.causes._deviations import Suspects, suspects_of
from ocmm_core.inspection.evaluation import EvaluatedJob, JobView, held_below
from ocmm_core.measuring import MeasuredPoint, Rows
from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict
from ocmm_core.tolerances.kinds import needs_part_frame, spec_of
from ocmm_core.tolerances.uncertainty import Budget, budget_of
from ocmm_core.tolerances.zones import Characteristic, Evaluation


def limits_of(item: Characteristic, result: CharacteristicResult) -> tuple[float, float]:
    """Return the limits of a value, its bonus included; the lower one may be infinite."""
    low = float("-inf") if spec_of(item.kind).one_sided else item.nominal + item.lower
    return low, item.nominal + item.upper + result.bonus


def is_low(item: Characteristic, result: CharacteristicResult) -> bool:
    low, high = limits_of(item, result)
    value = result.measured
    return value is not None and low - value > value - high


def way_to_good(item: Characteristic, result: CharacteristicResult) -> float | None:
    """Return the distance of a value from conformity, U included; None without a value."""
    beyond, uncertainty = beyond_limit(item, result), result.uncertainty
    return None if beyond is None or uncertainty is None else beyond + uncertainty


def beyond_limit(item: Characteristic, result: CharacteristicResult) -> float | None:
    """Return the distance beyond the nearer limit, negative inside; None without a value."""
    value = result.measured
    if value is None:
        return None
    low, high = limits_of(item, result)
    return max(low - value, value - high)


def amount_words(item: Characteristic, result: CharacteristicResult) -> str:
    """Return the excess of a value, or the required U or value, next to U, in words."""
    beyond, u, value = beyond_limit(item, result), result.uncertainty, result.measured
    if beyond is None or u is None or value is None:
        return result.note
    # Decided in place, so that a sentence is collected whole for each unit.
    turns = result.unit == "deg"
    low, high = limits_of(item, result)
    above = value - high >= low - value
    limit, word = (high, "upper") if above else (low, "lower")
    if result.verdict is Verdict.NOT_CONFORM:
        times = f" ({beyond / u:.1f} times U)" if u > 0.0 and beyond > 0.0 else ""
        return (
            f"{beyond:.4f}{'°' if turns else ' mm'} beyond the {word} limit "
            f"{limit:.4f}{'°' if turns else ' mm'}; U is {u:.4f}{'°' if turns else ' mm'}{times}."
        )
    if high - low < 2.0 * u and low > float("-inf"):
        return (
            f"U is {u:.4f}{'°' if turns else ' mm'}, but the tolerance is only "
            f"{high - low:.4f}{'°' if turns else ' mm'} wide: U would have to be below "
            f"{0.5 * (high - low):.4f}{'°' if turns else ' mm'}."
        )
    if abs(beyond) > u and result.note:
        # The number is clear of the limit: the reason is in the note.
        return f"Not because of U, which is {u:.4f}{'°' if turns else ' mm'}: {result.note}"
    edge = limit - u if above else limit + u
    if beyond > 0.0:
        return (
            f"{beyond:.4f}{'°' if turns else ' mm'} beyond the {word} limit "
            f"{limit:.4f}{'°' if turns else ' mm'}, less than U "
            f"({u:.4f}{'°' if turns else ' mm'}): neither conformance nor non-conformance is "
            "proven."
        )
    side = "above" if not above else "below"
    return (
        f"{-beyond:.4f}{'°' if turns else ' mm'} inside the {word} limit "
        f"{limit:.4f}{'°' if turns else ' mm'}, but U is {u:.4f}{'°' if turns else ' mm'}: U "
        f"would have to be below {-beyond:.4f}{'°' if turns else ' mm'}, or the value {side} "
        f"{edge:.4f}{'°' if turns else ' mm'}."
    )


class Cause(Enum):
    """Cause that the evidence supports."""

    OUTLIER = "outlier"
    BURR = "burr"
    SIDE = "probe side"
    COVERAGE = "weak coverage"
    NOISE = "scatter of the points"
    TIP = "tip"
    TEMPERATURE = "temperature"
    DATUM = "datum"
    ALIGNMENT = "alignment"
    UNCERTAINTY = "uncertainty"
    DOUBT = "measurement in doubt"
    PART = "the part"


@dataclass(frozen=True, slots=True)
class CauseFinding:
    """A cause with its evidence."""

    cause: Cause
    features: tuple[str, ...]
    points: tuple[int, ...]
    """Numbers of the points that drive the value, the strongest first."""
    suggestion: str
    """What to do, one sentence."""
    evidence: str = ""
    """One sentence; may be empty."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """Why one characteristic is not CONFORM, and what to do."""

    characteristic: str
    verdict: Verdict
    unit: str
    beyond: float | None
    """Distance beyond the nearer limit, in ``unit``; negative inside, None without a value."""
    uncertainty: float | None
    """U (95 %); None together with ``beyond``."""
    why: str
    """The amount next to U, in one or two sentences."""
    finding: CauseFinding

    @property
    def cause(self) -> Cause:
        return self.finding.cause

    @property
    def points(self) -> tuple[int, ...]:
        return self.finding.points

    @property
    def suggestion(self) -> str:
        return self.finding.suggestion


def points_words(numbers: Sequence[int]) -> str:
    """Return numbers in words: "point 3", "points 3, 4 and 5"."""
    if len(numbers) == 1:
        return f"point {numbers[0]}"
    return f"points {', '.join(str(n) for n in numbers[:-1])} and {numbers[-1]}"


MOST_POINTS = 5
"""Maximum number of named points."""

CURED = 0.4
"""Share of the distance to the limit that may remain if a cause explains a value."""
_WEAKEST = 0.5
"""Points with a weaker push relative to the strongest are not named."""

Results = Mapping[str, CharacteristicResult]


class Inquiry:
    """Queries to one job; shared quantities are computed once."""

    def __init__(self, job: EvaluatedJob, view: JobView) -> None:
        self.job = job
        self.view = view
        asked = {
            result.name
            for result in view.characteristics
            if result.verdict in (Verdict.NOT_CONFORM, Verdict.NOT_PROVEN)
        }
        self.items = [item for item in job.plan.characteristics if item.name in asked]
        self.numbers = np.array([point.number for point in job.points])
        self._trials: dict[str, Results] = {}

    # Facts of the job.

    @cached_property
    def suspects(self) -> dict[str, Suspects]:
        """Return the points contradicted by their own feature, by feature."""
        found = {}
        for sample in self.job.samples:
            # Noise depends on the direction of a face, so features are compared relative to it.
            others = [scatter_ratio(item) for item in self.job.samples if item is not sample]
            noise = sample.scatter / scatter_ratio(sample)
            usual = max(float(np.median(others)), 1.0) * noise if len(others) > 1 else None
            seen = suspects_of(self.job.actual[sample.feature], noise, usual)
            if seen is not None:
                found[sample.feature] = seen
        return found

    @cached_property
    def common(self) -> Common | None:
        """Return the common errors; None while the pose of the part is unknown."""
        out = {number for item in self.suspects.values() for number in item.numbers}
        places = np.flatnonzero(np.isin(self.numbers, list(out)))
        return common_causes(self.job, places.tolist())

    @cached_property
    def as_measured(self) -> Results:
        return self._named(self.job.results_of(self.items))

    @cached_property
    def noisy(self) -> float | None:
        """Return the excess scatter of nearly all points relative to noise; None if normal."""
        return scatter_of(self.job, self.suspects.keys())

    @cached_property
    def held_by(self) -> tuple[str, ...]:
        """Return the features that hold the part frame, which influence several values."""
        bound = self.job.plan.bound_alignment
        return () if bound is None else bound.features

    def is_doubted(self, item: Characteristic, result: CharacteristicResult) -> bool:
        """Return whether something other than the value decides: its note has the remedy."""
        if result.verdict is not Verdict.NOT_PROVEN:
            return False
        if self.view.unproven or held_below(result, self.job.plan, self.view):
            return True
        return bool(unknown_frame(self.job.alignment)) and needs_part_frame(item)

    # Results under hypotheses.

    @staticmethod
    def _named(results: Sequence[CharacteristicResult]) -> Results:
        return {result.name: result for result in results}

    def trial(self, key: str, make: Callable[[], Sequence[CharacteristicResult]]) -> Results:
        """Return the results in question from ``make``, cached by key."""
        if key not in self._trials:
            try:
                self._trials[key] = self._named(make())
            except OcmmError:
                # A hypothesis that cannot be evaluated explains nothing.
                self._trials[key] = {}
        return self._trials[key]

    def moved(self, key: str, by: Callable[[], Float]) -> Results:
        """Return the results in question with ball centres moved by (N, 3), mm."""
        job = self.job
        return self.trial(key, lambda: job.results_of(self.items, job.moved(by())))

    def cured(self, item: Characteristic, trial: Results) -> float | None:
        """Return the remaining share of the distance to the limit, 0 to `CURED`; None if more."""
        before, after = self.as_measured.get(item.name), trial.get(item.name)
        if before is None or after is None:
            return None
        way, left = way_to_good(item, before), way_to_good(item, after)
        if way is None or left is None or way <= 0.0 or left > CURED * way:
            return None
        return max(left, 0.0) / way

    def turned(self, name: str) -> tuple[MeasuredPoint, ...]:
        """Return the points of the job, with one feature compensated to the other side."""
        return tuple(
            replace(point, direction=-point.direction) if point.feature == name else point
            for point in self.job.points
        )

    def rests_on(self, item: Characteristic) -> list[str]:
        return self.job.plan.rests_on(item)

    def own_features(self, item: Characteristic) -> tuple[str, ...]:
        """Return the toleranced probed features, including datums that are toleranced."""
        return tuple(
            dict.fromkeys(name for one in item.features for name in self.job.plan.probed(one))
        )

    def own_points(self, name: str) -> tuple[int, ...]:
        feature = self.job.actual.get(name)
        return () if feature is None else feature.numbers

    def jacobian(self, rows: Rows, name: str) -> Float:
        """Return the derivative of a value by its feature's points along their normals, (n,)."""
        for sample in self.job.samples:
            if sample.feature == name:
                jacobian = sample.jacobian(rows)
                strongest = int(np.argmax(np.sum(jacobian**2, axis=1)))
                found: Float = jacobian[strongest]
                return found
        return np.zeros(0)

    def strongest(self, item: Characteristic, result: CharacteristicResult) -> tuple[int, ...]:
        """Return the points that push the value most in its direction."""
        evaluation, common = self.job.evaluations.get(item.name), self.common
        if spec_of(item.kind).form_alone:
            return self.extremes(item.features[0])
        if evaluation is None:
            return ()
        sign = -1.0 if is_low(item, result) else 1.0
        if common is None:
            # Pose of the part unknown: each point counts by its distance from its element.
            return self._foremost(self._by_residuals(evaluation, sign))
        back = common.place.T_nominal_from_world
        pushes: list[tuple[float, int]] = []
        for surface in common.surfaces:
            off, normals, _ = surface.lies(back)
            push = (
                sign
                * off
                * np.sum(evaluation.gradient.at(surface.places) * (normals @ back.rotation), axis=1)
            )
            pushes += zip(push.tolist(), self.numbers[surface.places].tolist(), strict=True)
        return self._foremost(pushes)

    def _by_residuals(self, evaluation: Evaluation, sign: float) -> list[tuple[float, int]]:
        pushes: list[tuple[float, int]] = []
        for sample in self.job.samples:
            residuals = self.job.actual[sample.feature].fit.residuals
            jacobian = sample.jacobian(evaluation.gradient[None])[0]
            # A line has two directions of residual across it, and its residuals have no sign.
            if len(jacobian) == len(residuals):
                numbers = self.numbers[sample.places].tolist()
                pushes += zip((sign * jacobian * residuals).tolist(), numbers, strict=True)
        return pushes

    @staticmethod
    def _foremost(pushes: list[tuple[float, int]]) -> tuple[int, ...]:
        pushes.sort(reverse=True)
        least = _WEAKEST * pushes[0][0] if pushes else 0.0
        return tuple(number for push, number in pushes[:MOST_POINTS] if push > max(least, 0.0))

    def extremes(self, name: str) -> tuple[int, ...]:
        """Return the two points of a feature that limit its form."""
        feature = self.job.actual.get(name)
        if feature is None or feature.touches is None:
            return ()
        residuals = feature.fit.residuals
        highest, lowest = int(np.argmax(residuals)), int(np.argmin(residuals))
        return tuple(dict.fromkeys((feature.numbers[highest], feature.numbers[lowest])))

    def farthest(self, name: str) -> tuple[int, ...]:
        """Return the points of a feature that lie farthest from their nominal."""
        common = self.common
        for surface in common.surfaces if common is not None else ():
            if common is not None and surface.name == name:
                off = np.abs(surface.lies(common.place.T_nominal_from_world)[0])
                order = surface.places[np.argsort(-off)][:MOST_POINTS]
                return tuple(self.numbers[order].tolist())
        return ()

    def budget(self, item: Characteristic) -> Budget | None:
        """Return the uncertainty budget of a value; None without U."""
        evaluation = self.job.evaluations.get(item.name)
        if evaluation is None:
            return None
        try:
            return budget_of(
                item, evaluation, self.job.actual, self.job.parts, self.job.factors,
                self.job.samples,
            )  # fmt: skip
        except MeasuringError:
            return None
