"""``ocmm calibrate``: cameras from known points, relocation, verification, their history."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ocmm_core.calibration.relocation import BARS_WANTED, LENGTH_LIMIT_MM, POSES_WANTED
from ocmm_core.calibration.verification import Limits
from ocmm_core.cli.calibrate._options import (
    VERIFICATION_BAR,
    VIRTUAL_BAR,
    WAVE_S,
    BarOption,
    CheckBarOption,
    DecisionOption,
    FolderOption,
    MoveOption,
    NewOption,
    OverruleOption,
    RecordOption,
    ShotsOption,
    TemperatureOption,
    WhoOption,
)
from ocmm_core.cli.terminal import (
    ForceOption,
    ProbeOption,
    ProbesOption,
    RigOption,
    SeedOption,
    SourceOption,
    SpeedOption,
    TipOption,
    make_console,
    say,
)
from ocmm_core.composition import DEFAULT_SEED, DEFAULT_SOURCE, RECOMMENDED_RIG, STANDARD_PROBE
from ocmm_core.errors import CalibrationError

if TYPE_CHECKING:
    from ocmm_core.calibration.cameras import KnownPoints, KnownPointsProcedure
    from ocmm_core.calibration.guided import Shot


calibrate_app = typer.Typer(
    no_args_is_help=True,
    help="Calibrate the cameras, recalibrate them in place, and verify the calibration.\n\nA "
    "new calibration is active as soon as it is accepted, and SUSPECT until 'verify' has "
    "passed. Every observation is stored at once: an interrupted command resumes where it "
    "stopped when started again.\n\nExit codes: 0 accepted (and passed), 1 old one kept, "
    "waiting, or failed, 2 could not run.",
)


class LensChoice(StrEnum):
    """What happens to the lenses in a relocation."""

    FIXED = "fixed"
    PRIOR = "prior"
    FREE = "free"


class GeometryChoice(StrEnum):
    """How the LEDs of the probe are known."""

    KNOWN = "known"
    UNCERTAIN = "uncertain"
    UNKNOWN = "unknown"


class RuleChoice(StrEnum):
    """How limits of a verification are applied."""

    GUARDED = "guarded"
    SIMPLE = "simple"


class WorldChoice(StrEnum):
    """What the world frame hangs on."""

    CAMERAS = "cameras"
    POINTS = "points"
    SET = "set"


@calibrate_app.command()
def cameras(
    *,
    points: Annotated[Path, typer.Option("--points", help="List of reference positions (CSV).")],
    spots: Annotated[
        Path | None, typer.Option("--spots", help="Recorded averaged spots (CSV) of the points.")
    ] = None,
    evaluation: Annotated[
        int | None,
        typer.Option("--evaluation", min=0, help="Points kept for evaluation; default: a quarter."),
    ] = None,
    source: SourceOption = DEFAULT_SOURCE,
    rig: RigOption = RECOMMENDED_RIG,
    calibrations: FolderOption = None,
    who: WhoOption = "unnamed",
    temperature: TemperatureOption = None,
    decision: DecisionOption = None,
    overrule: OverruleOption = "",
    new: NewOption = False,
    seed: SeedOption = DEFAULT_SEED,
    move: MoveOption = None,
    speed: SpeedOption = 0.0,
    record: RecordOption = None,
    force: ForceOption = False,
) -> None:
    """Calibrate all cameras from known points: a target is brought to every position of a list.

    Live, a point is taken as soon as the target rests at a new place, in the order of the list.
    """
    from ocmm_core.calibration.cameras import (
        KnownPointsProcedure,
        load_reference_points,
        load_spots,
    )
    from ocmm_core.calibration.guided import ProcedureKind
    from ocmm_core.cli.calibrate._report import print_calibration
    from ocmm_core.cli.calibrate._run import continued, open_site
    from ocmm_core.cli.calibrate._steps import (
        collect_from,
        compute,
        finish,
        is_lacking,
        now,
        require_end,
        store_in_cameras,
    )
    from ocmm_core.composition import VirtualSite, scenes_of_known_points

    console, site = make_console(), open_site(rig, calibrations)
    listed = load_reference_points(points)
    procedure = (
        None
        if new
        else continued(
            site,
            ProcedureKind.KNOWN_POINTS,
            lambda path: KnownPointsProcedure.resume(path, site.design, site.store),
            console,
        )
    )
    if procedure is None:
        procedure = KnownPointsProcedure.begin(
            site.sessions, site.design, site.store, listed, now(),
            who=who, temperature_c=temperature, evaluation=evaluation,
        )  # fmt: skip
    _require_same_list(procedure, listed)
    if spots is not None:
        procedure.take_table(load_spots(spots, listed), now())
        require_end(procedure)
    elif is_lacking(procedure):
        virtual = VirtualSite(rig, STANDARD_PROBE, seed, move)
        scenes = scenes_of_known_points(virtual, procedure.view, procedure.points)
        collect_from(procedure, site, rig, source, virtual, scenes, speed, record, force, console)
    compute(procedure, overrule)
    outcome = procedure.view.outcome
    if outcome is not None:
        print_calibration(console, outcome)
    finish(procedure, site, decision, say("calibrated from known points"), console)
    store_in_cameras(site, source, rig, force, console)


@calibrate_app.command()
def relocate(
    *,
    bar: BarOption = VIRTUAL_BAR,
    shots: ShotsOption = None,
    world: Annotated[
        WorldChoice,
        typer.Option(
            "--world",
            help=(
                "World frame: kept by the cameras, by known control points, or defined by three."
            ),
        ),
    ] = WorldChoice.CAMERAS,
    control: Annotated[
        Path | None, typer.Option("--control", help="List of known control points (CSV).")
    ] = None,
    lens: Annotated[
        LensChoice, typer.Option("--lens", help="Lenses: kept, refined from known values, or free.")
    ] = LensChoice.PRIOR,
    geometry: Annotated[
        GeometryChoice, typer.Option("--geometry", help="Source of the LED positions.")
    ] = GeometryChoice.UNCERTAIN,
    poses: Annotated[int, typer.Option("--poses", min=20, help="At least.")] = POSES_WANTED,
    placements: Annotated[
        int, typer.Option("--placements", min=1, help="Least number of bar placements.")
    ] = BARS_WANTED,
    limit: Annotated[
        float,
        typer.Option("--limit", help="Target: standard uncertainty of a length, mm."),
    ] = LENGTH_LIMIT_MM,
    seats: Annotated[
        bool,
        typer.Option(
            "--seats/--no-seats", help="Skip seats: for recordings without them (--source replay:)."
        ),
    ] = True,
    source: SourceOption = DEFAULT_SOURCE,
    rig: RigOption = RECOMMENDED_RIG,
    probe: ProbeOption = STANDARD_PROBE,
    probes: ProbesOption = None,
    tip: TipOption = None,
    calibrations: FolderOption = None,
    who: WhoOption = "unnamed",
    temperature: TemperatureOption = None,
    decision: DecisionOption = None,
    overrule: OverruleOption = "",
    new: NewOption = False,
    seed: SeedOption = DEFAULT_SEED,
    move: MoveOption = None,
    speed: SpeedOption = 0.0,
    record: RecordOption = None,
    force: ForceOption = False,
) -> None:
    """Calibrate cameras that were moved, without a CMM: wave the probe, show the bar.

    Two cones that are fixed to the table are visited first and last: what moved meanwhile shows.
    """
    from ocmm_core.calibration.cameras import load_reference_points
    from ocmm_core.calibration.guided import ProcedureKind, load_shots
    from ocmm_core.calibration.records import load_bar
    from ocmm_core.calibration.relocation import RelocationProcedure
    from ocmm_core.cli.calibrate._report import print_calibration
    from ocmm_core.cli.calibrate._run import continued, open_site, take_relocation_shots
    from ocmm_core.cli.calibrate._steps import (
        body_in_use_of,
        collect_from,
        compute,
        finish,
        is_lacking,
        now,
        require_end,
        store_in_cameras,
    )
    from ocmm_core.composition import VirtualSite, scenes_of_relocation

    console, site = make_console(), open_site(rig, calibrations)
    body, artefact = body_in_use_of(source, probe, probes, tip), load_bar(bar)
    known = None if control is None else load_reference_points(control)
    procedure = (
        None
        if new
        else continued(
            site,
            ProcedureKind.RELOCATION,
            lambda path: RelocationProcedure.resume(path, site.rig, body, site.store),
            console,
        )
    )
    recorded = () if shots is None else load_shots(shots, site.rig, body.n_leds)
    if procedure is None:
        procedure = RelocationProcedure.begin(
            site.sessions, site.rig, body, site.store, artefact, now(),
            who=who, temperature_c=temperature, world=world.value, control=known, lens=lens.value,
            geometry=geometry.value, poses_wanted=poses, bars_wanted=placements,
            length_limit_mm=limit, seats=_has_seats(source, recorded, seats=seats),
        )  # fmt: skip
    if shots is not None:
        take_relocation_shots(procedure, recorded)
        require_end(procedure)
    elif is_lacking(procedure):
        virtual = VirtualSite(rig, probe, seed, move)
        scenes = scenes_of_relocation(
            virtual, site.design, procedure.view, procedure.bar, procedure.control
        )
        collect_from(procedure, site, rig, source, virtual, scenes, speed, record, force, console)
    compute(procedure, overrule)
    outcome = procedure.view.outcome
    if outcome is not None:
        print_calibration(console, outcome)
    finish(procedure, site, decision, "relocated", console)
    store_in_cameras(site, source, rig, force, console)


def _has_seats(source: str, recorded: Sequence[Shot], *, seats: bool) -> bool:
    """Return whether two seats are visited first and last; only what was recorded may lack them."""
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


@calibrate_app.command()
def verify(
    *,
    bar: CheckBarOption = VERIFICATION_BAR,
    sphere: Annotated[
        list[Path] | None,
        typer.Option("--sphere", help="Sphere document; can be repeated."),
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
    from ocmm_core.calibration.guided import ProcedureKind, load_shots
    from ocmm_core.calibration.records import load_bar, load_sphere
    from ocmm_core.calibration.verification import VerificationProcedure
    from ocmm_core.cli.calibrate._report import print_status, print_verification
    from ocmm_core.cli.calibrate._run import (
        continued,
        open_site,
        retake_misplaced,
        take_verification_shots,
    )
    from ocmm_core.cli.calibrate._steps import (
        body_in_use_of,
        collect_from,
        decided_code,
        is_lacking,
        now,
        require_end,
    )
    from ocmm_core.composition import VirtualSite, scenes_of_verification

    console, site = make_console(), open_site(rig, calibrations)
    body, artefact = body_in_use_of(source, probe, probes, tip), load_bar(bar)
    spheres = tuple(load_sphere(path) for path in sphere or ())
    procedure = (
        None
        if new
        else continued(
            site,
            ProcedureKind.VERIFICATION,
            lambda path: VerificationProcedure.resume(path, site.rig, body, site.store),
            console,
        )
    )
    if procedure is None:
        procedure = VerificationProcedure.begin(
            site.sessions, site.rig, body, site.store, artefact, now(),
            who=who, temperature_c=temperature, spheres=spheres,
            two_places=two_places,
            limits=Limits(constant, per_length, largest, diameter, rule.value, form),
        )  # fmt: skip
    for one in excuse or ():
        corner, _, reason = one.partition(":")
        procedure.excuse_corner(corner, reason, now())
    retake_misplaced(procedure, console)
    if shots is not None:
        take_verification_shots(procedure, load_shots(shots, site.rig, body.n_leds))
        require_end(procedure)
    elif is_lacking(procedure):
        virtual = VirtualSite(rig, probe, seed, move)
        scenes = scenes_of_verification(
            virtual, site.rig, procedure.view, procedure.bar, procedure.spheres
        )
        collect_from(procedure, site, rig, source, virtual, scenes, speed, record, force, console)
    procedure.compute()
    outcome = procedure.view.outcome
    if outcome is not None:
        print_verification(console, outcome)
    code = decided_code(procedure, decision, "verified", console)
    print_status(console, site.document, site.calibrations, now())
    failed = outcome is None or not outcome.record.passed
    raise typer.Exit(1 if failed else code)


@calibrate_app.command()
def sensors(
    *,
    seconds: Annotated[
        float, typer.Option("--seconds", min=10.0, help="Duration of waving the probe.")
    ] = WAVE_S,
    source: SourceOption = DEFAULT_SOURCE,
    rig: RigOption = RECOMMENDED_RIG,
    probe: ProbeOption = STANDARD_PROBE,
    probes: ProbesOption = None,
    tip: TipOption = None,
    calibrations: FolderOption = None,
    seed: SeedOption = DEFAULT_SEED,
    move: MoveOption = None,
    speed: SpeedOption = 0.0,
    force: ForceOption = False,
) -> None:
    """Learn the pattern of the sensors, so that a pushed camera is noticed sooner.

    Wave the probe through the whole volume right after a verification has passed. Without this,
    only larger pushes are noticed within seconds.
    """
    from ocmm_core.cli.calibrate._run import open_site, real_feed, virtual_feed
    from ocmm_core.cli.calibrate._sensors import learn, require_usable, wave
    from ocmm_core.cli.calibrate._steps import body_in_use_of, now
    from ocmm_core.composition import Origin, VirtualSite, origin_of
    from ocmm_core.simulation.calibration_scenes import WAY_S, FreeMotionScene

    console, site = make_console(), open_site(rig, calibrations)
    body = body_in_use_of(source, probe, probes, tip)
    calibration = require_usable(site, now())
    if origin_of(source) is Origin.VIRTUAL:
        scenes = (FreeMotionScene(ways=round(seconds / WAY_S), seed=seed),)
        feed = virtual_feed(VirtualSite(rig, probe, seed, move).script(scenes), source, speed)
    else:
        feed = real_feed(rig, site.design, source, force=force)
    learn(site, body, wave(site, body, feed, seconds, console), calibration, console)


@calibrate_app.command()
def status(*, rig: RigOption = RECOMMENDED_RIG, calibrations: FolderOption = None) -> None:
    """Say which calibration of a rig is in force, whether it is whole, and whether it may be used.

    All files that it rests on are read again. Exit code 1 where points may not be taken.
    """
    from ocmm_core.calibration.records import default_folder
    from ocmm_core.cli.calibrate._report import print_status
    from ocmm_core.cli.calibrate._steps import now

    usable = print_status(make_console(), rig, calibrations or default_folder(), now())
    raise typer.Exit(0 if usable else 1)


@calibrate_app.command()
def history(*, rig: RigOption = RECOMMENDED_RIG, calibrations: FolderOption = None) -> None:
    """List what happened to the calibrations of a rig."""
    from ocmm_core.cli.calibrate._report import print_history
    from ocmm_core.cli.calibrate._run import open_site

    print_history(make_console(), open_site(rig, calibrations).store)


def _require_same_list(procedure: KnownPointsProcedure, listed: KnownPoints) -> None:
    """Refuse to go on with a session that was begun with another list."""
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
