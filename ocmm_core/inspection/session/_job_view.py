"""View of a job for screens, scripts and reports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ocmm_core.camera import Rig
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature, CommandingPoints
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.inspection.evaluation import (
    REMOVE,
    EvaluationCache,
    FeatureState,
    FeatureView,
    JobHeader,
    JobResults,
    JobStatus,
    JobView,
    Progress,
    SessionOptions,
    Target,
    Whereabouts,
    coverage_of,
    evaluate_job,
    notes_of,
    notes_on,
    outliers,
    targets_of,
    whereabouts,
)
from ocmm_core.inspection.plan import NotedRoom, Plan, environment_words, requirement_count
from ocmm_core.inspection.session._job_points import JobPoints
from ocmm_core.inspection.session._placed_part import placed, planned_feature
from ocmm_core.measuring import Refusal
from ocmm_core.part_model import PartModel
from ocmm_core.tracking import ProbeBody, TipSensitivity


@dataclass(frozen=True, slots=True)
class JobState:
    """State of a job other than its points."""

    job: str
    header: JobHeader
    progress: Progress
    methods: Mapping[str, str]
    """Detection of the side of each feature."""
    sensitivities: tuple[TipSensitivity, ...]
    """Of the points that count, in order."""
    refusal: Refusal | None
    """Why the last touch gave no point."""
    paused: bool
    unproven: str
    """Why the job proves nothing; empty if it does."""
    undo: str
    redo: str
    """`undo`, `redo`: Steps that these would revert, in words."""
    simulated: bool
    """Partly from a virtual rig."""
    camera_doubts: tuple[str, ...] = ()
    """Unproven properties of its cameras, in sentences."""
    part: PartModel | None = None
    room_doubt: str = ""
    room: tuple[NotedRoom, ...] = ()
    """`room_doubt`, `room`: Why ambient conditions invalidate it, and the readings."""


def view_of(
    plan: Plan,
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
    points: JobPoints,
    state: JobState,
    cache: EvaluationCache,
) -> JobView:
    """Return the current view of the job; ``cache`` is that of the session."""
    progress = state.progress
    found = evaluate_job(
        plan, points.counting, state.sensitivities, rig, body, options,
        progress.done, progress.skipped, cache,
    )  # fmt: skip
    status = JobStatus(held=notes_of(points.held), unproven=state.unproven)
    results = found.judged(status)
    place = cache.watched(
        "place", (plan, options), found.actual, lambda actual: _place(plan, options, actual)
    )
    seen = _Seen(found, status, points, state, place, cache)
    features = tuple(map(seen.feature, plan.features))
    last = points.counting[-1].tip_world if points.counting else None
    targets: tuple[Target, ...] = ()
    if progress.active:
        targets = targets_of(
            plan, progress.active, points.of(progress.active), place, body.tip_radius, last
        )
        features = tuple(
            replace(item, targets=targets) if item.name == progress.active else item
            for item in features
        )
    placed_part = cache.known(
        "part", (state.part, place, rig), lambda: placed(state.part, place, rig)
    )
    planned = None
    if progress.active and not isinstance(found.actual[progress.active], ActualFeature):
        planned = planned_feature(
            plan, progress.active, points.of(progress.active), place, placed_part, rig,
            body.tip_radius,
        )  # fmt: skip
    return JobView(
        job=state.job,
        part=plan.part,
        operator=state.header.operator,
        features=features,
        active=progress.active,
        characteristics=results,
        refusal=state.refusal,
        complete=not progress.active,
        requirements=cache.known("requirements", (plan,), lambda: requirement_count(plan)),
        unproven=state.unproven,
        room_doubt=state.room_doubt,
        room=environment_words(state.room, points.last_number),
        held=_counting(points, status.held),
        temperature=options.climate.words,
        at_20_c=options.climate.part.compensated,
        header=state.header,
        probing=progress.probing,
        paused=state.paused,
        target=targets[0] if targets else None,
        constructed=tuple(_made(plan, item.name, found, progress) for item in plan.constructions),
        undo=state.undo,
        redo=state.redo,
        simulated=state.simulated,
        camera_doubts=state.camera_doubts,
        noise=found.noise.notes,
        placed_part=placed_part,
        planned=planned,
    )


def _counting(points: JobPoints, held: Mapping[int, str]) -> tuple[int, ...]:
    return tuple(p.number for p in points.counting if p.number in held) if held else ()


def _place(
    plan: Plan, options: SessionOptions, actual: Mapping[str, ActualFeature | FitError]
) -> Whereabouts | None:
    place = whereabouts(plan, actual)
    if place is None and options.near is not None:
        return Whereabouts(options.near, approximate=True)
    return place


class _Seen:
    """Views of the probed features of a job."""

    def __init__(
        self,
        found: JobResults,
        status: JobStatus,
        points: JobPoints,
        state: JobState,
        place: Whereabouts | None,
        cache: EvaluationCache,
    ) -> None:
        self._found, self._state, self._place, self._cache = found, state, place, cache
        self._notes = notes_on(found.points, status.held)
        self._deleted = points.all_deleted()

    def feature(self, nominal: NominalFeature) -> FeatureView:
        name = nominal.name
        actual, own = self._found.actual[name], self._found.points.get(name, ())
        # The pose of the part matters only to extended shapes.
        extends = nominal.shape.spec.spread in ("line", "plane")
        place = self._place.T_nominal_from_world if extends and self._place else None
        commanding = self._found.commanding.get(name)
        why = "" if commanding is None else f"{commanding.words} {REMOVE}"
        note, deleted = self._notes.get(name, why), self._deleted.get(name, ())
        state, method = _state(name, self._state.progress), self._state.methods[name]

        def made() -> FeatureView:
            fitted = actual if isinstance(actual, ActualFeature) else None
            return FeatureView(
                name=name,
                shape=nominal.shape,
                needed=nominal.points,
                state=state,
                points=tuple(own),
                fit=None if fitted is None else fitted.fit,
                note=(why or actual.what) if isinstance(actual, FitError) else note,
                outliers=_flagged(fitted, commanding),
                commanding=commanding,
                deleted=deleted,
                coverage=None if fitted is None else coverage_of(nominal, fitted.fit, own, place),
                text=nominal.text,
                picture=nominal.picture,
                compensation=method,
            )

        inputs = (nominal, actual, own, place, commanding, note, deleted, state, method)
        return self._cache.known(("seen", name), inputs, made)


def _flagged(feature: ActualFeature | None, commanding: CommandingPoints | None) -> tuple[int, ...]:
    """Return the numbers of outliers; a fit that some points command flags nothing else rightly."""
    if commanding is not None:
        return commanding.numbers
    return () if feature is None else outliers(feature)


def _made(plan: Plan, name: str, found: JobResults, progress: Progress) -> FeatureView:
    """Return a constructed feature; it is done when all its inputs are."""
    actual = found.actual[name]
    done = set(plan.probed(name)) <= progress.done
    fit = actual.fit if isinstance(actual, ActualFeature) else None
    return FeatureView(
        name=name,
        shape=plan.shapes[name],
        needed=0,
        state=FeatureState.DONE if done else FeatureState.PENDING,
        points=(),
        fit=fit,
        note="" if isinstance(actual, ActualFeature) else actual.what,
    )


def _state(name: str, progress: Progress) -> FeatureState:
    if name == progress.active:
        return FeatureState.ACTIVE
    if name in progress.skipped:
        return FeatureState.SKIPPED
    return FeatureState.DONE if name in progress.done else FeatureState.PENDING
