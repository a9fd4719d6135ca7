"""``ocmm acceptance interim``: the check of 90 seconds, its chart, and held points."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ocmm_core.cli.terminal import (
    CalibrationsOption,
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
    say_word,
)
from ocmm_core.composition import DEFAULT_SEED, DEFAULT_SOURCE, RECOMMENDED_RIG, STANDARD_PROBE

if TYPE_CHECKING:
    from ocmm_core.acceptance import InterimChart


def interim(
    *,
    artefact: Annotated[
        list[str] | None, typer.Option("--artefact", help="The dumbbell: id or document.")
    ] = None,
    procedure: Annotated[str, typer.Option("--procedure", help="Id or TOML file.")] = "INTERIM",
    source: SourceOption = DEFAULT_SOURCE,
    rig: RigOption = RECOMMENDED_RIG,
    probe: ProbeOption = STANDARD_PROBE,
    calibrations: CalibrationsOption = None,
    probes: ProbesOption = None,
    tip: TipOption = None,
    temperature: Annotated[
        float, typer.Option("--temperature", help="Of the room, degrees Celsius.")
    ] = 20.0,
    who: Annotated[str, typer.Option("--who", help="Name for the record.")] = "unnamed",
    seed: SeedOption = DEFAULT_SEED,
    speed: SpeedOption = 0.0,
    folder: Annotated[
        Path | None, typer.Option("--folder", help="Of checks; default: that of this user.")
    ] = None,
    force: ForceOption = False,
) -> None:
    """Check the system in 90 seconds: two spheres on a bar, at start of shift or after a knock.

    A check that is out is repeated at once. Out again: the points since the last good check are
    held back in every job until a verification passes. Ends with 1 then.
    """
    from ocmm_core.acceptance import InterimHistory, InterimWord, RoomAir, note_check, save_record
    from ocmm_core.cli.acceptance._report import print_record
    from ocmm_core.cli.acceptance._run import run_test
    from ocmm_core.composition import open_test_site, tests_folder

    console = make_console()
    site = open_test_site(
        procedure, artefact or [], source, rig, probe, calibrations, probes, tip, seed
    )
    base = tests_folder(folder, site)
    history = InterimHistory(base)
    if history.doubt:
        console.print(say(history.doubt), style="yellow", highlight=False)
    for attempt in range(2):
        record = run_test(
            replace(site, seed=seed + attempt), base, console, temperature_c=temperature, who=who,
            place="", customer="", condition="as found", air=RoomAir(), retest=False,
            new=True, speed=speed, record=None, force=force,
        )  # fmt: skip
        print_record(console, record)
        save_record(base / "records", record)
        chart = note_check(history, record, site.cameras.store, datetime.now(UTC))
        _print(chart)
        if chart.word is not InterimWord.REPEAT:
            break
    if chart.word is InterimWord.STOP:
        if site.cameras.store is not None:
            console.print(
                say("Held     Points since the last good check, until a verification passes")
            )
        raise typer.Exit(1)


def _print(chart: InterimChart) -> None:
    console, last = make_console(), chart.points[-1]
    known = "" if last.z != last.z else f", {last.z:+.1f} s from the centre"
    console.print(
        say(f"Check    {len(chart.points)}: {1e3 * last.check.error_mm:+.1f} µm{known}: ")
        + say_word(last.word.value),
        highlight=False,
    )
    if last.reason:
        console.print(f"         {say(last.reason)}", highlight=False)
