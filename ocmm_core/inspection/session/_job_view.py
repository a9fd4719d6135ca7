"""View of a job for screens, scripts and reports, and its nominal part with the assumed pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature, CommandingPoints
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, unit
from ocmm_core.inspection import evaluation
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


def placed(
    model: PartModel | None, place: evaluation.Whereabouts | None, rig: Rig
) -> PlacedPart | None:
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
    place: evaluation.Whereabouts | None,
    placed_part: PlacedPart | None,
    rig: Rig,
    tip_radius: float,
) -> evaluation.PlannedFeature:
    """Return a feature by its nominals, to be shown before it is measured.

    While the part's pose is unknown it is where the part is shown, not for guidance. Each of
    `points` replaces a target. `tip_radius`: mm.
    """
    nominal = plan.feature(name)
    if place is not None:
        return evaluation.PlannedFeature(
            nominal, place.T_nominal_from_world.inverse(), supposed=False
        )
    if placed_part is not None:
        there = placed_part.T_world_from_model
    else:
        there = _in_the_middle(_box_of(plan), rig)
    supposed = evaluation.Whereabouts(there.inverse(), approximate=True)
    targets = evaluation.targets_of(plan, name, points, supposed, tip_radius, None)
    if not targets and not evaluation.places_of(nominal, nominal.points).points.size:
        # Its size is not in the plan: show its middle.
        middle = there.apply(np.array(nominal.point))
        normal = np.zeros(3)
        if nominal.shape.spec.spread == "plane":
            normal = there.rotation @ unit(np.array(nominal.direction))
        ball = middle + tip_radius * normal
        targets = (evaluation.Target(name, middle, normal, ball, approximate=True),)
    return evaluation.PlannedFeature(nominal, there, supposed=True, targets=targets)


def _box_of(plan: Plan) -> Float:
    places = [evaluation.places_of(one, one.points).points for one in plan.features]
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
    header: evaluation.JobHeader
    progress: evaluation.Progress
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
    options: evaluation.SessionOptions,
    points: JobPoints,
    state: JobState,
    cache: evaluation.EvaluationCache,
) -> evaluation.JobView:
    """Return the current view of the job; ``cache`` is that of the session."""
    progress = state.progress
    found = evaluation.evaluate_job(
        plan, points.counting, state.sensitivities, rig, body, options,
        progress.done, progress.skipped, cache,
    )  # fmt: skip
    status = evaluation.JobStatus(held=evaluation.notes_of(points.held), unproven=state.unproven)
    results = found.judged(status, cache)
    place = cache.watched(
        "place", (plan, options), found.actual, lambda actual: _place(plan, options, actual)
    )
    seen = _Seen(plan, found, status, points, state, place, cache)
    features = seen.features()
    last = points.counting[-1].tip_world if points.counting else None
    targets: tuple[evaluation.Target, ...] = ()
    if progress.active:
        own = points.of_feature(progress.active)
        targets = evaluation.targets_of(plan, progress.active, own, place, body.tip_radius, last)
        if targets:
            active = replace(features[progress.active], targets=targets)
            features = {**features, progress.active: active}
    placed_part = cache.known(
        "part", (state.part, place, rig), lambda: placed(state.part, place, rig)
    )
    planned = None
    if progress.active and not isinstance(found.actual[progress.active], ActualFeature):
        planned = planned_feature(
            plan, progress.active, own, place, placed_part, rig, body.tip_radius
        )
    return evaluation.JobView(
        job=state.job,
        part=plan.part,
        operator=state.header.operator,
        features=tuple(features.values()),
        active=progress.active,
        characteristics=results,
        refusal=state.refusal,
        complete=not progress.active,
        requirements=cache.known("requirements", (plan,), lambda: requirement_count(plan)),
        unproven=state.unproven,
        room_doubt=state.room_doubt,
        room=environment_words(state.room, points.last_number),
        held=tuple(p.number for p in points.counting if p.number in status.held)
        if status.held
        else (),
        temperature=options.climate.summary,
        at_20_c=options.climate.part.compensated,
        header=state.header,
        probing=progress.probing,
        paused=state.paused,
        target=targets[0] if targets else None,
        constructed=seen.constructed(),
        undo=state.undo,
        redo=state.redo,
        simulated=state.simulated,
        camera_doubts=state.camera_doubts,
        noise=found.noise.notes,
        placed_part=placed_part,
        planned=planned,
    )


def _place(
    plan: Plan, options: evaluation.SessionOptions, actual: Mapping[str, ActualFeature | FitError]
) -> evaluation.Whereabouts | None:
    place = evaluation.whereabouts(plan, actual)
    if place is None and options.near is not None:
        return evaluation.Whereabouts(options.near, approximate=True)
    return place


class _Seen:
    """Views of the features of a job."""

    def __init__(
        self,
        plan: Plan,
        found: evaluation.JobResults,
        status: evaluation.JobStatus,
        points: JobPoints,
        state: JobState,
        place: evaluation.Whereabouts | None,
        cache: evaluation.EvaluationCache,
    ) -> None:
        self._plan, self._found, self._cache = plan, found, cache
        self._methods, progress = state.methods, state.progress
        self._notes = evaluation.notes_on(found.points, status.held)
        self._deleted = points.all_deleted()
        self._facts = facts = cache.known("seen", (plan,), lambda: _PlanViews.from_plan(plan))
        # The pose of the part matters only to extended shapes.
        there = None if place is None else place.T_nominal_from_world
        self._places = dict.fromkeys(facts.extended, there)
        self._states = dict.fromkeys(facts.nominals, evaluation.FeatureState.PENDING)
        self._states |= dict.fromkeys(progress.done, evaluation.FeatureState.DONE)
        self._states |= dict.fromkeys(progress.skipped, evaluation.FeatureState.SKIPPED)
        if progress.active:
            self._states[progress.active] = evaluation.FeatureState.ACTIVE

    def features(self) -> Mapping[str, evaluation.FeatureView]:
        """Return the probed features by name, in the order of the plan."""
        found = self._found
        return self._cache.table(
            "features", (self._plan,),
            (found.actual, found.points, found.commanding, self._places, self._notes,
             self._deleted, self._states, self._methods),
            self._feature, names=self._facts.names,
        )  # fmt: skip

    def constructed(self) -> tuple[evaluation.FeatureView, ...]:
        """Return the constructed features; each is done when all its inputs are."""
        facts = self._facts
        rows = self._cache.table(
            "constructions", (self._plan,), (self._found.actual,), self._constructed,
            names=tuple(facts.probed), reads=facts.probed, below=(self._states,),
        )  # fmt: skip
        return tuple(rows.values())

    def _feature(self, name: str) -> evaluation.FeatureView:
        nominal, found = self._facts.nominals[name], self._found
        actual, own = found.actual[name], found.points.get(name, ())
        commanding = found.commanding.get(name)
        why = "" if commanding is None else f"{commanding.summary} {evaluation.REMOVE}"
        fitted = actual if isinstance(actual, ActualFeature) else None
        place = self._places.get(name)
        return evaluation.FeatureView(
            name=name,
            shape=nominal.shape,
            needed=nominal.points,
            state=self._states[name],
            points=tuple(own),
            fit=None if fitted is None else fitted.fit,
            note=(why or actual.what)
            if isinstance(actual, FitError)
            else self._notes.get(name, why),
            outliers=_flagged(fitted, commanding),
            commanding=commanding,
            deleted=self._deleted.get(name, ()),
            coverage=None
            if fitted is None
            else evaluation.coverage_of(nominal, fitted.fit, own, place),
            text=nominal.text,
            picture=nominal.picture,
            compensation=self._methods[name],
            spacing=nominal.spacing,
            scan=nominal.scan,
        )

    def _constructed(self, name: str) -> evaluation.FeatureView:
        actual = self._found.actual[name]
        fitted = actual if isinstance(actual, ActualFeature) else None
        done = {self._states[below] for below in self._facts.probed[name]} <= {
            evaluation.FeatureState.DONE
        }
        return evaluation.FeatureView(
            name=name,
            shape=self._plan.shapes[name],
            needed=0,
            state=evaluation.FeatureState.DONE if done else evaluation.FeatureState.PENDING,
            points=(),
            fit=None if fitted is None else fitted.fit,
            note=actual.what if isinstance(actual, FitError) else "",
        )


@dataclass(frozen=True, slots=True)
class _PlanViews:
    """Quantities for views that follow from a plan alone."""

    nominals: Mapping[str, NominalFeature]
    names: tuple[str, ...]
    extended: tuple[str, ...]
    """`nominals`, `names`, `extended`: of the probed features; lines and planes."""
    probed: Mapping[str, Set[str]]
    """Probed features of each construction, by its name."""

    @classmethod
    def from_plan(cls, plan: Plan) -> _PlanViews:
        return cls(
            {item.name: item for item in plan.features},
            tuple(item.name for item in plan.features),
            tuple(
                item.name for item in plan.features if item.shape.spec.spread in ("line", "plane")
            ),
            {item.name: frozenset(plan.probed(item.name)) for item in plan.constructions},
        )


def _flagged(feature: ActualFeature | None, commanding: CommandingPoints | None) -> tuple[int, ...]:
    """Return the numbers of outliers; a fit that some points command flags nothing else rightly."""
    if commanding is not None:
        return commanding.numbers
    return () if feature is None else evaluation.outliers(feature)
