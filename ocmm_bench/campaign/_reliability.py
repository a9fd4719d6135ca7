"""``ocmm selftest reliability``: the lanes by name, and the table of findings."""

from __future__ import annotations

import time
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ocmm_cli.terminal import make_console, print_grid
from ocmm_core.host import require_linux

if TYPE_CHECKING:
    from ocmm_bench.campaign._trials import LaneResult
    from ocmm_cli.terminal import PlainConsole

selftest_app = typer.Typer(no_args_is_help=True, help="Test this installation.")

_FOR_EVER = 1_000_000_000
_MOST_NOTES = 10


class LaneName(StrEnum):
    KILLS = "kills"
    CUTS = "cuts"
    FAULTS = "faults"
    NAMES = "names"
    WRITERS = "writers"
    CLOCK = "clock"
    HOSTILE = "hostile"
    SIDES = "sides"
    SOAK = "soak"


@selftest_app.callback()
def _selftest() -> None:
    require_linux("The campaign that kills programs and fails disks")


@selftest_app.command()
def reliability(
    *, lane: list[LaneName] | None, runs: int | None, hours: float | None, seed: int,
    state: Path | None,
) -> None:  # fmt: skip
    """Kill, cut and break the program while it stores, and count what is lost.

    Beside every zero stands the rate that so many trials without a finding exclude with 95 %: 3/N.
    Exit code 1 where anything was found.
    """
    console = make_console()
    names = [LaneName(name) for name in (lane or list(LaneName))]
    results = run_reliability(names, runs, hours, seed, state, console)
    print_results(results, console)
    raise typer.Exit(int(any(result.failed for result in results)))


def run_reliability(
    names: list[LaneName],
    runs: int | None,
    hours: float | None,
    seed: int,
    state: Path | None,
    console: PlainConsole,
) -> list[LaneResult]:
    from rich.progress import MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from ocmm_bench.campaign._clock import clock
    from ocmm_bench.campaign._faults import cuts, faults
    from ocmm_bench.campaign._hostile import hostile
    from ocmm_bench.campaign._hostile_sides import hostile_sides
    from ocmm_bench.campaign._kills import kills, soak
    from ocmm_bench.campaign._lost_names import lost_names
    from ocmm_bench.campaign._trials import run_lane
    from ocmm_bench.campaign._writers import writers

    lanes = {
        LaneName.KILLS: kills, LaneName.CUTS: cuts, LaneName.FAULTS: faults,
        LaneName.NAMES: lost_names, LaneName.WRITERS: writers, LaneName.CLOCK: clock,
        LaneName.HOSTILE: hostile,
        LaneName.SIDES: hostile_sides,
        LaneName.SOAK: soak,
    }  # fmt: skip
    most = runs or (100 if hours is None else _FOR_EVER)
    results = []
    columns = (
        TextColumn("{task.description}", markup=False),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        for name in names:
            share = float("inf") if hours is None else hours * 3600.0 / len(names)
            task = progress.add_task(name.value, total=None if most == _FOR_EVER else most)
            results.append(
                run_lane(
                    name.value, lanes[name], seed, most, state, time.monotonic() + share,
                    lambda done, task=task: progress.update(task, completed=done),  # type: ignore[misc]
                )
            )  # fmt: skip
    return results


def print_results(results: list[LaneResult], console: PlainConsole) -> None:
    from ocmm_bench.campaign._trials import FINDINGS, bound

    rows = []
    for result in results:
        trials = len(result.trials)
        if result.why_not and not trials:
            rows.append((result.lane, "NOT RUN", "", result.why_not, "", ""))
            continue
        head = (result.lane, str(trials), str(result.acknowledged))
        for finding in FINDINGS[result.lane]:
            count = result.count(finding)
            rate = f"{bound(trials):.2g}" if count == 0 else ""
            rows.append((*head, finding, str(count), rate))
            head = ("", "", "")
    columns = ("Lane", "Trials", "Acknowledged", "Finding", "Found", "Rate below (95 %)")
    print_grid(console, columns, rows, "Reliability")
    notes = [
        f"{trial.lane} {trial.number}: {', '.join(trial.found)}. {trial.note}"
        for result in results
        for trial in result.trials
        if trial.found
    ]
    for note in notes[:_MOST_NOTES]:
        console.print(note)
    if len(notes) > _MOST_NOTES:
        console.print(f"... and {len(notes) - _MOST_NOTES} more.")
