"""The current job: its file, its session, and the watches that hold its points.

Findings of the monitor report a suspect calibration and hold points. The suspicion is stored with a
calibration from a store until a verification passes, which releases the points. Failures entered by
other programs also hold points. Without a store it lasts as long as the job.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

from ocmm_core.calibration import monitor, records
from ocmm_core.camera import Rig
from ocmm_core.fieldbus.described import refuse_unproven
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.finished import first_taken, is_known, settle_cameras
from ocmm_core.inspection.plan import Plan, climate_for, part_of_plan, release_in_job
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.seals import NO_RELEASE, ReleaseState
from ocmm_core.station._calibration_watch import PAUSE, ProbeWatch
from ocmm_core.station._faults import StationEvents, StationFaults
from ocmm_core.storage import JobFile, saved_sentence
from ocmm_core.tracking import ProbeBody, ReferenceBody, TrackBlock

WHO = "monitor"
"""Author of suspicions in the history."""

_USABLE = (records.CalibrationStatus.VALID, records.CalibrationStatus.DUE)
_REMEDIES = {
    monitor.ChangeCause.PROBE: "Check the probe and calibrate it, then start a new job.",
    monitor.ChangeCause.COMMON: "Align the part again.",
}
_REMEDY = "Fasten the cameras and verify the calibration; if that fails, calibrate again."


class ChangeWatch:
    """Feed the monitor and act on its findings; `push` belongs to the reconstruction thread.

    `session`, `job`: Hold the points. Raises CalibrationError if the baseline learned for this
    calibration is damaged.
    """

    def __init__(
        self,
        in_use: records.CalibrationInUse,
        body: ProbeBody,
        session: InspectionSession,
        job: JobFile,
    ) -> None:
        self._in_use = in_use
        self._body = body
        self._session = session
        self._job = job
        self._settled = 0
        self._baseline = None
        if in_use.record is not None and in_use.store is not None:
            self._baseline = monitor.load_baseline(
                in_use.store.folder, records.record_hash(in_use.record), body.identity
            )
        self._monitor = self._new_monitor()
        self._doubt: records.Blocker | None = None
        self._stored = False

    @property
    def doubt(self) -> records.Blocker | None:
        """Return the change and its remedy, or None; thread-safe."""
        return self._doubt

    def push(self, track: TrackBlock, view: records.CalibrationView) -> bool:
        """Process tracked frames; return whether the suspicion changed.

        `track`: consecutive frames. `view`: current state of the calibration. Raises OcmmError if
        the suspicion could not be made durable; it holds until the program ends in any case.
        """
        settled = self.settle()
        if self._doubt is not None:
            return self._cleared(view) or settled
        alarms = (item for item in self._monitor.push(track) if item.alarm)
        if self._in_use.rig.markers is not None:
            # The views of a tracker are computed: none of them moves.
            alarms = (item for item in alarms if item.cause is monitor.ChangeCause.PROBE)
        alarm = next(alarms, None)
        if alarm is None:
            return settled
        self._raise(alarm, int(track.time_ns[-1]), view)
        return True

    def settle(self) -> bool:
        """Hold and release points by the history of the calibration; return whether any changed.

        The store reads entries of other processes whenever the calibration is judged
        (`calibration.records.judge`), some times a second. Raises OcmmError if it could not be made
        durable, or the history cannot be read.
        """
        store, record = self._in_use.store, self._in_use.record
        if store is None or record is None or len(store.events) == self._settled:
            return False
        self._settled = len(store.events)
        used = self._job.head.rig_identity
        if not is_known(store.events, used):
            return False
        return settle_cameras(self._session, self._job, store, used)

    def _raise(
        self, alarm: monitor.DriftReport, now_ns: int, view: records.CalibrationView
    ) -> None:
        self._doubt = records.Blocker(alarm.what, _REMEDIES.get(alarm.cause, _REMEDY))
        since_s = None if alarm.since_ns is None else alarm.since_ns * 1e-9
        try:
            self._session.held.hold_back(since_s, alarm.what)
        finally:
            store = self._in_use.store
            of_cameras = alarm.cause in (monitor.ChangeCause.CAMERA, monitor.ChangeCause.UNKNOWN)
            if store is not None and of_cameras and view.word in _USABLE:
                now = datetime.now(UTC)
                # Never found good in this run: the change may be earlier.
                since = None
                if since_s is not None:
                    since = self._moment(since_s, now_ns * 1e-9, now)
                store.suspect(WHO, alarm.what, since, now)
                self._stored = True

    def _moment(self, since_s: float, now_s: float, now: datetime) -> datetime:
        """Return the wall time of a moment of the frames, also of faster simulated ones.

        Points are stored after their frames, and must also be before the moment in wall time.
        """
        taken = first_taken(self._job)
        before = [
            taken[point.number] + timedelta(microseconds=1)
            for feature in self._session.view.features
            for point in feature.points
            if point.time_s < since_s and point.number in taken
        ]
        return max([now - timedelta(seconds=now_s - since_s), *before])

    def _cleared(self, view: records.CalibrationView) -> bool:
        """Release the points once a verification has lifted the stored suspicion."""
        if not self._stored or view.word not in _USABLE:
            return False
        self._session.held.release("The calibration has since been verified.")
        self._doubt, self._stored = None, False
        self._monitor = self._new_monitor()
        return True

    def _new_monitor(self) -> monitor.CalibrationMonitor:
        record = self._in_use.record
        maps = record.residual_maps if record is not None else ()
        return monitor.CalibrationMonitor(self._in_use.rig, self._body, maps, self._baseline)


@dataclass(frozen=True, slots=True)
class Gear:
    """Equipment of every job of a station."""

    calibration: records.CalibrationInUse
    probe: records.ProbeInUse
    """`calibration`, `probe`: Of the cameras, and of the mounted tip."""
    reference: ReferenceBody | None = None
    """Reference body of all coordinates; None without one."""
    pause: timedelta = PAUSE
    """Time without a point or a check after which the tip must be checked."""
    released_only: bool = False

    @property
    def rig(self) -> Rig:
        return self.calibration.rig

    @property
    def body(self) -> ProbeBody:
        return self.probe.body


@dataclass(frozen=True, slots=True)
class PlanInUse:
    """A plan with the options of its sessions."""

    plan: Plan
    options: SessionOptions
    """Limits, and the climate with the plan's expansion."""
    file: Path | None = None
    """Path of the plan, next to its pictures; None if unknown."""

    def with_plan(self, plan: Plan, file: Path | None) -> PlanInUse:
        """Return another plan in use; InputError as `climate_for`."""
        # The pose of a part by the former plan does not apply.
        options = replace(
            self.options, climate=climate_for(self.options.climate, self.plan, plan), near=None
        )
        return PlanInUse(plan, options, file)


