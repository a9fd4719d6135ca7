"""The commands of ``ocmm`` and their options."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ocmm_core import __version__
from ocmm_core.cli.acceptance import acceptance_app, artefact_app, msa_app
from ocmm_core.cli.archive import archive_app
from ocmm_core.cli.audit import audit_app, key_app
from ocmm_core.cli.bus import bus_app, camera_app, rig_app
from ocmm_core.cli.calibrate import (
    calibrate_app,
    check_tip_command,
    mount_tip,
    probe_command,
    probe_history,
    probe_status,
    tip_command,
    write_cameras,
)
from ocmm_core.cli.campaign import selftest_app
from ocmm_core.cli.measure import (
    align_command,
    align_plan_command,
    certificate_app,
    compare_command,
    plan_app,
    recall_archived,
    recall_command,
    report_command,
)
from ocmm_core.cli.station import settings_app, station_app, support_app
from ocmm_core.cli.study import (
    fit_command,
    probe_app,
    study_app,
    uncertainty_command,
    verify_fits_command,
)
from ocmm_core.cli.terminal import (
    BusProcessorOption,
    CalibrationsOption,
    CheckAfterOption,
    CompensatePartOption,
    CompensateProbeOption,
    ForceOption,
    IncompleteOption,
    OutOption,
    PartExpansionOption,
    PartOption,
    PartTemperatureOption,
    PlanOption,
    ProbeDesignOption,
    ProbeOption,
    ProbesOption,
    ProbeTemperatureOption,
    ReferenceOption,
    RigOption,
    SeedOption,
    SourceOption,
    SpeedOption,
    StreamCertOption,
    StreamHostOption,
    StreamKeyOption,
    StreamOption,
    StreamTokenOption,
    TemperatureSigmaOption,
    TipOption,
    UncalibratedOption,
    make_console,
    shown,
)
from ocmm_core.composition import (
    DEFAULT_SEED,
    DEFAULT_SOURCE,
    DEMO_PART,
    DEMO_PLAN,
    RECOMMENDED_RIG,
    STANDARD_PROBE,
)
from ocmm_core.errors import InputError, OcmmError

if TYPE_CHECKING:
    from ocmm_core.archive import ArchivePlace
    from ocmm_core.composition import StationRequest


app = typer.Typer(
    name="ocmm",
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    help="Measure parts with an optical coordinate measuring machine.\n\nCameras track the LEDs "
    "of a hand-held probe; OCMM computes the position of its ball, fits features to the "
    "probed points and evaluates their tolerances.\n\nWithout a command, the window opens with its "
    "Start page; where there is no display, this help is printed.\n\nExit codes: 0 every "
    "characteristic conforms, 1 one does not or is not proven to, 2 not or not completely "
    "measured, 3 program failure: the message names the cause and a log file.",
    epilog="To try it: ocmm demo. The rig, probe, part and plan documents in the resources "
    "folder are templates for your own.",
)
app.command(name="align")(align_command)
app.command(name="align-plan")(align_plan_command)
app.command(name="compare")(compare_command)
app.command(name="uncertainty")(uncertainty_command)
app.command(name="report")(report_command)
app.command(name="recall")(recall_command)
app.command(name="fit")(fit_command)
app.command(name="verify-fits")(verify_fits_command)
app.add_typer(rig_app, name="rig")
app.add_typer(bus_app, name="bus")
app.add_typer(camera_app, name="camera")
app.add_typer(calibrate_app, name="calibrate")
app.add_typer(study_app, name="study")
app.add_typer(selftest_app, name="selftest")
app.add_typer(probe_app, name="probe")
app.add_typer(plan_app, name="plan")
app.add_typer(archive_app, name="archive")
app.add_typer(audit_app, name="audit")
app.add_typer(key_app, name="key")
app.add_typer(certificate_app, name="certificate")
app.add_typer(station_app, name="station")
app.add_typer(settings_app, name="settings")
app.add_typer(support_app, name="support")
app.add_typer(acceptance_app, name="acceptance")
app.add_typer(artefact_app, name="artefact")
app.add_typer(msa_app, name="msa")
calibrate_app.command()(write_cameras)
calibrate_app.command(name="probe")(probe_command)
calibrate_app.command(name="tip")(tip_command)
calibrate_app.command(name="check-tip")(check_tip_command)
archive_app.command(name="recall")(recall_archived)
for command in (mount_tip, probe_status, probe_history):
    calibrate_app.command()(command)


class ThemeName(StrEnum):
    """Colours of the window."""

    DARK = "dark"
    LIGHT = "light"
    CONTRAST = "contrast"


class Order(StrEnum):
    """Order of probing."""

    PLAN = "plan"
    ANY = "any"


_OUT = Path("ocmm-out")


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"ocmm {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    context: typer.Context,
    _: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    if context.invoked_subcommand is not None:
        return
    if _has_display():
        _open_window("--start")
    typer.echo(context.get_help())


@app.command(
    add_help_option=False,
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True},
)
def window(context: typer.Context) -> None:
    """Open the window and measure at once, with the options that `ocmm window --help` lists.

    What no option says is taken from the settings (`ocmm settings show`); an option wins.
    """
    _open_window(*context.args)


@app.command()
def demo(
    *,
    headless: Annotated[
        bool, typer.Option("--headless", help="Measure on the terminal, without the window.")
    ] = False,
    source: SourceOption = DEFAULT_SOURCE,
    plan: PlanOption = DEMO_PLAN,
    out: OutOption = _OUT,
    seed: SeedOption = DEFAULT_SEED,
    speed: Annotated[
        float | None,
        typer.Option(
            "--speed", min=0.0, help="Default: 1 (real time) in the window, 0 (full) else."
        ),
    ] = None,
    theme: Annotated[
        ThemeName | None,
        typer.Option("--theme", help="Colours of the window. Default: as in the settings."),
    ] = None,
    incomplete: IncompleteOption = False,
) -> None:
    """Measure the demonstration part on the virtual rig: SIMULATED, a robot hand measures.

    Opens the window where there is a display. Without one, or with --headless, measures the whole
    part and prints the table with the true values beside the measured ones.
    """
    from ocmm_core.composition import StationRequest

    if not headless and _has_display():
        _open_window(
            "--source", source, "--plan", str(plan), "--out", str(out),
            "--seed", str(seed), "--speed", str(1.0 if speed is None else speed),
            *([] if theme is None else ["--theme", theme.value]),
        )  # fmt: skip
    request = StationRequest(plan=plan, out=out, source=source, seed=seed, speed=speed or 0.0)
    _measure(request, with_truth=True, incomplete=incomplete)


@app.command()
def measure(
    *,
    plan: Annotated[
        Path | None, typer.Option("--plan", help="Plan document (TOML): what to measure.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            help="Folder for job file and report; with --continue: that of the job.",
        ),
    ] = None,
    source: SourceOption = DEFAULT_SOURCE,
    rig: RigOption = RECOMMENDED_RIG,
    probe: ProbeOption = STANDARD_PROBE,
    reference: ReferenceOption = None,
    part: PartOption = DEMO_PART,
    seed: SeedOption = DEFAULT_SEED,
    speed: SpeedOption = 0.0,
    operator: Annotated[str, typer.Option("--operator", help="Operator name.")] = "unnamed",
    serial: Annotated[str, typer.Option("--serial", help="Serial number of the part.")] = "-",
    order_number: Annotated[
        str, typer.Option("--order-number", help="Order number, for the report.")
    ] = "",
    batch: Annotated[str, typer.Option("--batch", help="Batch that the part belongs to.")] = "",
    parts: Annotated[
        int,
        typer.Option(
            "--parts",
            min=1,
            help="Measure this many parts in sequence, one job file each; the serial number is "
            "incremented. Waits for Enter between parts so that the part can be changed; "
            "virtual rigs change it themselves.",
        ),
    ] = 1,
    go_on: Annotated[
        Path | None,
        typer.Option(
            "--continue",
            help="Resume this job file, with its own plan, instead of starting a new job.",
        ),
    ] = None,
    order: Annotated[
        Order, typer.Option("--order", help="Probe in plan order or in any order.")
    ] = Order.PLAN,
    record: Annotated[
        Path | None, typer.Option("--record", help="Keep all raw frames in this file as well.")
    ] = None,
    thesis: Annotated[
        bool,
        typer.Option(
            "--thesis", help="Compute poses with the method of the thesis, for comparison."
        ),
    ] = False,
    calibrations: CalibrationsOption = None,
    uncalibrated: UncalibratedOption = False,
    probes: ProbesOption = None,
    tip: TipOption = None,
    check_after: CheckAfterOption = 8.0,
    probe_design: ProbeDesignOption = None,
    probe_temperature: ProbeTemperatureOption = None,
    compensate_probe: CompensateProbeOption = False,
    part_temperature: PartTemperatureOption = None,
    part_expansion: PartExpansionOption = None,
    compensate_part: CompensatePartOption = False,
    temperature_sigma: TemperatureSigmaOption = 0.5,
    force: ForceOption = False,
    bus_processor: BusProcessorOption = None,
    stream: StreamOption = None,
    stream_host: StreamHostOption = "127.0.0.1",
    stream_token: StreamTokenOption = None,
    stream_cert: StreamCertOption = None,
    stream_key: StreamKeyOption = None,
    incomplete: IncompleteOption = False,
    formats: Annotated[
        list[str] | None,
        typer.Option(
            "--format",
            help="Of the report, see ocmm report; can be repeated. Default: polyworks.",
        ),
    ] = None,
    archive: Annotated[
        str | None,
        typer.Option("--archive", help="local, off, a file or a server. Default: the settings."),
    ] = None,
) -> None:
    """Measure a part by a plan, and write the job file and the report.

    Every point is in the job file (DIR/NAME-001.ocmm) before it counts. The report (on the
    template of this station, see ocmm report --remember) is a few files
    beside it: _job.csv with the verdict on the part, _report.csv, _features.csv, _points.csv, a
    cloud and a macro. Their names say SIMULATED and INCOMPLETE where that is so. Without
    --incomplete no report is written of a job that lacks something.
    """
    from ocmm_core.composition import ClimateRequest, StationRequest, stream_options
    from ocmm_core.station.archiving import archive_place

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
    request = StationRequest(
        plan=plan or DEMO_PLAN, out=out or (go_on.parent if go_on is not None else _OUT), rig=rig,
        probe=probe, part=part, source=source, seed=seed, speed=speed, operator=operator,
        serial=serial, order=order_number, batch=batch, resume=go_on,
        probing="any" if order is Order.ANY else "plan", record=record, force=force,
        bus_processor=bus_processor, reference=reference,
        calibrations=calibrations, uncalibrated=uncalibrated, probes=probes, tip=tip,
        check_after_h=check_after,
        climate=ClimateRequest(
            probe_design, probe_temperature, part_temperature, temperature_sigma, part_expansion,
            compensate_probe, compensate_part,
        ),
        method="thesis" if thesis else "gauss-newton",
        stream=stream_options(stream, stream_host, stream_token, stream_cert, stream_key),
    )  # fmt: skip
    _measure(
        request, with_truth=False, parts=parts, incomplete=incomplete,
        formats=tuple(formats or ()), archived=archive_place(archive),
    )  # fmt: skip


@app.command()
def record(
    *,
    out: Annotated[Path, typer.Option("--out", help="File for the recording.")],
    source: SourceOption = DEFAULT_SOURCE,
    plan: PlanOption = DEMO_PLAN,
    rig: RigOption = RECOMMENDED_RIG,
    probe: ProbeOption = STANDARD_PROBE,
    reference: ReferenceOption = None,
    part: PartOption = DEMO_PART,
    seed: SeedOption = DEFAULT_SEED,
    speed: SpeedOption = 0.0,
    seconds: Annotated[
        float | None,
        typer.Option(
            "--seconds", min=0.1, help="Stop after this much bus time; default: at the end."
        ),
    ] = None,
    force: ForceOption = False,
) -> None:
    """Record the raw frames of a source, to be measured later with --source replay:FILE.

    The recording is safe against a crash at any moment: what is whole up to then can be replayed.
    Stop a live source with --seconds or Ctrl-C.
    """
    from ocmm_core.cli.measure import record_source
    from ocmm_core.composition import StationRequest

    request = StationRequest(
        plan=plan, out=out.parent, rig=rig, probe=probe, part=part, source=source, seed=seed,
        speed=speed, force=force, reference=reference,
    )  # fmt: skip
    record_source(request, out, seconds, make_console())


@app.command()
def bench(
    *,
    seconds: Annotated[
        float, typer.Option("--seconds", min=0.2, help="Duration of each measurement.")
    ] = 2.0,
    memory: Annotated[
        float,
        typer.Option(
            "--memory", min=0.0, help="Also run the whole chain for this many minutes of bus time."
        ),
    ] = 0.0,
) -> None:
    """Print the speed of the hot path on this machine, as ratios against limits and a peer.

    With --memory 60 the whole chain runs for an hour of bus time at full speed (some minutes on
    the clock), and its memory is printed ten times.
    """
    from ocmm_core.cli.study import print_run, run_bench, run_for

    console = make_console()
    run_bench(seconds, console)
    if memory > 0.0:
        print_run(run_for(60.0 * memory, console), 60.0 * memory, console)


@app.command(name="compile", hidden=True)
def compile_command(
    processes: Annotated[
        int | None, typer.Option("--processes", min=1, help="Default: one a core.")
    ] = None,
) -> None:
    """Compile what is computed most, so that nobody waits for it later; the set-up does it.

    What is there already is not compiled again. Another processor needs it anew.
    """
    from ocmm_core.composition import compile_all

    done = compile_all(processes)
    typer.echo(f"{done.listed} compiled functions are ready, {done.compiled} were compiled now.")


def _measure(
    request: StationRequest,
    *,
    with_truth: bool,
    parts: int = 1,
    incomplete: bool = False,
    formats: tuple[str, ...] = (),
    archived: ArchivePlace | None = None,
) -> None:
    from ocmm_core.cli.archive import hand_over_after_measuring
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
    from ocmm_core.export.report import load_paper, template_in_use
    from ocmm_core.inspection.archive import next_serial

    # Before a job is begun: a name that is none, or a template that cannot be used.
    formats = chosen_formats(formats or [DEFAULT_FORMAT])
    load_paper(template_in_use())
    console = make_console()
    code = 0
    beside: list[OcmmError] = []
    if parts > 1:
        # Better before the first part than after it.
        next_serial(request.serial)
    jobs: list[Path] = []
    try:
        for part in range(parts):
            if part:
                request = replace(request, serial=next_serial(request.serial))
                origin = origin_of(request.source)
                if origin is not Origin.VIRTUAL:
                    # The virtual rig puts a new part in place by itself; nothing else does.
                    replayed = origin is Origin.RECORDING
                    await_part(console, part + 1, parts, request.serial, replayed=replayed)
            built = build_station(request)
            jobs.append(built.job_path)
            view = run_job(built, request.out, console, incomplete=incomplete, formats=formats)
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
        # After everything else: nothing that is measured waits for an archive.
        hand_over_after_measuring(archived, jobs, console)
    if beside:
        # The parts are measured; what was wanted besides, e.g. a recording, is not there.
        raise beside[0]
    raise typer.Exit(code)


def _open_window(*arguments: str) -> None:
    """Become the window.

    In the place of this process: whoever ends or kills it ends or kills the window, and nobody
    waits in between.
    """
    command = [sys.executable, "-m", "ocmm_gui", *arguments]
    sys.stdout.flush()
    os.execv(command[0], command)  # noqa: S606 - our own interpreter and module


def _has_display() -> bool:
    """Return whether a window can be shown; asked of the environment, without loading Qt."""
    if sys.platform != "linux":
        return True
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"))
