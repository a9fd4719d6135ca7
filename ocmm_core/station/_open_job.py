"""The current job: its file, its session, and the watches that hold its points."""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from datetime import timedelta
from pathlib import Path

from ocmm_core.calibration.records import CalibrationInUse, ProbeInUse
from ocmm_core.camera import Rig
from ocmm_core.fieldbus.described import refuse_unproven
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.plan import Plan, climate_for, part_of_plan, release_in_job
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.seals import NO_RELEASE, ReleaseState
from ocmm_core.station._drift_watch import ChangeWatch
from ocmm_core.station._faults import StationEvents, StationFaults
from ocmm_core.station._probe_watch import PAUSE, ProbeWatch
from ocmm_core.storage import JobFile, saved_sentence
from ocmm_core.tracking import ProbeBody, ReferenceBody


@dataclass(frozen=True, slots=True)
class Gear:
    """Equipment of every job of a station."""

    calibration: CalibrationInUse
    probe: ProbeInUse
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
        """Return the sentence on what is not lost."""
        return saved_sentence(self.now.file.saved_in)


class PartLoader:
    """Load the part of a job's plan in the background.

    `faults`, `events`: receive failures and success.
    """

    def __init__(self, faults: StationFaults, events: StationEvents) -> None:
        self._faults, self._events = faults, events
        self._thread: threading.Thread | None = None
        self._given_up = threading.Event()

    def begin(self, job: OpenJob) -> None:
        """Load the part of a job, unless its file holds it, cancelling a running load."""
        self.close()
        if job.session.part.model is not None or job.use.plan.model is None:
            return
        if job.use.file is None:
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
