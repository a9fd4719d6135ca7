"""``ocmm acceptance interim``: the check of 90 seconds, its chart, and what it holds back."""

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
    from ocmm_core.acceptance import InterimCheck, InterimHistory, InterimWord, save_record
    from ocmm_core.calibration.records import record_hash
    from ocmm_core.cli.acceptance._report import print_record
    from ocmm_core.cli.acceptance._run import run_test
    from ocmm_core.composition import open_test_site, tests_folder

    console = make_console()
    site = open_test_site(
        procedure, artefact or [], source, rig, probe, calibrations, probes, tip, seed
    )
    base = tests_folder(folder, site)
    history = InterimHistory(base)
    for attempt in range(2):
        record = run_test(
            replace(site, seed=seed + attempt), base, console, temperature_c=temperature, who=who,
            place="", customer="", condition="as found", retest=False, new=True, speed=speed,
            record=None, force=force,
        )  # fmt: skip
        print_record(console, record)
        save_record(base / "records", record)
        # The farthest of length and diameters, as shares of their limits: one number a check.
        value = max(record.values, key=lambda one: abs(one.error_mm) / one.limit_mm)
        length = next(one for one in record.values if one.quantity == "Interim_L")
        chosen = value if abs(value.error_mm) > value.limit_mm else length
        check = InterimCheck(
            utc=record.ended_utc, calibration=record.instrument.calibration,
            artefact=record.artefacts[0].use.serial, tip=record.instrument.tip,
            error_mm=chosen.error_mm, limit_mm=chosen.limit_mm, record=record_hash(record),
        )  # fmt: skip
        chart = history.add(check)
        _print(chart)
        if chart.word is not InterimWord.REPEAT:
            break
    if chart.word is InterimWord.STOP:
        store = site.cameras.store
        if store is not None:
            reason = f"The interim check is out: {chart.points[-1].reason}"
            store.suspect(who, reason, chart.last_good, datetime.now(UTC))
            console.print("Held     Points since the last good check, until a verification passes")
        raise typer.Exit(1)


def _print(chart: InterimChart) -> None:
    console, last = make_console(), chart.points[-1]
    known = "" if last.z != last.z else f", {last.z:+.1f} s from the centre"
    console.print(
        f"Check    {len(chart.points)}: {1e3 * last.check.error_mm:+.1f} µm{known}: "
        f"{last.word.value}",
        highlight=False,
    )
    if last.reason:
        console.print(f"         {last.reason}", highlight=False)
