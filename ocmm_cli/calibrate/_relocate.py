"""``ocmm calibrate relocate``: recalibrate cameras that were moved, with the probe and a bar."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ocmm_cli.calibrate._feed_options import FeedOptions
from ocmm_cli.terminal import make_console, print_table_account
from ocmm_core.errors import CalibrationError
from ocmm_core.tables import TableOptions

if TYPE_CHECKING:
    from ocmm_core.calibration.guided import Shot
    from ocmm_sim.calibration_scenes import Scene
    from ocmm_sim.sources import VirtualSite


def relocate(
    *, bar: Path, shots: Path | None, spot: TableOptions,
    world: Literal["cameras", "points", "set"], control: Path | None, layout: TableOptions,
    lens: Literal["fixed", "prior", "free"], geometry: Literal["known", "uncertain", "unknown"],
    poses: int, placements: int, limit: float, seats: bool, source: str, rig: Path, probe: Path,
    probes: Path | None, tip: str | None, calibrations: Path | None, who: str,
    temperature: float | None, temperature_u: str, decision: bool | None, overrule: str, new: bool,
    feed: FeedOptions,
) -> None:  # fmt: skip
    """Calibrate cameras that were moved, without a CMM: wave the probe, show the bar.

    Two cones that are fixed to the table are visited first and last: what moved meanwhile shows.
    """
    from ocmm_cli.calibrate._report import print_calibration
    from ocmm_cli.calibrate._run import continued, open_site, take_relocation_shots
    from ocmm_cli.calibrate._steps import (
        body_in_use_of,
        collect_from,
        compute,
        finish,
        is_lacking,
        now,
        require_end,
        store_in_cameras,
    )
    from ocmm_core.acceptance import read_temperature
    from ocmm_core.calibration.cameras import read_reference_points
    from ocmm_core.calibration.guided import ProcedureKind, load_shots
    from ocmm_core.calibration.records import load_bar
    from ocmm_core.calibration.relocation import RelocationProcedure

    console, site = make_console(), open_site(rig, calibrations)
    body, artefact = body_in_use_of(source, probe, probes, tip), load_bar(bar)
    known = None
    if control is not None:
        read = read_reference_points(control, layout)
        print_table_account(read.account)
        known = read.points
    warm = read_temperature(temperature, temperature_u, now())
    procedure = continued(
        site,
        ProcedureKind.RELOCATION,
        lambda path: RelocationProcedure.resume(path, site.rig, body, site.store),
        console,
        warm,
        new=new,
    )
    recorded: tuple[Shot, ...] = ()
    if shots is not None:
        table = load_shots(shots, site.rig, body.n_leds, spot)
        print_table_account(table.account)
        recorded = table.shots
    if procedure is None:
        procedure = RelocationProcedure.begin(
            site.sessions, site.rig, body, site.store, artefact, now(),
            who=who, temperature=warm, world=world, control=known, lens=lens,
            geometry=geometry, poses_wanted=poses, bars_wanted=placements,
            length_limit_mm=limit, seats=_has_seats(source, recorded, seats=seats),
        )  # fmt: skip
    if shots is not None:
        take_relocation_shots(procedure, recorded)
        require_end(procedure)
    elif is_lacking(procedure):

        def scenes(virtual: VirtualSite) -> tuple[Scene, ...]:
            from ocmm_sim.sources import scenes_of_relocation

            return scenes_of_relocation(
                virtual, site.design, procedure.view, procedure.bar, procedure.control
            )

        collect_from(procedure, site, source, probe, scenes, feed, console)
    compute(procedure, overrule)
    outcome = procedure.view.outcome
    if outcome is not None:
        print_calibration(console, outcome)
    finish(procedure, site, decision, "relocated", console)
    store_in_cameras(site, source, rig, feed.force, console)


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
