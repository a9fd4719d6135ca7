"""``ocmm calibrate probe``: the geometry of a probe and its tip, from two sweeps in a cone.

Also ``probe-status``, ``probe-history`` and ``mount-tip``: the tips of a probe.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from msgspec.structs import replace

from ocmm_cli.calibrate._setup import ProbeSetup
from ocmm_cli.terminal import (
    PlainConsole,
    heads,
    lead,
    make_console,
    print_grid,
    print_table_account,
    tr,
    tr_word,
)
from ocmm_core.calibration.sweeping import PivotRequest
from ocmm_core.documents import resource
from ocmm_core.errors import CalibrationError
from ocmm_core.tables import TableOptions

if TYPE_CHECKING:
    from ocmm_cli.calibrate._steps import TerminalProbeSite
    from ocmm_core.calibration.pivot import PivotSweep
    from ocmm_core.calibration.records import ProbeStore, TipState
    from ocmm_core.calibration.sweeping import PivotProcedure
    from ocmm_sim.calibration_scenes import SweepProbe
    from ocmm_sim.sources import VirtualSite


_FIRST_CONE, _SECOND_CONE = (0.0, 0.0, -150.0), (70.0, 10.0, -130.0)
_OTHER_PROBE = resource("probes", "thesis.toml")
_SECONDS, _SECONDS_PER_POSE = 10.0, 0.0375
"""A swept probe gives about forty poses per second, and needs time to reach all sides."""

_REST_S = 3.0
_RANGES = (30.0, 30.0, 13.0)


def probe_command(
    *, tip: str, sweeps: Path | None, spot: TableOptions, request: PivotRequest, because: str,
    overrule: str, anew: bool, setup: ProbeSetup,
) -> None:  # fmt: skip
    """Calibrate a probe: its ball rests in a cone and it is swept about it, in two places.

    A sweep begins when the ball rests in the cone, and ends when enough was seen. Then lift the
    ball out, leave the cone, and sweep in another one: the second sweep must show the same tip. At
    the end the ball rests in the first cone once more: what moved meanwhile shows.
    """
    from ocmm_cli.calibrate import _run as run
    from ocmm_cli.calibrate import _steps as steps
    from ocmm_cli.calibrate._tip_report import print_probe, print_tip_status
    from ocmm_core.calibration.guided import ProcedureDecision
    from ocmm_core.calibration.pivot import load_sweeps
    from ocmm_core.calibration.sweeping import PivotProcedure, PivotSetup

    console = make_console()
    place = steps.open_probe_site(setup, console)
    site, body, store = place.site, place.body, place.store
    again = _has_again(setup.source, sweeps, again=request.again)
    stated = PivotSetup(who=setup.who, tip=tip, request=dataclasses.replace(request, again=again))
    procedure = run.opened(PivotProcedure, place.of_probe, stated, setup, console)
    if anew and procedure.base.decision is ProcedureDecision.OPEN:
        procedure.sweep_anew(run.now())
    if overrule and procedure.base.decision is ProcedureDecision.OPEN:
        procedure.force(run.now(), overrule)
    if sweeps is not None:
        table = load_sweeps(sweeps, site.rig, body.n_leds, spot)
        print_table_account(table.account)
        _take_recorded(procedure, table.sweeps)
    elif steps.is_lacking(procedure):
        _collect(procedure, place, setup, console)
    procedure.compute()
    outcome = procedure.view.outcome
    if outcome is not None:
        print_probe(console, outcome)
    made = run.decide(procedure, setup.decision, because, console)
    if made is ProcedureDecision.ACCEPTED:
        store.refresh()
        console.print(f"{lead('Record   ')}{store.folder}: {store.active_hash(tip)}")
    print_tip_status(console, store, tip, run.now())
    if made is not ProcedureDecision.ACCEPTED:
        raise typer.Exit(1)


def virtual_sweeps(scene: str, step: str, seed: int, poses: int) -> tuple[SweepProbe, ...]:
    """Return the sweeps that a session in ``step`` still lacks, for the virtual hand."""
    from ocmm_core.calibration.sweeping import AGAIN, SECOND
    from ocmm_sim.calibration_scenes import ScriptedJump, SweepProbe

    seconds = _SECONDS + _SECONDS_PER_POSE * poses
    first = SweepProbe(cone=_FIRST_CONE, seconds=seconds, seed=seed, reach_deg=_RANGES)
    if scene == "slack":
        first = replace(first, slack_mm=0.003)
    elif scene == "pushed":
        first = replace(first, jumps=(ScriptedJump(at_s=5.0, shift_mm=(0.1, 0.05, 0.0)),))
    elif scene == "narrow":
        first = replace(first, reach_deg=(6.0, 6.0, 3.0))
    elif scene == "hidden-led":
        first = replace(first, hidden=(1,))
    elif scene == "other-tip":
        first = replace(first, tip_shift_mm=(0.8, -0.3, 2.0))
    second = replace(first, seed=seed + 1)
    if scene != "same-place":
        second = replace(second, cone=_SECOND_CONE)
    # Held still and upright, as at the start.
    end = first.jumps[-1].shift_mm if first.jumps else (0.0, 0.0, 0.0)
    cone = (_FIRST_CONE[0] + end[0], _FIRST_CONE[1] + end[1], _FIRST_CONE[2] + end[2])
    again = replace(first, cone=cone, seconds=_REST_S, reach_deg=(0.0, 0.0, 0.0), jumps=())
    if step == AGAIN:
        return (again,)
    return (second, again) if step == SECOND else (first, second, again)


def _has_again(source: str, sweeps: Path | None, *, again: bool) -> bool:
    """Return whether the first cone is visited again; only recordings may lack it."""
    from ocmm_core.composition import Origin, origin_of

    if sweeps is not None:
        return False
    if not again and origin_of(source) is not Origin.RECORDING:
        raise CalibrationError(
            "calibrate.again",
            (
                "--no-again is only for recordings without the return visit, and the source "
                "is not a recording."
            ),
            "Omit it, and put the ball back into the first cone at the end.",
        )
    return again


def _take_recorded(procedure: PivotProcedure, sweeps: Sequence[PivotSweep]) -> None:
    """Take recorded sweeps that the session does not have yet."""
    from ocmm_cli.calibrate._run import now, pass_open_gates
    from ocmm_core.calibration.sweeping import SWEEPS

    pass_open_gates(procedure)
    for name, sweep in zip(SWEEPS, sweeps, strict=True):
        view = procedure.view
        if view.base.step.name != name:
            continue
        taken = view.sweep.poses if view.sweep is not None else 0
        left = sweep.uv[taken:]
        if len(left):
            procedure.take_sweep(left, float(sweep.sigma_px[0]), now())
        if not procedure.base.step.gate.open:
            procedure.end_sweep(now())
        pass_open_gates(procedure)


def _collect(
    procedure: PivotProcedure, place: TerminalProbeSite, setup: ProbeSetup, console: PlainConsole
) -> None:
    from ocmm_cli.calibrate._run import now
    from ocmm_cli.calibrate._steps import collect_from, is_lacking
    from ocmm_core.calibration.sweeping import SECOND

    def scenes(_sim: object, _virtual: VirtualSite) -> tuple[SweepProbe, ...]:
        step, wanted = procedure.base.step.name, procedure.view.first.poses_wanted
        return virtual_sweeps(setup.scene, step, setup.seed, wanted)

    probe = _OTHER_PROBE if setup.scene == "other-probe" else setup.probe
    try:
        collect_from(procedure, place.site, setup, probe, scenes, console, cameras=place.cameras)
    except CalibrationError:
        # If a person overruled the guards, the last sweep may end with the poses it has.
        sweep = procedure.view.sweep
        if sweep is None or procedure.base.step.name != SECOND or not sweep.may_end:
            raise
        procedure.end_sweep(now())
        if is_lacking(procedure):
            # The recording covers the sweeps; the final visit comes after it.
            _collect(procedure, place, dataclasses.replace(setup, record=None), console)


def probe_status(*, probe: Path, probes: Path | None) -> None:
    """Say which tip is on the probe, and whether it and the others may be used.

    Exit code 1 where points may not be taken with the mounted tip.
    """
    from ocmm_cli.calibrate._report import evidence_words
    from ocmm_core.calibration.records import State, probe_overview
    from ocmm_core.tracking import load_probe

    console, store = make_console(), _store(probe, probes)
    found = probe_overview(store, datetime.now(UTC))
    console.show_line(f"Probe    {load_probe(probe).name}, by {probe}")
    console.print_line(f"{lead('Folder   ')}{store.folder}")
    if found.fault:
        console.print_line(f"{lead('Records  ')}{tr('cannot be used.')} {tr(found.fault)}")
        raise typer.Exit(1)
    if not found.tips:
        console.show_line(f"Tips     none: probe never calibrated ({store.folder}).")
        raise typer.Exit(1)
    for state in found.tips:
        _print_tip(console, state)
        if state.status.state is not State.UNUSABLE:
            console.print_line(f"{lead('Evidence ')}{evidence_words(store, state.tip)}")
    mounted = found.tips[0]
    raise typer.Exit(0 if mounted.mounted and mounted.status.state.usable else 1)


def probe_history(*, probe: Path, probes: Path | None) -> None:
    """List what happened to a probe and its tips."""
    rows = []
    for event in _store(probe, probes).events:
        since = tr(f" Good until {event.since_utc[:19]}.") if event.since_utc else ""
        lost = tr(f" Lost before: {', '.join(event.lost)}.") if event.lost else ""
        rows.append((
            event.utc[:19], event.tip, event.kind.value, event.record[:12], event.who,
            f"{event.reason}{since}{lost}",
        ))  # fmt: skip
    columns = heads("UTC", "Tip", "What", "Record", "Who", "Reason")
    print_grid(make_console(), columns, rows, tr_word("History"))


def mount_tip(tip: str, *, probe: Path, probes: Path | None, who: str) -> None:
    """Say that a tip, maybe the same one again, was screwed on; it must be checked.

    No points are taken until 'ocmm calibrate check-tip' has passed.
    """
    store = _store(probe, probes)
    store.mount(tip, who, datetime.now(UTC))
    status = store.status(tip, datetime.now(UTC))
    mounted = tr(f"Tip '{tip}' is mounted.")
    make_console().print_line(f"{mounted} {tr(status.reason)} {tr(status.remedy)}".rstrip())


def _store(probe: Path, folder: Path | None) -> ProbeStore:
    from ocmm_core.calibration.records import ProbeStore, default_probe_folder, probe_store_folder
    from ocmm_core.tracking import load_probe

    place = folder if folder is not None else default_probe_folder()
    return ProbeStore(probe_store_folder(place, load_probe(probe).name))


def _print_tip(console: PlainConsole, state: TipState) -> None:
    from ocmm_core.calibration.records import record_hash

    record, qualified, status = state.calibration, state.qualification, state.status
    on = tr("mounted") if state.mounted else tr("not mounted")
    console.show_line(f"Tip      {state.tip} ({on})")
    console.print_line(f"{lead('State    ')}{tr_word(status.state.value)}")
    if status.reason:
        console.print_line(f"         {tr(status.reason)} {tr(status.remedy)}")
    if status.since_utc:
        console.show_line(f"         Points since {status.since_utc[:19]} UTC are suspect.")
    console.show_line(
        f"Record   {record_hash(record)}\n         calibrated {record.made_utc[:19]} UTC by "
        f"{record.made_by}{_warmth(record.temperature_c)}, valid until "
        f"{record.valid_until_utc[:10]}"
    )
    if qualified is not None:
        console.show_line(
            f"Ball     {qualified.diameter_mm:.4f} mm, U = {2e3 * qualified.diameter_sigma_mm:.1f} "
            f"um (k = 2), form {1e3 * qualified.form_mm:.1f} um\n         qualified "
            f"{qualified.made_utc[:19]} UTC by {qualified.made_by}"
            f"{_warmth(qualified.temperature_c)}, valid until {qualified.valid_until_utc[:10]}"
        )
    if state.check is not None:
        verdict = "passed" if state.check.passed else "FAILED"
        console.show_line(f"Checked  {state.check.made_utc[:19]} UTC: {verdict}")


def _warmth(celsius: float | None) -> str:
    return "" if celsius is None else " " + tr(f"at {celsius:.1f} C")
