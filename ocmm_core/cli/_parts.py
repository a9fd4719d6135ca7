"""Measure parts one by one: measure, print, report, then upload to the archive."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import typer

from ocmm_core.cli.terminal import make_console, shown
from ocmm_core.errors import OcmmError

if TYPE_CHECKING:
    from ocmm_core.archive.outbox import ArchivePlace
    from ocmm_core.composition import StationRequest


def measure_parts(
    request: StationRequest,
    *,
    with_truth: bool,
    parts: int = 1,
    incomplete: bool = False,
    formats: tuple[str, ...] = (),
    archived: ArchivePlace | None = None,
) -> None:
    """Measure parts one by one, and exit with the worst code.

    Raises OcmmError if a part could not be measured, or a secondary output (recording, report)
    failed.
    """
    from ocmm_core.cli.archive import MeasuredJobs
    from ocmm_core.cli.measure import (
        await_part,
        exit_code,
        missing_sentences,
        print_explanations,
        print_table,
        print_verdict,
        run_job,
    )
    from ocmm_core.composition import Origin, build_station, origin_of, true_values
    from ocmm_core.export import DEFAULT_FORMAT, chosen_formats
    from ocmm_core.export.template import load_paper, template_in_use
    from ocmm_core.inspection.archive import next_serial

    # Check names and templates before a job is started.
    formats = chosen_formats(formats or [DEFAULT_FORMAT])
    load_paper(template_in_use())
    console = make_console()
    code = 0
    beside: list[OcmmError] = []
    if parts > 1:
        # Fail before the first part.
        next_serial(request.serial)
    jobs = MeasuredJobs(archived, console)
    try:
        for part in range(parts):
            if part:
                request = replace(request, serial=next_serial(request.serial))
                origin = origin_of(request.source)
                if origin is not Origin.VIRTUAL:
                    # Only the virtual rig changes parts automatically.
                    replayed = origin is Origin.RECORDING
                    await_part(console, part + 1, parts, request.serial, replayed=replayed)
            built = build_station(request)
            jobs.begin(built.job_path)
            try:
                view = run_job(built, request.out, console, incomplete=incomplete, formats=formats)
            finally:
                if built.station.job.lost is not None:
                    jobs.drop(built.job_path)
            truth = None
            if with_truth and built.virtual is not None:
                truth = true_values(built.station.job.plan, built.virtual.part)
            print_table(console, view, truth)
            print_explanations(console, built.station.job.explanations())
            print_verdict(console, view)
            if not view.part_verdict.complete:
                typer.echo(
                    shown(missing_sentences(view, built.job_path, written=incomplete)), err=True
                )
            code = max(code, exit_code(view))
            beside += [fault.error for fault in built.station.faults.beside]
    finally:
        # Last: measurements never wait for an archive.
        jobs.hand_over()
    if beside:
        # The parts are measured; a secondary output, e.g. a recording, failed.
        raise beside[0]
    raise typer.Exit(code)
