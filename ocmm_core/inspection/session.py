"""One job being measured: touches become points, points features, features results.

The session has no threads and no clock of its own. Its methods may be called from any thread; one
lock guards them, and every change makes a new frozen `JobView`.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable
from dataclasses import replace

from ocmm_core.camera.rig import Rig
from ocmm_core.errors import MeasuringError
from ocmm_core.features.shapes import MINIMUM_POINTS
from ocmm_core.geometry import RigidTransform
from ocmm_core.inspection.acceptance import judge_touch
from ocmm_core.inspection.evaluation import (
    JobStanding,
    checked_features,
    evaluate_job,
    frame_of,
)
from ocmm_core.inspection.options import SessionOptions
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.quarantine import (
    Ward,
    event_text,
    held_back,
    notes_of,
)
from ocmm_core.inspection.reference_use import ReferenceUse
from ocmm_core.inspection.view import JobView
from ocmm_core.measuring.point import MeasuredPoint, Refusal
from ocmm_core.measuring.temperature import EVENT as TEMPERATURE
from ocmm_core.measuring.temperature import (
    Climate,
    climate_of_text,
    record_text,
    reported_points,
)
from ocmm_core.measuring.trigger import Touch
from ocmm_core.storage.job_file import JobFile
from ocmm_core.tracking.body import ProbeBody
from ocmm_core.tracking.result import ReferenceHome
from ocmm_core.tracking.sensitivity import TipSensitivity

_CALIBRATION, _PROBE, _UNCALIBRATED = "calibration", "probe", "uncalibrated"
"""Kinds of events of the job file."""


class InspectionSession:
    """Carry out a plan, point by point.

    Parameters
    ----------
    plan, rig, body
        What is measured, and with what.
    job
        Where points are made durable before anybody is told of them. Points that it holds already
        are taken over, so that a job goes on after an interruption.
    options
        Limits.

    Raises
    ------
    MeasuringError
        The job holds points of another probe or tip, or relative to another reference body.
    """

    def __init__(
        self, plan: Plan, rig: Rig, body: ProbeBody, job: JobFile, options: SessionOptions
    ) -> None:
        self._plan = plan
        self._rig = rig
        self._body = body
        self._job = job
        self._options = options
        self._lock = threading.RLock()
        self._points: list[MeasuredPoint] = job.points()
        if self._points and job.head.probe_identity != body.identity:
            raise MeasuringError(
                "session.other_probe",
                f"{job.path}: the points of this job were taken with another probe, with another "
                f"tip, or before the tip was calibrated or qualified anew.",
                "Begin a new job; or give the probe and the tip that this one was begun with.",
            )
        self._reference = ReferenceUse(
            rig, body, options.reference, job, begun=bool(self._points)
        )
        self._sensitivities: dict[int, TipSensitivity] = {
            point.number: self._reference.sensitivity(point.spots, point.reference_spots)
            for point in self._points
        }
        self._done: set[str] = set()
        self._refusal: Refusal | None = None
        events = job.events()
        notes = [event.text for event in events if event.kind == _UNCALIBRATED]
        self._unproven = notes[-1] if notes else ""
        self._recorded = [event.text for event in events if event.kind == TEMPERATURE]
        if self._points:
            self._require_same_climate()
        self._held = {ward: held_back(events, ward) for ward in Ward}
        self._first_own = job.next_number()
        for feature in plan.features:
            if self._count(feature.name) >= feature.points:
                self._done.add(feature.name)
        self._active = ""
        self._advance()
        self._view: JobView | None = None

    @property
    def view(self) -> JobView:
        """Return the job as it stands; computed when somebody looks after a change."""
        with self._lock:
            if self._view is None:
                self._view = self._evaluate()
            return self._view

    @property
    def T_part_from_world(self) -> RigidTransform | None:
        """Return the part frame, or None while its datums are not measured."""
        with self._lock:
            points = reported_points(self._points, self._options.climate.part)
            return frame_of(self._plan, checked_features(self._plan, points, self._options))

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
            self._job.append_event(_CALIBRATION, calibration)
            self._job.append_event(_PROBE, probe)
            if unproven:
                self._job.append_event(_UNCALIBRATED, unproven)
                self._unproven = unproven
            self._view = None

    def note_climate(self) -> None:
        """Store with which temperatures and switches the points from now on are taken.

        Raises
        ------
        StorageError
            It could not be made durable.
        """
        with self._lock:
            text = record_text(self._options.climate.record())
            if self._recorded[-1:] != [text]:
                self._job.append_event(TEMPERATURE, text)
                self._recorded.append(text)

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
            numbers = [
                point.number
                for point in self._points
                # Points of earlier runs have times of another clock.
                if point.number >= self._first_own
                and (since_s is None or point.time_s >= since_s)
            ]
            return self.hold_back_points(numbers, reason, Ward.CAMERAS)

    def hold_back_points(self, numbers: Iterable[int], reason: str, ward: Ward) -> list[int]:
        """Hold back points, and return those that were not yet; StorageError as `hold_back`."""
        with self._lock:
            new = [number for number in numbers if number not in self._held[ward]]
            self._held[ward] |= dict.fromkeys(new, reason)
            self._view = None
            if new:
                self._job.append_event(ward.held, event_text(new, reason))
            return new

    def release(self, reason: str, ward: Ward = Ward.CAMERAS) -> list[int]:
        """Let points count again that were held back, and return them.

        What was held back for the cameras in an earlier run stays so.

        Raises
        ------
        StorageError
            It could not be made durable; they stay held back.
        """
        with self._lock:
            held = self._held[ward]
            first = self._first_own if ward is Ward.CAMERAS else 0
            numbers = [number for number in held if number >= first]
            if numbers:
                self._job.append_event(ward.released, event_text(numbers, reason))
                self._held[ward] = {k: v for k, v in held.items() if k not in numbers}
                self._view = None
            return numbers

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
            outcome = self._point(touch, feature if feature is not None else self._active)
            self._view = None
            if isinstance(outcome, Refusal):
                self._note(outcome)
                return outcome
            self._append(outcome)
            self._refusal = None
            if self._count(outcome.feature) >= self._plan.feature(outcome.feature).points:
                self._done.add(outcome.feature)
                if outcome.feature == self._active:
                    self._advance()
            return outcome

    def undo(self) -> None:
        """Take back the last point; its observation stays in the job file.

        Raises
        ------
        MeasuringError
            There is no point.
        """
        with self._lock:
            last = self._take_back("undone by the operator")
            self._done.discard(last.feature)
            self._active = last.feature
            self._refusal = None
            self._view = None

    def flip(self) -> None:
        """Turn the compensation of the last point to the other side.

        Raises
        ------
        MeasuringError
            There is no point.
        """
        with self._lock:
            last = self._last()
            number = self._job.next_number()
            self._sensitivities[number] = self._sensitivities[last.number]
            turned = replace(last, number=number, direction=-last.direction, approach="flipped")
            # First held back, then there: whatever happens between, it never counts by mistake.
            for ward, held in self._held.items():
                if last.number in held:
                    self.hold_back_points([number], held[last.number], ward)
            self._job.replace_point(last.number, "compensation flipped by the operator", turned)
            self._points[-1] = turned
            self._view = None

    def finish(self) -> None:
        """Accept the active feature with the points it has and go to the next one.

        Raises
        ------
        MeasuringError
            No feature is active, or it has fewer points than its shape needs.
        """
        with self._lock:
            if not self._active:
                raise MeasuringError(
                    "session.complete",
                    "Every feature of the plan is measured.",
                    "Export the report, or select a feature to measure it again.",
                )
            feature = self._plan.feature(self._active)
            minimum, count = MINIMUM_POINTS[feature.shape], self._count(feature.name)
            if count < minimum:
                raise MeasuringError(
                    "session.too_few",
                    f"{feature.name} has {count} of the {minimum} points that a "
                    f"{feature.shape.value.lower()} needs.",
                    f"Take {minimum - count} more.",
                )
            self._job.append_event("finished", f"{feature.name} with {count} points")
            self._done.add(feature.name)
            self._advance()
            self._view = None

    def select(self, name: str) -> None:
        """Make a feature the one that takes the next point.

        Raises
        ------
        MeasuringError
            The plan has no feature of that name.
        """
        with self._lock:
            if name not in {feature.name for feature in self._plan.features}:
                raise MeasuringError(
                    "session.feature",
                    f"The plan has no feature called {name!r}.",
                    "Select one of the features in the list.",
                )
            self._active = name
            self._done.discard(name)
            self._view = None

    def missing(self) -> list[tuple[str, int]]:
        """Return the features that are not done and how many points each still needs."""
        with self._lock:
            return [
                (feature.name, max(feature.points - self._count(feature.name), 0))
                for feature in self._plan.features
                if feature.name not in self._done
            ]

    def refuse(self, refusal: Refusal) -> None:
        """Note that a trigger got no answer from the cameras."""
        with self._lock:
            self._note(refusal)

    def _note(self, refusal: Refusal) -> None:
        self._refusal = refusal
        self._job.append_event("refused", f"{refusal.code.value}: {refusal.what}")
        self._view = None

    def _point(self, touch: Touch, feature: str) -> MeasuredPoint | Refusal:
        judged = judge_touch(
            touch, feature, self._rig, self._body, self._options, self._reference
        )
        if isinstance(judged, Refusal):
            return judged
        number = self._job.next_number()
        self._sensitivities[number] = judged.sensitivity
        return judged.point(number, feature, self._body.tip_radius)

    def _append(self, point: MeasuredPoint) -> None:
        self._job.append_point(point)
        self._points.append(point)

    def _take_back(self, reason: str) -> MeasuredPoint:
        """Annul the last point and return it; MeasuringError if there is none."""
        self._job.annul_point(self._last().number, reason)
        return self._points.pop()

    def _last(self) -> MeasuredPoint:
        if not self._points:
            raise MeasuringError("session.no_point", "No point was taken yet.", "Take one first.")
        return self._points[-1]

    def _count(self, feature: str) -> int:
        return sum(point.feature == feature for point in self._points)

    def _advance(self) -> None:
        names = [feature.name for feature in self._plan.features if feature.name not in self._done]
        self._active = names[0] if names else ""

    def _evaluate(self) -> JobView:
        found = evaluate_job(
            self._plan,
            self._points,
            [self._sensitivities[point.number] for point in self._points],
            self._rig,
            self._body,
            self._options,
            frozenset(self._done),
        )
        standing = JobStanding(
            active=self._active,
            done=frozenset(self._done),
            held=notes_of(self._held),
            unproven=self._unproven,
        )
        results = found.judged(self._plan, standing)
        return JobView(
            job=self._job.path.stem,
            part=self._plan.part,
            operator=self._job.head.operator,
            features=found.features_seen(self._plan, results, standing),
            active=self._active,
            characteristics=results,
            refusal=self._refusal,
            complete=not self._active,
            unproven=self._unproven,
            held=tuple(p.number for p in self._points if p.number in standing.held),
            temperature=self._options.climate.words,
            at_20_c=self._options.climate.part.compensated,
        )

    def _require_same_climate(self) -> None:
        """Raise MeasuringError where points of this job were taken with other temperatures."""
        before = climate_of_text(self._recorded[-1]) if self._recorded else Climate()
        if before.record() != self._options.climate.record():
            raise MeasuringError(
                "session.temperature",
                f"{self._job.path}: its points were taken with other temperatures or switches. "
                f"{before.words}",
                "Go on with the same, or begin a new job.",
            )
