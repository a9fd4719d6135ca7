"""Change of the job while the station runs: the next part, another plan, or an open job."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from ocmm_core.documents import digest
from ocmm_core.errors import OcmmError
from ocmm_core.failure import REOPEN, contained
from ocmm_core.inspection.evaluation import JobHeader
from ocmm_core.inspection.plan import (
    plan_release,
    read_plan,
    require_consistent,
    require_released,
    stored_plan,
)
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.station._faults import StationEvents
from ocmm_core.station._frame_loop import FrameLoop
from ocmm_core.station._instruments import Instruments
from ocmm_core.station._job import drop_if_empty, give_back, job_for
from ocmm_core.station._open_job import CurrentJob, Gear, PartLoader, PlanInUse, open_job
from ocmm_core.storage import JobFile, JobHead

_NOTHING_CHANGED = "The previous job remains active and unchanged."


class JobChange:
    """Start another job, or resume one, while the station runs.

    `instruments`: note the equipment of the other job's points. `frames`: paused meanwhile.
    `parts`: load the part of the other job's plan.
    """

    def __init__(
        self,
        gear: Gear,
        current: CurrentJob,
        instruments: Instruments,
        frames: FrameLoop,
        events: StationEvents,
        parts: PartLoader,
    ) -> None:
        self._parts = parts
        self._gear, self._current = gear, current
        self._instruments, self._frames, self._events = instruments, frames, events
        self._plan_files: dict[str, Path] = {}
        now = current.now
        if now.use.file is not None:
            self._plan_files[now.file.head.plan_identity] = now.use.file

    def next_part(self, header: JobHeader) -> None:
        """Start a new job for another part by the same plan.

        Errors as `job_for`; InputError also if this station requires released plans.
        """
        now = self._current.now
        if self._gear.released_only:
            require_released(now.file.path, now.release)
        job = job_for(header, now.file.head, now.use.plan, now.file.path.parent, now.release)
        self._start(job, lambda: self._current.now.use)

    def change_plan(self, path: Path, header: JobHeader) -> str:
        """Start a job by the plan of a file; return the state of the former one in a sentence.

        An unfinished job with points is paused first and can be resumed. With the current plan this
        is `next_part`. `header`: operator, serial number, order and batch; the part is that of the
        plan. InputError or StorageError: the plan or a name cannot be used, or the file cannot be
        made; nothing has changed then.
        """
        path, now = path.absolute(), self._current.now
        if self._gear.released_only:
            require_released(path, plan_release(path))
        if digest(path) == now.file.head.plan_identity:
            self.next_part(replace(header, part=now.use.plan.part))
            return ""
        job, use = _job_by(path, header, now.file.head, now.use, now.file.path.parent)
        self._plan_files[job.head.plan_identity] = path
        return self._start(job, lambda: use)

    def go_on(self, path: Path) -> str:
        """Resume an open job by the plan in its own file; returns as `change_plan`.

        StorageError, InputError, MeasuringError: the file cannot be opened for measuring, or its
        plan cannot be used; the job belongs to another probe, or to another reference body.
        """
        job = JobFile.open(path)
        now = self._current.now
        return self._start(
            job, lambda: _plan_of(job, now.file.head, now.use, self._plan_files), made=False
        )

    def _start(self, job: JobFile, by: Callable[[], PlanInUse], *, made: bool = True) -> str:
        """Measure into another job file, closing the former one, all or nothing.

        On any error the former job continues, and the other file is closed, and removed if it was
        ``made`` for this and holds no point.
        """
        before, words = self._current.now, ""
        lost = before.file.check_name()
        if lost is not None:
            give_back(job, made=made)
            raise lost
        self._parts.close()
        was_paused = before.session.pausing.paused
        try:
            after = open_job(job, by(), self._gear)
            pipeline = None
            if after.session.reference_home is not None:
                # Its points are relative to the reference body's pose at its start.
                pipeline = self._frames.pipeline_from(after.session.reference_home)
            with self._frames.exclusive():
                self._instruments.note_start(after)
                if after.use is not before.use:
                    words = _pause_unfinished(before.session, before.file)
                self._current.now = after
                drop_if_empty(before.file)
                if pipeline is not None:
                    self._frames.track_by(pipeline)
        except BaseException as error:
            self._current.now = before
            self._parts.start(before)
            give_back(job, made=made)
            if words and not was_paused:
                before.session.pausing.resume()
            if isinstance(error, OcmmError) or not isinstance(error, Exception):
                raise
            raise contained(
                error, "The change of the job", _NOTHING_CHANGED, remedy=REOPEN
            ) from error
        self._parts.start(after)
        self._events.emit(self._events.changed)
        return words


def _job_by(
    path: Path, header: JobHeader, like: JobHead, before: PlanInUse, folder: Path
) -> tuple[JobFile, PlanInUse]:
    """Return a new job by a plan file, and the plan; `like`, `before`: head and plan before."""
    plan, text = read_plan(path)
    require_consistent(path, plan)
    use = before.with_plan(plan, path)
    head = replace(like, plan_text=text)
    header = replace(header, part=plan.part)
    return job_for(header, head, plan, folder, plan_release(path)), use


def _plan_of(job: JobFile, like: JobHead, now: PlanInUse, files: Mapping[str, Path]) -> PlanInUse:
    """Return the plan of a job: the one in use, or that of its own file.

    `like`, `now`: head and plan of the current job. `files`: plans by SHA-256, for the pictures.
    """
    identity = job.head.plan_identity
    if identity == like.plan_identity:
        return now
    return now.with_plan(stored_plan(job.head), files.get(identity))


def _pause_unfinished(session: InspectionSession, job: JobFile) -> str:
    """Pause an unfinished job with points, and return a sentence about it."""
    missing = session.steps.missing()
    if not missing or job.next_number() == 1:
        return ""
    session.pausing.pause()
    features = "feature is" if len(missing) == 1 else "features are"
    return (
        f"Job {job.path.stem} is paused, {len(missing)} {features} still to be measured. All "
        "points saved; resume it from Job."
    )
