"""``ocmm calibrate verify``: an independent check of the calibration by lengths and spheres."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer

from ocmm_cli.calibrate._feed_options import FeedOptions
from ocmm_cli.terminal import make_console, print_table_account
from ocmm_core.calibration.verification import Limits
from ocmm_core.tables import TableOptions

if TYPE_CHECKING:
    from ocmm_sim.calibration_scenes import Scene
    from ocmm_sim.sources import VirtualSite


def verify(
    *, bar: Path, sphere: list[Path] | None, two_places: bool, excuse: list[str] | None,
    shots: Path | None, spot: TableOptions, constant: float,
    per_length: float, largest: float, diameter: float, form: float,
    rule: Literal["guarded", "simple"], source: str, rig: Path, probe: Path, probes: Path | None,
    tip: str | None, calibrations: Path | None, who: str, temperature: float | None,
    temperature_u: str, decision: bool | None, new: bool, feed: FeedOptions,
) -> None:  # fmt: skip
    """Verify the calibration in force with a bar along seven lines, and with spheres.

    Two cones that are fixed to the table are visited first and last: what moved meanwhile shows.
    """
    from ocmm_cli.calibrate._report import print_status, print_verification
    from ocmm_cli.calibrate._run import (
        continued,
        open_site,
        retake_misplaced,
        take_verification_shots,
    )
    from ocmm_cli.calibrate._steps import (
        body_in_use_of,
        collect_from,
        decided_code,
        is_lacking,
        now,
        require_end,
    )
    from ocmm_core.acceptance import read_temperature
    from ocmm_core.calibration.guided import ProcedureKind, load_shots
    from ocmm_core.calibration.records import load_bar, load_sphere
    from ocmm_core.calibration.verification import VerificationProcedure

    console, site = make_console(), open_site(rig, calibrations)
    body, artefact = body_in_use_of(source, probe, probes, tip), load_bar(bar)
    spheres = tuple(load_sphere(path) for path in sphere or ())
    warm = read_temperature(temperature, temperature_u, now())
    procedure = continued(
        site,
        ProcedureKind.VERIFICATION,
        lambda path: VerificationProcedure.resume(path, site.rig, body, site.store),
        console,
        warm,
        new=new,
    )
    if procedure is None:
        procedure = VerificationProcedure.begin(
            site.sessions, site.rig, body, site.store, artefact, now(),
            who=who, temperature=warm, spheres=spheres,
            two_places=two_places,
            limits=Limits(constant, per_length, largest, diameter, rule, form),
        )  # fmt: skip
    for one in excuse or ():
        corner, _, reason = one.partition(":")
        procedure.excuse_corner(corner, reason, now())
    retake_misplaced(procedure, console)
    if shots is not None:
        recorded = load_shots(shots, site.rig, body.n_leds, spot)
        print_table_account(recorded.account)
        take_verification_shots(procedure, recorded.shots)
        require_end(procedure)
    elif is_lacking(procedure):

        def scenes(virtual: VirtualSite) -> tuple[Scene, ...]:
            from ocmm_sim.sources import scenes_of_verification

            return scenes_of_verification(
                virtual, site.rig, procedure.view, procedure.bar, procedure.spheres
            )

        collect_from(procedure, site, source, probe, scenes, feed, console)
    procedure.compute()
    outcome = procedure.view.outcome
    if outcome is not None:
        print_verification(console, outcome)
    code = decided_code(procedure, decision, "verified", console)
    print_status(console, site.document, site.calibrations, now())
    failed = outcome is None or not outcome.record.passed
    raise typer.Exit(1 if failed else code)
