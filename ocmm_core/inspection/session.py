"""One job being measured: touches become points, points features, features results.

The session has no threads and no clock of its own. Its methods may be called from any thread; one
lock guards them, and every change makes a new frozen `JobView`.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from ocmm_core.camera.rig import Rig
from ocmm_core.errors import MeasuringError
from ocmm_core.features.shapes import MINIMUM_POINTS
from ocmm_core.geometry import RigidTransform
from ocmm_core.inspection.acceptance import judge_touch
from ocmm_core.inspection.deeds import Deed, Deeds
from ocmm_core.inspection.evaluation import checked_features, frame_of
from ocmm_core.inspection.header import header_of
from ocmm_core.inspection.job_points import FLIPPED, Change, JobPoints
from ocmm_core.inspection.job_view import JobState, view_of
from ocmm_core.inspection.options import SessionOptions
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.progress import EVENT, PAUSED, RESUMED, Progress, progress_of
from ocmm_core.inspection.quarantine import Ward
from ocmm_core.inspection.reference_use import ReferenceUse
from ocmm_core.inspection.view import JobView, Probing
from ocmm_core.measuring.point import MeasuredPoint, Refusal, RefusalCode
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

_CALIBRATION, _PROBE, _UNCALIBRATED = "calibration", "probe", "uncalibrated"
"""Kinds of events of the job file."""

_UNDONE = "undone by the operator"
_LONGEST_REASON = 200


class InspectionSession:
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
        self._plan = plan
        self._rig = rig
        self._body = body
        self._job = job
        self._options = options
        self._lock = threading.RLock()
        self._points = JobPoints(job)
        begun = bool(self._points.counting)
        if begun and job.head.probe_identity != body.identity:
            raise MeasuringError(
                "session.other_probe",
                f"{job.path}: the points of this job were taken with another probe, with another "
                f"tip, or before the tip was calibrated or qualified anew.",
                "Begin a new job; or give the probe and the tip that this one was begun with.",
            )
        self._reference = ReferenceUse(rig, body, options.reference, job, begun=begun)
        self._points.sensitivities(self._reference)
        self._refusal: Refusal | None = None
        events = job.events()
        notes = [event.text for event in events if event.kind == _UNCALIBRATED]
        self._unproven = notes[-1] if notes else ""
        self._recorded = [event.text for event in events if event.kind == TEMPERATURE]
        if begun:
            self._require_same_climate()
        self._header = header_of(job.head, events)
        self._progress = progress_of(plan, self._points.counts(), events)
        pauses = [event.kind for event in events if event.kind in (PAUSED, RESUMED)]
        self._paused = pauses[-1:] == [PAUSED]
        self._deeds = Deeds()
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
            points = reported_points(self._points.counting, self._options.climate.part)
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
            numbers = self._points.taken_since(since_s)
            return self.hold_back_points(numbers, reason, Ward.CAMERAS)

    def hold_back_points(self, numbers: Iterable[int], reason: str, ward: Ward) -> list[int]:
        """Hold back points, and return those that were not yet; StorageError as `hold_back`."""
        with self._lock:
            self._view = None
            return self._points.hold_back(numbers, reason, ward)

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

    def undo(self) -> None:
        """Take back the last step: a point, a deletion, a skip; nothing leaves the job file.

        Raises
        ------
        MeasuringError
            There is nothing to take back.
        """
        with self._lock:
            deed = self._deeds.last or self._last_point()
            if deed is None:
                raise MeasuringError(
                    "session.no_point", "No point was taken yet.", "Take one first."
                )
            self._deeds.undid(self._reverse(deed, "undone"))

    def redo(self) -> None:
        """Do again what was undone last.

        Raises
        ------
        MeasuringError
            Nothing was undone since the last step.
        """
        with self._lock:
            deed = self._deeds.last_undone
            if deed is None:
                raise MeasuringError(
                    "session.no_redo", "Nothing was undone.", "Undo something first."
                )
            self._deeds.redid(self._reverse(deed, "done again"))

    def flip(self, number: int | None = None) -> None:
        """Turn the compensation of a point, or of the last one, to the other side.

        Raises
        ------
        MeasuringError
            There is no such point.
        """
        with self._lock:
            if not self._points.counting:
                raise MeasuringError(
                    "session.no_point", "No point was taken yet.", "Take one first."
                )
            old = self._points.counting[-1] if number is None else self._points.point(number)
            new = replace(
                old,
                number=self._points.next_number(),
                direction=-old.direction,
                approach="flipped",
            )
            change = self._points.replace(old, new, FLIPPED)
            self._remember(f"flip of point {old.number}", change, self._progress)

    def delete_point(self, number: int, reason: str) -> None:
        """Take a point out, and say why; its observation stays in the job file.

        The feature is fitted without it. It takes points again where it has fewer than the plan
        wants; `finish` accepts it with fewer.

        Raises
        ------
        MeasuringError
            There is no such point, or no reason is given.
        """
        with self._lock:
            feature = self._points.point(number).feature
            self._did(
                f"deletion of point {number}",
                self._settled(feature, -1),
                annul={number: _checked_reason(reason)},
            )

    def restore_point(self, number: int) -> None:
        """Put a deleted point back, with a new number.

        Raises
        ------
        MeasuringError
            The point was not deleted, or is back already.
        """
        with self._lock:
            feature = self._points.taken_out(number).feature
            self._did(
                f"restoring of point {number}", self._settled(feature, 1), restore=[number]
            )

    def skip(self, name: str = "") -> None:
        """Leave a feature, or the active one, out; what rests on it is not measured.

        Raises
        ------
        MeasuringError
            There is no such feature, or none is active.
        """
        with self._lock:
            name = self._known(name or self._require_active())
            self._did(
                f"skipping of {name}", self._progress.left_out(name), events=[("skipped", name)]
            )

    def repeat(self, name: str = "") -> None:
        """Measure a feature, or the active one, anew: all its points are taken out.

        Raises
        ------
        MeasuringError
            There is no such feature, or none is active.
        """
        with self._lock:
            name = self._known(name or self._require_active())
            numbers = [point.number for point in self._points.of(name)]
            self._did(
                f"repeating of {name}",
                self._progress.opened(name),
                annul=dict.fromkeys(numbers, f"{name} is measured anew"),
                events=[("repeated", name)],
            )

    def finish(self) -> None:
        """Accept the active feature with the points it has and go to the next one.

        Raises
        ------
        MeasuringError
            No feature is active, or it has fewer points than its shape needs.
        """
        with self._lock:
            feature = self._plan.feature(self._require_active())
            minimum, count = MINIMUM_POINTS[feature.shape], self._points.count(feature.name)
            if count < minimum:
                raise MeasuringError(
                    "session.too_few",
                    f"{feature.name} has {count} of the {minimum} points that a "
                    f"{feature.shape.value.lower()} needs.",
                    f"Take {minimum - count} more.",
                )
            self._did(
                f"finishing of {feature.name}",
                self._progress.finished(feature.name),
                events=[("finished", f"{feature.name} with {count} points")],
            )

    def select(self, name: str) -> None:
        """Make a feature the one that takes the next point.

        Raises
        ------
        MeasuringError
            The plan has no feature of that name.
        """
        with self._lock:
            self._stand(self._progress.opened(self._known(name)))

    def set_order(self, probing: Probing) -> None:
        """Probe in the order of the plan, or in any: the feature that is touched is then found.

        Before the part frame is known, which says where the features are, the order of the plan
        holds in any case.
        """
        with self._lock:
            self._stand(replace(self._progress, probing=probing))

    def _stand(self, after: Progress) -> None:
        self._change(after, {}, (), ())
        self._progress, self._view = after, None

    def pause(self) -> None:
        """Take no points until `resume`, whatever is touched; also when the job is opened anew."""
        with self._lock:
            if not self._paused:
                self._job.append_event(PAUSED, "by the operator")
                self._paused, self._view = True, None

    def resume(self) -> None:
        """Take points again."""
        with self._lock:
            if self._paused:
                self._job.append_event(RESUMED, "by the operator")
                self._paused, self._view = False, None

    def refit(self) -> None:
        """Compute everything again from the raw observations of the points."""
        with self._lock:
            self._points.forget_sensitivities()
            self._view = None

    def missing(self) -> list[tuple[str, int]]:
        """Return the features that are not done and how many points each still needs."""
        with self._lock:
            settled = self._progress.done | self._progress.skipped
            return [
                (feature.name, max(feature.points - self._points.count(feature.name), 0))
                for feature in self._plan.features
                if feature.name not in settled
            ]

    def refuse(self, refusal: Refusal) -> None:
        """Note that a trigger got no answer from the cameras."""
        with self._lock:
            self._note(refusal)

    def _note(self, refusal: Refusal) -> None:
        self._refusal = refusal
        self._job.append_event("refused", f"{refusal.code.value}: {refusal.what}")
        self._view = None

    def _point(self, touch: Touch, wanted: str | None) -> MeasuredPoint | Refusal:
        if self._paused:
            return Refusal(
                RefusalCode.PAUSED,
                "The job is paused.",
                "Go on with the job, then touch again.",
                float(touch.window.time_ns[0]) * 1e-9 if len(touch.window) else 0.0,
            )
        name = wanted if wanted is not None else self._progress.active
        judged = judge_touch(touch, name, self._rig, self._body, self._options, self._reference)
        if isinstance(judged, Refusal):
            return judged
        point = judged.point(self._points.next_number(), name, self._body.tip_radius)
        change = self._points.add(point, judged.sensitivity)
        before = self._progress.opened(name)
        after = before if self._progress.active == name else self._progress
        if self._points.count(name) >= self._plan.feature(name).points:
            after = after.finished(name)
        self._deeds.did(Deed(f"point {point.number} of {name}", change, before, after))
        self._progress, self._refusal, self._view = after, None, None
        return point

    def _did(
        self,
        words: str,
        after: Progress,
        annul: Mapping[int, str] = MappingProxyType({}),
        restore: Sequence[int] = (),
        events: Sequence[tuple[str, str]] = (),
    ) -> None:
        """Make a step of the inspector durable, all or nothing, and remember it."""
        self._remember(words, self._change(after, annul, restore, events), after)

    def _remember(self, words: str, change: Change, after: Progress) -> None:
        self._deeds.did(Deed(words, change, self._progress, after))
        self._progress, self._refusal, self._view = after, None, None

    def _change(
        self,
        after: Progress,
        annul: Mapping[int, str],
        restore: Sequence[int],
        events: Sequence[tuple[str, str]],
    ) -> Change:
        stands = [(EVENT, after.text)] if after != self._progress else []
        return self._points.change(annul, restore, [*events, *stands])

    def _reverse(self, deed: Deed, word: str) -> Deed:
        """Take a step back, and return the one that this was."""
        # A point in the place of another has the same observation: it is not to come back twice.
        reason = FLIPPED if deed.change.added and deed.change.removed else _UNDONE
        change = self._change(
            deed.before,
            {self._points.latest(number): reason for number in deed.change.added},
            [self._points.latest(number) for number in deed.change.removed],
            [(word, deed.words)],
        )
        self._progress, self._refusal, self._view = deed.before, None, None
        return deed.undone_by(change)

    def _last_point(self) -> Deed | None:
        """Return the taking of the last point of an earlier run as a step."""
        if not self._points.counting:
            return None
        last = self._points.counting[-1]
        return Deed(
            f"point {last.number} of {last.feature}",
            Change((last.number,), ()),
            self._progress.opened(last.feature),
            self._progress,
        )

    def _settled(self, name: str, more: int) -> Progress:
        """Return the progress after ``more`` points of a feature."""
        if self._points.count(name) + more >= self._plan.feature(name).points:
            return self._progress.finished(name)
        return self._progress.reopened(name)

    def _require_active(self) -> str:
        if not self._progress.active:
            raise MeasuringError(
                "session.complete",
                "Every feature of the plan is measured.",
                "Export the report, or select a feature to measure it again.",
            )
        return self._progress.active

    def _known(self, name: str) -> str:
        if name not in self._progress.names:
            raise MeasuringError(
                "session.feature",
                f"The plan has no feature called {name!r}.",
                "Select one of the features in the list.",
            )
        return name

    def _evaluate(self) -> JobView:
        deed, undone = self._deeds.last or self._last_point(), self._deeds.last_undone
        return view_of(
            self._plan,
            self._rig,
            self._body,
            self._options,
            self._points,
            JobState(
                job=self._job.path.stem,
                header=self._header,
                progress=self._progress,
                sensitivities=tuple(self._points.sensitivities(self._reference)),
                refusal=self._refusal,
                paused=self._paused,
                unproven=self._unproven,
                undo=deed.words if deed is not None else "",
                redo=undone.words if undone is not None else "",
            ),
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


def _checked_reason(reason: str) -> str:
    """Return the reason of a deletion on one line; MeasuringError where there is none."""
    line = " ".join(reason.split())[:_LONGEST_REASON]
    if not line or not line.isprintable():
        raise MeasuringError(
            "session.no_reason",
            "A point is only deleted with a reason.",
            "Say in some words why it does not belong to the feature.",
        )
    return line
