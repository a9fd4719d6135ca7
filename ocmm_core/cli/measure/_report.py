"""``ocmm report``: reports of jobs from their own files."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from ocmm_core.errors import StorageError

if TYPE_CHECKING:
    from ocmm_core.export.report import ReportData


# Those of the registry, which is not loaded for a help; a test holds the two together.
FORMAT_WORDS = "polyworks, qif, dfq, xlsx, json, pdf or all"
PROFILED_WORDS = "polyworks, dfq, xlsx"


def report_command(
    *,
    jobs: Annotated[
        list[Path], typer.Argument(help="Job files (.ocmm), also from other computers.")
    ],
    formats: Annotated[
        list[str] | None,
        typer.Option(
            "--format",
            help=f"One of {FORMAT_WORDS}; can be repeated.",
        ),
    ] = None,
    profile: Annotated[
        Path | None,
        typer.Option(
            "--profile",
            help="Profile document of the text files: delimiter, decimal sign, unit, columns. "
            f"Used by {PROFILED_WORDS}. Default: PolyWorks.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Report folder. Default: that of the first job."),
    ] = None,
    preview_only: Annotated[
        bool,
        typer.Option("--preview", help="Print the contents of the files without writing them."),
    ] = False,
    probes: Annotated[
        Path | None,
        typer.Option(
            "--probes",
            help="Probe record folder, searched for later findings on the tip. Default: that of "
            "this user.",
        ),
    ] = None,
    calibrations: Annotated[
        Path | None,
        typer.Option(
            "--calibrations",
            help="Calibration folder, searched for later findings on the cameras. Default: that "
            "of this user.",
        ),
    ] = None,
    incomplete: Annotated[
        bool,
        typer.Option("--incomplete", help="Report an incomplete job too."),
    ] = False,
) -> None:
    """Report jobs from their own files, read-only.

    Everything is computed anew from the raw observations in the job file, and what comes out
    otherwise than it is stored is told. Each report is read back and compared before it replaces an
    older one. Several jobs of one plan become several values in a Q-DAS file.
    """
    from ocmm_core.export import (
        DEFAULT_FORMAT,
        EXPORTERS,
        PDF,
        chosen_formats,
        preview,
        preview_text,
        require_complete,
        write_report,
    )
    from ocmm_core.export.report import load_profile

    console = Console(soft_wrap=True)
    chosen = chosen_formats(formats or [DEFAULT_FORMAT])
    layout = None if profile is None else load_profile(profile)
    data = [_data(path, probes, calibrations, console) for path in jobs]
    written = [name for name in chosen if name in EXPORTERS]
    if preview_only:
        for name in written:
            typer.echo(f"== {EXPORTERS[name].title}")
            typer.echo(preview_text(preview(data, name, layout)))
        if PDF.name in chosen:
            typer.echo("The window shows the pages of the PDF report (Results, Report).")
        return
    folder = out if out is not None else jobs[0].parent
    if not incomplete:
        # Before the first file, whatever the formats are.
        require_complete(data)
    if written:
        for path in write_report(data, written, folder, layout, incomplete=incomplete):
            console.print(f"Report  {path}", highlight=False, markup=False)
    if PDF.name in chosen:
        for line in _print_pages(jobs, folder, probes, calibrations, incomplete=incomplete):
            console.print(f"Report  {line}", highlight=False, markup=False)


def _print_pages(
    jobs: list[Path],
    folder: Path,
    probes: Path | None,
    calibrations: Path | None,
    *,
    incomplete: bool,
) -> list[str]:
    """Write the PDF reports in a process with the drawing of the window; return their paths."""
    # The core knows no Qt: what draws is a program of its own, as the window is.
    command = [sys.executable, "-m", "ocmm_gui.reports", *map(str, jobs), "--out", str(folder)]
    if probes is not None:
        command += ["--probes", str(probes)]
    if calibrations is not None:
        command += ["--calibrations", str(calibrations)]
    if incomplete:
        command += ["--incomplete"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - our own interpreter and module
    if done.returncode != 0:
        last = done.stderr.strip().splitlines()[-1:] or ["the drawing program ended"]
        raise StorageError(
            "export.pdf",
            f"The PDF report was not written: {last[0]}",
            "The other formats are not affected.",
        )
    return done.stdout.splitlines()


def _data(
    path: Path, probes: Path | None, calibrations: Path | None, console: Console
) -> ReportData:
    from ocmm_core.export.report import report_of_job
    from ocmm_core.inspection.archive import reopen_job
    from ocmm_core.inspection.evaluation import job_states, part_line

    job = reopen_job(path, probes, calibrations=calibrations)
    for doubt in (*job.doubts, *job.remarks):
        console.print(f"{path.name}: {doubt}", style="yellow", highlight=False, markup=False)
    words = "; ".join((*job_states(job.view), part_line(job.view)))
    console.print(f"{path.stem}: {words}", highlight=False, markup=False)
    return report_of_job(job)
