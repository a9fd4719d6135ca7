"""View of a job for screens, scripts and reports, and its nominal part with the assumed pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature, CommandingPoints
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, unit
from ocmm_core.inspection.evaluation import (
    REMOVE,
    EvaluationCache,
    FeatureState,
    FeatureView,
    JobHeader,
    JobResults,
    JobStatus,
    JobView,
    PlannedFeature,
    Progress,
    SessionOptions,
    Target,
    Whereabouts,
    coverage_of,
    evaluate_job,
    notes_of,
    notes_on,
    outliers,
    places_of,
    targets_of,
    whereabouts,
)
from ocmm_core.inspection.plan import NotedRoom, Plan, environment_words, requirement_count
from ocmm_core.inspection.session._job_points import JobPoints
from ocmm_core.inspection.session._step_log import JobLedger
from ocmm_core.measuring import MeasuredPoint, Refusal
from ocmm_core.part_model import PartModel, PlacedPart
from ocmm_core.tracking import ProbeBody, TipSensitivity


class PlacedNominal:
    """Nominal part of a job from its CAD model; initially the one in its file."""

    def __init__(self, ledger: JobLedger) -> None:
        self._ledger = ledger
        self._model = ledger.job.part()

    @property
    def model(self) -> PartModel | None:
        return self._model

    def show(self, model: PartModel) -> None:
        """Make a part durable and show it; the first one counts; StorageError if not durable."""
        with self._ledger.lock:
            if self._model is None:
                self._ledger.job.store_part(model)
                self._model = model
                self._ledger.view = None


def placed(model: PartModel | None, place: Whereabouts | None, rig: Rig) -> PlacedPart | None:
    """Return a part in its pose, else upright in mid-volume; None without part."""
    if model is None:
        return None
    if place is None:
        return PlacedPart(model, _in_the_middle(model.box, rig), is_rough=True)
    return PlacedPart(model, place.T_nominal_from_world.inverse(), is_rough=place.approximate)


def planned_feature(
    plan: Plan,
    name: str,
    points: Sequence[MeasuredPoint],
    place: Whereabouts | None,
    placed_part: PlacedPart | None,
    rig: Rig,
    tip_radius: float,
) -> PlannedFeature:
    """Return a feature by its nominals, to be shown before it is measured.

    While the part's pose is unknown it is where the part is shown, not for guidance. Each of
    `points` replaces a target. `tip_radius`: mm.
    """
    nominal = plan.feature(name)
    if place is not None:
        return PlannedFeature(nominal, place.T_nominal_from_world.inverse(), supposed=False)
    if placed_part is not None:
        there = placed_part.T_world_from_model
    else:
        there = _in_the_middle(_box_of(plan), rig)
    supposed = Whereabouts(there.inverse(), approximate=True)
    targets = targets_of(plan, name, points, supposed, tip_radius, None)
    if not targets and not places_of(nominal, nominal.points).points.size:
        # Its size is not in the plan: show its middle.
        middle = there.apply(np.array(nominal.point))
        normal = np.zeros(3)
        if nominal.shape.spec.spread == "plane":
            normal = there.rotation @ unit(np.array(nominal.direction))
        ball = middle + tip_radius * normal
        targets = (Target(name, middle, normal, ball, approximate=True),)
    return PlannedFeature(nominal, there, supposed=True, targets=targets)


def _box_of(plan: Plan) -> Float:
    places = [places_of(one, one.points).points for one in plan.features]
    every = np.concatenate([*places, [one.point for one in plan.features]])
    return np.stack([every.min(axis=0), every.max(axis=0)])


def _in_the_middle(box: Float, rig: Rig) -> RigidTransform:
    # Upright is opposite to the columns of the sensors.
    columns = np.mean([camera.T_camera_from_world.rotation[1] for camera in rig.cameras], axis=0)
    axis = int(np.argmax(np.abs(columns)))
    up = -np.sign(columns[axis]) * np.eye(3)[axis]
    turn = np.cross([0.0, 0.0, 1.0], up)
    length = float(np.linalg.norm(turn))
    if length > 0.0:
        rotation = rotation_from_vector(turn / length * np.arctan2(length, up[2]))
    else:
        rotation = np.diag([1.0, np.sign(up[2]), np.sign(up[2])])
    middle = rig.volume_world.mean(axis=0)
    return RigidTransform(rotation, middle - rotation @ box.mean(axis=0))


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
        held=tuple(p.number for p in points.counting if p.number in status.held),
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
