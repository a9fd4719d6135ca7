"""``ocmm verify-fits``: fits of this installation against certified reference pairs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.text import Text

from ocmm_cli.study._fit import criterion_of
from ocmm_cli.terminal import heads, make_console, print_grid, print_table_account, say, say_word
from ocmm_core.documents import shortened
from ocmm_core.tables import COUNT_OF_POINTS

if TYPE_CHECKING:
    from ocmm_core.features.measured import PairResult, SetReport


def verify_fits_command(folder: Path, convention: str, criterion: str) -> None:
    """Fit reference points and print the worst difference from the certified results.

    Every fit starts cold. The form may follow the certified numbers of a pair. The account of the
    reader goes to stderr. Exit code 1: one difference is beyond its limit, or a fit failed.
    """
    from ocmm_core.features.measured import Convention, verify_folder

    reports = verify_folder(folder, Convention[convention.upper()], criterion_of(criterion))
    shown = [
        item for item in _fields()
        if item[0] != "form" or any(report.worst("form") is not None for report in reports)
    ]  # fmt: skip
    for report in reports:
        _print_accounts(report)
    console = make_console()
    rows: list[Sequence[str | Text]] = [
        (
            report.name, str(len(report.results)),
            *(_number(report.worst(field)) for field, _ in shown),
            Text(say_word("PASS"), "green") if report.passed
            else Text(say_word("FAIL"), "bold red"),
        )
        for report in reports
    ]  # fmt: skip
    columns = (*heads("Set", "Pairs"), *(title for _, title in shown), say_word("Result"))
    print_grid(console, columns, rows, say_word("Worst error of each set"))
    for report in reports:
        for line in _lines(report):
            console.print(line, highlight=False)
    failed = sum(not result.passed for report in reports for result in report.results)
    total = sum(len(report.results) for report in reports)
    console.print(say(f"{total - failed} of {total} pairs within the limits."), highlight=False)
    raise typer.Exit(int(failed > 0))


def _print_accounts(report: SetReport) -> None:
    """Print what the reader took and left out; files that differ from the usual form in full."""
    console = make_console(stderr=True)
    usual = counts = 0
    for result in report.results:
        account, name = result.account, f"{report.name}/{result.name}"
        if account is not None:
            reasons = {one.why for one in account.skipped}
            if reasons - {COUNT_OF_POINTS} or account.unit_from or len(account.columns) > 3:
                console.print(f"{name}:", style="dim", highlight=False, markup=False)
                print_table_account(account)
            else:
                usual, counts = usual + 1, counts + len(reasons)
        if result.left_out:
            texts = ", ".join(map(shortened, result.left_out))
            sentence = say(f"{name}: not read of the certified result: {texts}.")
            console.print(sentence, style="dim", highlight=False, markup=False)
    if usual:
        sentence = say(
            f"{report.name}: all rows of {usual} point files read as x, y, z; unit mm, assumed. "
            f"Left out: the number of points in {counts} of them."
        )
        console.print(sentence, style="yellow", highlight=False, markup=False)


def _fields() -> tuple[tuple[str, str], ...]:
    """Return the columns: the field of a result, and its title."""
    from ocmm_core.features.measured import APEX_LIMIT, DIRECTION_LIMIT, POSITION_LIMIT, SIZE_LIMIT

    return (
        ("position", say(f"Position mm\n(limit {POSITION_LIMIT:.0e})")),
        ("size", say(f"Size mm\n(limit {SIZE_LIMIT:.0e})")),
        ("direction", say(f"Direction rad\n(limit {DIRECTION_LIMIT:.0e})")),
        ("apex", say(f"Apex deg\n(limit {APEX_LIMIT:.0e})")),
        ("form", say(f"Form mm\n(limit {SIZE_LIMIT:.0e})")),
    )


def _lines(report: SetReport) -> list[str]:
    """Return a sentence for every pair that failed or is compared by its residuals alone."""
    lines = []
    for result in report.results:
        if result.failure:
            lines.append(say(f"{report.name}/{result.name}: no fit. {result.failure}"))
        elif not result.passed:
            lines.append(say(f"{report.name}/{result.name}: beyond a limit ({_beyond(result)})."))
        elif result.residual is not None:
            lines.append(
                say(
                    f"{report.name}/{result.name}: several cones pass through its {result.points} "
                    f"points; only residuals are compared, rms {result.residual:.1e} mm."
                )
            )
        elif result.reading:
            lines.append(say(f"{report.name}/{result.name}: agrees when read as {result.reading}."))
    return lines


def _beyond(result: PairResult) -> str:
    """Return every difference of a pair that did not pass."""
    known = [(field, getattr(result, field)) for field, _ in _fields()]
    return ", ".join(f"{field} {value:.1e}" for field, value in known if value is not None)


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.1e}"
