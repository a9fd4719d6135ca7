"""The measuring station: acquisition, reconstruction and session, run together.

Window and command line use the same station. Frames go from the ring through tracking to the
session on one thread of its own (the reconstruction thread); everybody else pulls snapshots.
Signals carry changes of state only and are emitted on the thread that made the change.
"""

from __future__ import annotations

import inspect
import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import ClassVar

from psygnal import EmitLoopError, Signal, SignalInstance

from ocmm_core.acquisition.bus_process import Acquisition, ChildProcess, RemoteObjects
from ocmm_core.acquisition.frames import (
    AcquisitionState,
    AcquisitionStatus,
    FrameBlock,
    FrameRing,
    StopReason,
    read_status,
)
from ocmm_core.calibration.records import (
    CalibrationInUse,
    CalibrationOverview,
    CalibrationView,
    Obstacle,
    ProbeInUse,
    ProbeOverview,
    ProbeView,
    Word,
    overview,
    probe_overview,
)
from ocmm_core.documents import digest
from ocmm_core.errors import MeasuringError, OcmmError
from ocmm_core.export import DEFAULT_FORMAT, write_report, write_together
from ocmm_core.export.report import Instrument, Profile, ReportData, report_data
from ocmm_core.failure import contained
from ocmm_core.fieldbus.report import BusReport
from ocmm_core.fieldbus.wire import is_virtual_interface
from ocmm_core.inspection.causes import Explanation
from ocmm_core.inspection.evaluation import JobHeader, JobView, LiveView, SessionOptions, StatusWord
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import MeasuredPoint, Refusal, RefusalCode
from ocmm_core.station._bus_watch import BusView, BusWatch, bus_text
from ocmm_core.station._calibration_watch import CalibrationWatch
from ocmm_core.station._change_watch import ChangeWatch
from ocmm_core.station._faults import Fault, Faults
from ocmm_core.station._frame_loop import FrameLoop, FrameSink, Tracked
from ocmm_core.station._jobs import drop_if_empty, give_back, job_for
from ocmm_core.station._live import LiveState
from ocmm_core.station._plan_change import PlanInUse, job_by, pause_unfinished, plan_of
from ocmm_core.station._probe_watch import PAUSE, ProbeWatch
from ocmm_core.station.stream import ButtonChange, ButtonWatch, StreamOptions, StreamServer
from ocmm_core.storage import JobFile, JobStep
from ocmm_core.tracking import ReferenceBody, TrackBlock, TrackingOptions, in_rig

_log = logging.getLogger(__name__)

_STOP_S = 1.5
_EVALUATION = "The evaluation"
_NOTHING_CHANGED = "The job before is measured as it was."
_UNKNOWN = AcquisitionStatus(
    AcquisitionState.STOPPED, StopReason.FAILED, "", 0, 0, 0, 0, 0, 0, 0, 0
)
_REPORT_TRIES = 20


@dataclass(frozen=True, slots=True)
class StationOptions:
    """How the station works.

    Attributes
    ----------
    session, tracking
        Options of the session and of the tracking.
    live_source
        Frames come by themselves, over a bus, so that silence means a fault.
    intent
        For scripted operators: which feature the touch that ends at an exposure is meant for;
        None where the active feature of the session takes every point.
    pause
        After so long without a point or a check the tip must be checked.
    stream
        How points and poses are given to other programs; None where they are not.
    plan_file
        Where the plan is, with its pictures beside it; None where that is not known.
    simulated
        The frames come from a virtual rig; the job says so, for good.
    """

    session: SessionOptions
    tracking: TrackingOptions
    live_source: bool = False
    intent: Callable[[int], str | None] | None = None
    pause: timedelta = PAUSE
    stream: StreamOptions | None = None
    plan_file: Path | None = None
    simulated: bool = False


