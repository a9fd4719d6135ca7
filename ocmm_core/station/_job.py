"""The job of a running station: its file, its state, actions of an inspector, and its reports."""

from __future__ import annotations

import logging
import uuid
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from ocmm_core.errors import MeasuringError, OcmmError, StorageError
from ocmm_core.export import DEFAULT_FORMAT, write_report
from ocmm_core.export.report import Instrument, ReportData, reported_features
from ocmm_core.export.template import paper_of
from ocmm_core.failure import contained
from ocmm_core.inspection.causes import Explanation
from ocmm_core.inspection.evaluation import JobHeader, JobView, StatusWord
from ocmm_core.inspection.finished import SUFFIX, require_new_serial
from ocmm_core.inspection.plan import Plan, note_release
from ocmm_core.inspection.session import HEADER_EVENT, InspectionSession, check_header, header_text
from ocmm_core.measuring import Climate, MeasuredPoint, Refusal, RefusalCode
from ocmm_core.named_file import FileIdentity
from ocmm_core.names import file_stem
from ocmm_core.seals import NO_RELEASE, ReleaseState
from ocmm_core.station._faults import StationEvents, StationFaults
from ocmm_core.station._frame_loop import FrameLoop, refuse
from ocmm_core.station._instruments import Instruments
from ocmm_core.station._looks import Looks
from ocmm_core.station._open_job import CurrentJob, OpenJob
from ocmm_core.storage import NAMED, JobFile, JobHead, JobStep, now_utc

_EVALUATION = "The evaluation"


class StationJob:
    """Show and change the current job; thread-safe. `looks`: may record now; `frames`: records."""

    def __init__(
        self,
        current: CurrentJob,
        looks: Looks,
        frames: FrameLoop,
        faults: StationFaults,
        events: StationEvents,
    ) -> None:
        self._current, self._looks, self._frames = current, looks, frames
        self._faults, self._events = faults, events

    @property
    def path(self) -> Path:
        return self._current.now.file.path

    @property
    def plan(self) -> Plan:
        return self._current.now.use.plan

    @property
    def plan_identity(self) -> str:
        """Return the SHA-256 of the current plan's document."""
        return self._current.now.file.head.plan_identity

    @property
    def release(self) -> ReleaseState:
        """Return the state of the plan's release at the start of the job."""
        return self._current.now.release

    @property
    def plan_file(self) -> Path | None:
        """Return the path of the plan, next to its pictures; None if unknown."""
        return self._current.now.use.file

    def view(self) -> JobView:
        """Return the current job; after an OcmmError the station is FAILED, earlier views void."""
        fault = self._faults.measuring
        if fault is not None and fault.part == _EVALUATION:
            raise fault.error
        try:
            return self._current.now.session.view
        except Exception as error:
            if self._current.ended:
                # A job closed meanwhile has no view.
                raise
            raise self._faults.fail(error, _EVALUATION) from error

    @property
    def climate(self) -> Climate:
        """Return the temperatures of probe and part."""
        return self._current.now.use.options.climate

    def missing(self) -> list[tuple[str, int]]:
        return self._current.now.session.steps.missing()

    def explanations(self) -> tuple[Explanation, ...]:
        """Return why results are not CONFORM, and the remedies; see `InspectionSession`."""
        return self._current.now.session.explanations()

    @property
    def lost(self) -> StorageError | None:
        """Return why the job is not on the disk under its name; also after the station closed."""
        return self._current.now.file.check_name()

    def stored(self) -> tuple[str, list[MeasuredPoint]]:
        """Return the name of the current job, and its durable points that count."""
        file = self._current.now.file
        return file.path.stem, file.points()

    def steps_since(self, job: Path | None, after: int) -> tuple[Path, list[JobStep]]:
        """Return the job and its steps after a row, from 0 if other; StorageError as `steps`."""
        file = self._current.now.file
        return file.path, file.steps(after if file.path == job else 0)

    def record_point(self) -> None:
        """Record a point now, result by signal; if not ready it is refused, not recorded later."""
        live = self._looks.live()
        if live.status not in (StatusWord.NOT_READY, StatusWord.FAILED):
            self._frames.arm()
            return
        remedy = "Touch again when READY is shown."
        refuse(
            self._current.now.session,
            Refusal(RefusalCode.NOT_READY, live.reason, remedy, live.time_s),
            self._events,
        )

    def change(self, verb: Callable[[InspectionSession], object]) -> None:
        """Apply an action to the session, such as ``session.steps.skip()``, and report it.

        An unexpected error leaves the job uncertain: the station is FAILED then. OcmmError: from
        the session; nothing is reported then.
        """
        try:
            verb(self._current.now.session)
        except OcmmError:
            raise
        except Exception as error:
            # File and memory may differ by a step: only a restart rereads it.
            raise self._faults.fail(error, "The change of the job", tell=False) from error
        self._events.emit(self._events.changed)


