"""``ocmm calibrate``: cameras from known points, relocation, verification, their history."""

from __future__ import annotations

from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from ocmm_core.acquisition.recorder import FrameRecorder
from ocmm_core.calibration.artefacts import load_bar, load_sphere
from ocmm_core.calibration.in_use import Word
from ocmm_core.calibration.probe_in_use import judge_probe, require_records
from ocmm_core.calibration.procedure import Decision, Kind, Procedure
from ocmm_core.calibration.procedure_known_points import KnownPointsProcedure
from ocmm_core.calibration.procedure_relocation import (
    BARS_WANTED,
    LENGTH_LIMIT_MM,
    POSES_WANTED,
    RelocationProcedure,
)
from ocmm_core.calibration.procedure_verification import VerificationProcedure
from ocmm_core.calibration.reference_points import (
    ReferencePoints,
    load_reference_points,
    load_spots,
)
from ocmm_core.calibration.shot_table import load_shots
from ocmm_core.calibration.verification import Limits
from ocmm_core.cli.calibrate_report import (
    print_calibration,
    print_history,
    print_standing,
    print_verification,
)
from ocmm_core.cli.calibrate_run import (
    Site,
    collect,
    continued,
    decide,
    open_site,
    pass_open_gates,
    real_feed,
    retake_misplaced,
    take_relocation_shots,
    take_verification_shots,
    virtual_feed,
)
from ocmm_core.cli.calibrate_scenes import (
    VirtualSite,
    scenes_of_known_points,
    scenes_of_relocation,
    scenes_of_verification,
)
from ocmm_core.cli.calibrate_sensors import WAVE_S, learn, require_usable, wave
from ocmm_core.cli.calibration_choice import choose_probe
from ocmm_core.cli.headless import make_console
from ocmm_core.cli.options import (
    DEFAULT_SEED,
    RECOMMENDED_RIG,
    STANDARD_PROBE,
    ForceOption,
    ProbeOption,
    ProbesOption,
    RigOption,
    SeedOption,
    SourceOption,
    SpeedOption,
    TipOption,
)
from ocmm_core.cli.write_cameras import write_accepted
from ocmm_core.documents import resource
from ocmm_core.errors import CalibrationError
from ocmm_core.simulation.calibrating import WAY_S, Scene, Wave
from ocmm_core.tracking.body import ProbeBody

calibrate_app = typer.Typer(
    no_args_is_help=True,
    help="Calibrate the cameras, calibrate them anew where they stand, and verify it.\n\n"
    "A new calibration is in force as soon as it is accepted, and SUSPECT until 'verify' has "
    "passed. Every observation is stored at once: a command that was stopped, however hard, goes "
    "on where it was when it is started again.\n\n"
    "Exit codes: 0 accepted (and passed), 1 kept the old one, waiting, or failed, 2 could not.",
)

VIRTUAL_SOURCES = ("simulated", "ethercat:virtual")


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


FolderOption = Annotated[
    Path | None,
    typer.Option("--calibrations", help="Folder of calibrations; without it that of this user."),
]
WhoOption = Annotated[str, typer.Option("--who", help="Who does it; goes into the record.")]
TemperatureOption = Annotated[
    float | None, typer.Option("--temperature", help="Of the surroundings, degrees Celsius.")
]
DecisionOption = Annotated[
    bool | None,
    typer.Option(
        "--accept/--keep",
        help="Accept the result, or keep what is in force; without either, a terminal asks, and a "
        "script leaves the session waiting.",
    ),
]
NewOption = Annotated[
    bool, typer.Option("--new", help="Begin a new session although one can go on.")
]
MoveOption = Annotated[
    int | None,
    typer.Option("--move", help="Virtual rig: its frame was moved, drawn with this seed."),
]
OverruleOption = Annotated[
    str,
    typer.Option(
        "--overrule", help="Why guards about how the data were taken are overruled; recorded."
    ),
]
BarOption = Annotated[Path, typer.Option("--bar", help="Document of the length bar.")]
ShotsOption = Annotated[
    Path | None, typer.Option("--shots", help="Recorded averaged spots instead of a source.")
]
RecordOption = Annotated[
    Path | None,
    typer.Option("--record", help="Keep all raw frames in this file; --source replay:FILE."),
]

