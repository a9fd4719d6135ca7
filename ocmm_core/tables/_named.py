"""Tables whose first line names the columns, with a head of ``# key: value`` lines."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.documents import shortened
from ocmm_core.errors import InputError
from ocmm_core.tables._account import SkippedRows, TableAccount, TableColumn, TableOptions
from ocmm_core.tables._columns import are_units, with_units_below
from ocmm_core.tables._grid import heading_cells, read_grid, require_no_codes
from ocmm_core.tables._headings import is_summary, role_of
from ocmm_core.tables._numbers import NumberGrammar, grammar_of, is_number
from ocmm_core.tables._text import bytes_of, text_lines
from ocmm_core.tables._unit_choice import UnitChoice, choose_unit, statements_in
from ocmm_core.units import heading_unit

_LARGEST_TABLE = 16 << 20
_SIGNS = "\t;|,"


@dataclass(frozen=True, slots=True)
class NamedColumns:
    """Required and known columns of a table."""

    required: tuple[str, ...]
    """Lower case."""
    numbers: tuple[str, ...]
    """Columns of numbers, which prove the decimal sign."""
    known: tuple[str, ...] | None = None
    """All columns that may occur; None if others are left out."""
    optional: tuple[str, ...] = ()
    """Columns that are read if they occur."""

    @property
    def read(self) -> frozenset[str]:
        return frozenset((*self.required, *self.numbers, *self.optional, *(self.known or ())))


@dataclass(frozen=True, slots=True)
class TextRow:
    """One line of a table."""

    line: int
    """Its number in the file, from 1."""
    cells: dict[str, str]


@dataclass(frozen=True, slots=True)
class TextTable:
    """A table as it was read."""

    path: Path
    head: dict[str, tuple[int, str]]
    """Key (lower case) to line number and value."""
    columns: tuple[str, ...]
    """Names, lower case; empty for a column that is not read."""
    rows: tuple[TextRow, ...]
    """In the order of the file."""
    heading_line: int
    headings: tuple[str, ...]
    units: Mapping[str, tuple[int, str]]
    """Line and text of the unit in the heading of a column, by its name."""
    comments: tuple[tuple[int, str], ...]
    separator: str
    grammar: NumberGrammar
    skipped: tuple[SkippedRows, ...]
    sha256: str

    def value(self, key: str, what: str) -> tuple[int, str]:
        """Return line and value of a key of the head; InputError, naming ``what``, if missing."""
        if key not in self.head:
            raise InputError(
                "table.head",
                f"{self.path}: the header has no line '# {key}: ...' with {what}.",
                "Add that line above the column names.",
            )
        return self.head[key]

    def number(self, row: TextRow, column: str) -> float:
        """Return the number in a cell; InputError if it is not a number."""
        return self._checked(self.grammar, row.line, f"column '{column}'", row.cells[column])

    def head_number(self, key: str, what: str) -> tuple[int, str, float]:
        """Return line, text and number of a key of the head, by its own decimal sign."""
        line, text = self.value(key, what)
        grammar = grammar_of(self.path, [(line, text)])
        return line, text, self._checked(grammar, line, f"'{key}'", text)

    def _checked(self, grammar: NumberGrammar, line: int, where: str, text: str) -> float:
        number = grammar.value(text)
        if not math.isfinite(number):
            raise InputError(
                "table.number",
                f"{self.path}, line {line}: {where} holds {text!r}, which is not a number.",
                "Write it with digits and one decimal point or comma, without a unit.",
            )
        return number

    def unit(self, roles: Sequence[str], options: TableOptions | None = None) -> UnitChoice:
        """Return the unit of the columns ``roles``; InputError if it is unknown or contradictory.

        It is that of the user, of the headings or of a comment; mm if none states one.
        """
        units = {name: found for name, found in self.units.items() if name in roles}
        stated = statements_in(self.comments)
        rows = [(row.line, row.cells["unit"]) for row in self.rows if "unit" in row.cells]
        between = (self.rows[0].line, self.rows[-1].line) if self.rows else (0, 0)
        return choose_unit(
            self.path, stated, units, options or TableOptions(), rows, roles, between
        )

    def account(self, unit: UnitChoice) -> TableAccount:
        columns = tuple(
            TableColumn(heading, name, unit.of_column.get(name, ""))
            for heading, name in zip(self.headings, self.columns, strict=True)
        )
        return TableAccount(
            self.path, "Table", len(self.rows), (self.rows[0].line, self.rows[-1].line), columns,
            unit.symbol, unit.factor, unit.evidence, self.separator, self.grammar.decimal,
            self.grammar.evidence, self.skipped,
        )  # fmt: skip


def read_table(
    path: Path | str,
    wanted: NamedColumns,
    options: TableOptions | None = None,
    most: int = _LARGEST_TABLE,
) -> TextTable:
    """Return the table at ``path``.

    InputError if the file cannot be read, has no line with the column names, lacks a column or
    names one twice, a row has another number of cells, or the decimal sign is ambiguous.
    """
    path, options = Path(path), options or TableOptions()
    content = bytes_of(path, most)
    grid = read_grid(path, text_lines(path, content), options, has_texts=True)
    if not grid.body:
        raise _empty(path)
    line, text = grid.body[0]
    if not grid.is_declared:
        blank = " " if len(wanted.read) > 1 else ","
        grid.separator = next((sign for sign in _SIGNS if sign in text), blank)
    names = [heading_unit(cell) for cell in heading_cells(text, grid.separator)]
    while len(names) > 1 and not names[-1][0]:
        names.pop()
    columns, has_heading = _roles([cell for cell, _ in names], wanted), True
    if options.columns:
        columns, has_heading = _stated(options.columns, [cell for cell, _ in names], wanted)
    _check_columns(path, line, columns, wanted)
    if has_heading:
        grid.log.add(line, text, "is the heading")
    split = grid.splitter()
    units = {
        name: (line, unit) for name, (_, unit) in zip(columns, names, strict=True) if name and unit
    } if has_heading else {}  # fmt: skip
    rows = []
    body = grid.body[has_heading:]
    if has_heading and body:
        below = dict(zip(columns, split(*body[0]), strict=False))
        if _states_units(below, wanted):
            units = with_units_below(path, units, body[0][0], below)
            grid.log.add(*body.pop(0), "units of the columns")
    for number, row in body:
        cells = split(number, row)
        while len(cells) > len(columns) and not cells[-1]:
            cells.pop()
        if not any(cells):
            continue
        if len(cells) != len(columns):
            hint = " A decimal comma needs semicolons or tabs between the columns."
            raise InputError(
                "table.cells",
                f"{path}, line {number}: there are {len(cells)} cells, but {len(columns)} columns.",
                f"Give every column a cell.{hint * (grid.separator == ',')}",
            )
        words = [cell for cell in cells if cell and not is_number(cell)]
        if words and is_summary(words):
            grid.log.add(number, row, "not a point by its first word")
            continue
        of_name = {name: cell for name, cell in zip(columns, cells, strict=True) if name}
        rows.append(TextRow(number, of_name))
    if not rows:
        raise _empty(path)
    numbers = [
        (row.line, cell)
        for row in rows
        for name in wanted.numbers
        if is_number(cell := row.cells.get(name, ""))
    ]
    for number, comment in grid.comments:
        grid.log.add(number, comment, "belongs to the header" if ":" in comment else "is a comment")
    for name in wanted.numbers:
        if name in columns:
            require_no_codes(path, [(row.line, [row.cells[name]]) for row in rows])
    return TextTable(
        path, _head(path, grid.comments), tuple(columns), tuple(rows), line if has_heading else 0,
        tuple(name for name, _ in names) if has_heading else tuple(columns), units,
        tuple(grid.comments), grid.separator, grammar_of(path, numbers, options.decimal),
        grid.log.entries(), hashlib.sha256(content).hexdigest(),
    )  # fmt: skip


def _states_units(below: Mapping[str, str], wanted: NamedColumns) -> bool:
    """Return whether the row below the heading has a unit for each required number."""
    needed = [below.get(name, "") for name in wanted.required if name in wanted.numbers]
    return all(needed) and are_units(needed) and are_units(list(below.values()))


def _roles(headings: Sequence[str], wanted: NamedColumns) -> list[str]:
    """Return the names of columns; headings of other programs get the name that they mean.

    "X-Koordinate" is x and "Point" a name, unless another column has that name.
    """
    columns = [heading.lower() for heading in headings]
    meant = [role_of(heading) for heading in headings]
    for place, role in enumerate(meant):
        if role in wanted.read and role not in columns and columns[place] not in wanted.read:
            columns[place] = role if meant.count(role) == 1 else columns[place]
    if wanted.known is not None:
        return columns
    return [name if name in wanted.read else "" for name in columns]


def _empty(path: Path) -> InputError:
    return InputError(
        "table.empty",
        f"{path}: the table has no rows.",
        "Give a table with column names and at least one row below them.",
    )


def _head(path: Path, comments: Sequence[tuple[int, str]]) -> dict[str, tuple[int, str]]:
    head: dict[str, tuple[int, str]] = {}
    for line, text in comments:
        key, colon, value = text.strip(_SIGNS + ' "').lstrip("#/ ").partition(":")
        name = key.strip().lower()
        if not colon:
            continue
        if name in head and head[name][1] != value.strip():
            raise InputError(
                "table.head",
                f"{path}, line {line}: '{shortened(name)}' contradicts line {head[name][0]}.",
                "Keep one of the two lines.",
            )
        head[name] = (line, value.strip())
    return head


def _stated(text: str, heading: Sequence[str], wanted: NamedColumns) -> tuple[list[str], bool]:
    """Return the columns of --columns, and whether the first line is a heading."""
    words = [word.strip().lower() for word in text.replace(";", ",").split(",")]
    columns = ["" if word in ("-", "_") else word for word in words]
    if len(columns) != len(heading):
        raise InputError(
            "table.columns",
            f"{len(columns)} columns are stated, the table has {len(heading)}.",
            "Name every column, with '-' for one that is not read.",
        )
    numeric = [cell for cell, name in zip(heading, columns, strict=True) if name in wanted.numbers]
    return columns, not any(map(is_number, numeric))


def _check_columns(path: Path, line: int, columns: Sequence[str], wanted: NamedColumns) -> None:
    where = f"{path}, line {line}: "
    for name in columns:
        if wanted.known is not None and name not in (*wanted.known, ""):
            raise InputError(
                "table.columns",
                f"{where}there is no column {shortened(name)}.",
                f"Columns are {', '.join(wanted.known)}. State '-' for a column that is not read.",
            )
    missing = [name for name in wanted.required if name not in columns]
    if missing:
        raise InputError(
            "table.columns",
            f"{where}the column names lack {', '.join(map(repr, missing))}.",
            f"Name the columns {', '.join(wanted.required)} in the first line below the header.",
        )
    twice = sorted({name for name in columns if name and columns.count(name) > 1})
    if twice:
        raise InputError(
            "table.columns",
            f"{where}the column {twice[0]!r} occurs twice.",
            "Give every column its own name.",
        )
