from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.console import Console

from ocmm_cli.calibrate._feed_options import FeedOptions
from ocmm_cli.calibrate._report import print_status
from ocmm_cli.calibrate._run import (
    TerminalSite,
    collect,
    decide,
    make_recorder,
    pass_open_gates,
    real_feed,
    virtual_feed,
)
from ocmm_cli.calibrate._write_cameras import write_accepted
from ocmm_cli.terminal import lead, make_console, say
from ocmm_core.calibration.cameras import KnownPointsProcedure
from ocmm_core.calibration.guided import Procedure, ProcedureDecision
from ocmm_core.calibration.records import CalibrationStatus, judge, require_records
from ocmm_core.calibration.relocation import RelocationProcedure
from ocmm_core.composition import Origin, choose_probe, origin_of
from ocmm_core.errors import CalibrationError
from ocmm_core.tracking import ProbeBody

if TYPE_CHECKING:
    from ocmm_sim.calibration_scenes import Scene
    from ocmm_sim.sources import VirtualSite


def is_lacking(procedure: Procedure) -> bool:
    """Return whether observations are missing."""
    return pass_open_gates(procedure) < len(procedure.base.steps) - 1


def require_end(procedure: Procedure) -> None:
    """Raise CalibrationError if recorded data do not suffice."""
    if is_lacking(procedure):
        gate = procedure.base.step.gate
        raise CalibrationError("calibrate.incomplete", gate.reason, gate.remedy)


def collect_from(
    procedure: Procedure,
    site: TerminalSite,
    source: str,
    probe: Path,
    scenes: Callable[[VirtualSite], tuple[Scene, ...]],
    options: FeedOptions,
    console: Console,
) -> None:
    """Record from a source, a virtual one by its scenes, and keep its frames if wanted."""
    frames = None
    if origin_of(source) is Origin.VIRTUAL:
        from ocmm_sim.sources import VirtualSite

        virtual = VirtualSite(site.document, probe, options.seed, options.move)
        script = virtual.script(scenes(virtual))
        frames = script.build().n_frames
        feed = virtual_feed(script, source, options.speed)
    else:
        feed = real_feed(site.document, site.design, source, force=options.force)
    collect(procedure, feed, frames, console, make_recorder(feed, options.record, site.design))


def compute(procedure: KnownPointsProcedure | RelocationProcedure, overrule: str) -> None:
    """Compute the result, overruling the guards if a reason is given."""
    if overrule and procedure.base.decision is ProcedureDecision.OPEN:
        procedure.force(now(), overrule)
    procedure.compute()


def decided_code(procedure: Procedure, decision: bool | None, reason: str, console: Console) -> int:
    """Decide on the result, and return the exit code."""
    made = decide(procedure, decision, reason, console)
    return 0 if made is ProcedureDecision.ACCEPTED else 1


def finish(
    procedure: Procedure, site: TerminalSite, decision: bool | None, reason: str, console: Console
) -> None:
    """Decide, print the calibration in force, and exit if nothing was accepted."""
    code = decided_code(procedure, decision, reason, console)
    print_status(console, site.document, site.calibrations, now())
    if code:
        raise typer.Exit(code)


def store_in_cameras(
    site: TerminalSite, source: str, rig: Path, force: bool, console: Console
) -> None:
    """Write an accepted calibration into real cameras; virtual ones lose it when they end."""
    record = site.store.active()
    if record is not None and origin_of(source) is Origin.CAMERAS:
        write_accepted(record, source, rig, console, force=force)


def body_in_use_of(source: str, probe: Path, probes: Path | None, tip: str | None) -> ProbeBody:
    """Return the probe by the records of its tip, or by its document if there are none.

    CalibrationError if records, or files they need, are damaged, or a named tip has none.
    """
    in_use = choose_probe(source, probe, probes, tip, uncalibrated=False)
    if in_use.fault is not None and (
        tip is not None or in_use.fault[0] is not CalibrationStatus.NONE
    ):
        require_records(in_use)
    if in_use.records is not None:
        defect = None if in_use.store is None else in_use.store.defect(in_use.tip, thorough=True)
        if defect is not None:
            raise defect
        view = judge(in_use, now())
        make_console().print(f"{lead('Probe  ')}{say(view.label)}", highlight=False)
    return in_use.body


def now() -> datetime:
    return datetime.now(UTC)
