"""Records of features and values of a job, its results, and the preview of an alignment."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field

import numpy as np

from ocmm_core.alignment import AlignmentReport, BoundAlignment, preview_alignment
from ocmm_core.camera import Rig
from ocmm_core.errors import FitError, InputError
from ocmm_core.features.measured import ActualFeature, CommandingPoints, measured_of
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.evaluation import _job_graph as job_graph
from ocmm_core.inspection.evaluation._cache import EvaluationCache, Grouped
from ocmm_core.inspection.evaluation._options import SessionOptions
from ocmm_core.inspection.evaluation._quarantine import REMOVE, notes_on, with_doubt
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import (
    DayCheck,
    MeasuredPoint,
    PointFactors,
    check_noise,
    joined_factors,
    joint_factors,
    reported_points,
    root_of,
    touches_checked,
)
from ocmm_core.tolerances.decisions import (
    CharacteristicResult,
    evaluate_one,
    not_measured,
    not_proven,
    provisional,
)
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.uncertainty import FormSample, form_samples
from ocmm_core.tolerances.zones import Characteristic, Frames, HeldFrame
from ocmm_core.tracking import ProbeBody, TipSensitivity


@dataclass(frozen=True, slots=True)
class Record:
    feature: ActualFeature | FitError
    factors: PointFactors | None
    """Uncertainty of its own points; None without any."""
    sample: FormSample | None
    """Evidence of its form; None if none."""


class ValueGraph:
    """Values of a job. `rig`, `body`: Cameras and probe of the points."""

    def __init__(self, graph: job_graph.FeatureGraph, rig: Rig, body: ProbeBody) -> None:
        self._graph, self._rig, self._body = graph, rig, body
        self._cache = graph.cache

    def results(
        self,
        touched: job_graph.PointsByFeature,
        sensitivities: Mapping[str, Sequence[TipSensitivity]],
        actual: job_graph.Found,
    ) -> Mapping[str, CharacteristicResult]:
        """Return a result for every characteristic of the plan, by name.

        `touched`, `actual`: points and features by `FeatureGraph`. `sensitivities`: of each
        feature's points, in order.
        """
        graph, table = self._graph, self._cache.table
        plan, facts, alignment = graph.plan, graph.facts, graph.alignment(actual)
        same = (self._rig, self._body, graph.options, facts)
        blocks = table(
            "factors", same, (sensitivities, touched.points),
            lambda name: self._factors(name, touched, sensitivities[name]),
        )  # fmt: skip
        records = table(
            "record", (plan,), (actual, blocks),
            lambda name: self._record(name, actual[name], blocks),
            reads=facts.planes, below=(blocks,),
        )  # fmt: skip
        asked = graph.below.asked
        return self._cache.watched_table(
            "value", (plan, alignment), records,
            lambda name, watch: self._value(asked[name], alignment, watch, touched.owners),
            graph.below.names,
        )  # fmt: skip

    def _factors(
        self, name: str, touched: job_graph.PointsByFeature, sensitivities: Sequence[TipSensitivity]
    ) -> PointFactors:
        points, options, facts = touched.points[name], self._graph.options, self._graph.facts
        numbers = touched.places[name]

        def made(first: int) -> PointFactors:
            found = joint_factors(
                points[first:], sensitivities[first:], self._rig, self._body, options.contact,
                options.climate.part, self._graph.plan.common_uncertainties, self._root,
            )  # fmt: skip
            return found.at(np.array(numbers[first:], dtype=np.int64))

        return self._cache.appended(
            ("factors", name), (self._rig, self._body, options, facts), (points, sensitivities),
            made, lambda *parts: joined_factors(parts),
        )  # fmt: skip

    def _root(self, covariance: Float) -> Float:
        key = "root", covariance.shape, covariance.tobytes()
        return self._cache.known(key, (), lambda: root_of(covariance))

    def _record(
        self, name: str, feature: ActualFeature | FitError, blocks: Mapping[str, PointFactors]
    ) -> Record:
        facts = self._graph.facts
        plane = facts.by_name[name].projection if name in facts.by_name else ""
        found = [blocks[other] for other in (name, plane) if other in blocks]
        own = blocks.get(name)

        sample = None
        if own is not None and not isinstance(feature, FitError):
            sample = next(iter(form_samples({name: feature}, joined_factors(found))), None)
        return Record(feature, own, sample)

    def _value(
        self,
        item: Characteristic,
        alignment: BoundAlignment | None,
        records: Mapping[str, Record],
        owners: Mapping[int, str],
    ) -> CharacteristicResult:
        def kept(
            datums: tuple[str, ...],
            actual: Mapping[str, ActualFeature],
            make: Callable[[Mapping[str, ActualFeature]], HeldFrame],
        ) -> HeldFrame:
            return self._cache.watched(("datums", datums), (alignment,), actual, make)

        known = _Known(records, owners)
        frames = Frames(measured_of(known.actual), alignment, kept)
        return evaluate_one(item, alignment, known, frames, self._graph.plan.rule)


class _Known:
    """Records in the form that evaluations need."""

    def __init__(self, records: Mapping[str, Record], owners: Mapping[int, str]) -> None:
        self._records, self._owners = records, owners
        self.actual = _Features(records)

    def touching(self, places: Sequence[int]) -> set[str]:
        return set(map(self._owners.__getitem__, places))

    def factors(self, names: Collection[str]) -> PointFactors:
        found = [self._records[name].factors for name in names]
        return joined_factors([factors for factors in found if factors is not None])

    def sample(self, name: str) -> FormSample | None:
        return self._records[name].sample


class _Features(Mapping[str, ActualFeature | FitError]):
    def __init__(self, records: Mapping[str, Record]) -> None:
        self._records = records

    def __getitem__(self, name: str) -> ActualFeature | FitError:
        return self._records[name].feature

    def __iter__(self) -> Iterator[str]:
        return iter(self._records)

    def __len__(self) -> int:
        return len(self._records)


@dataclass(frozen=True, slots=True)
class JobStatus:
    """Suspicions about a job."""

    held: Mapping[int, str]
    unproven: str
    """Why the job proves nothing; empty if it does."""


@dataclass(frozen=True, slots=True)
class JobResults:
    """Results of the points of a job."""

    points: Mapping[str, Sequence[MeasuredPoint]]
    actual: Mapping[str, ActualFeature | FitError]
    """Every feature of the plan, or why it is unknown."""
    results: tuple[CharacteristicResult, ...]
    rests_on: Mapping[str, Sequence[str]]
    """The probed features of each characteristic, by its name."""
    commanding: Mapping[str, CommandingPoints] = field(default_factory=dict)
    """Points that command the fit of a probed feature, by its name."""
    noise: DayCheck = field(default_factory=DayCheck)
    """Noise of the spots against the stated one; U is widened by it."""
    _reads: Mapping[str, Set[str]] = field(default_factory=dict)
    """As ``rests_on``, without order."""

    def judged(
        self, status: JobStatus, cache: EvaluationCache | None = None
    ) -> tuple[CharacteristicResult, ...]:
        """Return the results, suspect ones as not proven; ``cache`` as in `evaluate_job`."""
        doubtful = {name: f"{one.summary} {REMOVE}" for name, one in self.commanding.items()}
        notes = doubtful | notes_on(self.points, status.held)
        if not notes and not status.unproven:
            return self.results
        results = {item.name: item for item in self.results}

        def judged(name: str) -> CharacteristicResult:
            result = with_doubt(results[name], self.rests_on[name], notes)
            return not_proven(result, status.unproven) if status.unproven else result

        rows = (cache or EvaluationCache()).table(
            "judged", (status.unproven, self.rests_on), (results,), judged,
            reads=self._reads, below=(notes,),
        )  # fmt: skip
        return tuple(rows.values())


def evaluate_job(
    plan: Plan,
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
    done: frozenset[str],
    skipped: frozenset[str] = frozenset(),
    cache: EvaluationCache | None = None,
) -> JobResults:
    """Return features and results of the points of a job.

    ``sensitivities`` in the order of the points; ``cache`` of earlier evaluations of the same job.
    """
    cache = cache or EvaluationCache()
    graph = job_graph.FeatureGraph(plan, options, cache)
    noise, rig = noise_of_job(points, rig, body, cache)
    touched = graph.touched(points)
    actual = graph.features(touched)
    commanding = graph.commanding(touched, actual)
    for name, one in commanding.items():
        if isinstance(actual[name], FitError):
            actual[name] = FitError("session.commanded", one.summary, REMOVE)
    seen = graph.grouped("sensitivities", points, sensitivities).by_feature
    results = ValueGraph(graph, rig, body).results(touched, seen, actual)
    progress = _Probed(graph.below, done, skipped, touched.points.keys(), actual)
    standing = dict.fromkeys(skipped, "skipped") | dict.fromkeys(done, "done")
    judged = cache.table(
        "as_far", (plan,), (results,),
        lambda name: progress.as_far(graph.below.asked[name], results[name]),
        reads=graph.below.reads, below=(standing, touched.points, actual),
    )  # fmt: skip
    return JobResults(
        touched.points, actual, tuple(judged.values()), graph.below.rests_on, commanding, noise,
        graph.below.reads,
    )  # fmt: skip


def noise_of_job(
    points: Sequence[MeasuredPoint], rig: Rig, body: ProbeBody, cache: EvaluationCache | None = None
) -> tuple[DayCheck, Rig]:
    """Return the noise of a job against the stated one, and the rig with the greater of both."""
    chosen = [points[index] for index in touches_checked(len(points))]

    def made() -> tuple[DayCheck, Rig]:
        check = check_noise(chosen, rig, body)
        return check, check.widened(rig)

    return (cache or EvaluationCache()).known("noise", (rig, body, *chosen), made)


@dataclass(frozen=True, slots=True)
class _Probed:
    """Progress of the features of a job."""

    below: job_graph.Below
    done: frozenset[str]
    skipped: frozenset[str]
    touched: Iterable[str]
    actual: Mapping[str, ActualFeature | FitError]

    def as_far(self, item: Characteristic, result: CharacteristicResult) -> CharacteristicResult:
        """Return a result without a verdict if a feature it depends on is not done.

        PROVISIONAL once one of its own features has points. NOT MEASURED before that, and if one
        was skipped or is done without a number.
        """
        below = self.below.rests_on[item.name]
        open_ = [name for name in below if name not in self.done]
        if not open_:
            return result
        for name in below:
            fault = self.actual[name]
            if name in self.done and isinstance(fault, FitError):
                return not_measured(item, fault.what)
            if name in self.skipped:
                return not_measured(item, f"{name} was skipped.")
        own, waits = self.below.own[item.name], f"Waits for {open_[0]}."
        if own.isdisjoint(self.touched):
            return result if result.measured is None else not_measured(item, waits)
        if spec_of(item.kind).own_form:
            # Further points can only increase form: a subset is no evidence.
            nothing = not_measured(item, "")
            return provisional(nothing, f"Form is evaluated when {open_[0]} is complete.")
        if result.measured is None:
            # If the feature itself has no number yet, its own reason is better.
            why = result.note if open_[0] in own else waits
            return provisional(result, why)
        return provisional(result, f"Provisional: {open_[0]} is incomplete.")


def checked_features(
    plan: Plan, points: Sequence[MeasuredPoint], options: SessionOptions
) -> dict[str, ActualFeature | FitError]:
    """Return every feature of a plan, or why unknown; rows of jacobians are points by index."""
    own = Grouped.from_points(points, points, None)
    places = Grouped.from_points(points, range(len(points)), None)
    touched = job_graph.PointsByFeature(own.by_feature, places.by_feature, own.owners)
    return job_graph.FeatureGraph(plan, options, EvaluationCache()).features(touched)


def measured_frame(
    plan: Plan, points: Sequence[MeasuredPoint], options: SessionOptions, cache: EvaluationCache
) -> RigidTransform | None:
    """Return the part frame of stored points, using the cache."""
    graph = job_graph.FeatureGraph(plan, options, cache)
    return graph.frame(graph.features(graph.touched(points)))


def alignment_of(
    plan: Plan, actual: Mapping[str, ActualFeature | FitError]
) -> BoundAlignment | None:
    """Return the alignment for results, bound to nominals; senses are open until measured."""
    return job_graph.FeatureGraph(plan, SessionOptions(), EvaluationCache()).alignment(actual)


def frame_of(plan: Plan, actual: Mapping[str, ActualFeature | FitError]) -> RigidTransform | None:
    """Return the part frame, or None while its datums are not measured."""
    return job_graph.part_frame_of(plan.bound_alignment, actual)


def alignment_of_points(
    plan: Plan,
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
) -> AlignmentReport:
    """Return residuals, their uncertainty and open degrees of freedom of the plan's alignment.

    ``sensitivities`` in the order of ``points``. InputError if the plan has no alignment.
    """
    bound = plan.bound_alignment
    if bound is None:
        raise InputError(
            "alignment.none",
            f"Plan {plan.name} has no alignment: its results are independent of the frame.",
            "Add an alignment to the plan to get coordinates or positions.",
        )
    reported = reported_points(points, options.climate.part)
    factors = joint_factors(
        reported, sensitivities, rig, body, options.contact, options.climate.part,
        plan.common_uncertainties,
    )  # fmt: skip
    return preview_alignment(bound, checked_features(plan, reported, options), factors)
