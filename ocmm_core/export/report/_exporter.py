"""Interface of report formats."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ocmm_core.export.report._profile import Profile
from ocmm_core.export.report._report_data import ReportData
from ocmm_core.export.report._tables import Table


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportFormat:
    """Description of a format for people and commands.

    Reports of incomplete jobs are refused in every format alike (`require_complete`).
    """

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
    """Differences between files read back and the jobs, a sentence each. It has a reader
    independent of the writer."""
    preview: Callable[[Sequence[ReportData], Profile], tuple[Table, ...]]
    """Contents of the files as tables."""
    batch: bool
    """Several jobs go into one file as several values; otherwise the functions get one job at a
    time."""
