"""One job being measured: touches become points, points features, features results.

The session has no threads and no clock of its own. Its methods may be called from any thread; one
lock guards them, and every change makes a new frozen `JobView`.
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
    JobView,
    SessionOptions,
    Ward,
    aligned_nominals,
    checked_features,
    frame_of,
)
from ocmm_core.inspection.plan import Plan, taught_plan
from ocmm_core.inspection.session._acceptance import Meant, judge_touch
from ocmm_core.inspection.session._any_order import Contact
from ocmm_core.inspection.session._conditions import Conditions
from ocmm_core.inspection.session._header import header_of
from ocmm_core.inspection.session._job_view import JobState, view_of
from ocmm_core.inspection.session._meaning import meant_for
from ocmm_core.inspection.session._reference_use import ReferenceUse
from ocmm_core.inspection.session._steps import JobSteps, UnderWay
from ocmm_core.measuring import (
    MeasuredPoint,
    Refusal,
    RefusalCode,
    StablePoint,
    Touch,
    reported_points,
)
from ocmm_core.storage import JobFile
from ocmm_core.tracking import ProbeBody, ReferenceHome, TipSensitivity


class InspectionSession(JobSteps):
    """Carry out a plan, point by point.

    Parameters
    ----------
    plan, rig, body
        What is measured, and with what.
    job
        Where points are made durable before anybody is told of them. Points that it holds already
        are taken over, and what was decided about features, so that a job goes on where it was
        interrupted.
    options
        Limits.

    Raises
    ------
    MeasuringError
        The job holds points of another probe or tip, of other cameras, or relative to another
        reference body.
    """

    def __init__(
        self, plan: Plan, rig: Rig, body: ProbeBody, job: JobFile, options: SessionOptions
    ) -> None:
        super().__init__(plan, job)
        self._rig = rig
        self._body = body
        self._options = options
        begun = bool(self._points.counting)
        if begun and job.head.probe_identity != body.identity:
            raise MeasuringError(
                "session.other_probe",
                f"{job.path}: the points of this job were taken with another probe, with another "
                f"tip, or before the tip was calibrated or qualified anew.",
                "Begin a new job; or give the probe and the tip that this one was begun with.",
            )
        if begun and options.reference is None and job.head.rig_identity != rig.identity:
            raise MeasuringError(
                "session.other_cameras",
                f"{job.path}: the cameras were calibrated anew since this job was begun: where its "
                "points are is not known to these.",
                "Begin a new job.",
            )
        self._reference = ReferenceUse(rig, body, options.reference, job, begun=begun)
        self._conditions = Conditions(job, options, begun=begun)
        self._header = header_of(job.head, job.events())
        self._evaluating = threading.Lock()
        """Held by who computes the view; never taken by who holds the lock of the job."""
        self._explained: tuple[object, tuple[Explanation, ...]] | None = None

    @property
    def view(self) -> JobView:
        """Return the job as it stands; computed when somebody looks after a change.

        That takes up to some seconds. One computes at a time, and nobody who takes a point or
        decides something waits for it: what was changed meanwhile is in the next view.
        """
        with self._evaluating:
            with self._lock:
                known = self._view
                if isinstance(known, JobView):
                    return self._looking(known, known)
                state, points = self._state(), self._points.snapshot()
                begun = self._view = UnderWay()
            made = view_of(self._plan, self._rig, self._body, self._options, points, state)
            with self._lock:
                return self._looking(made, begun)

    def _looking(self, view: JobView, kept: JobView | UnderWay) -> JobView:
        """Return a view with what somebody looks at, kept where nothing has changed meanwhile."""
        if view.looked_at != self._looked_at:
            # Looking back computes nothing anew, and so can change nothing.
            view = replace(view, looked_at=self._looked_at)
        if self._view is kept:
            self._view = view
        return view

    @property
    def T_part_from_world(self) -> RigidTransform | None:
        """Return the part frame, or None while its datums are not measured."""
        with self._lock:
            points = reported_points(self._points.counting, self._options.climate.part)
            return frame_of(self._plan, checked_features(self._plan, points, self._options))

    def explanations(self) -> tuple[Explanation, ...]:
        """Return why results are NOT CONFORM or NOT PROVEN, and what to do.

        It takes some tenths of a second, in which nothing is locked; asked again before anything
        has changed it is remembered.
        """
        while True:
            view = self.view
            with self._lock:
                known = self._explained
                # Who looks back gets another view of the same results.
                if known is not None and known[0] is view.characteristics:
                    return known[1]
                if self._view is view:
                    points = tuple(self._points.counting)
                    sensitivities = tuple(self._points.sensitivities(self._reference))
                    break
        found = explanations(
            self._plan, view, points, sensitivities, self._rig, self._body, self._options
        )
        self._explained = view.characteristics, found
        return found

    @property
    def reference_home(self) -> ReferenceHome | None:
        """Return where the reference body stood when the job began; None before that is known."""
        return self._reference.home

    def keep_reference(self, home: ReferenceHome) -> None:
        """Make the first place of the reference body durable; the first one counts.

        Raises
        ------
        StorageError
            It could not be; no point may be taken then.
        """
        with self._lock:
            self._reference.keep(home)

    def note_calibration(self, calibration: str, probe: str, unproven: str) -> None:
        """Store with which calibration and probe the points from now on are taken.

        Parameters
        ----------
        calibration
            What is said about that of the cameras, and its hash.
        probe
            What is said about probe and tip, and the hashes of their records.
        unproven
            Why this job proves nothing from now on, for good; empty where it does.

        Raises
        ------
        StorageError
            It could not be made durable.
        """
        with self._lock:
            self._conditions.note_calibration(calibration, probe, unproven)
            self._view = None

    def note_origin(self, *, simulated: bool) -> None:
        """Store that points are taken from a virtual rig, for good; nothing where they are not.

        Raises
        ------
        StorageError
            It could not be made durable.
        """
        with self._lock:
            if self._conditions.note_origin(simulated=simulated):
                self._view = None

    def note_climate(self) -> None:
        """Store with which temperatures and switches the points from now on are taken.

        Raises
        ------
        StorageError
            It could not be made durable.
        """
        with self._lock:
            self._conditions.note_climate()

    def note_limits(self) -> None:
        """Store by which limits points are taken and judged from now on.

        Raises
        ------
        StorageError
            It could not be made durable.
        """
        with self._lock:
            self._conditions.note_limits()

    def hold_back(self, since_s: float | None, reason: str) -> list[int]:
        """Hold back the points that were taken since a moment of this run, and return them.

        Parameters
        ----------
        since_s
            Bus time, s; None for all points of this run.
        reason
            A sentence.

        Raises
        ------
        StorageError
            It could not be made durable; the points are held back until the program ends.
        """
        with self._lock:
            numbers = self._points.taken_since(since_s)
            return self.hold_back_points(numbers, reason, Ward.CAMERAS)

    def hold_back_points(self, numbers: Iterable[int], reason: str, ward: Ward) -> list[int]:
        """Hold back points, and return those that were not yet; StorageError as `hold_back`."""
        with self._lock:
            self._view = None
            return self._points.hold_back(numbers, reason, ward)

    def held_for(self, ward: Ward) -> dict[int, str]:
        """Return the points that count and are held back for a ward, and why."""
        with self._lock:
            held = self._points.held[ward]
            return {p.number: held[p.number] for p in self._points.counting if p.number in held}

    def release(self, reason: str, ward: Ward = Ward.CAMERAS) -> list[int]:
        """Let points count again that were held back, and return them.

        What was held back for the cameras in an earlier run stays so.

        Raises
        ------
        StorageError
            It could not be made durable; they stay held back.
        """
        with self._lock:
            self._view = None
            return self._points.release(reason, ward)

    def release_points(self, numbers: Iterable[int], reason: str, ward: Ward) -> list[int]:
        """Let points count again, and return those that were held; StorageError as `release`."""
        with self._lock:
            self._view = None
            return self._points.release_points(numbers, reason, ward)

    def take_touch(self, touch: Touch, feature: str | None = None) -> MeasuredPoint | Refusal:
        """Turn a touch into a durable point of the active feature, or say why not.

        Parameters
        ----------
        touch
            The frames.
        feature
            Feature that the touch is meant for; None for the active one.

        Raises
        ------
        StorageError
            The point could not be made durable; it is not part of the job then.
        """
        with self._lock:
            outcome = self._point(touch, feature)
            if isinstance(outcome, Refusal):
                self._note(outcome)
            return outcome

    def taught_plan(self, decimals: int = 3) -> Plan:
        """Return the plan with the nominals that this part shows; see `teach.taught_plan`.

        For tests: nothing in the product asks for it.
        """
        with self._lock:
            points = reported_points(self._points.counting, self._options.climate.part)
            actual = checked_features(self._plan, points, self._options)
            frame = frame_of(self._plan, actual)
            return taught_plan(self._plan, actual, frame, decimals)

    def know(self, sensitivities: Mapping[int, TipSensitivity]) -> None:
        """Take over what was computed from the raw observations of points already, by number."""
        with self._lock:
            self._points.know(sensitivities)

    def refit(self) -> None:
        """Compute everything again from the raw observations of the points."""
        with self._lock:
            self._points.forget_sensitivities()
            self._view = None

    def accept_alignment(self, words: str) -> None:
        """Make durable that somebody looked at the alignment and accepted it, and what he saw.

        Raises
        ------
        StorageError
            It could not be made durable.
        """
        with self._lock:
            self._job.append_event("alignment", words)

    def refuse(self, refusal: Refusal) -> None:
        """Note that a trigger got no answer from the cameras."""
        with self._lock:
            self._note(refusal)

    def _note(self, refusal: Refusal) -> None:
        self._job.append_event("refused", f"{refusal.code.value}: {refusal.what}")
        self._refusal, self._view, self._looked_at = refusal, None, ""

    def _point(self, touch: Touch, wanted: str | None) -> MeasuredPoint | Refusal:
        if self._paused:
            return Refusal(
                RefusalCode.PAUSED,
                "The job is paused.",
                "Go on with the job, then touch again.",
                float(touch.window.time_ns[0]) * 1e-9 if len(touch.window) else 0.0,
            )
        judged = judge_touch(
            touch,
            lambda stable, ways: self._meant(stable, ways, wanted),
            self._rig,
            self._body,
            self._options,
            self._reference,
        )
        if isinstance(judged, Refusal):
            return judged
        name, progress = judged.feature, self._progress
        point = judged.point(self._points.next_number(), self._body.tip_radius)
        before = progress.opened(name)
        follows = progress.active == name or progress.probing == "any"
        after = before if follows else progress
        if self._points.count(name) + 1 >= self._plan.feature(name).points:
            after = after.finished(name)
        self._log.take(point, judged.sensitivity, before, after)
        self._changed()
        return point

    def _meant(
        self, stable: StablePoint, ways: tuple[Float, ...], wanted: str | None
    ) -> Meant | Refusal:
        progress = self._progress
        return meant_for(
            self._plan,
            progress,
            Contact(stable.tip_world, ways, self._body.tip_radius, stable.time_s),
            self._aligned,
            wanted=wanted,
            selected=self._selected if self._selected == progress.active else "",
        )

    def _aligned(self) -> RigidTransform | None:
        """Return the motion to the frame of the nominals; None while datums are not measured."""
        points = reported_points(self._points.counting, self._options.climate.part)
        return aligned_nominals(self._plan, checked_features(self._plan, points, self._options))

    def _frame_doubt(self) -> str:
        """Return why the frame of the plan proves nothing about a real part; empty where it may."""
        name = simulated_frame(self._plan.alignment)
        if not name or self._conditions.simulated:
            return ""
        return f"The frame {name} of the plan is {SIMULATED}: it says nothing about a real part."

    def _state(self) -> JobState:
        """Return what the job is, beside its points."""
        deed, undone = self._log.last, self._log.last_undone
        return JobState(
            job=self._job.path.stem,
            header=self._header,
            progress=self._progress,
            methods={name: self.compensation_of(name) for name in self._progress.names},
            sensitivities=tuple(self._points.sensitivities(self._reference)),
            refusal=self._refusal,
            paused=self._paused,
            unproven=self._conditions.unproven or self._frame_doubt(),
            undo=deed.words if deed is not None else "",
            redo=undone.words if undone is not None else "",
            simulated=self._conditions.simulated,
        )
