"""Commands on a job file: ``ocmm align``, and the readings of ``ocmm environment``."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import typer

from ocmm_cli.terminal import lead, make_console, say
from ocmm_core.errors import InputError

if TYPE_CHECKING:
    from ocmm_core.alignment import AlignmentReport
    from ocmm_core.geometry import Float
    from ocmm_core.inspection.archive import ReopenedJob


def align_command(*, job: Path, save: Path | None, name: str, control: list[str] | None) -> None:
    """Show the alignment of a job: residuals, uncertainty, open degrees of freedom.

    Read-only. With --save the frame is written as a document that other plans take over.
    """
    from ocmm_cli.measure._headless import print_states
    from ocmm_core.alignment import report_lines
    from ocmm_core.inspection.archive import reopen_job
    from ocmm_core.inspection.evaluation import alignment_of_points

    console = make_console(soft_wrap=True)
    opened = reopen_job(job)
    for doubt in opened.doubts:
        console.print(f"{job.name}: {say(doubt)}", style="yellow")
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
        said = say(f"{SIMULATED}: frame {document.name} comes from a virtual rig. {NO_REAL_PART}")
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
    report prints them, and a plan may require them ([environment] of the plan). Of several readings
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
        console.say("Nothing was read off in the room.")
    for _, sentence in told:
        console.say(sentence)
