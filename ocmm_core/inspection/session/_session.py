"""A running job: touches become points, points features, features results.

A touch enters unless the job is paused or the ball moves. No threads, no clock. Any
thread may call; one lock guards it, and every change makes a new frozen `JobView`.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping
from dataclasses import replace

from ocmm_core.alignment import simulated_frame
from ocmm_core.camera import Rig
from ocmm_core.errors import MeasuringError
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.causes import Explanation, explanations
from ocmm_core.inspection.evaluation import (
    SIMULATED,
    HoldReason,
    JobView,
    SessionOptions,
    Target,
    measured_frame,
    surface_covariances,
)
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.session._assignment import TouchAssigner, awaits_pull, methods_of
from ocmm_core.inspection.session._header import Conditions, header_of
from ocmm_core.inspection.session._job_points import ReferenceUse
from ocmm_core.inspection.session._job_view import JobState, PlacedNominal, view_of
from ocmm_core.inspection.session._path_intake import PathIntake
from ocmm_core.inspection.session._step_log import JobLedger, UnderWay
from ocmm_core.inspection.session._steps import JobSteps, Pausing, PointSteps
from ocmm_core.inspection.session._touch_filter import TouchFilter
from ocmm_core.measuring import (
    MeasuredPoint,
    PointOptions,
    Refusal,
    Touch,
    TouchNoise,
    approach_direction,
    average,
    with_skew,
)
from ocmm_core.storage import JobFile
from ocmm_core.tracking import ProbeBody, ReferenceHome, TipSensitivity


class TouchIntake:
    """Make durable points of touches (rest, `TouchAssigner`, `TouchFilter`); thread-safe."""

    def __init__(
        self,
        ledger: JobLedger,
        rig: Rig,
        body: ProbeBody,
        options: PointOptions,
        assignment: TouchAssigner,
    ) -> None:
        self._ledger, self._rig, self._body, self._options = ledger, rig, body, options
        self._noise = TouchNoise(rig, body)
        self._assignment = assignment

    def record_touch(self, touch: Touch, feature: str | None = None) -> MeasuredPoint | Refusal:
        """Make a durable point of a touch, or return why not; StorageError if not durable.

        `feature`: intended feature; None for the active one.
        """
        with self._ledger.lock:
            outcome = self._rest(touch, feature)
            if isinstance(outcome, Refusal):
                self._ledger.note(outcome)
            return outcome

    def refuse(self, refusal: Refusal) -> None:
        """Note that a trigger got no answer from the cameras."""
        with self._ledger.lock:
            self._ledger.note(refusal)

    def _rest(self, touch: Touch, feature: str | None) -> MeasuredPoint | Refusal:
        time_s = float(touch.window.time_ns[0]) * 1e-9 if len(touch.window) else 0.0
        refusal = self._ledger.obstacle(time_s, interrupted=touch.interrupted)
        if refusal is not None:
            return refusal
        stable = average(touch.window, touch.expected, self._rig, self._options, self._noise)
        if not isinstance(stable, Refusal) and touch.skew is not None:
            stable = with_skew(stable, touch.window, self._rig, self._body, touch.skew)
        if isinstance(stable, Refusal):
            return stable
        near_mm = self._options.approach_mm
        trails = (touch.trail_world, touch.pull_world[::-1])
        ways = [approach_direction(trail, stable.tip_world, near_mm) for trail in trails]
        known = tuple(way for way in ways if way is not None)
        return self._assignment.assign_touch(touch, stable, known, feature)


class HeldPoints:
    """Hold points while cameras or tip are suspect, and release them."""

    def __init__(self, ledger: JobLedger) -> None:
        self._ledger = ledger

    def hold_back(self, since_s: float | None, reason: str) -> list[int]:
        """Hold the points since a moment of this run, and return them.

        `since_s`: bus time, s; None for all. StorageError: not durable, held till the program ends.
        """
        with self._ledger.lock:
            numbers = self._ledger.points.taken_since(since_s)
            return self.hold_back_points(numbers, reason, HoldReason.CAMERAS)

    def hold_back_points(
        self, numbers: Iterable[int], reason: str, hold_reason: HoldReason
    ) -> list[int]:
        """Hold points, and return those newly held; StorageError as `hold_back`."""
        with self._ledger.lock:
            self._ledger.view = None
            return self._ledger.points.hold_back(numbers, reason, hold_reason)

    def held_for(self, hold_reason: HoldReason) -> dict[int, str]:
        """Return the points that count and are held for a reason."""
        with self._ledger.lock:
            held = self._ledger.points.held[hold_reason]
            return {
                p.number: held[p.number] for p in self._ledger.points.counting if p.number in held
            }

    def release(self, reason: str, hold_reason: HoldReason = HoldReason.CAMERAS) -> list[int]:
        """Release held points and return them; StorageError, and they stay held, if not durable.

        Points held for the cameras in an earlier run stay held.
        """
        with self._ledger.lock:
            self._ledger.view = None
            return self._ledger.points.release(reason, hold_reason)

    def release_points(
        self, numbers: Iterable[int], reason: str, hold_reason: HoldReason
    ) -> list[int]:
        """Release points, and return those that were held; StorageError as `release`."""
        with self._ledger.lock:
            self._ledger.view = None
            return self._ledger.points.release_points(numbers, reason, hold_reason)


class MeasuredFrame:
    """Part frame of a job, computed on demand."""

    def __init__(self, ledger: JobLedger, options: SessionOptions) -> None:
        self._ledger, self._options = ledger, options

    @property
    def T_part_from_world(self) -> RigidTransform | None:
        """Return the part frame, or None while its datums are not measured."""
        ledger = self._ledger
        with ledger.lock:
            points = list(ledger.points.counting)
        return measured_frame(ledger.plan, points, self._options, ledger.cache)


class InspectionSession:
    """Carry out a plan, point by point.

    ``job`` makes points durable before they are reported; its points and decisions are used, so
    that an interrupted job resumes. MeasuringError if it holds points of another probe or tip, of
    other cameras, or relative to another reference body.
    """

    def __init__(
        self, plan: Plan, rig: Rig, body: ProbeBody, job: JobFile, options: SessionOptions
    ) -> None:
        self._ledger = ledger = JobLedger(plan, job)
        self.steps = JobSteps(ledger)
        """Decisions about the job and its features."""
        self.points = PointSteps(ledger)
        """Decisions about single points."""
        self.pausing = Pausing(ledger)
        self.held = HeldPoints(ledger)
        self.part = PlacedNominal(ledger)
        """The nominal part, if there is a CAD model."""
        self._rig = rig
        self._body = body
        self._options = options
        begun = bool(self._ledger.points.counting)
        if begun and job.head.probe_identity != body.identity:
            raise MeasuringError(
                "session.other_probe",
                f"{job.path}: the points of this job were taken with another probe, another "
                "tip, or before the tip was calibrated or qualified again.",
                "Start a new job, or give the probe and tip this one was started with.",
            )
        if begun and options.reference is None and job.head.rig_identity != rig.identity:
            raise MeasuringError(
                "session.other_cameras",
                f"{job.path}: the cameras were recalibrated after this job was started; the "
                "position of its points is unknown to the new calibration.",
                "Start a new job.",
            )
        self._reference = ReferenceUse(rig, body, options.reference, job, begun=begun)
        acceptance = TouchFilter(ledger, rig, body, options, self._reference)
        assignment = TouchAssigner(ledger, body.tip_radius, options, acceptance)
        self.touches = TouchIntake(ledger, rig, body, options.point, assignment)
        self.paths = PathIntake(ledger, rig, body, options, self._reference, assignment)
        self.frame = MeasuredFrame(ledger, options)
        self.conditions = Conditions(ledger, options, begun=begun)
        self._header = header_of(job.head, job.events())
        self._evaluating = threading.Lock()
        """Held while computing the view; never acquired with the lock of the job held."""
        self._explained: tuple[object, tuple[Explanation, ...]] | None = None

    @property
    def has_points(self) -> bool:
        """Whether a point counts; without the lock, which a slow disk can hold."""
        return bool(self._ledger.points.counting)

    @property
    def awaits_pull(self) -> bool:
        """Return whether the ball is followed during its retract after a touch."""
        with self._ledger.lock:
            return awaits_pull(self._ledger.plan, self._ledger.progress)

    @property
    def view(self) -> JobView:
        """Return the current job; computed at the first read after a change, in up to some seconds.

        One thread computes at a time, without blocking: concurrent changes are in the next view.
        """
        with self._evaluating:
            with self._ledger.lock:
                known = self._ledger.view
                if isinstance(known, JobView):
                    return self._looking(known, known)
                state, points = self._state(), self._ledger.points.snapshot()
                begun = self._ledger.view = UnderWay()
            made = view_of(
                self._ledger.plan, self._rig, self._body, self._options, points, state,
                self._ledger.cache,
            )  # fmt: skip
            with self._ledger.lock:
                return self._looking(made, begun)

    def _looking(self, view: JobView, kept: JobView | UnderWay) -> JobView:
        """Return a view with the feature under review, cached if nothing has changed meanwhile."""
        if view.looked_at != self._ledger.looked_at:
            # A review computes nothing, and so can change nothing.
            view = replace(view, looked_at=self._ledger.looked_at)
        commanded = self._ledger.commanded
        if commanded is not None and view.target is not commanded:
            view = replace(view, target=commanded)
        if self._ledger.view is kept:
            self._ledger.view = view
        return view

    def explanations(self) -> tuple[Explanation, ...]:
        """Return why results are NOT CONFORM or NOT PROVEN, and remedies; some 0.1 s, cached."""
        while True:
            view = self.view
            with self._ledger.lock:
                known = self._explained
                # A review makes another view of the same results.
                if known is not None and known[0] is view.characteristics:
                    return known[1]
                if self._ledger.view is view:
                    points = tuple(self._ledger.points.counting)
                    sensitivities = tuple(self._ledger.points.sensitivities(self._reference))
                    break
        found = explanations(
            self._ledger.plan, view, points, sensitivities, self._rig, self._body, self._options
        )
        self._explained = view.characteristics, found
        return found

    def surface_covariances(self) -> dict[int, Float]:
        """Return `evaluation.surface_covariances` of the points that count."""
        ledger = self._ledger
        with ledger.lock:
            points = tuple(ledger.points.counting)
            sensitivities = tuple(ledger.points.sensitivities(self._reference))
        return surface_covariances(
            ledger.plan, points, sensitivities, self._rig, self._body, self._options
        )

    def remove_commanding(self, name: str = "") -> tuple[int, ...]:
        """Delete the points that command a fit, in one step; MeasuringError if none does."""
        view = self.view
        feature = view.feature(name) if name else view.shown
        found = None if feature is None else feature.commanding
        if feature is None or found is None:
            raise MeasuringError(
                "session.not_commanded",
                "No point commands the fit of this feature.",
                "Select the point to delete.",
            )
        self.points.delete_points(found.numbers, found.summary)
        return found.numbers

    @property
    def reference_home(self) -> ReferenceHome | None:
        """Return the pose of the reference body at the start of the job; None if not yet known."""
        return self._reference.home

    def keep_reference(self, home: ReferenceHome) -> None:
        """Make the first pose of the body durable, once; StorageError: no point may be recorded."""
        with self._ledger.lock:
            self._reference.keep(home)

    def stored_points(
        self,
    ) -> tuple[tuple[MeasuredPoint, ...], tuple[tuple[MeasuredPoint, str], ...]]:
        """Return the points that count, and the others with the reason, oldest first."""
        with self._ledger.lock:
            return tuple(self._ledger.points.counting), self._ledger.points.all_taken_out()

    def know(self, sensitivities: Mapping[int, TipSensitivity]) -> None:
        """Use sensitivities that were already computed from raw observations, by number."""
        with self._ledger.lock:
            self._ledger.points.know(sensitivities)

    def guide(self, target: Target | None) -> None:
        """Guide to a point that another program asks for; None: to those of the plan again."""
        with self._ledger.lock:
            self._ledger.commanded, self._ledger.view = target, None

    def refit(self) -> None:
        """Recalculate everything from the raw observations of the points."""
        with self._ledger.lock:
            self._ledger.points.forget_sensitivities()
            self._ledger.view = None

    def accept_alignment(self, words: str) -> None:
        """Make the acceptance of the alignment durable, with its words, or raise StorageError."""
        with self._ledger.lock:
            self._ledger.job.append_event("alignment", words)

    def _frame_doubt(self) -> str:
        """Return why the frame of the plan proves nothing about a real part; empty if it may."""
        name = simulated_frame(self._ledger.plan.alignment)
        if not name or self.conditions.simulated:
            return ""
        return f"Frame {name} of the plan is {SIMULATED}: it says nothing about a real part."

    def _state(self) -> JobState:
        ledger = self._ledger
        step, undone = ledger.log.last, ledger.log.last_undone
        return JobState(
            job=ledger.job.name,
            header=self._header,
            progress=ledger.progress,
            methods=methods_of(ledger.plan, ledger.progress),
            sensitivities=tuple(ledger.points.sensitivities(self._reference)),
            refusal=ledger.refusal,
            paused=ledger.paused,
            unproven=self.conditions.unproven or self._frame_doubt() or self.conditions.room_doubt,
            room_doubt=self.conditions.room_doubt,
            room=self.conditions.rooms,
            undo=step.words if step is not None else "",
            redo=undone.words if undone is not None else "",
            simulated=self.conditions.simulated,
            camera_doubts=self.conditions.camera_doubts,
            part=self.part.model,
        )
