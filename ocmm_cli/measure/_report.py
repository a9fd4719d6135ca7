"""``ocmm report``: reports of jobs from their own files."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ocmm_cli.measure._pages import print_reports
from ocmm_cli.terminal import PlainConsole, lead, make_console, progress_line, tr
from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.processes import processes_for, side_by_side

if TYPE_CHECKING:
    from ocmm_core.export.report import ReportData
    from ocmm_core.export.template import Particulars


@dataclass(frozen=True, slots=True)
class ReportFacts:
    """`Particulars` as options."""

    number: str
    customer: str
    customer_address: str
    order: str
    drawing: str
    revision: str
    machine: str
    place: str
    received: str
    room: str
    humidity: str
    pressure: str
    deviation: list[str] | None
    remark: list[str] | None

    def particulars(self) -> Particulars:
        from ocmm_core.export.template import Particulars

        named = asdict(self)
        deviations, remarks = (tuple(named.pop(name) or ()) for name in ("deviation", "remark"))
        return Particulars(**named, deviations=deviations, remarks=remarks)


def report_command(
    *, jobs: Annotated[list[Path], typer.Argument(readable=False)], formats: list[str] | None,
    profile: Path | None, out: Path | None, preview_only: bool, probes: Path | None,
    calibrations: Path | None, incomplete: bool, template: Path | None, remember: bool,
    section: list[str] | None, facts: ReportFacts,
) -> None:  # fmt: skip
    """Report jobs from their own files, read-only.

    Everything is recomputed from the raw observations in the job file, and what comes out
    otherwise than it is stored is told. Each report is read back and compared before it replaces an
    older one. Several jobs of one plan become several values in a Q-DAS file. A job that cannot be
    read is named and left out; the command ends with 2 then. What the job does not know (customer,
    drawing ...) is given here or was kept with it; what nobody gives is "not stated" on the paper.
    With --section and without --format, only the sections are written.
    """
    from ocmm_cad.sections import OF_PLAN, SectionPlane, section_files, section_tables, sections_of
    from ocmm_core import export
    from ocmm_core.export.report import load_profile, polyworks_profile
    from ocmm_core.export.template import (
        Particulars,
        ambient_conditions,
        keep_given,
        keep_template,
        load_paper,
        paper_of,
        template_in_use,
    )

    given = facts.particulars()
    ambient_conditions(given)
    # Reject an unusable template before the jobs are computed.
    load_paper(template or template_in_use())
    console = make_console(soft_wrap=True)
    planes = [SectionPlane.of_text(one) for one in section or () if one != OF_PLAN]
    chosen = export.chosen_formats(formats or [export.DEFAULT_FORMAT][: not section])
    layout = polyworks_profile() if profile is None else load_profile(profile)
    read, faults = _read_all(jobs, probes, calibrations, console)
    if not read:
        raise faults[0]
    if remember:
        if template is not None:
            console.print(f"{lead('Template  ')}{keep_template(template)}")
        if given != Particulars():
            for one in read:
                kept = keep_given(one.path, paper_of(one.path, given, template).given)
                console.print(f"{lead('Kept  ')}{kept}")
    data = [replace(one.data, paper=paper_of(one.path, given, template)) for one in read]
    sections = [sections_of(one, planes, of_plan=OF_PLAN in (section or ())) for one in data]
    written = [name for name in chosen if name in export.EXPORTERS]
    if preview_only:
        for name in written:
            typer.echo(f"== {export.EXPORTERS[name].title}")
            typer.echo(export.preview_text(export.preview(data, name, layout)))
        pairs = zip(data, sections, strict=True)
        if tables := [it for one, own in pairs for it in section_tables(one, own, layout.units)]:
            typer.echo(export.preview_text(tables))
        if export.PDF.name in chosen:
            typer.echo(tr("The window shows the pages of the PDF report (Results, Report)."))
        return
    folder = out if out is not None else jobs[0].parent
    if not incomplete:
        # Before the first file, for all formats.
        export.require_complete(data)
    files = [section_files(*pair, layout) for pair in zip(data, sections, strict=True)]
    drawn = {name: content for one in files for name, content in one.items()}
    if len(drawn) < sum(map(len, files)):
        raise StorageError(
            "export.twice",
            "Two jobs have the same name, and so would their sections.",
            "Report jobs of the same name to separate folders.",
        )
    write = partial(export.write_report, incomplete=incomplete, beside=drawn)
    if written or drawn:
        for path in write(data, written, folder, layout):
            console.print(f"{lead('Report  ')}{path}")
    if export.PDF.name in chosen:
        for path in print_reports(data, folder, incomplete=incomplete):
            console.print(f"{lead('Report  ')}{path}")
    if faults:
        raise faults[0]


@dataclass(frozen=True, slots=True)
class _Read:
    """A job to be reported, with its warnings."""

    path: Path
    data: ReportData
    doubts: tuple[str, ...]
    words: tuple[str, ...]
    """States of the job and the verdict on the part."""


def _read_all(
    jobs: list[Path], probes: Path | None, calibrations: Path | None, console: PlainConsole
) -> tuple[list[_Read], list[OcmmError]]:
    """Open all jobs, many in parallel; print warnings of each, in order."""
    with progress_line() as tell:
        found = list(
            side_by_side(
                partial(_read, probes=probes, calibrations=calibrations),
                jobs,
                processes_for(len(jobs)),
                lambda path: f"The reading of {path.name}",
                lambda done: tell(tr(f"Read {done} of {len(jobs)} jobs"), done / len(jobs)),
            )
        )
    read: list[_Read] = []
    faults: list[OcmmError] = []
    for one in found:
        if isinstance(one, OcmmError):
            faults.append(one)
            console.show(one.what, style="yellow")
            continue
        read.append(one)
        for doubt in one.doubts:
            console.print(f"{one.path.name}: {tr(doubt)}", style="yellow")
        words = "; ".join(map(tr, one.words))
        console.print(f"{one.path.stem}: {words}")
    return read, faults


def _read(path: Path, probes: Path | None, calibrations: Path | None) -> _Read:
    from ocmm_core.export.report import report_of_job
    from ocmm_core.inspection.evaluation import job_states, part_line
    from ocmm_core.inspection.finished import reopen_job

    job = reopen_job(path, probes, calibrations=calibrations)
    words = (*job_states(job.view), part_line(job.view))
    return _Read(path, report_of_job(job), (*job.doubts, *job.remarks), words)
