"""Interface of report formats."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ocmm_core.export.report._profile import Profile
from ocmm_core.export.report._report_data import ReportData
from ocmm_core.export.report._tables import ReportTable


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportFormat:
    """Description of a format; all refuse incomplete jobs (`require_complete`)."""

    name: str
    title: str
    purpose: str
    """Audience of the files."""
    suffixes: tuple[str, ...]
    """Endings of its file names, after the name of the job."""
    profile: str
    """What it uses of the profile; may be empty."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Exporter(ReportFormat):
    """A format written by the core."""

    contents: Callable[[Sequence[ReportData], Profile], dict[str, bytes]]
    """The files of jobs, bytes by file name."""
    differences: Callable[[Sequence[ReportData], Profile, Mapping[str, bytes]], list[str]]
    """Differences between files and jobs, in sentences, by a reader independent of the writer."""
    preview: Callable[[Sequence[ReportData], Profile], tuple[ReportTable, ...]]
    batch: bool
    """Several jobs go into one file as several values; otherwise one job at a time."""
