"""Points of a text file or a mesh, in mm, with the account of the reader."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ocmm_core.documents import shortened
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Points3
from ocmm_core.tables._account import COUNT_OF_POINTS, TableAccount, TableColumn, TableOptions
from ocmm_core.tables._columns import (
    AXES,
    ColumnPlan,
    are_units,
    check_texts,
    checked_roles,
    counted_roles,
    find_heading,
    heading_roles,
    require_one_set,
    stated_columns,
)
from ocmm_core.tables._grid import (
    TextGrid,
    fault,
    heading_cells,
    read_grid,
    require_no_codes,
    require_whole,
)
from ocmm_core.tables._headings import is_summary
from ocmm_core.tables._meshes import Mesh, read_mesh
from ocmm_core.tables._named import NamedColumns, TextRow, TextTable, read_table
from ocmm_core.tables._numbers import NUMBER, NumberGrammar, grammar_of, is_number, number_with_unit
from ocmm_core.tables._text import bytes_of, text_lines
from ocmm_core.tables._unit_choice import PIXELS, choose_unit, statements_in

_UV = ("u", "v")
_PIXEL_WORDS = ("px", "pixel", "pixels")


@dataclass(frozen=True, slots=True)
class PixelTable:
    """Rows with a spot each, the uncertainty of a spot, and the account of the reader."""

    table: TextTable
    sigma_px: float
    """Standard deviation of a spot, px per axis; above zero."""
    account: TableAccount

    def uv(self, row: TextRow) -> tuple[float, float]:
        """Return the place of a spot, px; InputError if a cell is not a number."""
        return self.table.number(row, "u"), self.table.number(row, "v")


def read_pixels(
    path: Path | str, columns: tuple[str, ...], options: TableOptions | None = None
) -> PixelTable:
    """Return a table of spots; ``columns`` are all its columns, with ``u`` and ``v`` in pixels.

    InputError as `read_table`, if the header lacks ``sigma``, or the file states a unit of length.
    """
    table = read_table(path, NamedColumns(columns, _UV), options)
    stated = [(line, text) for name, (line, text) in table.units.items() if name in _UV]
    if "unit" in table.head:
        stated.append(table.head["unit"])
    others = [one for one in stated if one[1].casefold().strip(" []().") not in _PIXEL_WORDS]
    if "unit" not in table.head:
        others += [(line, one.text) for line, one in statements_in(table.comments)]
    if others:
        line, text = others[0]
        raise InputError(
            "table.unit",
            f"{table.path}, line {line}: the unit is {shortened(text)}, but spots are in px.",
            "Give u and v in pixels of the full sensor, with the heading u, v or u [px], v [px].",
        )
    line, text, sigma = table.head_number("sigma", "the uncertainty of a spot, in px")
    if not sigma > 0.0:
        raise InputError(
            "table.value",
            f"{table.path}, line {line}: 'sigma' is {text}, but must be greater than zero.",
            "State its value.",
        )
    return PixelTable(table, sigma, table.account(PIXELS))


MOST_POINTS = 300_000
FARTHEST_MM = 1e7
"""Ten kilometres; larger coordinates are not measurements and lose digits in a fit."""
_COUNT = re.compile(r"(\d{1,9})(\s+(points?|pts|punkte|3))?", re.IGNORECASE)
"""Of points, also as rows and columns of a table."""
_MISSING = ("nan", "inf", "infinity", "n/a", "na", "null", "none", "", "#n/a", "#ref!", "#value!")
"""Texts of programs in the place of a number."""
_GIVE_ROWS = "Give one row with x, y and z for every point."


@dataclass(frozen=True, slots=True)
class PointsFile:
    points: Points3
    """(n, 3), mm."""
    account: TableAccount
    """Rows read and lines left out."""

    @property
    def unit(self) -> str:
        return self.account.unit

    @property
    def factor(self) -> float:
        """Return the size of the unit of the file in mm."""
        return self.account.factor


def read_points_file(path: Path | str, options: TableOptions | None = None) -> PointsFile:
    """Return the points of a text file or a mesh, and the account of the reader.

    A row of a text file has x, y and z. A heading decides the order of the columns; without one,
    names may be next to three numbers, and a unit vector may follow. The vertices of PLY, OBJ, OFF,
    STL and PCD are read as the format prescribes. The unit is the one that the file states, else
    mm. Each line that is not read has an entry in the account. InputError, naming the line, if a
    row, a column, a number or a unit could have several meanings, or the file cannot be read.
    """
    file, options = Path(path), options or TableOptions()
    content = bytes_of(file)
    mesh = read_mesh(file, content)
    if mesh is not None:
        return _of_mesh(file, mesh, options)
    grid = read_grid(file, text_lines(file, content), options)
    return _of_text(file, grid, options, has_end=content.rstrip(b"\0")[-1:] in (b"\n", b"\r"))


def _of_mesh(file: Path, mesh: Mesh, options: TableOptions) -> PointsFile:
    units = choose_unit(file, statements_in(mesh.comments), {}, options)
    points = units.in_mm(mesh.points)
    if not len(points):
        raise InputError("table.empty", f"{file}: no points.", "Give a file with vertices.")
    if len(points) > MOST_POINTS or not bool(np.all(np.abs(points) < FARTHEST_MM)):
        what = f"more than {MOST_POINTS:,} points" if len(points) > MOST_POINTS else (
            "a coordinate is more than 10 km, or not a number"
        )  # fmt: skip
        raise InputError(
            "table.points", f"{file}: {what}.", "Give a file with the points of one feature."
        )
    columns = tuple(TableColumn(axis, axis) for axis in AXES)
    account = TableAccount(
        file, mesh.form, len(points), mesh.lines, columns, units.symbol, units.factor,
        units.evidence, skipped=mesh.skipped,
    )  # fmt: skip
    return PointsFile(points, account)


def _of_text(file: Path, grid: TextGrid, options: TableOptions, *, has_end: bool) -> PointsFile:
    plan, body = _heading(grid, options)
    rows, titles = _rows(grid, body, plan, options)
    if not rows:
        raise InputError("table.empty", f"{file}: no points.", "Give rows with x, y and z.")
    if plan is None:
        roles = counted_roles(file, rows)
        plan = ColumnPlan(tuple(str(place + 1) for place in range(len(roles))), roles)
    for line, text in grid.comments:
        if line != plan.line:
            grid.log.add(line, text, "is a comment")
    check_texts(file, len(grid.comments) + len(grid.behind) + len(titles))
    statements = statements_in([*grid.comments, *grid.behind, *titles])
    bare, suffixes = _without_units(rows, [plan.index(axis) for axis in AXES])
    unit_cells = [(line, cells[plan.index("unit")]) for line, cells in rows if "unit" in plan.roles]
    lines = [line for line, _ in rows]
    units = choose_unit(
        file, statements, plan.units(file, AXES), options, unit_cells or suffixes,
        between=(lines[0], lines[-1]),
    )  # fmt: skip
    coordinates = list(zip(lines, bare, strict=True))
    require_no_codes(file, coordinates)
    if not has_end:
        require_whole(file, coordinates)
    if not options.columns:
        require_one_set(grid, plan, rows)
    values, grammar = _values(file, plan, rows, bare, options)
    points = units.in_mm(values)
    far = ~(np.abs(points) < FARTHEST_MM).all(axis=1)
    if far.any():
        line, cells = rows[int(np.argmax(far))]
        raise fault(
            file, line, "number", " ".join(cells), "has a coordinate of more than 10 km",
            "Check the number, and the unit of the file.",
        )  # fmt: skip
    columns = tuple(
        TableColumn(heading, role, units.of_column.get(role, ""))
        for heading, role in zip(plan.headings, plan.roles, strict=True)
    )
    account = TableAccount(
        file, "Text", len(rows), (rows[0][0], rows[-1][0]), columns, units.symbol, units.factor,
        units.evidence, grid.separator, grammar.decimal, grammar.evidence, grid.log.entries(),
    )  # fmt: skip
    return PointsFile(points, account)


def _heading(
    grid: TextGrid, options: TableOptions
) -> tuple[ColumnPlan | None, list[tuple[int, str]]]:
    """Return the columns that --columns or the heading names, and the lines below the heading."""
    found = find_heading(grid)
    body = grid.body
    plan = None
    if found is not None:
        line, cells, roles = found
        for number, text in body:
            if number < line:
                grid.log.add(number, text, "above the heading")
            if number == line:
                grid.log.add(number, text, "is the heading")
        body = [one for one in body if one[0] > line]
        if not options.columns:
            roles = checked_roles(grid.path, line, cells, roles)
        plan = ColumnPlan(tuple(cells), roles, line)
        if body and are_units(units := grid.splitter()(*body[0])):
            grid.log.add(*body[0], "units of the columns")
            plan = replace(plan, unit_row=tuple(units))
            body = body[1:]
    if options.columns:
        stated = stated_columns(options.columns)
        if plan is not None and len(plan.headings) == len(stated):
            return replace(plan, roles=stated), body
        names = tuple(str(place + 1) for place in range(len(stated)))
        return ColumnPlan(names, stated, 0 if plan is None else plan.line), body
    return plan, body


def _rows(
    grid: TextGrid, body: list[tuple[int, str]], plan: ColumnPlan | None, options: TableOptions
) -> tuple[list[tuple[int, list[str]]], list[tuple[int, str]]]:
    """Return the rows of points, and the titles around them; each other line gets an entry."""
    split, file = grid.splitter(), grid.path
    width = 0 if plan is None else len(plan.headings)
    has_heading = plan is not None and plan.line > 0
    rows: list[tuple[int, list[str]]] = []
    titles = [one for one in grid.body if plan is not None and one[0] < plan.line]
    announced: int | None = None
    last = _last_with_numbers(split, body)
    for place, (line, text) in enumerate(body):
        cells = split(line, text)
        while len(cells) > max(width, 1) and not cells[-1]:
            cells.pop()
        words = [cell for cell in cells if cell and not is_number(cell)]
        count = len(cells) - len(words) - cells.count("")
        if not count and (place > last or not (rows or has_heading)):
            if heading_roles(heading_cells(text, grid.separator)) is not None:
                raise fault(
                    file, line, "heading", text, "is a heading below the first row",
                    "Give a file with one table.",
                )  # fmt: skip
            if len(cells) == width and rows:
                raise fault(file, line, "row", text, "has no numbers", _GIVE_ROWS)
            titles.append((line, text))
            grid.log.add(line, text, "below the points" if rows else "is a title")
        elif words and is_summary(words):
            grid.log.add(line, text, "not a point by its first word")
        elif not rows and announced is None and _COUNT.fullmatch(text):
            announced = int(text.split()[0])
            grid.log.add(line, text, COUNT_OF_POINTS)
        elif not rows and not has_heading and _is_title(cells, words, count):
            titles.append((line, text))
            grid.log.add(line, text, "is a title")
        else:
            width = width or len(cells)
            if len(cells) != width:
                raise _wrong_width(grid, line, text, len(cells), width, has_heading=has_heading)
            if len(rows) == MOST_POINTS:
                raise InputError(
                    "table.points",
                    f"{file}, line {line}: more than {MOST_POINTS:,} points.",
                    "Give a file with the points of one feature.",
                )
            rows.append((line, cells))
    if announced is not None and announced != len(rows):
        raise InputError(
            "table.count",
            f"{file}: the first line declares {announced} points, but {len(rows)} follow.",
            "Check that the file is complete.",
        )
    return rows, titles


def _is_title(cells: list[str], words: list[str], count: int) -> bool:
    """Return whether a row is text, and not a point with a missing number."""
    failed = any(word.lower().strip("+-") in _MISSING for word in words)
    few = count < len(AXES) and count <= len(words)
    return few and bool(words) and not is_number(cells[0]) and not failed


def _last_with_numbers(
    split: Callable[[int, str], list[str]], body: Sequence[tuple[int, str]]
) -> int:
    for place in range(len(body) - 1, -1, -1):
        if any(map(is_number, split(*body[place]))):
            return place
    return -1


def _wrong_width(
    grid: TextGrid, line: int, text: str, count: int, width: int, *, has_heading: bool
) -> InputError:
    if grid.separator == "," and count == 2 * width:
        what = f"could be {width} numbers with decimal commas or {count}"
        remedy = "Write the numbers with a decimal point, or separate them by semicolons."
    elif has_heading:
        what = f"has {count} cells, the heading {width}"
        remedy = "State the columns, such as name,x,y,z."
    else:
        what, remedy = f"has {count} cells, not {width}", _GIVE_ROWS
    return fault(grid.path, line, "cells", text, what, remedy)


def _without_units(
    rows: Sequence[tuple[int, list[str]]], places: Sequence[int]
) -> tuple[list[list[str]], list[tuple[int, str]]]:
    """Return the coordinates as texts, and the units behind them (empty if there are none)."""
    bare: list[list[str]] = []
    units: list[tuple[int, str]] = []
    for line, cells in rows:
        texts = [cells[place] for place in places]
        if not all(map(NUMBER.fullmatch, texts)):
            split = [number_with_unit(text) for text in texts]
            texts = [text for text, _ in split]
            own = [unit for _, unit in split if unit is not None]
            if own:
                same = len(own) == len(texts) and len({unit.symbol for unit in own}) == 1
                units.append((line, own[0].symbol if same else "several units"))
        bare.append(texts)
    return bare, units and [(line, dict(units).get(line, "")) for line, _ in rows]


def _values(
    file: Path,
    plan: ColumnPlan,
    rows: Sequence[tuple[int, list[str]]],
    bare: Sequence[Sequence[str]],
    options: TableOptions,
) -> tuple[Float, NumberGrammar]:
    """Return the coordinates (n, 3) in the unit of the file, and the decimal sign."""
    cells = [(line, text) for (line, _), texts in zip(rows, bare, strict=True) for text in texts]
    try:
        grammar = grammar_of(file, cells, options.decimal)
    except InputError:
        # Other columns may have the evidence.
        texts = [place for place, role in enumerate(plan.roles) if role in ("name", "unit")]
        more = [
            (line, text)
            for line, row in rows
            for place, text in enumerate(row)
            if place not in texts and is_number(text)
        ]
        grammar = grammar_of(file, more, options.decimal)
    found = np.array([[grammar.value(text) for text in texts] for texts in bare], dtype=np.float64)
    bad = ~np.isfinite(found)
    if bad.any():
        row, column = map(int, np.argwhere(bad)[0])
        text = bare[row][column]
        raise fault(
            file, rows[row][0], "number", text, "is not a coordinate",
            "Give numbers such as 12.345 or -1.2e-3; state another decimal sign, or "
            "lines to skip.",
        )  # fmt: skip
    return found, grammar
