"""A whole job without a window: run it, show its progress, print its table, ask for the next."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.text import Text

from ocmm_cli.measure._pages import print_reports
from ocmm_cli.terminal import (
    DeferredInterrupt,
    PlainConsole,
    error_text,
    heads,
    lead,
    print_grid,
    shown,
    tr,
    tr_word,
)
from ocmm_core.acquisition.frames import AcquisitionState, AcquisitionStatus, StopReason
from ocmm_core.calibration.records import CalibrationStatus, ProbeView
from ocmm_core.composition import BuiltStation
from ocmm_core.errors import CalibrationError, MeasuringError, OcmmError
from ocmm_core.export import DEFAULT_FORMAT, PDF, chosen_formats
from ocmm_core.fieldbus.report import pace_words
from ocmm_core.inspection.causes import Explanation
from ocmm_core.inspection.evaluation import INCOMPLETE, JobHeader, JobView, state_lines
from ocmm_core.measuring import Refusal
from ocmm_core.named_file import FileIdentity
from ocmm_core.tolerances.decisions import U_LABEL, U_WORDS, CharacteristicResult, PartWord, Verdict
from ocmm_core.tolerances.kinds import spec_of

_POLL_S = 0.05
_STYLE = {
    Verdict.CONFORM: "green",
    Verdict.NOT_CONFORM: "bold red",
    Verdict.NOT_PROVEN: "yellow",
    Verdict.NOT_MEASURED: "yellow",
    Verdict.PROVISIONAL: "yellow",
}


def run_job(
    built: BuiltStation,
    out: Path,
    console: PlainConsole,
    *,
    incomplete: bool = False,
    formats: Sequence[str] = (),
) -> JobView:
    """Measure until the job is complete or the source has ended, and write the report.

    ``built`` is closed; ``out``: folder of the report, also of an ``incomplete`` job; ``formats``:
    see `export.chosen_formats`, empty for the default. StorageError if the job is not on the disk
    under its name: its report is removed; MeasuringError if the source ended or failed before the
    job was complete, InternalError if the station has failed: points stay in the job file;
    CalibrationError if the calibration does not allow points.
    """
    station, reported = built.station, False
    files: tuple[FileIdentity, ...] = ()
    chosen = chosen_formats(formats or [DEFAULT_FORMAT])
    console.print(f"{lead('Source  ')}{built.description.name}", highlight=True)
    console.show(f"Plan    {station.job.plan.name}, part {station.job.plan.part}", highlight=True)
    console.print(f"{lead('Job     ')}{built.job_path}", highlight=True)
    console.print(f"{lead('Header  ')}{_header(station.job.view().header)}")
    for fault in built.passed_over:
        # It may be a part of the batch; this cannot be determined.
        console.print(f"{lead('Passed over  ')}{tr(fault.what)}", style="yellow")
    calibration = station.instruments.calibration()
    console.print(f"{lead('Calibration  ')}{tr(calibration.label)}")
    console.print(f"{lead('Temperature  ')}{tr(station.job.view().temperature)}")
    if station.instruments.reference is not None:
        console.print(f"{lead('Reference  ')}{tr(station.instruments.reference.label)}")
    for warning in calibration.warnings:
        console.show(warning, style="yellow")
    interrupt = DeferredInterrupt()
    try:
        station.events.point_refused.connect(lambda refusal: _print_refusal(console, refusal))
        station.faults.failed.connect(lambda error: _print_error(console, error))
        station.start()
        if station.stream is not None:
            host, port = station.stream.address
            console.print(f"{lead('Stream  ')}{host}:{port}")
        _print_probe(console, station.instruments.probe())
        _wait(built, console, interrupt)
        failure = station.faults.why_failed()
        if failure is not None:
            raise failure
        view = station.job.view()
        status = station.looks.acquisition()
        if view.part_verdict.complete or incomplete:
            reported = True
            tables = [name for name in chosen if name != PDF.name]
            if tables:
                paths = station.reports.export(out, tables, incomplete=incomplete)
                files = tuple(map(FileIdentity.of_written, paths))
            for file in files:
                console.print(f"{lead('Report  ')}{file.path}", highlight=True)
        if not view.complete:
            raise _incomplete(view, status, built.job_path)
    finally:
        station.close()
        interrupt.close()
        print_counters(console, station.looks.acquisition())
        lost = station.job.lost
        if lost is not None:
            # No report may refer to a job that cannot be found.
            for file in files:
                file.remove()
            raise lost
        if reported and PDF.name in chosen:
            _print_pages(built.job_path, out, console, incomplete=incomplete)
    # Ctrl-C during the report ends the command behind it.
    interrupt.check()
    return view


def _print_pages(job: Path, out: Path, console: PlainConsole, *, incomplete: bool) -> None:
    """Write the PDF from the closed file of the job."""
    from ocmm_core.export.report import report_of_job
    from ocmm_core.export.template import paper_of
    from ocmm_core.inspection.finished import reopen_job

    data = replace(report_of_job(reopen_job(job)), paper=paper_of(job))
    for path in print_reports([data], out, incomplete=incomplete):
        console.print(f"{lead('Report  ')}{path}")


def print_table(
    console: PlainConsole, view: JobView, truth: Mapping[str, float] | None = None
) -> None:
    _print_results(console, view, truth)
    for result in view.characteristics:
        if result.note:
            console.print(f"{result.name}: {tr(result.note)}", style="dim")
    if view.unproven:
        console.show(view.unproven, style="bold red")
    console.print(f"{tr('Lengths in mm, angles in degrees.')} {tr(U_WORDS)}.", style="dim")
    if truth is not None:
        held, known = _held(view, truth)
        console.show(
            f"Measured ± U holds the true value of {held} of {known} characteristics; 95 % are "
            "expected. (Form excluded: noise can only enlarge it.)"
        )


def _print_results(console: PlainConsole, view: JobView, truth: Mapping[str, float] | None) -> None:
    names = ["Nominal", "Measured", "Deviation", "Lower", "Upper", U_LABEL, "True", "Error"]
    count = 6 if truth is None else 8
    rows: list[Sequence[str | Text]] = [
        (
            one.name, *_cells(one, (truth or {}).get(one.name))[:count],
            Text(tr_word(one.verdict.value), _STYLE[one.verdict]),
        )
        for one in view.characteristics
    ]  # fmt: skip
    columns = heads("Characteristic", *names[:count], "Verdict")
    spare = (heads("Nominal", "Lower", "Upper", "True"), heads("Deviation", "Error"))
    print_grid(console, columns, rows, f"{view.part}: {view.job}", spare)


def print_verdict(console: PlainConsole, view: JobView) -> None:
    """Print the states, the reasons, and in the last line, for scripts, the part verdict."""
    print_states(console, view)
    for reason in view.part_verdict.reasons:
        console.show(reason, style="bold yellow")
    verdict = view.part_verdict.shown_as
    style = "" if verdict is None else _STYLE[verdict]
    # English in every language: scripts read it.
    console.print(view.part_verdict.headline, style=style)


def print_states(console: PlainConsole, view: JobView) -> None:
    """Print a line for every limitation of a job: SIMULATED, INCOMPLETE."""
    for line in state_lines(view):
        console.show(line, style="bold yellow")


def print_explanations(console: PlainConsole, explained: Sequence[Explanation]) -> None:
    """Print a line for every result that is not good: by how much, and the remedy."""
    for item in explained:
        console.print(f"{item.characteristic}: {tr(item.why)} {tr(item.suggestion)}")


def print_counters(console: PlainConsole, status: AcquisitionStatus) -> None:
    console.show(
        f"Cycles  {status.elapsed}: {status.good} good, {status.late} late, {status.lost} lost, "
        f"{status.bad} bad"
    )
    console.show(
        f"Frames  {status.frames} delivered, {status.frames_lost} lost, {status.overrun} overrun"
    )
    if status.mean_pace is not None:
        words = pace_words(status.mean_pace) or tr("The virtual bus kept pace with real time.")
        console.show(f"Pace    {status.mean_pace:.2f}: {tr(words)}")


def exit_code(view: JobView) -> int:
    """Return 0 if the part conforms or has no tolerance, 2 if incomplete, else 1."""
    if not view.part_verdict.complete:
        return 2
    return int(view.part_verdict.word not in (PartWord.CONFORMS, PartWord.NO_TOLERANCE))


def missing_sentences(view: JobView, job_path: Path, *, written: bool) -> str:
    """Return the missing features of an ended job, and the remedy."""
    missing = ", ".join(view.part_verdict.missing)
    said = f"{tr_word(INCOMPLETE)}: {missing} {tr('not measured.')}"
    if written:
        return said
    return f"{said} " + tr(f"No report written; ocmm report {job_path} --incomplete writes one.")


def _header(header: JobHeader) -> str:
    """Return operator, serial number, and order and batch if given, on one line."""
    beside = {"order": header.order, "batch": header.batch}
    named = {"operator": header.operator, "serial": header.serial}
    named |= {word: name for word, name in beside.items() if name}
    return ", ".join(f"{tr_word(word)} {name}" for word, name in named.items())


def _wait(built: BuiltStation, console: PlainConsole, interrupt: DeferredInterrupt) -> None:
    station = built.station
    total = sum(feature.points for feature in station.job.plan.features)
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn(tr("points"), markup=False),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task(tr("Starting"), total=total)
        while not station.wait_finished(_POLL_S):
            interrupt.check()
            missing = station.job.missing()
            left = sum(count for _, count in missing)
            doing = f"{lead('Probing ')}{missing[0][0]}" if missing else tr("Finishing")
            slow = tr(station.looks.acquisition().pace_words)
            progress.update(
                task, completed=total - left, description=f"{slow} {doing}" if slow else doing
            )
            if not missing or _script_is_over(built):
                return
            if station.faults.measuring is not None:
                return
            _require_calibration(built)


def _print_probe(console: PlainConsole, probe: ProbeView) -> None:
    # A tip requested by name is mounted when the station starts.
    console.print(f"{lead('Probe  ')}{tr(probe.label)}")
    for warning in probe.warnings:
        console.show(warning, style="yellow")


def _require_calibration(built: BuiltStation) -> None:
    """Raise CalibrationError if no further point is possible."""
    for view in (built.station.instruments.calibration(), built.station.instruments.probe()):
        if view.blocking_reason is None or view.word in (
            CalibrationStatus.VALID,
            CalibrationStatus.DUE,
            CalibrationStatus.DESIGN,
        ):
            # Blockers of a valid calibration are temporary: warm-up, cameras not read yet.
            continue
        if built.station.faults.measuring is not None:
            # It also makes them unusable, and is the true cause.
            return
        # A source that cannot be started is reported first.
        if built.station.looks.acquisition().state is AcquisitionState.RUNNING:
            raise CalibrationError(
                "calibration.not_usable",
                f"{view.word.value}: {view.blocking_reason.what}",
                f"{view.blocking_reason.remedy} With --uncalibrated, points are taken but prove "
                "nothing.",
            )


def _script_is_over(built: BuiltStation) -> bool:
    if not built.live or built.virtual is None:
        return False
    # A refused last touch extends the script once its frames are measured, a second later at most.
    second = round(1e9 / built.virtual.frame_period_ns)
    return built.station.looks.live().frame_counter >= built.virtual.n_frames + second


def _incomplete(view: JobView, status: AcquisitionStatus, job_path: Path) -> OcmmError:
    lacking = ", ".join(
        f"{feature.name} ({len(feature.points)}/{feature.needed})"
        for feature in view.features
        if len(feature.points) < feature.needed
    )
    if status.stop_reason is StopReason.FAILED and status.message:
        return status.error("measure.source", f"Missing: {lacking}.")
    return MeasuringError(
        "measure.incomplete",
        f"The source ended before the job was complete. Missing: {lacking}.",
        f"Measure what is missing. Points so far are in {job_path}; ocmm report {job_path} "
        "--incomplete reports them.",
    )


def _print_error(console: PlainConsole, error: OcmmError) -> None:
    # Immediately, although the error is repeated at the end: closing takes time.
    console.print(Text.assemble((shown(tr(error.what)), "red"), " ", shown(tr(error.remedy))))


def _print_refusal(console: PlainConsole, refusal: Refusal) -> None:
    stamp = time.strftime("%H:%M:%S")
    console.print(f"{stamp} {tr('Point refused:')} {error_text(refusal)}")


def _held(view: JobView, truth: Mapping[str, float]) -> tuple[int, int]:
    """Return for how many characteristics the truth lies within U, and of how many."""
    inside = [
        abs(result.measured - truth[result.name]) <= result.uncertainty
        for result in view.characteristics
        if result.measured is not None
        and result.uncertainty is not None
        and not spec_of(result.kind).form_alone
        and result.name in truth
    ]
    return sum(inside), len(inside)


def _cells(result: CharacteristicResult, true: float | None) -> list[str]:
    """Return the texts of all number columns; a dash without a number."""
    measured, deviation, uncertainty = result.measured, result.deviation, result.uncertainty
    error = None if measured is None or true is None else measured - true
    return [
        _number(result.nominal),
        _number(measured),
        _number(deviation, "+"),
        _number(result.lower, "+"),
        _number(result.upper, "+"),
        _number(uncertainty),
        _number(true),
        _number(error, "+"),
    ]


def _number(value: float | None, sign: str = "-") -> str:
    return "-" if value is None else f"{value:{sign}z.4f}"


_NO = ("q", "quit", "n", "no", "nein")


def await_part(
    console: PlainConsole, number: int, parts: int, serial: str, *, replayed: bool
) -> None:
    """Wait for the confirmation that the next part is in place; else raise MeasuringError."""
    console.print(
        tr(f"Part {number} of {parts} is next, serial {serial}.")
        + " "
        + (
            tr("The recording restarts from the beginning.")
            if replayed
            else tr("Put it in place and keep hands and probe off it.")
        )
    )
    try:
        answer = console.input(tr("Enter: measure it; q and Enter: stop: "))
    except EOFError:
        console.print()
        raise _ended(number, parts, serial, "no answer: end of input") from None
    if not console.is_terminal:
        # No Enter has ended the line.
        console.print()
    if answer.strip().lower() in _NO:
        raise _ended(number, parts, serial, "stopped by the operator")


def _ended(number: int, parts: int, serial: str, why: str) -> MeasuringError:
    left = parts - number + 1
    return MeasuringError(
        "measure.parts_left",
        f"Part {number} of {parts} was not started ({why}).",
        f"The parts before it are complete. Continue with --serial {serial} --parts {left}.",
    )
