"""``ocmm calibrate``: cameras from known points, relocation, verification, their history."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ocmm_cli.calibrate._boards import calibrate_bundle
from ocmm_cli.calibrate._setup import CameraSetup, ProbeChoice
from ocmm_cli.terminal import (
    DeferredInterrupt,
    PlainConsole,
    lead,
    make_console,
    print_table_account,
    tr,
)
from ocmm_core.calibration.relocation import RelocationRequest
from ocmm_core.calibration.verification import Limits
from ocmm_core.composition import STANDARD_PROBE
from ocmm_core.errors import CalibrationError
from ocmm_core.tables import TableOptions

if TYPE_CHECKING:
    from ocmm_cli.calibrate._run import TerminalSite
    from ocmm_core.calibration import monitor
    from ocmm_core.calibration.cameras import KnownPoints, KnownPointsProcedure
    from ocmm_core.calibration.guided import Shot
    from ocmm_core.composition import Feed
    from ocmm_core.tracking import ProbeBody


calibrate_app = typer.Typer(
    no_args_is_help=True,
    help="Calibrate the cameras, recalibrate them in place, and verify the calibration.\n\nA "
    "new calibration is active as soon as it is accepted, and SUSPECT until 'verify' has "
    "passed. Every observation is stored at once: an interrupted command resumes where it "
    "stopped when started again.\n\nExit codes: 0 accepted (and passed), 1 old one kept, "
    "waiting, or failed, 2 could not run.",
)


calibrate_app.command("bundle")(calibrate_bundle)


@calibrate_app.command()
def cameras(
    *, points: Path, spots: Path | None, spot: TableOptions, evaluation: int | None,
    layout: TableOptions, overrule: str, setup: CameraSetup,
) -> None:  # fmt: skip
    """Calibrate all cameras from known points: a target is brought to every position of a list.

    Live, a point is taken as soon as the target rests at a new place, in the order of the list.
    """
    from ocmm_cli.calibrate import _run as run
    from ocmm_cli.calibrate import _steps as steps
    from ocmm_core.calibration.cameras import (
        KnownPointsProcedure,
        KnownPointsSetup,
        load_spots,
        read_reference_points,
    )
    from ocmm_core.tracking import load_probe

    console, site = make_console(), run.open_site(setup.rig, setup.calibrations)
    read = read_reference_points(points, layout)
    print_table_account(read.account)
    listed = read.points
    stated = KnownPointsSetup(who=setup.who, points=listed, evaluation=evaluation)
    place = site.of_cameras(site.design, load_probe(STANDARD_PROBE))
    procedure = run.opened(KnownPointsProcedure, place, stated, setup, console)
    _require_same_list(procedure, listed)
    if spots is not None:
        table = load_spots(spots, listed, spot)
        if table.account is not None:
            print_table_account(table.account)
        procedure.take_table(table, run.now())
        steps.require_end(procedure)
    elif steps.is_lacking(procedure):
        steps.collect_from(
            procedure, site, setup, STANDARD_PROBE,
            lambda sim, at: sim.scenes_of_known_points(at, procedure.view, procedure.points),
            console, setup.move,
        )  # fmt: skip
    steps.conclude(procedure, site, setup, overrule, "calibrated from known points", console)


@calibrate_app.command()
def relocate(
    *, bar: Path, shots: Path | None, spot: TableOptions, control: Path | None,
    layout: TableOptions, request: RelocationRequest, choice: ProbeChoice, overrule: str,
    setup: CameraSetup,
) -> None:  # fmt: skip
    """Calibrate cameras that were moved, without a CMM: wave the probe, show the bar.

    Two cones that are fixed to the table are visited first and last: what moved meanwhile shows.
    """
    from ocmm_cli.calibrate import _run as run
    from ocmm_cli.calibrate import _steps as steps
    from ocmm_core.calibration.cameras import read_reference_points
    from ocmm_core.calibration.guided import load_shots
    from ocmm_core.calibration.records import load_bar
    from ocmm_core.calibration.relocation import RelocationProcedure, RelocationSetup

    console, site = make_console(), run.open_site(setup.rig, setup.calibrations)
    body, artefact = steps.body_in_use_of(setup.source, choice), load_bar(bar)
    known = None
    if control is not None:
        read = read_reference_points(control, layout)
        print_table_account(read.account)
        known = read.points
    recorded: tuple[Shot, ...] = ()
    if shots is not None:
        table = load_shots(shots, site.rig, body.n_leds, spot)
        print_table_account(table.account)
        recorded = table.shots
    seats = _has_seats(setup.source, recorded, seats=request.seats)
    stated = RelocationSetup(
        who=setup.who, bar=artefact, control=known, request=replace(request, seats=seats)
    )
    place = site.of_cameras(site.rig, body)
    procedure = run.opened(RelocationProcedure, place, stated, setup, console)
    if shots is not None:
        run.take_relocation_shots(procedure, recorded)
        steps.require_end(procedure)
    elif steps.is_lacking(procedure):
        steps.collect_from(
            procedure, site, setup, choice.probe,
            lambda sim, at: tuple(sim.relocation_by_step(
                at, site.design, procedure.view, procedure.bar, procedure.control
            ).values()),
            console, setup.move,
        )  # fmt: skip
    steps.conclude(procedure, site, setup, overrule, "relocated", console)


@calibrate_app.command()
def verify(
    *, bar: Path, sphere: list[Path] | None, two_places: bool, excuse: list[str] | None,
    shots: Path | None, spot: TableOptions, limits: Limits, choice: ProbeChoice,
    setup: CameraSetup,
) -> None:  # fmt: skip
    """Verify the calibration in force with a bar along seven lines, and with spheres.

    Two cones that are fixed to the table are visited first and last: what moved meanwhile shows.
    """
    from ocmm_cli.calibrate import _run as run
    from ocmm_cli.calibrate import _steps as steps
    from ocmm_cli.calibrate._report import print_status, print_verification
    from ocmm_core.calibration.guided import load_shots
    from ocmm_core.calibration.records import load_bar, load_sphere
    from ocmm_core.calibration.verification import VerificationProcedure, VerificationSetup

    console, site = make_console(), run.open_site(setup.rig, setup.calibrations)
    body, artefact = steps.body_in_use_of(setup.source, choice), load_bar(bar)
    stated = VerificationSetup(
        who=setup.who, bar=artefact, spheres=tuple(load_sphere(path) for path in sphere or ()),
        two_places=two_places, limits=limits,
    )  # fmt: skip
    place = site.of_cameras(site.rig, body)
    procedure = run.opened(VerificationProcedure, place, stated, setup, console)
    for one in excuse or ():
        corner, _, reason = one.partition(":")
        procedure.excuse_corner(corner, reason, run.now())
    run.retake_misplaced(procedure, console)
    if shots is not None:
        recorded = load_shots(shots, site.rig, body.n_leds, spot)
        print_table_account(recorded.account)
        run.take_verification_shots(procedure, recorded.shots)
        steps.require_end(procedure)
    elif steps.is_lacking(procedure):
        steps.collect_from(
            procedure, site, setup, choice.probe,
            lambda sim, at: sim.scenes_of_verification(
                at, site.rig, procedure.view, procedure.bar, procedure.spheres
            ),
            console, setup.move,
        )  # fmt: skip
    procedure.compute()
    outcome = procedure.view.outcome
    if outcome is not None:
        print_verification(console, outcome)
    code = steps.decided_code(procedure, setup.decision, "verified", console)
    print_status(console, site.document, site.calibrations, run.now())
    raise typer.Exit(1 if outcome is None or not outcome.record.passed else code)


@calibrate_app.command()
def sensors(
    *, seconds: float, source: str, rig: Path, choice: ProbeChoice, calibrations: Path | None,
    seed: int, move: int | None, speed: float, force: bool,
) -> None:  # fmt: skip
    """Learn the pattern of the sensors, so that a pushed camera is noticed sooner.

    Wave the probe through the whole volume right after a verification has passed. Without this,
    only larger pushes are noticed within seconds.
    """
    from ocmm_cli.calibrate._run import now, open_site, real_feed, virtual_feed
    from ocmm_cli.calibrate._steps import body_in_use_of
    from ocmm_core.calibration import monitor
    from ocmm_core.composition import Origin, origin_of

    console, site = make_console(), open_site(rig, calibrations)
    body = body_in_use_of(source, choice)
    status = site.store.status(now())
    calibration = site.store.active_hash
    if calibration is None or not status.state.usable:
        # A moved camera must not be learned: the baseline belongs to the calibration in force.
        raise CalibrationError(
            "baseline.standing",
            f"The calibration is {status.state.value}: {status.reason}",
            status.remedy,
        )
    if origin_of(source) is Origin.VIRTUAL:
        from ocmm_sim.calibration_scenes import WAY_S, FreeMotionScene
        from ocmm_sim.sources import VirtualSite

        scenes = (FreeMotionScene(ways=round(seconds / WAY_S), seed=seed),)
        feed = virtual_feed(
            VirtualSite(rig, choice.probe, seed, move).script(scenes), source, speed
        )
    else:
        feed = real_feed(rig, site.read_by, source, force=force)
    baseline = monitor.learn_baseline(_wave(site, body, feed, seconds, console), site.rig, body)
    path = monitor.save_baseline(site.store.folder, baseline, calibration, body.identity)
    whole = site.rig.noise.pattern_px
    console.show(
        f"Sensors  {baseline.looks} samples; pattern {whole:.4f} px, residual "
        f"{baseline.left_px:.4f} px"
    )
    console.print(f"{lead('Baseline ')}{path}")


@calibrate_app.command()
def status(*, rig: Path, calibrations: Path | None) -> None:
    """Say which calibration of a rig is in force, whether it is whole, and whether it may be used.

    All files that it rests on are read again. Exit code 1 where points may not be taken.
    """
    from ocmm_cli.calibrate._report import print_status
    from ocmm_cli.calibrate._run import now
    from ocmm_core.calibration.records import default_folder

    usable = print_status(make_console(), rig, calibrations or default_folder(), now())
    raise typer.Exit(0 if usable else 1)


@calibrate_app.command()
def history(*, rig: Path, calibrations: Path | None) -> None:
    """List what happened to the calibrations of a rig."""
    from ocmm_cli.calibrate._report import print_history
    from ocmm_cli.calibrate._run import open_site

    print_history(make_console(), open_site(rig, calibrations).store)


def _require_same_list(procedure: KnownPointsProcedure, listed: KnownPoints) -> None:
    """Raise if a resumed session was started with another list."""
    import numpy as np

    begun = procedure.points
    same = begun.names == listed.names and np.array_equal(
        begun.positions_world, listed.positions_world
    )
    if not same:
        raise CalibrationError(
            "calibrate.points",
            f"Session {procedure.base.session} was started with another list of points.",
            "Give that list, or start a new session with --new.",
        )


def _has_seats(source: str, recorded: Sequence[Shot], *, seats: bool) -> bool:
    """Return whether two seats are visited first and last; only recordings may lack them."""
    from ocmm_core.composition import Origin, origin_of

    if recorded:
        return any(shot.kind == "repeat" for shot in recorded)
    if not seats and origin_of(source) is not Origin.RECORDING:
        raise CalibrationError(
            "calibrate.seats",
            "--no-seats is only for recordings without seats, and the source is not a recording.",
            "Omit it, and visit two cones fixed to the table first and last.",
        )
    return seats


_LOOK_NS = 10_000_000
_BATCH = 800
_IDLE_S = 0.005


def _wave(
    site: TerminalSite, body: ProbeBody, feed: Feed, seconds: float, console: PlainConsole
) -> list[monitor.ResidualSample]:
    """Return samples of the probe over ``seconds`` of bus time, or until the source ends."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from ocmm_core.acquisition.frames import AcquisitionState, read_status
    from ocmm_core.calibration import monitor
    from ocmm_core.tracking import TrackingPipeline

    pipeline = TrackingPipeline(site.rig, body)
    collector = monitor.ResidualAccumulator(site.rig, body, _LOOK_NS)
    looks: list[monitor.ResidualSample] = []
    left = round(seconds * 1e9 / feed.description.frame_period_ns)
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    console.print(f"{lead('Source   ')}{feed.description.name}", highlight=True)
    interrupt = DeferredInterrupt()
    try:
        with Progress(*columns, console=console, transient=True) as progress:
            task = progress.add_task(tr("Wave the probe through the whole volume"), total=left)
            feed.acquisition.start()
            while left > 0 and not interrupt.check():
                stopped = read_status(feed.ring).state is AcquisitionState.STOPPED
                block = feed.ring.read(min(_BATCH, left))
                if block is not None:
                    looks += collector.push(pipeline.process(block))
                    left -= len(block)
                    progress.advance(task, len(block))
                elif stopped:
                    break
                else:
                    time.sleep(_IDLE_S)
    finally:
        feed.end()
        interrupt.close()
    return looks
