"""Steps of all guided procedures: site of a probe, frames, conclusion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from ocmm_cli.calibrate import _run as run
from ocmm_cli.calibrate._report import print_calibration, print_status
from ocmm_cli.calibrate._setup import ProbeChoice, ProbeSetup, Setup
from ocmm_cli.calibrate._write_cameras import write_accepted
from ocmm_cli.terminal import PlainConsole, error_text, lead, make_console, tr, tr_word
from ocmm_core.calibration import records
from ocmm_core.calibration.cameras import KnownPointsProcedure
from ocmm_core.calibration.guided import Procedure, ProcedureDecision, SessionSite
from ocmm_core.calibration.relocation import RelocationProcedure
from ocmm_core.camera import load_rig
from ocmm_core.composition import (
    Origin,
    checked_for_replay,
    choose_calibration,
    choose_probe,
    origin_of,
)
from ocmm_core.errors import CalibrationError
from ocmm_core.tracking import ProbeBody, load_probe

if TYPE_CHECKING:
    from ocmm_sim.calibration_scenes import Scene
    from ocmm_sim.sources import VirtualSite


@dataclass(frozen=True, slots=True)
class TerminalProbeSite:
    """Resources of a session about a probe."""

    site: run.TerminalSite
    """Cameras, with the folder of sessions about the probe."""
    cameras: records.CalibrationInUse
    """State of their calibration."""
    body: ProbeBody
    store: records.ProbeStore

    @property
    def of_probe(self) -> SessionSite:
        """Return the site of a procedure for the probe."""
        return SessionSite(
            self.site.sessions, self.site.rig, self.body, self.store.folder, self.site.store.folder
        )


def open_probe_site(setup: ProbeSetup, console: PlainConsole) -> TerminalProbeSite:
    """Return cameras and records of a probe.

    InputError for a wrong document, CalibrationError without usable calibration of the cameras.
    """
    body, design = load_probe(setup.probe), load_rig(setup.rig)
    cameras = choose_calibration(
        setup.source, setup.rig, setup.calibrations, uncalibrated=setup.uncalibrated
    )
    require_cameras(cameras, console)
    folder = setup.probes or own_folder(setup.source)
    store = records.ProbeStore(records.probe_store_folder(folder, body.name))
    root = setup.calibrations or records.default_folder()
    of_cameras = records.CalibrationStore(records.store_folder(root, design.name))
    sessions = store.folder / run.SESSIONS
    site = run.TerminalSite(design, cameras.rig, setup.rig, root, of_cameras, sessions)
    return TerminalProbeSite(site, cameras, body, store)


def own_folder(source: str) -> Path:
    """Return the default folder of records; virtual probes have their own."""
    folder = records.default_probe_folder()
    return folder.with_name("virtual-probes") if origin_of(source) is Origin.VIRTUAL else folder


def require_cameras(cameras: records.CalibrationInUse, console: PlainConsole) -> None:
    """Refuse cameras without a usable calibration, and print warnings."""
    view = records.judge(cameras, run.now())
    unusable = cameras.fault is not None or view.word is records.CalibrationStatus.UNUSABLE
    if unusable and view.blocking_reason is not None:
        raise CalibrationError(
            "calibrate.cameras",
            f"The cameras cannot be used: {view.blocking_reason.what}",
            view.blocking_reason.remedy,
        )
    if view.blocker is not None:
        console.print(
            f"{lead('Cameras  ')}{tr_word(view.word.value)}: {error_text(view.blocker)}",
            style="yellow",
            highlight=True,
        )


def is_lacking(procedure: Procedure) -> bool:
    """Return whether observations are missing."""
    return run.pass_open_gates(procedure) < len(procedure.base.steps) - 1


def require_end(procedure: Procedure) -> None:
    """Raise CalibrationError if recorded data do not suffice."""
    if is_lacking(procedure):
        gate = procedure.base.step.gate
        raise CalibrationError("calibrate.incomplete", gate.reason, gate.remedy)


def collect_from(
    procedure: Procedure,
    site: run.TerminalSite,
    setup: Setup,
    probe: Path,
    scenes: Callable[[Any, VirtualSite], tuple[Scene, ...]],
    console: PlainConsole,
    move: int | None = None,
    cameras: records.CalibrationInUse | None = None,
) -> None:
    """Record from a source, a virtual one by its scenes, and keep its frames if wanted.

    ``scenes`` is called with `ocmm_sim.sources`, which is imported for virtual sources only.
    CalibrationError if a recording of real ``cameras`` has no known calibration, or the source
    ended before the last step.
    """
    frames = None
    if origin_of(setup.source) is Origin.VIRTUAL:
        from ocmm_sim import sources

        markers = site.rig.markers
        document = None if markers is None else markers.document
        virtual = sources.VirtualSite(site.document, probe, setup.seed, move, document)
        script = virtual.script(scenes(sources, virtual))
        frames = script.build().n_frames
        feed = run.virtual_feed(script, setup.source, setup.speed)
    else:
        feed = run.real_feed(site.document, site.read_by, setup.source, force=setup.force)
    if cameras is not None:
        try:
            require_cameras(checked_for_replay(cameras, feed.recorded), console)
        except BaseException:
            feed.ring.close()
            raise
    run.collect(
        procedure, feed, frames, console, run.make_recorder(feed, setup.record, site.read_by)
    )


def decided_code(
    procedure: Procedure, decision: bool | None, reason: str, console: PlainConsole
) -> int:
    """Decide on the result, and return the exit code."""
    made = run.decide(procedure, decision, reason, console)
    return 0 if made is ProcedureDecision.ACCEPTED else 1


def conclude(
    procedure: KnownPointsProcedure | RelocationProcedure,
    site: run.TerminalSite,
    setup: Setup,
    overrule: str,
    reason: str,
    console: PlainConsole,
) -> None:
    """Compute, overruling the guards if a reason is given; decide, and exit if nothing is accepted.

    An accepted calibration is written into real cameras; virtual ones lose it when they end.
    """
    if overrule and procedure.base.decision is ProcedureDecision.OPEN:
        procedure.force(run.now(), overrule)
    procedure.compute()
    outcome = procedure.view.outcome
    if outcome is not None:
        print_calibration(console, outcome)
    code = decided_code(procedure, setup.decision, reason, console)
    print_status(console, site.document, site.calibrations, run.now())
    if code:
        raise typer.Exit(code)
    site.store.refresh()
    record = site.store.active()
    if record is not None and origin_of(setup.source) is Origin.CAMERAS:
        write_accepted(record, setup.source, setup.rig, console, force=setup.force)


def body_in_use_of(source: str, choice: ProbeChoice) -> ProbeBody:
    """Return the probe by the records of its tip, or by its document if there are none.

    CalibrationError if records, or files they need, are damaged, or a named tip has none.
    """
    in_use = choose_probe(source, choice.probe, choice.probes, choice.tip, uncalibrated=False)
    if in_use.fault is not None and (
        choice.tip is not None or in_use.fault[0] is not records.CalibrationStatus.NONE
    ):
        records.require_records(in_use)
    if in_use.records is not None:
        defect = None if in_use.store is None else in_use.store.defect(in_use.tip, thorough=True)
        if defect is not None:
            raise defect
        view = records.judge(in_use, run.now())
        make_console().print(f"{lead('Probe  ')}{tr(view.label)}")
    return in_use.body