class MeasuringStation:
    """Measure one job.

    Parameters
    ----------
    plan, calibration, probe
        What is measured and with what.
    job
        The open job file; closed by `close`.
    acquisition
        Fills ``ring``; started and stopped by the station.
    ring
        Owned by the station from now on.
    options
        See `StationOptions`.
    recorder
        Gets every raw frame; closed by `close`.
    """

    changed: ClassVar[Signal] = Signal()
    """Emitted without arguments after every change of the job."""
    point_taken: ClassVar[Signal] = Signal(MeasuredPoint)
    """Emitted after a point has become durable."""
    point_refused: ClassVar[Signal] = Signal(Refusal)
    """Emitted when a touch gave no point."""
    button: ClassVar[Signal] = Signal(ButtonChange)
    """Emitted when the button of the probe goes down or up, whatever comes of it."""
    failed: ClassVar[Signal] = Signal(OcmmError)
    """Emitted when the reconstruction had to give up on a touch or altogether."""

    def __init__(
        self,
        plan: Plan,
        calibration: CalibrationInUse,
        probe: ProbeInUse,
        job: JobFile,
        acquisition: Acquisition,
        ring: FrameRing,
        options: StationOptions,
        recorder: FrameSink | None = None,
    ) -> None:
        self.rig = rig = calibration.rig
        self.body = body = probe.body
        self._job = job
        self._acquisition = acquisition
        self._ring = ring
        # What is said about results depends on how their poses were computed.
        session = replace(options.session, method=options.tracking.method)
        self._options = options = replace(options, session=session)
        self._use = PlanInUse(plan, options.session, options.plan_file)
        self._plan_files: dict[str, Path] = {}
        if options.plan_file is not None:
            self._plan_files[job.head.plan_identity] = options.plan_file
        self._recorder = recorder
        self._session = InspectionSession(plan, rig, body, job, options.session)
        self._bus = BusWatch(ring) if options.live_source else None
        self._live = LiveState(
            rig, body, options.session.point, self._bus, options.session.reference
        )
        objects = None
        if isinstance(acquisition, ChildProcess):
            objects = partial(RemoteObjects, acquisition)
        self._calibration = CalibrationWatch(
            calibration,
            self._bus,
            objects,
            failed=lambda error: self._faults.fail(error, "The watch over the calibration"),
        )
        self._changes = ChangeWatch(calibration, body, self._session, job)
        self._probe = ProbeWatch(probe, self._session, job, options.pause)
        self._button = ButtonWatch()
        self._watcher: Callable[[FrameBlock], None] | None = None
        self._faults = Faults(self._tell_fault, self._stop_measuring, self._what_is_safe)
        self._frames = FrameLoop(
            ring,
            rig,
            body,
            options.session.reference,
            options.tracking,
            options.session.point,
            home=self._session.reference_home,
            pulled=lambda: self._session.awaits_pull,
            measure=self._measure,
            failed=lambda error: self._faults.fail(error, "The reconstruction"),
            recorder=recorder,
            unrecorded=lambda error: self._faults.note(error, "The recording"),
        )
        self._last_status: AcquisitionStatus | None = None
        self.stream: StreamServer | None = None
        """What other programs read points and poses from; None where they do not."""
        if options.stream is not None:
            self.stream = StreamServer(
                self, options.stream, lambda error: self._faults.note(error, "The live stream")
            )

    def start(self) -> None:
        """Start acquisition and reconstruction, and the stream where one is wanted.

        Raises
        ------
        MeasuringError
            The address of the stream cannot be had; nothing runs then.
        InternalError
            Nobody foresaw it; the station is FAILED then, as it is after any other error.
        """
        # psygnal looks at all modules when a listener fails first: here it costs nobody a frame, in
        # the reconstruction thread of a busy computer 0.3 s.
        inspect.stack()
        try:
            if self.stream is not None:
                self.stream.start()
            self._note_start(self._session, self._probe)
            self._acquisition.start()
            self._calibration.start()
            self._frames.start()
        except Exception as error:
            raise self._faults.fail(error, "The start", tell=False) from error

    @property
    def fault(self) -> Fault | None:
        """Return why nothing is measured any more until a new start; None while it is."""
        return self._faults.measuring

    @property
    def faults_beside(self) -> tuple[Fault, ...]:
        """Return what has failed beside the measuring: stream, recording, listeners."""
        return self._faults.beside

    def why_failed(self) -> OcmmError | None:
        """Return what to tell of `fault`, with the name of its log: waits until that is written."""
        fault = self._faults.with_log()
        return None if fault is None else fault.error

    def fail(self, error: Exception, part: str) -> None:
        """Measure no more: something that shows or judges what is measured has failed.

        Parameters
        ----------
        part
            What failed, as the beginning of a sentence.
        """
        self._faults.fail(error, part)

    def next_part(self, header: JobHeader) -> None:
        """Go on with a new job for another part by the same plan; errors as `job_for`."""
        job = job_for(header, self._job.head, self.plan, self._job.path.parent)
        self._begin(job, lambda: self._use)

    def change_plan(self, path: Path, header: JobHeader) -> str:
        """Begin a job by the plan of a file, and say in a sentence what became of the one before.

        A job that has points and is not finished is paused first; it can be gone on with. Where
        the file is the plan that is measured already, this is `next_part`.

        Parameters
        ----------
        path
            Document of the plan.
        header
            Operator, serial number, order and batch; the part is that of the plan.

        Raises
        ------
        InputError, StorageError
            As `job_by`; nothing has changed then.
        """
        path = path.absolute()
        if digest(path) == self.plan_identity:
            self.next_part(replace(header, part=self.plan.part))
            return ""
        job, use = job_by(path, header, self._job.head, self._use, self._job.path.parent)
        self._plan_files[job.head.plan_identity] = path
        return self._begin(job, lambda: use)

    def go_on(self, path: Path) -> str:
        """Go on with a job that was left open, by the plan in its own file.

        Returns what became of the job before, as `change_plan`.

        Raises
        ------
        StorageError, InputError, MeasuringError
            The file cannot be opened for measuring, or its plan cannot be used; the job belongs to
            another probe, or to another reference body.
        """
        job = JobFile.open(path)
        return self._begin(
            job, lambda: plan_of(job, self._job.head, self._use, self._plan_files), made=False
        )

    def _begin(self, job: JobFile, by: Callable[[], PlanInUse], *, made: bool = True) -> str:
        """Measure into another job file; the one before is closed.

        All or nothing: whatever is raised, the job before is measured as it was, and the other
        file is closed, and removed where it was ``made`` for this and holds no point.
        """
        before, was_paused, words = self._work, self._session.paused, ""
        try:
            use = by()
            session = InspectionSession(use.plan, self.rig, self.body, job, use.options)
            changes = ChangeWatch(self._calibration.in_use, self.body, session, job)
            probe = ProbeWatch(self._probe.in_use, session, job, self._options.pause)
            pipeline = None
            if session.reference_home is not None:
                # Its points are relative to where the reference body stood when it was begun.
                pipeline = self._frames.pipeline_from(session.reference_home)
            with self._frames.between():
                self._note_start(session, probe)
                if use is not self._use:
                    words = pause_unfinished(self._session, self._job)
                self._work = (job, session, use, changes, probe)
                drop_if_empty(before[0])
                if pipeline is not None:
                    self._frames.track_by(pipeline)
        except BaseException as error:
            self._work = before
            give_back(job, made=made)
            if words and not was_paused:
                before[1].resume()
            if isinstance(error, OcmmError) or not isinstance(error, Exception):
                raise
            raise contained(error, "The change of the job", _NOTHING_CHANGED) from error
        self._emit(self.changed)
        return words

    @property
    def _work(self) -> tuple[JobFile, InspectionSession, PlanInUse, ChangeWatch, ProbeWatch]:
        """Return everything that belongs to the job that is measured."""
        return self._job, self._session, self._use, self._changes, self._probe

    @_work.setter
    def _work(
        self, work: tuple[JobFile, InspectionSession, PlanInUse, ChangeWatch, ProbeWatch]
    ) -> None:
        self._job, self._session, self._use, self._changes, self._probe = work

    def _note_start(self, session: InspectionSession, probe: ProbeWatch) -> None:
        """Store with what the points from now on are taken."""
        probe.start()
        calibration, view = self.calibration(), probe.view()
        unproven = calibration.unproven
        if unproven and view.obstacle is not None:
            unproven = f"{unproven} {view.obstacle.what}"
        session.note_calibration(
            f"{calibration.word.value} {calibration.identity}", view.note, unproven
        )
        session.note_climate()
        session.note_limits()
        session.note_origin(simulated=self.simulated)

    @property
    def simulated(self) -> bool:
        """Return whether the frames come from a virtual rig, as far as is known by now."""
        report = self.bus_report()
        return self._options.simulated or (
            report is not None and is_virtual_interface(report.interface)
        )

    def _emit(self, signal: SignalInstance, *arguments: object) -> None:
        """Tell who listens; a listener that fails is none of the measuring's business."""
        try:
            signal.emit(*arguments)
        except EmitLoopError as error:
            self._faults.note(error, f"A listener to '{signal.name}'")

    def _tell_fault(self, error: OcmmError) -> None:
        try:
            self.failed.emit(error)
        except EmitLoopError as fault:
            # Nobody is left who could be told; the state says it.
            told = contained(fault, "A listener to 'failed'")
            _log.error("%s", told)

    def _stop_measuring(self) -> None:
        self._frames.request_stop()

    def _what_is_safe(self) -> str:
        return f"All points taken are saved in {self._job.path.absolute()}."

    def _done(self, verb: Callable[[], object]) -> None:
        """Change the job and tell of it; what nobody foresaw leaves the job in doubt.

        Raises
        ------
        OcmmError
            What the verb raises; nothing is told then.
        """
        try:
            verb()
        except OcmmError:
            raise
        except Exception as error:
            # The file may know of a step that the memory does not: only a new start reads it.
            raise self._faults.fail(error, "The change of the job", tell=False) from error
        self._emit(self.changed)

    def request_stop(self) -> None:
        """Ask both to end; returns at once."""
        self._acquisition.request_stop()
        self._frames.request_stop()

    def join(self, timeout_s: float) -> bool:
        """Wait for the end of both, no longer than this in all, and say whether it came."""
        until = time.monotonic() + timeout_s
        ended = self._acquisition.join(timeout_s)
        ended = self._frames.join(max(until - time.monotonic(), 0.0)) and ended
        return self._calibration.close(max(until - time.monotonic(), 0.0)) and ended

    def close(self) -> None:
        """Stop, and give back ring, recorder and job file. May be called twice."""
        if self._last_status is not None:
            return
        self.request_stop()
        if not self.join(_STOP_S):
            _log.error("The acquisition did not end within %s s.", _STOP_S)
        if self.stream is not None and not self.stream.close():
            _log.error("The stream did not end in time.")
        self._last_status = self.acquisition_status()
        if self._bus is not None:
            self._bus.close()
        self._ring.close()
        if self._recorder is not None:
            try:
                self._recorder.close()
            except Exception as error:
                # The points come before the recording: the job is closed all the same.
                self._faults.note(error, "The recording")
        self._job.close()

    def wait_finished(self, timeout_s: float) -> bool:
        """Wait until the source has ended and all its frames are measured; say whether so."""
        return self._frames.wait_drained(timeout_s)

    def acquisition_status(self) -> AcquisitionStatus:
        """Return the counters of the acquisition; after `close`, those at the end."""
        return self._last_status if self._last_status is not None else read_status(self._ring)

    def live(self) -> LiveView:
        """Return what the machine sees now."""
        status = _UNKNOWN
        try:
            status = self.acquisition_status()
            if self._faults.measuring is None:
                obstacle = self._obstacle()
                return self._live.view(status, str(obstacle or ""), self._words_beside)
        except Exception as error:
            self._faults.fail(error, "The judging of what is seen")
        return self._live.failed(status, self._faults.reason, self._words_beside)

    @property
    def _words_beside(self) -> tuple[str, ...]:
        return tuple(fault.error.what for fault in self._faults.beside)

    def calibration(self) -> CalibrationView:
        """Return what is to be said about the calibration, at most 0.2 s old."""
        try:
            return self._calibration.view()
        except Exception as error:
            told = self._faults.fail(error, "The watch over the calibration")
            return CalibrationView(
                word=Word.UNUSABLE,
                rig=self.rig.name,
                identity=self.rig.identity,
                obstacle=Obstacle(told.what, told.remedy),
            )

    def calibration_overview(self) -> CalibrationOverview:
        """Return what the store of the rig holds; reads all its records."""
        return overview(self._calibration.in_use.store)

    @property
    def calibration_in_use(self) -> CalibrationInUse:
        """Return the calibration that the job was begun with, and its store."""
        return self._calibration.in_use

    def probe_view(self) -> ProbeView:
        """Return what is to be said about probe and tip, at most 0.2 s old."""
        try:
            return self._probe.view()
        except Exception as error:
            told = self._faults.fail(error, "The watch over the probe")
            return ProbeView(
                word=Word.UNUSABLE,
                probe=self.body.name,
                tip=self._probe.in_use.tip,
                identity=self.body.identity,
                diameter_mm=2.0 * self.body.tip_radius,
                obstacle=Obstacle(told.what, told.remedy),
            )

    def probe_overview(self) -> ProbeOverview:
        """Return what the records of the probe hold; reads all of them."""
        return probe_overview(self._probe.in_use.store, datetime.now(UTC))

    @property
    def probe_in_use(self) -> ProbeInUse:
        """Return the probe that the job was begun with, and its records."""
        return self._probe.in_use

    @property
    def plan(self) -> Plan:
        """Return what is measured now."""
        return self._use.plan

    @property
    def plan_identity(self) -> str:
        """Return the SHA-256 of the document that is measured by now."""
        return self._job.head.plan_identity

    @property
    def plan_file(self) -> Path | None:
        """Return where the plan is, with its pictures beside it; None where not known."""
        return self._use.file

    @property
    def reference(self) -> ReferenceBody | None:
        """Return the reference body to which everything is given; None without one."""
        return self._options.session.reference

    def mount_tip(self, tip: str) -> None:
        """Say that a tip, maybe the same one again, was screwed on; it must be checked.

        With another tip than that of this job no points are taken any more: the geometry of a job
        does not change.

        Raises
        ------
        CalibrationError
            The probe has no records, or was never calibrated with this tip.
        StorageError
            It could not be made durable.
        """
        self._probe.mount(tip)
        self._emit(self.changed)

    def probe_records_changed(self) -> None:
        """Look at the records of the probe anew: something was appended to them.

        A check that passed lets points be taken again at once. A new calibration or qualification
        is for the next job: this one goes on only with the geometry that it was begun with.
        """
        self._probe.forget()
        self._probe.settle()
        self._emit(self.changed)

    def write_to_cameras(self) -> None:
        """Store the intrinsics of the calibration in the cameras and read them back.

        Takes up to some seconds: not for the thread of a window.

        Raises
        ------
        CalibrationError
            There is nothing to write, or nobody to write to.
        BusError
            A camera does not take them.
        """
        self._calibration.write_to_cameras()

    def show_frames_to(self, watcher: Callable[[FrameBlock], None] | None) -> None:
        """Show all frames to a calibration procedure from now on, or to nobody.

        It is called on the reconstruction thread. As long as it watches, no points are taken:
        whoever waves the probe through the volume does not measure the part.
        """
        self._watcher = watcher

    def job(self) -> JobView:
        """Return the job as it stands.

        Raises
        ------
        OcmmError
            It cannot be evaluated: the station is FAILED then, and what was told before is void.
        """
        fault = self._faults.measuring
        if fault is not None and fault.part == _EVALUATION:
            raise fault.error
        try:
            return self._session.view
        except Exception as error:
            if self._last_status is not None:
                # A job that was closed meanwhile has nothing to show any more.
                raise
            raise self._faults.fail(error, _EVALUATION) from error

    @property
    def job_path(self) -> Path:
        """Return where the job file is."""
        return self._job.path

    def stored_job(self) -> tuple[str, list[MeasuredPoint]]:
        """Return the name of the job that is measured, and its durable points that count."""
        job = self._job
        return job.path.stem, job.points()

    def steps_since(self, job: Path | None, after: int) -> tuple[Path, list[JobStep]]:
        """Return the job that is measured, and what was stored in it behind an audit row.

        From its beginning where ``job`` is another one. Raises StorageError as `JobFile.steps`.
        """
        measured = self._job
        return measured.path, measured.steps(after if measured.path == job else 0)

    def bus(self) -> BusView | None:
        """Return what is known about the bus; None where the frames do not come over one."""
        if self._bus is None:
            return None
        status = self.acquisition_status()
        ended = ""
        if status.state is AcquisitionState.STOPPED:
            ended = status.message or "The acquisition has ended."
        return self._bus.view(ended)

    def bus_report(self) -> BusReport | None:
        """Return what the bus process said last; None without one, or before its first report."""
        return self._bus.report() if self._bus is not None else None

    def save_bus_text(self, path: Path) -> None:
        """Write the report of the bus as text for support.

        Raises
        ------
        InputError
            There is nothing to report on.
        StorageError
            The file cannot be written.
        """
        write_together({path: bus_text(self._bus, self.rig.name).encode("utf-8")})

    def take(self) -> None:
        """Take a point now; the answer comes by signal.

        Where the machine is not ready the answer is a refusal, and nothing is taken later.
        """
        live = self.live()
        if live.status not in (StatusWord.NOT_READY, StatusWord.FAILED):
            self._frames.arm()
            return
        self._refuse(
            Refusal(
                RefusalCode.NOT_READY, live.reason, "Touch again when it says READY.", live.time_s
            )
        )

    def undo(self) -> None:
        """Take back the last step."""
        self._done(self._session.undo)

    def finish(self) -> None:
        """Accept the active feature with the points it has."""
        self._done(self._session.finish)

    def select(self, feature: str) -> None:
        """Make a feature the active one."""
        self._done(lambda: self._session.select(feature))

    def flip(self) -> None:
        """Turn the compensation of the last point to the other side."""
        self._done(self._session.flip)

    def change(self, verb: Callable[[InspectionSession], object]) -> None:
        """Let the session do something, such as ``InspectionSession.skip``, and tell of it.

        Raises
        ------
        OcmmError
            What the session raises; nothing is told then.
        """
        self._done(lambda: verb(self._session))

    def missing(self) -> list[tuple[str, int]]:
        """Return the features that are not done and how many points each still needs."""
        return self._session.missing()

    def explanations(self) -> tuple[Explanation, ...]:
        """Return why results are not CONFORM, and what to do; see `InspectionSession`."""
        return self._session.explanations()

    def report(self) -> ReportData:
        """Return everything that a report can say about the job as it stands.

        Takes up to some seconds: not for the thread of a window.

        Raises
        ------
        MeasuringError
            The job changes faster than it can be reported.
        OcmmError
            The job file cannot be read.
        """
        for _ in range(_REPORT_TRIES):
            session, job = self._session, self._job
            view = session.view
            found = self._report_of(session, job, view)
            # A point that came meanwhile would be in one half of the report only.
            if session.view is view and session is self._session:
                return found
        raise MeasuringError(
            "export.busy",
            "The job changes faster than it can be reported.",
            "Pause it, or write the report when less is probed at a time.",
        )

    def _report_of(self, session: InspectionSession, job: JobFile, view: JobView) -> ReportData:
        calibration, probe, reference = self.calibration(), self.probe_view(), self.reference
        back = tuple(job.annulled())
        return report_data(
            view,
            job.head,
            self.plan,
            T_part_from_world=session.T_part_from_world,
            calibration=Instrument(
                calibration.label, f"{calibration.word.value} {calibration.identity}"
            ),
            probe=Instrument(probe.label, probe.note),
            reference=Instrument(
                "" if reference is None else reference.label,
                "" if reference is None else f"{reference.name} {reference.identity}",
            ),
            climate=self._use.options.climate,
            observations=tuple(job.points()),
            annulled=tuple(point.number for point, _ in back),
            taken_utc=job.taken_utc(),
            taken_back=back,
            explained=session.explanations(),
        )

    def export(
        self,
        directory: Path,
        formats: Sequence[str] = (DEFAULT_FORMAT,),
        profile: Profile | None = None,
        *,
        incomplete: bool = False,
    ) -> tuple[Path, ...]:
        """Write reports of the job to ``directory`` and return their paths; as `write_report`."""
        return write_report(self.report(), formats, directory, profile, incomplete=incomplete)

    def _obstacle(self) -> Obstacle | None:
        """Return why no points may be taken because of calibration or tip, or None."""
        return self._hindrance()[1]

    def _hindrance(self) -> tuple[RefusalCode, Obstacle | None]:
        view = self._calibration.view()
        cameras = view.hindrance or (None if view.uncalibrated else self._changes.doubt)
        if cameras is not None:
            return RefusalCode.CALIBRATION, cameras
        return RefusalCode.TIP, self._probe.view().hindrance

    def _watch_changes(self, track: TrackBlock) -> None:
        """Let the monitor see the frames; what it holds back is told as a change of the job."""
        try:
            turned = self._changes.feed(in_rig(track), self._calibration.view())
        except OcmmError as error:
            self._tell_fault(error)
            turned = True
        if turned:
            self._calibration.forget()
            self._emit(self.changed)

    def _watch_probe(self, block: FrameBlock) -> None:
        """Look for what can change the tip; what it holds back is told as a change of the job."""
        try:
            changed = self._probe.feed(block)
        except OcmmError as error:
            self._tell_fault(error)
            changed = True
        if changed:
            self._emit(self.changed)

    def _refuse(self, refusal: Refusal) -> None:
        self._session.refuse(refusal)
        self._emit(self.point_refused, refusal)
        self._emit(self.changed)

    def _measure(self, tracked: Tracked) -> None:
        """Measure a block of frames; on the reconstruction thread."""
        block, track, pipeline = tracked.block, tracked.track, tracked.pipeline
        for change in self._button.feed(block):
            self._emit(self.button, change)
        if pipeline.home is not None and self._session.reference_home is None:
            # Durable before the first point that rests on it.
            self._session.keep_reference(pipeline.home)
        self._live.feed(block, track, pipeline, collecting=tracked.collecting)
        self._watch_probe(block)
        watcher = self._watcher
        if watcher is not None:
            try:
                watcher(block)
            except Exception as error:
                # It is still waved through the volume: no points, whoever looks.
                self._watcher = _look_away
                self._faults.note(error, "The calibration procedure")
            return
        self._watch_changes(track)
        if not tracked.touches:
            return
        code, obstacle = self._hindrance()
        for touch in tracked.touches:
            if obstacle is not None:
                self._refuse(
                    Refusal(
                        code,
                        obstacle.what,
                        obstacle.remedy,
                        float(block.time_ns[-1]) * 1e-9,
                    )
                )
                continue
            intent = self._options.intent
            feature = intent(touch.first_frame) if intent is not None else None
            try:
                # A service names its interface only once it runs: before the first point it has.
                self._session.note_origin(simulated=self.simulated)
                outcome = self._session.take_touch(touch, feature)
            except OcmmError as error:
                # A point that could not be made durable is no point; measuring goes on.
                self._tell_fault(error)
                continue
            if not isinstance(outcome, Refusal):
                self._probe.used()
            signal = self.point_refused if isinstance(outcome, Refusal) else self.point_taken
            self._emit(signal, outcome)
            self._emit(self.changed)


def _look_away(block: FrameBlock) -> None:
    """Watch nothing."""