VIRTUAL_BAR = resource("artefacts", "bar.toml")


@calibrate_app.command()
def cameras(
    *,
    points: Annotated[Path, typer.Option("--points", help="List of reference positions (CSV).")],
    spots: Annotated[
        Path | None, typer.Option("--spots", help="Recorded averaged spots (CSV) of the points.")
    ] = None,
    evaluation: Annotated[
        int | None,
        typer.Option("--evaluation", min=0, help="Points kept for evaluation; a quarter without."),
    ] = None,
    source: SourceOption = "simulated",
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
    console, site = make_console(), open_site(rig, calibrations)
    listed = load_reference_points(points)
    procedure = None
    if not new:
        procedure = continued(
            site,
            Kind.KNOWN_POINTS,
            lambda path: KnownPointsProcedure.resume(path, site.design, site.store),
            console,
        )
    if procedure is None:
        procedure = KnownPointsProcedure.begin(
            site.sessions, site.design, site.store, listed, _now(),
            who=who, temperature_c=temperature, evaluation=evaluation,
        )  # fmt: skip
    _require_same_list(procedure, listed)
    if spots is not None:
        procedure.take_table(load_spots(spots, listed), _now())
        _require_end(procedure)
    elif _is_lacking(procedure):
        virtual = VirtualSite(rig, STANDARD_PROBE, seed, move)
        scenes = scenes_of_known_points(virtual, procedure.view, procedure.points)
        _collect(procedure, site, rig, source, virtual, scenes, speed, record, force, console)
    _compute(procedure, overrule)
    outcome = procedure.view.outcome
    if outcome is not None:
        print_calibration(console, outcome)
    _finish(procedure, site, decision, "calibrated from known points", console)
    _store_in_cameras(site, source, rig, force, console)


@calibrate_app.command()
def relocate(
    *,
    bar: BarOption = VIRTUAL_BAR,
    shots: ShotsOption = None,
    world: Annotated[
        WorldChoice,
        typer.Option(
            "--world", help="Kept by the cameras, kept by known control points, or set by three."
        ),
    ] = WorldChoice.CAMERAS,
    control: Annotated[
        Path | None, typer.Option("--control", help="List of known control points (CSV).")
    ] = None,
    lens: Annotated[
        LensChoice, typer.Option("--lens", help="Lenses kept, known from before, or free.")
    ] = LensChoice.PRIOR,
    geometry: Annotated[
        GeometryChoice, typer.Option("--geometry", help="How the LEDs of the probe are known.")
    ] = GeometryChoice.UNCERTAIN,
    poses: Annotated[int, typer.Option("--poses", min=20, help="At least.")] = POSES_WANTED,
    placements: Annotated[
        int, typer.Option("--placements", min=1, help="Of the bar, at least.")
    ] = BARS_WANTED,
    limit: Annotated[
        float,
        typer.Option("--limit", help="Good enough: standard uncertainty of a length, mm."),
    ] = LENGTH_LIMIT_MM,
    source: SourceOption = "simulated",
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
    """Calibrate cameras that were moved, without a CMM: wave the probe, show the bar."""
    console, site = make_console(), open_site(rig, calibrations)
    body, artefact = _body(source, probe, probes, tip), load_bar(bar)
    known = None if control is None else load_reference_points(control)
    procedure = None
    if not new:
        procedure = continued(
            site,
            Kind.RELOCATION,
            lambda path: RelocationProcedure.resume(path, site.rig, body, site.store),
            console,
        )
    if procedure is None:
        procedure = RelocationProcedure.begin(
            site.sessions, site.rig, body, site.store, artefact, _now(),
            who=who, temperature_c=temperature, world=world.value, control=known, lens=lens.value,
            geometry=geometry.value, poses_wanted=poses, bars_wanted=placements,
            length_limit_mm=limit,
        )  # fmt: skip
    if shots is not None:
        take_relocation_shots(procedure, load_shots(shots, site.rig, body.n_leds))
        _require_end(procedure)
    elif _is_lacking(procedure):
        virtual = VirtualSite(rig, probe, seed, move)
        scenes = scenes_of_relocation(
            virtual, site.design, procedure.view, procedure.bar, procedure.control
        )
        _collect(procedure, site, rig, source, virtual, scenes, speed, record, force, console)
    _compute(procedure, overrule)
    outcome = procedure.view.outcome
    if outcome is not None:
        print_calibration(console, outcome)
    _finish(procedure, site, decision, "relocated", console)
    _store_in_cameras(site, source, rig, force, console)


@calibrate_app.command()
def verify(
    *,
    bar: BarOption = VIRTUAL_BAR,
    sphere: Annotated[
        list[Path] | None,
        typer.Option("--sphere", help="Document of a sphere; may be given more than once."),
    ] = None,
    shots: ShotsOption = None,
    constant: Annotated[
        float, typer.Option("--limit", help="Permissible error of a length: constant part, mm.")
    ] = Limits().constant,
    per_length: Annotated[
        float, typer.Option("--limit-per-length", help="And part of the length.")
    ] = Limits().per_length,
    largest: Annotated[
        float, typer.Option("--limit-largest", help="Never more than this, mm.")
    ] = Limits().largest,
    diameter: Annotated[
        float, typer.Option("--limit-diameter", help="Permissible error of a diameter, mm.")
    ] = Limits().diameter,
    rule: Annotated[
        RuleChoice,
        typer.Option("--rule", help="Uncertainty of the artefact off the limit, or only stated."),
    ] = RuleChoice.GUARDED,
    source: SourceOption = "simulated",
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
    """Verify the calibration in force with a bar along seven lines, and with spheres."""
    console, site = make_console(), open_site(rig, calibrations)
    body, artefact = _body(source, probe, probes, tip), load_bar(bar)
    spheres = tuple(load_sphere(path) for path in sphere or ())
    procedure = None
    if not new:
        procedure = continued(
            site,
            Kind.VERIFICATION,
            lambda path: VerificationProcedure.resume(path, site.rig, body, site.store),
            console,
        )
    if procedure is None:
        procedure = VerificationProcedure.begin(
            site.sessions, site.rig, body, site.store, artefact, _now(),
            who=who, temperature_c=temperature, spheres=spheres,
            limits=Limits(constant, per_length, largest, diameter, rule.value),
        )  # fmt: skip
    retake_misplaced(procedure, console)
    if shots is not None:
        take_verification_shots(procedure, load_shots(shots, site.rig, body.n_leds))
        _require_end(procedure)
    elif _is_lacking(procedure):
        virtual = VirtualSite(rig, probe, seed, move)
        scenes = scenes_of_verification(
            virtual, site.rig, procedure.view, procedure.bar, procedure.spheres
        )
        _collect(procedure, site, rig, source, virtual, scenes, speed, record, force, console)
    procedure.compute()
    outcome = procedure.view.outcome
    if outcome is not None:
        print_verification(console, outcome)
    code = _decide(procedure, decision, "verified", console)
    print_standing(console, site.store, _now())
    failed = outcome is None or not outcome.record.passed
    raise typer.Exit(1 if failed else code)


@calibrate_app.command()
def sensors(
    *,
    seconds: Annotated[
        float, typer.Option("--seconds", min=10.0, help="How long the probe is waved.")
    ] = WAVE_S,
    source: SourceOption = "simulated",
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
    console, site = make_console(), open_site(rig, calibrations)
    body = _body(source, probe, probes, tip)
    calibration = require_usable(site, _now())
    if source in VIRTUAL_SOURCES:
        scenes = (Wave(ways=round(seconds / WAY_S), seed=seed),)
        feed = virtual_feed(VirtualSite(rig, probe, seed, move).script(scenes), source, speed)
    else:
        feed = real_feed(rig, site.design, source, force=force)
    learn(site, body, wave(site, body, feed, seconds, console), calibration, console)


@calibrate_app.command()
def status(*, rig: RigOption = RECOMMENDED_RIG, calibrations: FolderOption = None) -> None:
    """Say which calibration is in force and whether it may be used."""
    usable = print_standing(make_console(), open_site(rig, calibrations).store, _now())
    raise typer.Exit(0 if usable else 1)


@calibrate_app.command()
def history(*, rig: RigOption = RECOMMENDED_RIG, calibrations: FolderOption = None) -> None:
    """List what happened to the calibrations of a rig."""
    print_history(make_console(), open_site(rig, calibrations).store)


def _require_same_list(procedure: KnownPointsProcedure, listed: ReferencePoints) -> None:
    """Refuse to go on with a session that was begun with another list."""
    begun = procedure.points
    same = begun.names == listed.names and np.array_equal(
        begun.positions_world, listed.positions_world
    )
    if not same:
        raise CalibrationError(
            "calibrate.points",
            f"The session {procedure.base.session} was begun with another list of points.",
            "Give that list, or begin a new session with --new.",
        )


def _is_lacking(procedure: Procedure) -> bool:
    return pass_open_gates(procedure) < len(procedure.base.steps) - 1


def _require_end(procedure: Procedure) -> None:
    if _is_lacking(procedure):
        gate = procedure.base.step.gate
        raise CalibrationError("calibrate.incomplete", gate.reason, gate.remedy)


def _collect(
    procedure: Procedure,
    site: Site,
    rig: Path,
    source: str,
    virtual: VirtualSite,
    scenes: tuple[Scene, ...],
    speed: float,
    record: Path | None,
    force: bool,
    console: Console,
) -> None:
    frames = None
    if source in VIRTUAL_SOURCES:
        script = virtual.script(scenes)
        frames = script.build().n_frames
        feed = virtual_feed(script, source, speed)
    else:
        feed = real_feed(rig, site.design, source, force=force)
    recorder = None
    if record is not None:
        try:
            recorder = FrameRecorder(record, feed.description, site.design)
        except BaseException:
            feed.ring.close()
            raise
    collect(procedure, feed, frames, console, recorder)


def _compute(procedure: KnownPointsProcedure | RelocationProcedure, overrule: str) -> None:
    if overrule and procedure.base.decision is Decision.OPEN:
        procedure.force(_now(), overrule)
    procedure.compute()


def _decide(procedure: Procedure, decision: bool | None, reason: str, console: Console) -> int:
    made = decide(procedure, decision, reason, console)
    return 0 if made is Decision.ACCEPTED else 1


def _finish(
    procedure: Procedure, site: Site, decision: bool | None, reason: str, console: Console
) -> None:
    code = _decide(procedure, decision, reason, console)
    print_standing(console, site.store, _now())
    if code:
        raise typer.Exit(code)


def _store_in_cameras(site: Site, source: str, rig: Path, force: bool, console: Console) -> None:
    """Write what was accepted into real cameras; virtual ones forget it when they end."""
    record = site.store.active()
    if record is not None and source.startswith("ethercat:") and source not in VIRTUAL_SOURCES:
        write_accepted(record, source, rig, console, force=force)


def _body(source: str, probe: Path, probes: Path | None, tip: str | None) -> ProbeBody:
    """Return the probe by the records of its tip, or by its document where there are none.

    Raises
    ------
    CalibrationError
        The records are damaged, or there are none of a tip that was named.
    """
    in_use = choose_probe(source, probe, probes, tip, uncalibrated=False)
    if in_use.fault is not None and (tip is not None or in_use.fault[0] is not Word.NONE):
        require_records(in_use)
    if in_use.records is not None:
        view = judge_probe(in_use, _now())
        make_console().print(f"Probe  {view.label}", highlight=False)
    return in_use.body


def _now() -> datetime:
    return datetime.now(UTC)
