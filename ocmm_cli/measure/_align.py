"""Commands on job files: ``ocmm align``, ``ocmm environment`` and ``ocmm compare``."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from ocmm_cli.measure._pages import print_pages
from ocmm_cli.options import ComputingSite
from ocmm_cli.terminal import (
    PlainConsole,
    heads,
    lead,
    make_console,
    print_grid,
    progress_line,
    tr,
    tr_word,
)
from ocmm_core.errors import InputError

if TYPE_CHECKING:
    from ocmm_core.alignment import AlignmentReport
    from ocmm_core.geometry import Float
    from ocmm_core.inspection.finished import ReopenedJob, Trend


def align_command(*, job: Path, save: Path | None, name: str, control: list[str] | None) -> None:
    """Show the alignment of a job: residuals, uncertainty, open degrees of freedom.

    Read-only. With --save the frame is written as a document that other plans take over.
    """
    from ocmm_cli.measure._headless import print_states
    from ocmm_core.alignment import report_lines
    from ocmm_core.inspection.evaluation import alignment_of_points
    from ocmm_core.inspection.finished import reopen_job

    console = make_console(soft_wrap=True)
    opened = reopen_job(job)
    for doubt in opened.doubts:
        console.print(f"{job.name}: {tr(doubt)}", style="yellow")
    print_states(console, opened.view)
    report = alignment_of_points(
        opened.plan, opened.points, opened.sensitivities, opened.rig, opened.body, opened.options
    )
    for line in report_lines(report):
        console.print(line)
    if save is not None:
        _save(save, name or save.stem, opened, report, control or [])
        console.print(f"{lead('Frame  ')}{save}")
    if not report.can_be_accepted:
        raise typer.Exit(2)


def align_plan_command(*, plan: Path, frame: Path, out: Path, relocate: float | None) -> None:
    """Write a plan that is aligned to a saved frame.

    The new plan holds what it needs of the frame, together with its hash. With a frame of a
    simulated job it proves nothing about real parts.
    """
    from ocmm_core.alignment import load_frame, relocation, saved_frame
    from ocmm_core.inspection.evaluation import NO_REAL_PART, SIMULATED
    from ocmm_core.inspection.plan import load_plan, save_plan

    document = load_frame(frame)
    console = make_console(soft_wrap=True)
    if document.simulated:
        said = tr(f"{SIMULATED}: frame {document.name} comes from a virtual rig. {NO_REAL_PART}")
        console.print(said, style="bold yellow")
    rule = saved_frame(document) if relocate is None else relocation(document, relocate)
    save_plan(msgspec.structs.replace(load_plan(plan), alignment=rule), out)
    console.print(f"{lead('Plan  ')}{out}")


def _save(
    path: Path, name: str, job: ReopenedJob, report: AlignmentReport, control: list[str]
) -> None:
    from ocmm_core.alignment import frame_document, save_frame
    from ocmm_core.inspection.evaluation import frame_covariance

    if report.T_nominal_from_world is None or report.free:
        raise InputError(
            "frame.open",
            (
                f"{job.path}: the alignment does not fully constrain the part, so there is "
                "no frame to save."
            ),
            "Measure what is missing, or align to features that constrain it.",
        )
    centres = _centres(job)
    for feature in control:
        if feature not in centres:
            raise InputError(
                "frame.no_centre",
                f"{job.path}: {feature} is not a measured feature with a centre.",
                f"Choose from {', '.join(centres) or 'none'}.",
            )
    document = frame_document(
        name=name,
        made=datetime.now(UTC).isoformat(timespec="seconds"),
        source=f"{job.plan.part} {job.view.header.serial}, {job.path.name}".strip(),
        T_frame_from_world=report.T_nominal_from_world,
        control_world={feature: centres[feature] for feature in control},
        simulated=job.view.simulated,
        covariance=frame_covariance(
            job.plan, job.points, job.sensitivities, job.rig, job.body, job.options
        ),
    )
    save_frame(path, document)


def _centres(job: ReopenedJob) -> dict[str, Float]:
    from ocmm_core.features.measured import CENTRED, ActualFeature
    from ocmm_core.inspection.evaluation import checked_features
    from ocmm_core.measuring import reported_points

    points = reported_points(job.points, job.options.climate.part)
    return {
        name: feature.fit.point
        for name, feature in checked_features(job.plan, points, job.options).items()
        if isinstance(feature, ActualFeature) and feature.fit.shape in CENTRED
    }


def environment_command(*, job: Path, room: str, humidity: str, pressure: str, who: str) -> None:
    """Record ambient readings in a job, and print those it contains.

    Readings before the first point apply to the start, those after the last point to the end. The
    report prints them, and a plan may require them (its table environment). Of several readings
    without a point in between the last one applies; the report lists all. Without a reading, the
    command prints those of the job.
    """
    from ocmm_core.ambient import TypedRoom
    from ocmm_core.inspection.plan import environment_words, note_room_in, noted_rooms
    from ocmm_core.storage import JobFile

    read = TypedRoom(room, humidity, pressure)
    read.check()
    with JobFile.read(job) if read.empty else JobFile.open(job) as opened:
        if not read.empty:
            note_room_in(opened, read, who)
        last = max((point.number for point in opened.points()), default=0)
        told = environment_words(noted_rooms(opened.events()), last)
    console = make_console(soft_wrap=True)
    if not told:
        console.show("Nothing was read off in the room.")
    for _, sentence in told:
        console.show(sentence)


def compare_command(
    *, jobs: Annotated[list[Path], typer.Argument(readable=False)], probes: Path | None,
    calibrations: Path | None, feature: str, table: Path | None, pages: Path | None,
    site: ComputingSite,
) -> None:  # fmt: skip
    """Compare the jobs of a batch: trend, control chart and Cp / Cpk of every characteristic.

    Run rules: Western Electric 1 (beyond a limit), 2 (two of three beyond two sigma), 3 (four of
    five beyond one sigma), 4 (eight on one side), and Nelson 3 (six rising or falling).

    Every job is opened read-only and recomputed from its points. Values in doubt are named and
    not counted; so are those of simulated jobs beside real ones. Jobs that cannot be read or are of
    another plan than the latest one are named and left out. Ends with 1 where one cannot be read.
    """
    from ocmm_core.documents import write_atomic
    from ocmm_core.export import batch_table
    from ocmm_core.inspection.evaluation import SIMULATED_LINE
    from ocmm_core.inspection.finished import compare_files

    console = make_console()
    with progress_line() as tell:
        found = compare_files(jobs, tell, probes, calibrations, site=site).about(feature)
    if found.simulated:
        console.show(SIMULATED_LINE, style="bold yellow")
    for name, words in zip(found.jobs, found.words, strict=True):
        said = "; ".join(map(tr, words))
        console.print(f"{name}: {said}")
    for sentence in found.left_out:
        console.print(f"{tr_word('left out')}: {tr(sentence)}", style="yellow")
    _print_table(console, found.trends, len(found.jobs))
    for trend in found.trends:
        for line in _lines(trend):
            console.print(f"{trend.name}: {tr(line)}")
    console.show(
        "Lengths in mm. Chart limits: 2.66 mean moving ranges; Cp and Cpk use the same scatter.",
        style="dim",
        highlight=True,
    )
    if table is not None:
        write_atomic(table, batch_table(found))
        console.print(f"{lead('Table  ')}{table}")
    if pages is not None:
        options = ["--out", str(pages), "--feature", feature]
        options += ["--probes", str(probes)] if probes is not None else []
        options += ["--calibrations", str(calibrations)] if calibrations is not None else []
        for line in print_pages(
            "ocmm_gui.reports._batch",
            [[*map(str, jobs), *options]],
            "compare.pdf",
            "The pages were not written",
            "The jobs are not affected.",
        ):
            console.print(f"{lead('Pages  ')}{line}")
    if found.unread:
        raise typer.Exit(1)


def _print_table(console: PlainConsole, trends: tuple[Trend, ...], count: int) -> None:
    title = tr(f"{count:d} job{'' if count == 1 else 's'}")
    rows = []
    for trend in trends:
        values, able = trend.values, trend.capability
        numbers = ["–"] * 3
        if len(values):
            numbers = [f"{x:z.4f}" for x in (values.mean(), values.min(), values.max())]
        rows.append((
            trend.name, f"{len(values)}/{count}", *numbers,
            f"{able.cp:.2f}" if able is not None and able.cp is not None else "–",
            f"{able.cpk:.2f}" if able is not None else "–",
            f"{able.cpk_low:.2f} – {able.cpk_high:.2f}" if able is not None else "–",
        ))  # fmt: skip
    columns = heads("Characteristic", "Parts", "Mean", "Least", "Greatest", "Cp", "Cpk", "95 %")
    print_grid(console, columns, rows, title)


def _lines(trend: Trend) -> list[str]:
    lines = [f"excluded: {why}" for why in trend.left_out]
    if trend.why_not:
        lines.append(trend.why_not)
    if trend.capability is not None:
        lines.append(trend.capability.summary)
    if trend.caution:
        lines.append(trend.caution)
    if trend.chart is not None:
        counted = [part for part in trend.parts if part.value is not None]
        lines += [
            tr(f"{counted[i].job} is {why.value} ({why.rule}).") for i, why in trend.chart.signals
        ]
    return lines