@dataclass(frozen=True, slots=True)
class OpenJob:
    """All parts of one job."""

    file: JobFile
    session: InspectionSession
    use: PlanInUse
    changes: ChangeWatch
    probe: ProbeWatch
    """`changes`, `probe`: Hold its points if cameras or tip are suspect."""
    release: ReleaseState = NO_RELEASE


def open_job(file: JobFile, use: PlanInUse, gear: Gear) -> OpenJob:
    """Return a job ready to measure; errors as `InspectionSession` and `ChangeWatch`.

    Raises InputError if its plan excludes cameras that cannot prove the age of their data.
    """
    device = gear.calibration.device
    if device is not None:
        refuse_unproven(device, allowed=use.plan.cameras == "unproven")
    session = InspectionSession(use.plan, gear.rig, gear.body, file, use.options)
    changes = ChangeWatch(gear.calibration, gear.body, session, file)
    watch = ProbeWatch(gear.probe, session, file, gear.pause)
    release = release_in_job(file.head, file.events())
    return OpenJob(file, session, use, changes, watch, release)


class CurrentJob:
    """The current job; thread-safe. Read ``now`` once for consistent values."""

    def __init__(self, now: OpenJob) -> None:
        self.now = now
        self.ended = False

    def what_is_safe(self) -> str:
        """Return the sentence on saved points."""
        return saved_sentence(self.now.file.saved_in)

    def has_points(self) -> bool:
        return self.now.session.has_points


class PartLoader:
    """Load the part of a job's plan in the background."""

    def __init__(self, faults: StationFaults, events: StationEvents) -> None:
        self._faults, self._events = faults, events
        self._thread: threading.Thread | None = None
        self._given_up = threading.Event()

    def start(self, job: OpenJob) -> None:
        """Load the part of a job, unless its file holds it, cancelling a running load."""
        self.close()
        shown = job.session.part.model is not None
        if shown or job.use.plan.model is None or job.use.file is None:
            return
        self._given_up = threading.Event()
        self._thread = threading.Thread(
            target=self._load, args=(job, job.use.file.parent, self._given_up), name="part"
        )
        self._thread.start()

    def close(self) -> None:
        """Cancel loading, and wait for its end."""
        self._given_up.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _load(self, job: OpenJob, folder: Path, given_up: threading.Event) -> None:
        try:
            found = part_of_plan(job.use.plan, folder, given_up.is_set)
            if given_up.is_set():
                return
            if found.doubt is not None:
                raise found.doubt
            if found.model is not None:
                job.session.part.show(found.model)
                self._events.emit(self._events.changed)
        except Exception as error:
            if not given_up.is_set():
                self._faults.note(error, "The CAD model")
