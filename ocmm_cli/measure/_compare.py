"""``ocmm compare``: compare several jobs of one plan."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ocmm_cli.measure._pages import print_pages
from ocmm_cli.options import ComputingSite
from ocmm_cli.terminal import (
    PlainConsole,
    heads,
    lead,
    make_console,
    print_grid,
    progress_line,
    say,
    say_word,
)

if TYPE_CHECKING:
    from ocmm_core.inspection.archive import Trend


def compare_command(
    *, jobs: Annotated[list[Path], typer.Argument(readable=False)], probes: Path | None,
    calibrations: Path | None, feature: str, table: Path | None, pages: Path | None,
    site: ComputingSite,
) -> None:  # fmt: skip
    """Compare the jobs of a batch: trend, control chart and Cp / Cpk of every characteristic.

    Run rules: Western Electric 1 (beyond a limit), 2 (two of three beyond two sigma), 3 (four of
    five beyond one sigma), 4 (eight on one side), and Nelson 3 (six rising or falling).

    Every job is opened read-only and recomputed from its points. Values in doubt are named and
    not counted; so are those of simulated jobs beside real ones. Jobs that cannot be read or are of
    another plan than the latest one are named and left out. Ends with 1 where one cannot be read.
    """
    from ocmm_core.documents import write_atomic
    from ocmm_core.export import batch_table
    from ocmm_core.inspection.archive import compare_files
    from ocmm_core.inspection.evaluation import SIMULATED_LINE

    console = make_console()
    with progress_line() as tell:
        found = compare_files(jobs, tell, probes, calibrations, site=site).about(feature)
    if found.simulated:
        console.say(SIMULATED_LINE, style="bold yellow")
    for name, words in zip(found.jobs, found.words, strict=True):
        said = "; ".join(map(say, words))
        console.print(f"{name}: {said}")
    for sentence in found.left_out:
        console.print(f"{say_word('left out')}: {say(sentence)}", style="yellow")
    _print_table(console, found.trends, len(found.jobs))
    for trend in found.trends:
        for line in _lines(trend):
            console.print(f"{trend.name}: {say(line)}")
    console.say(
        "Lengths in mm. Chart limits: 2.66 mean moving ranges; Cp and Cpk use the same scatter.",
        style="dim",
        highlight=True,
    )
    if table is not None:
        write_atomic(table, batch_table(found))
        console.print(f"{lead('Table  ')}{table}")
    if pages is not None:
        options = ["--out", str(pages), "--feature", feature]
        options += ["--probes", str(probes)] if probes is not None else []
        options += ["--calibrations", str(calibrations)] if calibrations is not None else []
        for line in print_pages(
            "ocmm_gui.reports._batch",
            [[*map(str, jobs), *options]],
            "compare.pdf",
            "The pages were not written",
            "The jobs are not affected.",
        ):
            console.print(f"{lead('Pages  ')}{line}")
    if found.unread:
        raise typer.Exit(1)


def _print_table(console: PlainConsole, trends: tuple[Trend, ...], count: int) -> None:
    title = say(f"{count:d} job{'' if count == 1 else 's'}")
    rows = []
    for trend in trends:
        values, able = trend.values, trend.capability
        numbers = ["–"] * 3
        if len(values):
            numbers = [f"{x:z.4f}" for x in (values.mean(), values.min(), values.max())]
        rows.append((
            trend.name, f"{len(values)}/{count}", *numbers,
            f"{able.cp:.2f}" if able is not None and able.cp is not None else "–",
            f"{able.cpk:.2f}" if able is not None else "–",
            f"{able.cpk_low:.2f} – {able.cpk_high:.2f}" if able is not None else "–",
        ))  # fmt: skip
    columns = heads("Characteristic", "Parts", "Mean", "Least", "Greatest", "Cp", "Cpk", "95 %")
    print_grid(console, columns, rows, title)


def _lines(trend: Trend) -> list[str]:
    lines = [f"excluded: {why}" for why in trend.left_out]
    if trend.why_not:
        lines.append(trend.why_not)
    if trend.capability is not None:
        lines.append(trend.capability.words)
    if trend.caution:
        lines.append(trend.caution)
    if trend.chart is not None:
        counted = [part for part in trend.parts if part.value is not None]
        lines += [
            say(f"{counted[i].job} is {why.value} ({why.rule}).") for i, why in trend.chart.signals
        ]
    return lines