_TRIES = 20


class Reports:
    def __init__(self, current: CurrentJob, instruments: Instruments) -> None:
        self._current, self._instruments = current, instruments

    def data(self) -> ReportData:
        """Return the report data of the current job.

        Takes up to some seconds: not for the thread of a window. MeasuringError: the job changes
        faster than it can be reported. OcmmError: the job file cannot be read, or lost its name.
        """
        for _ in range(_TRIES):
            job = self._current.now
            job.file.require_name()
            view = job.session.view
            found = self._data_of(job, view)
            # A concurrent point would be in one half of the report only.
            if job.session.view is view and job is self._current.now:
                return found
        raise MeasuringError(
            "export.busy",
            "The job is changing too fast to be reported.",
            "Pause it, or write the report when probing is slower.",
        )

    def export(
        self,
        directory: Path,
        formats: Sequence[str] = (DEFAULT_FORMAT,),
        *,
        incomplete: bool = False,
    ) -> tuple[Path, ...]:
        """Write reports on the sheet of this station; as `write_report`, InputError: template."""
        data = replace(self.data(), paper=paper_of(self._current.now.file.path))
        files = write_report(data, formats, directory, incomplete=incomplete)
        written = tuple(map(FileIdentity.of_written, files))
        lost = self._current.now.file.check_name()
        if lost is not None:
            for file in written:
                file.remove()
            raise lost
        return files

    def _data_of(self, job: OpenJob, view: JobView) -> ReportData:
        instruments = self._instruments
        calibration, probe = instruments.calibration(), instruments.probe()
        reference = instruments.reference
        back = tuple(job.file.annulled())
        frame, plan = job.session.frame.T_part_from_world, job.use.plan
        return ReportData(
            view, job.file.head, plan, frame, reported_features(view, plan, frame),
            calibration=Instrument(
                calibration.label, f"{calibration.word.value} {calibration.identity}"
            ),
            probe=Instrument(probe.label, probe.note),
            reference=Instrument(
                "" if reference is None else reference.label,
                "" if reference is None else f"{reference.name} {reference.identity}",
            ),
            climate=job.use.options.climate, observations=tuple(job.file.points()),
            annulled=tuple(point.number for point, _ in back), taken_utc=job.file.taken_utc(),
            taken_back=back, explanations=job.session.explanations(),
            covariances=job.session.surface_covariances(), seal=job.file.seal(),
            release=job.release,
        )  # fmt: skip


_log = logging.getLogger(__name__)


def job_for(
    header: JobHeader, like: JobHead, plan: Plan, folder: Path, release: ReleaseState = NO_RELEASE
) -> JobFile:
    """Return a new job file for a part, with the documents of a former job.

    `like`: head of the former job. `plan`: names the file. InputError: a name is invalid, or the
    batch has this part; StorageError: the file cannot be made.
    """
    check_header(header)
    require_new_serial(folder, header.batch, header.serial)
    head = replace(
        like,
        job_uuid=str(uuid.uuid4()),
        created_utc=now_utc(),
        operator=header.operator,
        part=header.part,
        serial=header.serial,
    )
    job = JobFile.create(free_path(folder, plan), head)
    try:
        job.change(events=((NAMED, job.path.stem), (HEADER_EVENT, header_text(header))))
        note_release(job, release)
    except BaseException:
        job.close(remove=True)
        raise
    return job


def drop_if_empty(job: JobFile) -> None:
    """Close a job, removing an empty file; StorageError, and still open, if unreadable."""
    job.close(remove=job.next_number() == 1)


def drop_job_without_points(path: Path) -> bool:
    """Remove a closed job without points, return if so; StorageError: in use or damaged, kept."""
    drop_if_empty(JobFile.open(path))
    return not path.exists()


def give_back(job: JobFile, *, made: bool) -> None:
    """Close a job not measured after all, remove it if new and empty; never raises."""
    try:
        if made:
            drop_if_empty(job)
    except Exception as error:
        _log.warning("%s was not removed: %s", job.path, contained(error, "The removal"))
    finally:
        job.close()


def free_path(folder: Path, plan: Plan) -> Path:
    """Return an unused path of a job file in ``folder``; StorageError if none."""
    stem = file_stem(plan.name)
    for number in range(1, 100_000):
        path = folder / f"{stem}-{number:03d}{SUFFIX}"
        # An orphaned log would be read as that of the new file.
        if not path.exists() and not path.with_name(f"{path.name}-wal").exists():
            return path
    raise StorageError(
        "job.names", f"{folder}: no free name for a new job.", "Choose another folder."
    )
