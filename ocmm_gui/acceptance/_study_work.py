"""Computation of a study in a separate process, from jobs on disk to verdicts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.inspection.archive import compare_folder, parts_of_batch
from ocmm_gui.kit import later
from ocmm_gui.work import Teller
from ocmm_shop import studies


@dataclass(frozen=True, slots=True)
class StudyProgress:
    """Progress of a study, and the next measurement; None if complete."""

    measured: int
    following: studies.StudyRun | None


@dataclass(frozen=True, slots=True)
class StudyProgressTask:
    """Read the existing measurements of a study."""

    plan: studies.StudyPlan
    jobs: Path

    def __call__(self, tell: Teller) -> StudyProgress:
        """Return the progress without computing results, to keep the study blind."""
        tell(later("Reading the jobs"), 0.2)
        parts = parts_of_batch(self.jobs, self.plan.name) if self.jobs.is_dir() else ()
        left = studies.open_runs(self.plan, {one.serial for one in parts})
        return StudyProgress(len(self.plan.runs) - len(left), left[0] if left else None)


@dataclass(frozen=True, slots=True)
class StudyTask:
    plan: studies.StudyPlan
    jobs: Path
    probes: Path | None
    calibrations: Path | None

    def __call__(self, tell: Teller) -> studies.StudyReport:
        """Return the studies; InputError as `study_jobs`."""
        return studies.study_jobs(
            self.plan, self.jobs, progress=tell, probes=self.probes,
            calibrations=self.calibrations,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class TypeOneStudy:
    """A type-1 study with its values."""

    study: studies.Type1Study
    values: Float
    name: str
    reference: float
    width: float
    simulated: bool


@dataclass(frozen=True, slots=True)
class TypeOneTask:
    """Compute Cg and Cgk of one characteristic of one part."""

    jobs: Path
    name: str
    """Characteristic; empty for the first one of the plan."""
    reference: float
    """Certified value, mm."""
    probes: Path | None
    calibrations: Path | None

    def __call__(self, tell: Teller) -> TypeOneStudy:
        """Return the study; raise InputError without data."""
        found = compare_folder(self.jobs, tell, probes=self.probes, calibrations=self.calibrations)
        known = [one for one in found.trends if one.name == self.name or not self.name]
        if not known:
            names = ", ".join(one.name for one in found.trends)
            raise InputError(
                "msa.name", f"There is no characteristic '{self.name}'.", f"Give one of {names}."
            )
        trend = known[0]
        width = trend.high - trend.low
        study = studies.type1_study(trend.values, self.reference, width)
        return TypeOneStudy(study, trend.values, trend.name, self.reference, width, found.simulated)
