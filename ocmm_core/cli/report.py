"""``ocmm report``: reports of jobs from their own files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ocmm_core.errors import InputError
from ocmm_core.export.profile import load_profile
from ocmm_core.export.registry import EXPORTERS, preview, preview_text, write_report
from ocmm_core.export.report_data import ReportData, report_of_job
from ocmm_core.inspection.reopen import reopen_job

_ALL = "all"


def report_command(
    *,
    jobs: Annotated[
        list[Path], typer.Argument(help="Job files (.ocmm), also of other computers.")
    ],
    formats: Annotated[
        list[str] | None,
        typer.Option(
            "--format",
            help=f"One of {', '.join(EXPORTERS)} or all; may be given several times.",
        ),
    ] = None,
    profile: Annotated[
        Path | None,
        typer.Option(
            "--profile",
            help="Profile document of the text files: delimiter, decimal sign, unit, columns. "
            "Default: that for PolyWorks.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Folder for the reports. Default: that of the first job."),
    ] = None,
    preview_only: Annotated[
        bool, typer.Option("--preview", help="Print what the files would hold, and write nothing.")
    ] = False,
) -> None:
    """Report jobs from their own files, read-only.

    Everything is computed anew from the raw observations in the job file, and what comes out
    otherwise than it is stored is told. Each report is read back and compared before it replaces an
    older one. Several jobs of one plan become several values in a Q-DAS file.
    """
    console = Console(soft_wrap=True)
    chosen = _formats(formats or ["polyworks"])
    layout = None if profile is None else load_profile(profile)
    data = [_data(path, console) for path in jobs]
    if preview_only:
        for name in chosen:
            typer.echo(f"== {EXPORTERS[name].title}")
            typer.echo(preview_text(preview(data, name, layout)))
        return
    for path in write_report(data, chosen, out if out is not None else jobs[0].parent, layout):
        console.print(f"Report  {path}", highlight=False, markup=False)


def _formats(names: list[str]) -> list[str]:
    """Return the formats that are meant; raise InputError for one that is none."""
    found = []
    for name in names:
        if name != _ALL and name not in EXPORTERS:
            raise InputError(
                "export.format",
                f"There is no format {name!r} of a report.",
                f"Choose among {', '.join(EXPORTERS)} and all.",
            )
        found += list(EXPORTERS) if name == _ALL else [name]
    return list(dict.fromkeys(found))


def _data(path: Path, console: Console) -> ReportData:
    job = reopen_job(path)
    for doubt in job.doubts:
        console.print(f"{path.name}: {doubt}", style="yellow", highlight=False, markup=False)
    return report_of_job(job)
