"""What every format of a report can do."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ocmm_core.export.report._profile import Profile
from ocmm_core.export.report._report_data import ReportData
from ocmm_core.export.report._tables import Table


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportFormat:
    """What people and commands know of a format.

    A report of an incomplete job is refused in every format alike (`require_complete`), so no
    format has a rule of its own.
    """

    name: str
    title: str
    purpose: str
    """Whom the files are for."""
    suffixes: tuple[str, ...]
    """How the names of its files end, behind the name of the job."""
    profile: str
    """What it takes from the profile; empty where it takes nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Exporter(ReportFormat):
    """A format that the core writes."""

    contents: Callable[[Sequence[ReportData], Profile], dict[str, bytes]]
    """The files of jobs, bytes by file name."""
    differences: Callable[[Sequence[ReportData], Profile, Mapping[str, bytes]], list[str]]
    """One sentence for everything in which files, as they were read back, differ from the jobs. It
    reads them with a reader of its own, never with what wrote them."""
    preview: Callable[[Sequence[ReportData], Profile], tuple[Table, ...]]
    """What will be in the files, as tables."""
    batch: bool
    """Several jobs go into one file as several values; otherwise each has files of its own, and the
    functions get one job at a time."""
