"""Guided procedures on the terminal: frames, observations, steps."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from ocmm_cli.calibrate._setup import Setup
from ocmm_cli.terminal import DeferredInterrupt, PlainConsole, lead, tr, tr_later
from ocmm_core import composition
from ocmm_core.acceptance import read_temperature
from ocmm_core.acquisition.frames import AcquisitionState, FrameBlock, StopReason, read_status
from ocmm_core.acquisition.recording import FrameRecorder
from ocmm_core.calibration import guided, records
from ocmm_core.calibration.guided import sessions
from ocmm_core.calibration.relocation import BAR, RelocationProcedure
from ocmm_core.calibration.verification import VerificationProcedure
from ocmm_core.camera import Rig, load_rig
from ocmm_core.errors import AcquisitionError, CalibrationError, InputError, StorageError
from ocmm_core.fieldbus.report import decode_report
from ocmm_core.inspection.plan import load_plan
from ocmm_core.tracking import ProbeBody

if TYPE_CHECKING:
    from ocmm_sim.calibration_scenes import CalibratingScript

_BATCH = 80
_IDLE_S = 0.002
_WARMTH_S = 2.0
SESSIONS = "sessions"

P = TypeVar("P", bound=guided.GuidedProcedure[Any, Any, Any, Any])


@dataclass(frozen=True, slots=True)
class TerminalSite:
    """Rig with the place of its calibrations."""

    design: Rig
    rig: Rig
    """With the calibration in force; the design without one."""
    document: Path
    calibrations: Path
    """Folder of calibrations, one subfolder per rig."""
    store: records.CalibrationStore
    sessions: Path

    @property
    def read_by(self) -> Rig:
        """Return the rig of the frames; the views of a tracker follow from the one in force."""
        return self.design if self.rig.markers is None else self.rig

    def of_cameras(self, rig: Rig, body: ProbeBody) -> guided.SessionSite:
        """Return the site of a procedure for the cameras."""
        return guided.SessionSite(self.sessions, rig, body, self.store.folder)


def open_site(rig: Path, calibrations: Path | None) -> TerminalSite:
    """Return the rig and its calibrations; InputError if the document is wrong."""
    design = load_rig(rig)
    root = calibrations or records.default_folder()
    folder = records.store_folder(root, design.name)
    store = records.CalibrationStore(folder)
    in_use = records.open_calibration(rig, root)
    return TerminalSite(design, in_use.rig, rig, root, store, folder / SESSIONS)


def opened(
    kind: type[P],
    site: guided.SessionSite,
    stated: guided.SessionSetup,
    setup: Setup,
    console: PlainConsole,
) -> P:
    """Return the newest resumable session of a kind, else a new one as ``stated``."""
    warm = read_temperature(setup.temperature, setup.temperature_u, now())
    for path in () if setup.new else sessions(site.sessions, kind.kind):
        try:
            procedure = kind.resume(site, path)
            if (
                isinstance(procedure, guided.ProbeProcedure)
                and isinstance(stated, guided.TipSetup)
                and procedure.tip != stated.tip
            ):
                raise CalibrationError(
                    "calibrate.tip",
                    f"The session is for tip '{procedure.tip}'.",
                    "Give that tip, or start a new session with --new.",
                )
        except (CalibrationError, InputError, StorageError) as error:
            # Started with another calibration, probe or version, or at an implausible temperature:
            # its observations are useless.
            if not guided.is_ended(path):
                console.print(f"{lead('Left out ')}{tr(error.what)}", style="dim")
            continue
        if is_open(procedure.base):
            step = procedure.base.step
            console.print(f"{lead('Continue ')}{path}: {tr(step.title)}, {step.done}/{step.wanted}")
            if procedure.base.torn:
                console.show(procedure.base.torn)
            if warm is not None:
                procedure.note_temperature(now(), warm)
            return procedure
    return kind.start(site, replace(stated, temperature=warm), now())


def virtual_feed(script: CalibratingScript, source: str, speed: float) -> composition.Feed:
    """Return the virtual rig, here or on a virtual wire; InputError if a source plays no scenes."""
    scenes = composition.source_of(source).spec.scenes
    if scenes is None:
        possible = [
            spec for spec in composition.sources()
            if spec.scenes is not None and bool(spec.rig) is (script.tracker is not None)
        ]  # fmt: skip
        raise InputError(
            "calibrate.source",
            f"--source is {source!r}, which has no calibration scenes.",
            f"Give {composition.names_in_words(possible)}.",
        )
    return scenes(script, speed)


def real_feed(rig: Path, design: Rig, source: str, *, force: bool) -> composition.Feed:
    """Return the cameras on a network interface, or a recording."""
    request = composition.StationRequest(
        plan=composition.DEMO_PLAN, out=Path(), rig=rig, source=source, force=force
    )
    return composition.make_feed(request, load_plan(composition.DEMO_PLAN), design)


def make_recorder(feed: composition.Feed, path: Path | None, design: Rig) -> FrameRecorder | None:
    """Return a recorder of frames, None without a path; on OcmmError the source is closed."""
    if path is None:
        return None
    try:
        return FrameRecorder(path, feed.description, design)
    except BaseException:
        feed.ring.close()
        raise


def collect(
    procedure: guided.Procedure,
    feed: composition.Feed,
    frames: int | None,
    console: PlainConsole,
    recorder: FrameRecorder | None = None,
) -> None:
    """Record from a source as `record_observations`, and end it.

    ``recorder`` also receives all frames and is closed; its failure is printed, and the calibration
    continues. CalibrationError if the source ended before the last step; the session keeps the
    observations so far.
    """
    console.print(f"{lead('Source   ')}{feed.description.name}", highlight=True)
    interrupt = DeferredInterrupt(
        f"{tr('All observations are stored.')} "
        + tr("Start the command again: it continues this session.")
    )
    kept = recorder

    def keep(block: FrameBlock) -> None:
        nonlocal kept
        try:
            if kept is not None:
                kept.append(block)
        except AcquisitionError as error:
            kept = None
            console.print(
                f"{tr(error.what)} {tr('Calibration continues.')} {tr(error.remedy)}",
                highlight=True,
            )

    def status_line(view: guided.ProcedureView) -> str:
        title, hint = tr(view.step.title), view.live.hint
        return f"{title}: {tr(hint)}" if hint else title

    try:
        feed.acquisition.start()
        record_observations(procedure, feed, frames, console, interrupt, keep, status_line)
    finally:
        status = feed.end()
        if recorder is not None:
            recorder.close()
        interrupt.close()
    view = procedure.base
    if view.current < len(view.steps) - 1:
        hint = view.live.hint
        why = view.step.gate.reason
        if hint:
            # English, as all errors; translated as a whole when shown.
            why = tr_later(f"{view.step.gate.reason} At its end: {hint}")
        if status.internal:
            raise status.error(
                "calibrate.source", "All observations are stored: start the command again."
            )
        if status.stop_reason is StopReason.FAILED and status.message:
            why = status.message
        raise CalibrationError(
            "calibrate.incomplete",
            f"{view.step.title}: the source ended. {why}",
            "Start the command again: it continues this session.",
        )


def record_observations(
    procedure: guided.Procedure,
    feed: composition.Feed,
    frames: int | None,
    console: PlainConsole,
    interrupt: DeferredInterrupt,
    keep: Callable[[FrameBlock], None],
    status_line: Callable[[guided.ProcedureView], str],
) -> None:
    """Record available observations of a started source; enter each step whose gate opens.

    Ends at the last step or with the source; ``frames``: length of its script, None without end.
    Ctrl-C is obeyed between two blocks. ``keep`` receives all frames before they are evaluated,
    ``status_line`` returns the text of the progress bar.
    """
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    last = len(procedure.base.steps) - 1
    seen = 0
    warmth_at = 0.0
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("", total=None)
        while pass_open_gates(procedure) < last and not interrupt.check():
            stopped = read_status(feed.ring).state is AcquisitionState.STOPPED
            block = feed.ring.read(_BATCH)
            if time.monotonic() >= warmth_at:
                warmth_at = time.monotonic() + _WARMTH_S
                _record_temperature(procedure, feed)
            if block is not None:
                keep(block)
                procedure.watch(block)
                seen += len(block)
                if procedure.base.live.ready:
                    procedure.record(now())
                    retake_misplaced(procedure, console)
                view = procedure.base
                progress.update(
                    task, description=status_line(view), completed=view.step.done,
                    total=view.step.wanted or None,
                )  # fmt: skip
            elif stopped or (frames is not None and seen >= frames):
                break
            else:
                time.sleep(_IDLE_S)


def retake_misplaced(procedure: guided.Procedure, console: PlainConsole) -> None:
    """Reopen lines of a verification whose bar was misplaced; print which."""
    if not isinstance(procedure, VerificationProcedure):
        return
    for number, line in enumerate(procedure.view.lines):
        if line.hint:
            console.print(f"{lead('Again    ')}{line.name}: {tr(line.hint)}")
            procedure.repeat_line(number, now())


def _record_temperature(procedure: guided.Procedure, feed: composition.Feed) -> None:
    report = decode_report(feed.ring.report())
    if report is not None:
        procedure.record_temperature(now(), [camera.temperature_c for camera in report.cameras])


def pass_open_gates(procedure: guided.Procedure) -> int:
    """Enter every step whose gate is open, and return the index of the current one."""
    view = procedure.base
    while view.current < len(view.steps) - 1 and view.step.gate.open:
        if isinstance(procedure, RelocationProcedure) and view.step.name == BAR:
            procedure.predict()
            if not procedure.base.step.gate.open:
                break
        procedure.advance(now())
        view = procedure.base
    return view.current


def decide(
    procedure: guided.Procedure, accept: bool | None, reason: str, console: PlainConsole
) -> guided.ProcedureDecision:
    """Accept the result, keep the old one, or leave the session open for a later decision."""
    if accept is None and console.is_terminal:
        console.show("Accept it? [y/n] ", end="", highlight=True)
        accept = is_yes(console.input())
    if accept is None:
        console.show(f"Session  {procedure.base.session}: waiting for --accept or --keep.")
    else:
        # Ctrl-C has no effect until the decision is stored.
        with contextlib.closing(DeferredInterrupt()):
            (procedure.accept if accept else procedure.keep)(now(), reason)
    return procedure.base.decision


def is_yes(answer: str) -> bool:
    """Return whether an answer is yes, or "ja" in German."""
    return answer.strip().lower().startswith(("y", "j"))


def is_open(view: guided.ProcedureView) -> bool:
    """Return whether a session can be resumed: not ended, or accepted but not stored."""
    return view.decision is guided.ProcedureDecision.OPEN or (
        view.decision is guided.ProcedureDecision.ACCEPTED and not view.stored
    )


def now() -> datetime:
    return datetime.now(UTC)


def take_relocation_shots(procedure: RelocationProcedure, shots: Sequence[guided.Shot]) -> None:
    """Add recorded shots missing in a session; CalibrationError for kinds it does not have."""
    view = procedure.view
    ends = len([shot for shot in shots if shot.kind == "seat" and not shot.place])
    left = {
        "pose": view.poses,
        "bar": view.bar_placements,
        "end": min(2 * view.bar_placements, ends),
        "repeat": view.visits,
    }
    for shot in shots:
        kind = "end" if shot.kind == "seat" and not shot.place else shot.kind
        if left.get(kind, 0) > 0:
            left[kind] -= 1
        elif kind == "pose":
            procedure.take_pose(shot.uv, shot.sigma_px, now())
        elif kind == "bar":
            procedure.take_bar(shot.uv, shot.sigma_px, now())
        elif kind == "repeat":
            procedure.take_visit(shot.uv, shot.sigma_px, now())
        elif kind == "end":
            procedure.take_seat("", shot.uv, shot.sigma_px, now())
        elif kind == "seat":
            if shot.place not in view.world_points:
                procedure.take_seat(shot.place, shot.uv, shot.sigma_px, now())
        else:
            raise _strange(shot, "relocation")


def take_verification_shots(procedure: VerificationProcedure, shots: Sequence[guided.Shot]) -> None:
    """Add shots that a session lacks, entering their steps; CalibrationError if out of sequence."""
    view = procedure.view
    left = sum(step.done for step in view.base.steps)
    wanted = {"seats": "seat", "lines": "nest", "spheres": "sphere", "again": "seat"}
    pass_open_gates(procedure)
    for shot in shots[left:]:
        if shot.kind != wanted.get(procedure.base.step.name):
            raise _strange(shot, f"step '{procedure.base.step.title}'")
        procedure.take_shot(shot.uv, shot.sigma_px, now())
        pass_open_gates(procedure)


def _strange(shot: guided.Shot, where: str) -> CalibrationError:
    return CalibrationError(
        "calibrate.shots",
        f"The recorded shots contain one of kind '{shot.kind}', which does not belong in {where}.",
        "Give the shots of this procedure, in order.",
    )
