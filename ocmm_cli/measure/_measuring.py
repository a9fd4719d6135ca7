"""``ocmm measure`` and ``ocmm demo``, on the terminal or in the window if a display answers."""

from __future__ import annotations

import importlib.util
import os
import sys
from contextlib import suppress
from dataclasses import astuple, replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ocmm_cli.options import ClimateOptions, JobOptions, StationChoice, StreamChoice
from ocmm_cli.terminal import error_text, make_console, print_notes, shown, tr, tr_later
from ocmm_core.ambient import TypedRoom
from ocmm_core.composition import DEMO_PLAN
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.host import display_answers, library_fault
from ocmm_core.plugins import install_line

if TYPE_CHECKING:
    from ocmm_core.composition import StationRequest
    from ocmm_shop.archive.outbox import ArchivePlace


_WITHOUT_QT = tr_later("The window needs the package PySide6, which is not installed here.")


def open_window(*arguments: str) -> None:
    """Replace this process by the window, which signals then reach directly."""
    if importlib.util.find_spec("PySide6") is None:
        raise InputError(
            "window.missing",
            _WITHOUT_QT,
            f"Install it: {install_line('gui')}. Without it, measure with 'ocmm measure'.",
        )
    command = [sys.executable, "-m", "ocmm_gui", *arguments]
    sys.stdout.flush()
    os.execv(command[0], command)  # noqa: S606 - our own interpreter and module


def has_display() -> bool:
    """Return whether a display answers, without loading Qt; write why the window is not opened."""
    if sys.platform != "linux" or os.environ.get("QT_QPA_PLATFORM"):
        return True
    named = {
        kind: name
        for kind, name in (("wayland", "WAYLAND_DISPLAY"), ("xcb", "DISPLAY"))
        if os.environ.get(name)
    }
    if not named:
        return False
    if importlib.util.find_spec("PySide6") is None:
        _print_step(tr(_WITHOUT_QT))
        return False
    answering = [kind for kind in named if display_answers(kind)]
    if answering:
        if len(named) > 1 and len(answering) == 1:
            # Qt would end with an abort at the other one.
            os.environ["QT_QPA_PLATFORM"] = answering[0]
        return True
    fault = library_fault()
    if fault is not None:
        _print_step(error_text(fault))
        return False
    for name in named.values():
        value = os.environ[name]
        _print_step(tr(f"{name} is {value!r}, but no display answers there."))
    return False


def _print_step(text: str) -> None:
    sys.stderr.write(f"ocmm: {text}\n")


def measure_parts(
    request: StationRequest,
    *,
    with_truth: bool,
    parts: int = 1,
    incomplete: bool = False,
    formats: tuple[str, ...] = (),
    archived: ArchivePlace | None = None,
) -> None:
    """Measure parts, and exit with the worst code; OcmmError if a part or output failed."""
    from ocmm_cli.archive import MeasuredJobs
    from ocmm_cli.measure import (
        await_part,
        exit_code,
        missing_sentences,
        print_explanations,
        print_table,
        print_verdict,
        run_job,
    )
    from ocmm_core.composition import Origin, build_station, origin_of
    from ocmm_core.export import DEFAULT_FORMAT, chosen_formats
    from ocmm_core.export.template import load_paper, template_in_use
    from ocmm_core.inspection.finished import next_serial
    from ocmm_core.station import drop_job_without_points

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
            jobs.start(built.job_path)
            try:
                view = run_job(built, request.out, console, incomplete=incomplete, formats=formats)
            except OcmmError:
                # A source that was refused leaves no job without points.
                with suppress(OcmmError):
                    if request.resume is None and drop_job_without_points(built.job_path):
                        jobs.drop(built.job_path)
                raise
            finally:
                if built.station.job.lost is not None:
                    jobs.drop(built.job_path)
            truth = None
            if with_truth and built.virtual is not None:
                from ocmm_sim.sources import true_values

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


_OUT = Path("ocmm-out")


def demo(
    *, headless: bool, source: str, plan: Path, out: Path, seed: int, speed: float | None,
    theme: str | None, incomplete: bool,
) -> None:  # fmt: skip
    """Measure the demonstration part on the virtual rig: SIMULATED, a robot hand measures.

    Opens the window where there is a display. Without one, or with --headless, measures the whole
    part and prints the table with the true values beside the measured ones.
    """
    from ocmm_core.composition import StationRequest

    if not headless and has_display():
        open_window(
            "--source", source, "--plan", str(plan), "--out", str(out),
            "--seed", str(seed), "--speed", str(1.0 if speed is None else speed),
            *([] if theme is None else ["--theme", theme]),
        )  # fmt: skip
    request = StationRequest(plan=plan, out=out, source=source, seed=seed, speed=speed or 0.0)
    measure_parts(request, with_truth=True, incomplete=incomplete)


def measure(
    *, plan: Path | None, go_on: Path | None, job: JobOptions, site: StationChoice,
    climate: ClimateOptions, read: TypedRoom, stream: StreamChoice, parts: int, incomplete: bool,
    formats: list[str] | None, archive: str | None,
) -> None:  # fmt: skip
    """Measure a part by a plan, and write the job file and the report.

    Every point is in the job file (DIR/NAME-001.ocmm) before it counts. The report (on the
    template of this station, see ocmm report --remember) is a few files
    beside it: _job.csv with the verdict on the part, _report.csv, _features.csv, _points.csv, a
    cloud and a macro. Their names say SIMULATED and INCOMPLETE where that is so. Without
    --incomplete no report is written of a job that lacks something.
    """
    from ocmm_core.composition import ClimateRequest, stream_options
    from ocmm_core.settings import SettingsStore
    from ocmm_shop.archiving import archive_place

    if plan is None and go_on is None:
        raise InputError(
            "measure.plan",
            "No plan and no job to resume given.",
            "Give --plan FILE, or --continue JOB.",
        )
    if parts > 1 and go_on is not None:
        raise InputError(
            "measure.parts",
            "--continue resumes one job, but --parts asks for several.",
            "Resume the job first, then measure the other parts.",
        )
    read.check()
    loaded = SettingsStore.of_this_user().load()
    print_notes(loaded.notes, stderr=True)
    request = site.request(
        plan or DEMO_PLAN, out=site.out or (go_on.parent if go_on is not None else _OUT),
        part=job.part, order=job.order_number, batch=job.batch, resume=go_on,
        probing="any" if job.order == "any" else "plan", record=job.record,
        climate=ClimateRequest(
            climate.probe_design, climate.probe_temperature, site.part_temperature,
            site.temperature_sigma, climate.part_expansion, climate.compensate_probe,
            climate.compensate_part, stated_u=climate.temperature_u,
        ),
        room=read, thermometers=climate.thermometer,
        method="thesis" if job.thesis else "gauss-newton",
        stream=stream_options(*astuple(stream)),
    )  # fmt: skip
    measure_parts(
        request, with_truth=False, parts=parts, incomplete=incomplete,
        formats=tuple(formats or ()), archived=archive_place(archive, loaded.settings),
    )  # fmt: skip
