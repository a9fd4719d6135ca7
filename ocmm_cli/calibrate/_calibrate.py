"""``ocmm calibrate``: cameras from known points, relocation, verification, their history."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ocmm_cli.calibrate._feed_options import FeedOptions
from ocmm_cli.calibrate._relocate import relocate
from ocmm_cli.calibrate._verify import verify
from ocmm_cli.terminal import make_console, print_table_account
from ocmm_core.composition import STANDARD_PROBE
from ocmm_core.errors import CalibrationError
from ocmm_core.tables import TableOptions

if TYPE_CHECKING:
    from ocmm_core.calibration.cameras import KnownPoints, KnownPointsProcedure
    from ocmm_sim.calibration_scenes import Scene
    from ocmm_sim.sources import VirtualSite


calibrate_app = typer.Typer(
    no_args_is_help=True,
    help="Calibrate the cameras, recalibrate them in place, and verify the calibration.\n\nA "
    "new calibration is active as soon as it is accepted, and SUSPECT until 'verify' has "
    "passed. Every observation is stored at once: an interrupted command resumes where it "
    "stopped when started again.\n\nExit codes: 0 accepted (and passed), 1 old one kept, "
    "waiting, or failed, 2 could not run.",
)


@calibrate_app.command()
def cameras(
    *, points: Path, spots: Path | None, spot: TableOptions,
    evaluation: int | None, layout: TableOptions, source: str,
    rig: Path, calibrations: Path | None, who: str, temperature: float | None, temperature_u: str,
    decision: bool | None, overrule: str, new: bool, feed: FeedOptions,
) -> None:  # fmt: skip
    """Calibrate all cameras from known points: a target is brought to every position of a list.

    Live, a point is taken as soon as the target rests at a new place, in the order of the list.
    """
    from ocmm_cli.calibrate._report import print_calibration
    from ocmm_cli.calibrate._run import continued, open_site
    from ocmm_cli.calibrate._steps import (
        collect_from,
        compute,
        finish,
        is_lacking,
        now,
        require_end,
        store_in_cameras,
    )
    from ocmm_core.acceptance import read_temperature
    from ocmm_core.calibration.cameras import (
        KnownPointsProcedure,
        load_spots,
        read_reference_points,
    )
    from ocmm_core.calibration.guided import ProcedureKind

    console, site = make_console(), open_site(rig, calibrations)
    read = read_reference_points(points, layout)
    print_table_account(read.account)
    listed = read.points
    warm = read_temperature(temperature, temperature_u, now())
    procedure = continued(
        site,
        ProcedureKind.KNOWN_POINTS,
        lambda path: KnownPointsProcedure.resume(path, site.design, site.store),
        console,
        warm,
        new=new,
    )
    if procedure is None:
        procedure = KnownPointsProcedure.begin(
            site.sessions, site.design, site.store, listed, now(),
            who=who, temperature=warm, evaluation=evaluation,
        )  # fmt: skip
    _require_same_list(procedure, listed)
    if spots is not None:
        table = load_spots(spots, listed, spot)
        if table.account is not None:
            print_table_account(table.account)
        procedure.take_table(table, now())
        require_end(procedure)
    elif is_lacking(procedure):

        def scenes(virtual: VirtualSite) -> tuple[Scene, ...]:
            from ocmm_sim.sources import scenes_of_known_points

            return scenes_of_known_points(virtual, procedure.view, procedure.points)

        collect_from(procedure, site, source, STANDARD_PROBE, scenes, feed, console)
    compute(procedure, overrule)
    outcome = procedure.view.outcome
    if outcome is not None:
        print_calibration(console, outcome)
    finish(procedure, site, decision, "calibrated from known points", console)
    store_in_cameras(site, source, rig, feed.force, console)


calibrate_app.command()(relocate)
calibrate_app.command()(verify)


@calibrate_app.command()
def sensors(
    *, seconds: float, source: str, rig: Path, probe: Path, probes: Path | None, tip: str | None,
    calibrations: Path | None, seed: int, move: int | None, speed: float, force: bool,
) -> None:  # fmt: skip
    """Learn the pattern of the sensors, so that a pushed camera is noticed sooner.

    Wave the probe through the whole volume right after a verification has passed. Without this,
    only larger pushes are noticed within seconds.
    """
    from ocmm_cli.calibrate._run import open_site, real_feed, virtual_feed
    from ocmm_cli.calibrate._sensors import learn, require_usable, wave
    from ocmm_cli.calibrate._steps import body_in_use_of, now
    from ocmm_core.composition import Origin, origin_of

    console, site = make_console(), open_site(rig, calibrations)
    body = body_in_use_of(source, probe, probes, tip)
    calibration = require_usable(site, now())
    if origin_of(source) is Origin.VIRTUAL:
        from ocmm_sim.calibration_scenes import WAY_S, FreeMotionScene
        from ocmm_sim.sources import VirtualSite

        scenes = (FreeMotionScene(ways=round(seconds / WAY_S), seed=seed),)
        feed = virtual_feed(VirtualSite(rig, probe, seed, move).script(scenes), source, speed)
    else:
        feed = real_feed(rig, site.design, source, force=force)
    learn(site, body, wave(site, body, feed, seconds, console), calibration, console)


@calibrate_app.command()
def status(*, rig: Path, calibrations: Path | None) -> None:
    """Say which calibration of a rig is in force, whether it is whole, and whether it may be used.

    All files that it rests on are read again. Exit code 1 where points may not be taken.
    """
    from ocmm_cli.calibrate._report import print_status
    from ocmm_cli.calibrate._steps import now
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
