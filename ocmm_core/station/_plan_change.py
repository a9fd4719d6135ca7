"""What a running station goes on with when the plan is another one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from ocmm_core.documents import read_bytes
from ocmm_core.inspection.evaluation import JobHeader, SessionOptions
from ocmm_core.inspection.plan import Plan, climate_for, load_plan, stored_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.station._jobs import job_for
from ocmm_core.storage import JobFile, JobHead


@dataclass(frozen=True, slots=True)
class PlanInUse:
    """A plan with what a session measures by it.

    Attributes
    ----------
    plan
        What is measured.
    options
        Limits, and the climate with the growth that the plan says.
    file
        Where the plan is, with its pictures beside it; None where that is not known.
    """

    plan: Plan
    options: SessionOptions
    file: Path | None = None

    def with_plan(self, plan: Plan, file: Path | None) -> PlanInUse:
        """Return another plan in use; InputError as `climate_for`."""
        # Where a part by the plan before stood says nothing about this one.
        options = replace(
            self.options, climate=climate_for(self.options.climate, self.plan, plan), near=None
        )
        return PlanInUse(plan, options, file)


def job_by(
    path: Path, header: JobHeader, like: JobHead, before: PlanInUse, folder: Path
) -> tuple[JobFile, PlanInUse]:
    """Return a new job file for a part by the plan of a file, and that plan.

    Parameters
    ----------
    path
        Document of the plan.
    header
        Operator, serial number, order and batch; the part is that of the plan.
    like, before
        Head and plan of the job before.
    folder
        Where the file is made.

    Raises
    ------
    InputError
        The plan cannot be used, or as `job_for`.
    StorageError
        The file cannot be made.
    """
    plan = load_plan(path)
    use = before.with_plan(plan, path)
    head = replace(like, plan_text=read_bytes(path).decode("utf-8"))
    return job_for(replace(header, part=plan.part), head, plan, folder), use


def plan_of(job: JobFile, like: JobHead, now: PlanInUse, files: Mapping[str, Path]) -> PlanInUse:
    """Return the plan that a job was begun with: the one in use, or that of its own file.

    Parameters
    ----------
    like, now
        Head and plan of the job that is measured.
    files
        Files of plans by their SHA-256, for the pictures.

    Raises
    ------
    InputError
        The plan is of another version of the program, or as `climate_for`.
    """
    identity = job.head.plan_identity
    if identity == like.plan_identity:
        return now
    return now.with_plan(stored_plan(job.head), files.get(identity))


def pause_unfinished(session: InspectionSession, job: JobFile) -> str:
    """Pause a job that has points and is not finished, and return what was done, a sentence.

    Raises
    ------
    StorageError
        It could not be made durable.
    """
    missing = session.missing()
    if not missing or job.next_number() == 1:
        return ""
    session.pause()
    features = "feature is" if len(missing) == 1 else "features are"
    return (
        f"Job {job.path.stem} is paused, {len(missing)} {features} still to be measured; all its "
        "points are in its file, and it can be gone on with."
    )
