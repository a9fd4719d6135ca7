"""``ocmm calibrate verify``: an independent check of the calibration by lengths and spheres."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ocmm_cli.calibrate._options import (
    VERIFICATION_BAR,
    CheckBarOption,
    DecisionOption,
    FolderOption,
    MoveOption,
    NewOption,
    RecordOption,
    ShotsOption,
    SpotColumnsOption,
    SpotDecimalOption,
    SpotSkipOption,
    WhoOption,
)
from ocmm_cli.terminal import (
    ForceOption,
    ProbeOption,
    ProbesOption,
    RigOption,
    SeedOption,
    SourceOption,
    SpeedOption,
    TemperatureOption,
    TemperatureUOption,
    TipOption,
    make_console,
    print_table_account,
)
from ocmm_core.calibration.verification import Limits
from ocmm_core.composition import DEFAULT_SEED, DEFAULT_SOURCE, RECOMMENDED_RIG, STANDARD_PROBE
from ocmm_core.tables import TableOptions

if TYPE_CHECKING:
    from ocmm_sim.calibration_scenes import CalibratingScript


class RuleChoice(StrEnum):
    """Rule of decision of a verification."""

    GUARDED = "guarded"
    SIMPLE = "simple"


def verify(
    *,
    bar: CheckBarOption = VERIFICATION_BAR,
    sphere: Annotated[
        list[Path] | None, typer.Option("--sphere", help="Sphere document; can be repeated.")
    ] = None,
    two_places: Annotated[
        bool,
        typer.Option(
            "--two-places", help="Touch each sphere in the near and in the far third of the volume."
        ),
    ] = False,
    excuse: Annotated[
        list[str] | None,
        typer.Option(
            "--excuse",
            help="Why a corner of the volume cannot be reached, e.g. 'X- Y+ Z-: a post stands "
            "there'; recorded.",
        ),
    ] = None,
    shots: ShotsOption = None,
    spot_columns: SpotColumnsOption = "",
    spot_decimal: SpotDecimalOption = "",
    spot_skip: SpotSkipOption = "",
    constant: Annotated[
        float, typer.Option("--limit", help="Permissible error of a length: constant part, mm.")
    ] = Limits().constant,
    per_length: Annotated[
        float,
        typer.Option(
            "--limit-per-length", help="Permissible error of a length: proportional part."
        ),
    ] = Limits().per_length,
    largest: Annotated[
        float, typer.Option("--limit-largest", help="Permissible error of a length: maximum, mm.")
    ] = Limits().largest,
    diameter: Annotated[
        float, typer.Option("--limit-diameter", help="Permissible error of a diameter, mm.")
    ] = Limits().diameter,
    form: Annotated[
        float, typer.Option("--limit-form", help="Permissible form of a sphere, mm.")
    ] = Limits().form,
    rule: Annotated[
        RuleChoice,
        typer.Option(
            "--rule", help="Artefact uncertainty: subtracted from the limit, or only stated."
        ),
    ] = RuleChoice.GUARDED,
    source: SourceOption = DEFAULT_SOURCE,
    rig: RigOption = RECOMMENDED_RIG,
    probe: ProbeOption = STANDARD_PROBE,
    probes: ProbesOption = None,
    tip: TipOption = None,
    calibrations: FolderOption = None,
    who: WhoOption = "unnamed",
    temperature: TemperatureOption = None,
    temperature_u: TemperatureUOption = "",
    decision: DecisionOption = None,
    new: NewOption = False,
    seed: SeedOption = DEFAULT_SEED,
    move: MoveOption = None,
    speed: SpeedOption = 0.0,
    record: RecordOption = None,
    force: ForceOption = False,
) -> None:
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
            limits=Limits(constant, per_length, largest, diameter, rule.value, form),
        )  # fmt: skip
    for one in excuse or ():
        corner, _, reason = one.partition(":")
        procedure.excuse_corner(corner, reason, now())
    retake_misplaced(procedure, console)
    if shots is not None:
        options = TableOptions("", spot_columns, spot_decimal, spot_skip)
        recorded = load_shots(shots, site.rig, body.n_leds, options)
        print_table_account(recorded.account)
        take_verification_shots(procedure, recorded.shots)
        require_end(procedure)
    elif is_lacking(procedure):

        def script() -> CalibratingScript:
            from ocmm_sim.sources import VirtualSite, scenes_of_verification

            virtual = VirtualSite(rig, probe, seed, move)
            return virtual.script(
                scenes_of_verification(
                    virtual, site.rig, procedure.view, procedure.bar, procedure.spheres
                )
            )

        collect_from(procedure, site, rig, source, script, speed, record, force, console)
    procedure.compute()
    outcome = procedure.view.outcome
    if outcome is not None:
        print_verification(console, outcome)
    code = decided_code(procedure, decision, "verified", console)
    print_status(console, site.document, site.calibrations, now())
    failed = outcome is None or not outcome.record.passed
    raise typer.Exit(1 if failed else code)
