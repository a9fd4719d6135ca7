"""Commands that measure a part: ``ocmm measure`` and ``ocmm demo``."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ocmm_cli._window import has_display, open_window
from ocmm_cli.terminal import (
    BusProcessorOption,
    CalibrationsOption,
    CheckAfterOption,
    CompensatePartOption,
    CompensateProbeOption,
    ForceOption,
    HumidityOption,
    IncompleteOption,
    OutOption,
    PartExpansionOption,
    PartOption,
    PartTemperatureOption,
    PlanOption,
    PressureOption,
    ProbeDesignOption,
    ProbeOption,
    ProbesOption,
    ProbeTemperatureOption,
    ReferenceOption,
    RigOption,
    RoomOption,
    SeedOption,
    SourceOption,
    SpeedOption,
    StreamCertOption,
    StreamHostOption,
    StreamKeyOption,
    StreamOption,
    StreamTokenOption,
    TemperatureSigmaOption,
    TemperatureUOption,
    ThermometerOption,
    TipOption,
    UncalibratedOption,
    make_console,
    print_notes,
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
from ocmm_core.surroundings import TypedRoom

if TYPE_CHECKING:
    from ocmm_core.composition import StationRequest
    from ocmm_shop.archive.outbox import ArchivePlace


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
    from ocmm_core.inspection.archive import next_serial
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
            jobs.begin(built.job_path)
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


class ThemeName(StrEnum):
    DARK = "dark"
    LIGHT = "light"
    CONTRAST = "contrast"


class Order(StrEnum):
    PLAN = "plan"
    ANY = "any"


_OUT = Path("ocmm-out")


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
        typer.Option("--speed", help="Default: 1 (real time) in the window, 0 (full) else."),
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

    if not headless and has_display():
        open_window(
            "--source", source, "--plan", str(plan), "--out", str(out),
            "--seed", str(seed), "--speed", str(1.0 if speed is None else speed),
            *([] if theme is None else ["--theme", theme.value]),
        )  # fmt: skip
    request = StationRequest(plan=plan, out=out, source=source, seed=seed, speed=speed or 0.0)
    measure_parts(request, with_truth=True, incomplete=incomplete)


def measure(
    *,
    plan: Annotated[
        Path | None, typer.Option("--plan", help="Plan document (TOML): what to measure.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", help="Folder for job file and report; with --continue: that of the job."
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
    temperature_sigma: TemperatureSigmaOption = None,
    temperature_u: TemperatureUOption = "",
    room: RoomOption = "",
    thermometer: ThermometerOption = "",
    humidity: HumidityOption = "",
    pressure: PressureOption = "",
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
            "--format", help="Of the report, see ocmm report; can be repeated. Default: polyworks."
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
    read = TypedRoom(room, humidity, pressure)
    read.check()
    loaded = SettingsStore.of_this_user().load()
    print_notes(loaded.notes, stderr=True)
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
            compensate_probe, compensate_part, stated_u=temperature_u,
        ),
        room=read, thermometers=thermometer,
        method="thesis" if thesis else "gauss-newton",
        stream=stream_options(stream, stream_host, stream_token, stream_cert, stream_key),
    )  # fmt: skip
    measure_parts(
        request, with_truth=False, parts=parts, incomplete=incomplete,
        formats=tuple(formats or ()), archived=archive_place(archive, loaded.settings),
    )  # fmt: skip
