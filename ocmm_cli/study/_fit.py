"""``ocmm fit``: fit one element to the points of a file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from ocmm_cli.terminal import (
    PlainConsole,
    heads,
    make_console,
    print_grid,
    print_table_account,
    tr,
    tr_later,
    tr_word,
)
from ocmm_core.documents import shortened
from ocmm_core.errors import FitError, InputError
from ocmm_core.features.shapes import Shape
from ocmm_core.tables import COUNT_OF_POINTS, TableOptions

if TYPE_CHECKING:
    from ocmm_cli.study._fit_rows import FitRow
    from ocmm_core.features.measured import PairResult, SetReport
    from ocmm_core.features.shapes import Criterion, Fit
    from ocmm_core.geometry import Float
    from ocmm_core.tolerances.uncertainty import FitUncertainty


LISTED = 20
"""Outliers that are printed one by one."""


def _word_of(shape: Shape) -> str:
    return shape.name.lower().replace("_", "-")


SHAPES = {_word_of(shape): shape for shape in Shape}


def _shape_of(word: str) -> Shape:
    if word not in SHAPES:
        words = ", ".join(repr(known) for known in SHAPES)
        raise typer.BadParameter(tr(f"{word!r} is not one of {words}."))
    return SHAPES[word]


def criterion_of(word: str) -> Criterion:
    from ocmm_core.features.shapes import Criterion

    return Criterion[word.upper().replace("-", "_")]


def fit_command(
    file: Path,
    shape: Annotated[Shape, typer.Option(
        parser=_shape_of, metavar=f"<{'|'.join(SHAPES)}>", autocompletion=lambda: list(SHAPES)
    )],
    criterion: str, free: bool, json: bool, layout: TableOptions,
) -> None:  # fmt: skip
    """Fit one element to points and print it with its form, uncertainty and outliers.

    The points are used as they are: no ball radius is subtracted. The account of the file (columns,
    unit, decimal sign, lines left out) is printed to the standard error output.

    The uncertainty follows from the scatter of the residuals, as if it were random and equal
    everywhere; it excludes the measuring system. U covers the true value in 95 of 100 cases for any
    number of points; numbers that the points determine too weakly are shown without U.
    """
    from ocmm_cli.study._fit_rows import fit_json
    from ocmm_core.features.measured import commanding_rows, fit_shape
    from ocmm_core.features.shapes import MINIMUM_POINTS, Criterion, read_points_file
    from ocmm_core.tolerances.uncertainty import fit_uncertainty

    if free and not shape.spec.may_be_free:
        raise InputError(
            "fit.free", f"--free applies to circles, not to a {_word_of(shape)}.", "Omit it."
        )
    if free and criterion in ("inscribed", "circumscribed"):
        raise InputError(
            "fit.free", "--free goes with least-squares and minimum-zone only.", "Omit one."
        )
    held = read_points_file(file, layout)
    points = held.points
    try:
        fit = fit_shape(shape, points, criterion=criterion_of(criterion), free=free)
    except FitError as error:
        odd = commanding_rows(shape, points, free=free)
        why = "" if odd is None else f" {odd.summary}"
        raise FitError(error.code, f"{file}: {error.what}{why}", error.remedy) from error
    odd = commanding_rows(shape, points, free=free)
    found = fit_uncertainty(fit, points)
    if json:
        typer.echo(fit_json(file, held.account, fit, points, criterion, found, odd))
        return
    print_table_account(held.account)
    console = make_console()
    if held.unit != "mm":
        console.show(
            f"Unit {held.unit}: all numbers are in mm, {held.factor:g} times those of the file.",
            style="yellow",
        )
    _print_fit(console, fit, found, len(points), criterion, free=free)
    if odd:
        console.show(f"{odd.summary} Check it, remove its row and fit again.", style="yellow")
    if fit.criterion is Criterion.LEAST_SQUARES:
        _print_outliers(console, fit, points)
    _print_rival(console, fit)
    if fit.rival is None and shape.spec.often_ambiguous and len(points) <= MINIMUM_POINTS[shape]:
        console.show(
            f"{len(points)} points are the minimum for a {shape.value}: other elements "
            "may pass through them too. Take more points.",
            style="yellow",
        )


def _print_fit(
    console: PlainConsole,
    fit: Fit,
    found: FitUncertainty | None,
    n: int,
    criterion: str,
    *,
    free: bool,
) -> None:
    from ocmm_cli.study._fit_rows import rows_of
    from ocmm_core.tolerances.decisions import U_LABEL

    how = f"{tr_word(criterion)} ({tr_word(fit.criterion.value)})"
    if free:
        how += f", {tr('one problem in space')}"
    rows, cells = rows_of(fit, found), []
    for row in rows:
        digits = 12 if row.unit == "" else 9
        text = "  ".join(f"{value:.{digits}f}" for value in row.values)
        own = row.expanded
        cells.append((row.words, text, "–" if own is None else f"{own:.2g} {row.stated_unit}"))
    title = tr(f"{fit.shape.value} through {n:d} points:") + f" {how}"
    print_grid(console, ("", tr_word("Value"), U_LABEL), cells, title)
    if fit.contacts:
        held = ", ".join(str(row + 1) for row in fit.contacts)
        console.show(f"Contact points {held} (rows of the file, from 1).", highlight=True)
    _print_uncertainty(console, rows)


def _print_uncertainty(console: PlainConsole, rows: Sequence[FitRow]) -> None:
    """Print the meaning of U, and why a number has none."""
    stated = [row for row in rows if row.stated is not None]
    if not stated:
        console.show(
            "No uncertainty: it needs least squares with more points than the element requires.",
            style="dim",
        )
        return
    known = [row.stated for row in stated if row.stated is not None and row.stated.k is not None]
    if known:
        degrees = _range([one.degrees for one in known], 1)
        factors = _range([one.k for one in known if one.k is not None], 2)
        console.show(
            f"U from the scatter of the points: {degrees} degrees of freedom, k = {factors}. It "
            "excludes the measuring system.",
            style="dim",
        )
    weak = [row.words for row in stated if row.stated is not None and not row.stated.valid]
    if weak:
        console.show(
            f"No U for {', '.join(weak)}: the points determine the element too weakly. "
            "Take more points, spread over more of it.",
            style="yellow",
        )


def _range(values: Sequence[float], digits: int) -> str:
    """Return the one value, or the least and the greatest."""
    low, high = (f"{round(value, digits):g}" for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def _print_outliers(console: PlainConsole, fit: Fit, points: Float) -> None:
    from ocmm_core.features.measured import outliers

    found = outliers(fit, points)
    for row in found[:LISTED]:
        console.show(
            f"Outlier: point {row + 1} is {fit.residuals[row]:+.6f} mm off; still used in the fit.",
            style="yellow",
        )
    if len(found) > LISTED:
        console.show(
            f"{len(found) - LISTED:d} more outlier{'' if len(found) - LISTED == 1 else 's'}.",
            style="yellow",
        )
    if not found:
        console.show("No outliers.", style="dim")


def _print_rival(console: PlainConsole, fit: Fit) -> None:
    from ocmm_core.features.search import sizes_in_words

    if fit.rival is None:
        return
    console.print(
        Text.assemble(
            ("AMBIGUOUS:", "bold red"),
            tr(
                " the points fit two elements, and their noise cannot tell which. Use neither; "
                "take more points, spread over more of the feature."
            ),
        )
    )
    for word, one in ((tr_later("The one above:"), fit), (tr_later("The other one:"), fit.rival)):
        centre = ", ".join(f"{value:.6f}" for value in one.point)
        console.print(
            f"{tr(word)} {sizes_in_words(one)}, "
            + tr(f"at {centre}; rms of the residuals {one.rms:.9f} mm.")
        )


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
            Text(tr_word("PASS"), "green") if report.passed
            else Text(tr_word("FAIL"), "bold red"),
        )
        for report in reports
    ]  # fmt: skip
    columns = (*heads("Set", "Pairs"), *(title for _, title in shown), tr_word("Result"))
    print_grid(console, columns, rows, tr_word("Worst error of each set"))
    for report in reports:
        for line in _lines(report):
            console.print(line)
    failed = sum(not result.passed for report in reports for result in report.results)
    total = sum(len(report.results) for report in reports)
    console.show(f"{total - failed} of {total} pairs within the limits.")
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
                console.print(f"{name}:", style="dim")
                print_table_account(account)
            else:
                usual, counts = usual + 1, counts + len(reasons)
        if result.left_out:
            texts = ", ".join(map(shortened, result.left_out))
            sentence = tr(f"{name}: not read of the certified result: {texts}.")
            console.print(sentence, style="dim")
    if usual:
        sentence = tr(
            f"{report.name}: all rows of {usual} point files read as x, y, z; unit mm, assumed. "
            f"Left out: the number of points in {counts} of them."
        )
        console.print(sentence, style="yellow")


def _fields() -> tuple[tuple[str, str], ...]:
    """Return the columns: the field of a result, and its title."""
    from ocmm_core.features.measured import APEX_LIMIT, DIRECTION_LIMIT, POSITION_LIMIT, SIZE_LIMIT

    return (
        ("position", tr(f"Position mm\n(limit {POSITION_LIMIT:.0e})")),
        ("size", tr(f"Size mm\n(limit {SIZE_LIMIT:.0e})")),
        ("direction", tr(f"Direction rad\n(limit {DIRECTION_LIMIT:.0e})")),
        ("apex", tr(f"Apex deg\n(limit {APEX_LIMIT:.0e})")),
        ("form", tr(f"Form mm\n(limit {SIZE_LIMIT:.0e})")),
    )


def _lines(report: SetReport) -> Iterator[str]:
    """Yield a sentence for every pair that failed or is compared by its residuals alone."""
    for result in report.results:
        if result.failure:
            yield tr(f"{report.name}/{result.name}: no fit. {result.failure}")
        elif not result.passed:
            yield tr(f"{report.name}/{result.name}: beyond a limit ({_beyond(result)}).")
        elif result.residual is not None:
            yield tr(
                f"{report.name}/{result.name}: several cones pass through its {result.points} "
                f"points; only residuals are compared, rms {result.residual:.1e} mm."
            )
        elif result.reading:
            yield tr(f"{report.name}/{result.name}: agrees when read as {result.reading}.")


def _beyond(result: PairResult) -> str:
    """Return every difference of a pair that did not pass."""
    known = [(field, getattr(result, field)) for field, _ in _fields()]
    return ", ".join(f"{field} {value:.1e}" for field, value in known if value is not None)


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.1e}"
