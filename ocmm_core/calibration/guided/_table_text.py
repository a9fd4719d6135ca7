"""Tables as people and programs write them: a head of ``# key: value`` lines, columns, rows.

Separated by tabs, semicolons or commas (the first of these in the line with the column names), with
decimal points, or decimal commas where the comma does not separate. Errors name file and line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError

SEPARATORS = "\t;,"
_LARGEST_TABLE = 16 << 20


@dataclass(frozen=True, slots=True)
class TextRow:
    """One line of a table."""

    line: int
    """Its number in the file, from 1."""
    cells: dict[str, str]
    """By column name."""


@dataclass(frozen=True, slots=True)
class TextTable:
    """A table as it was read."""

    path: Path
    """The file."""
    head: dict[str, tuple[int, str]]
    """Key (lower case) to line number and value."""
    columns: tuple[str, ...]
    """Names, lower case."""
    rows: tuple[TextRow, ...]
    """In the order of the file."""
    decimal_comma: bool

    def value(self, key: str, what: str) -> tuple[int, str]:
        """Return line number and value of a key of the head.

        Raises
        ------
        InputError
            It is missing; ``what`` says what it is for.
        """
        if key not in self.head:
            raise InputError(
                "table.head",
                f"{self.path}: the header has no line '# {key}: ...' with {what}.",
                "Add that line above the column names.",
            )
        return self.head[key]

    def number(self, row: TextRow, column: str) -> float:
        """Return the number in a cell; InputError where it is none."""
        return self.parse(row.line, f"column '{column}'", row.cells[column])

    def parse(self, line: int, where: str, text: str) -> float:
        """Return ``text`` as a finite number; InputError where it is none."""
        plain = text.replace(",", ".") if self.decimal_comma else text
        try:
            number = float(plain)
        except ValueError:
            number = math.nan
        # float() also takes 1_000, which nobody writes on purpose in a list of points.
        if not math.isfinite(number) or "_" in text:
            raise InputError(
                "table.number",
                f"{self.path}, line {line}: {where} holds {text!r}, which is not a number.",
                "Write it with digits and one decimal point or comma, without a unit or thousands "
                "separators.",
            )
        return number


def read_table(path: Path | str, required: tuple[str, ...]) -> TextTable:
    """Read the table at ``path``.

    Parameters
    ----------
    required
        Names of the columns that it must have, lower case; others are kept.

    Raises
    ------
    InputError
        The file cannot be read, is not UTF-8, has no line with the column names, lacks a column or
        names one twice, or a row has another number of cells.
    """
    path = Path(path)
    try:
        text = read_bytes(path, _LARGEST_TABLE).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            "table.encoding",
            f"{path}: byte {error.start} is not UTF-8 text.",
            "Save the file as UTF-8.",
        ) from error
    head: dict[str, tuple[int, str]] = {}
    columns: tuple[str, ...] = ()
    separator = ","
    rows: list[TextRow] = []
    for line, raw in enumerate(text.splitlines(), start=1):
        content = raw.strip()
        # A spreadsheet fills a short line up with separators.
        if not content.strip(SEPARATORS + '" '):
            continue
        if content.lstrip('"').startswith("#"):
            key, colon, value = content.strip(SEPARATORS + ' "').lstrip("# ").partition(":")
            if colon:
                head[key.strip().lower()] = (line, value.strip())
            continue
        if not columns:
            separator = next((sign for sign in SEPARATORS if sign in content), ",")
            columns = tuple(_cells(content, separator, lower=True))
            _check_columns(path, line, columns, required)
            continue
        cells = _cells(raw.strip("\r\n"), separator)
        if len(cells) != len(columns):
            raise InputError(
                "table.cells",
                f"{path}, line {line}: there are {len(cells)} cells, but {len(columns)} columns.",
                "Give every column a cell; with decimal commas separate by semicolons or tabs.",
            )
        rows.append(TextRow(line, dict(zip(columns, cells, strict=True))))
    if not rows:
        raise InputError(
            "table.empty", f"{path}: the table has no rows.", "Give a table with column names and "
            "at least one row below them.",
        )  # fmt: skip
    return TextTable(path, head, columns, tuple(rows), decimal_comma=separator != ",")


def _cells(line: str, separator: str, lower: bool = False) -> list[str]:
    cells = [cell.strip().strip('"').strip() for cell in line.split(separator)]
    return [cell.lower() for cell in cells] if lower else cells


def _check_columns(
    path: Path, line: int, columns: tuple[str, ...], required: tuple[str, ...]
) -> None:
    missing = [name for name in required if name not in columns]
    if missing:
        raise InputError(
            "table.columns",
            f"{path}, line {line}: the column names lack {', '.join(map(repr, missing))}.",
            f"Name the columns {', '.join(required)} in the first line below the header.",
        )
    twice = sorted({name for name in columns if columns.count(name) > 1})
    if twice:
        raise InputError(
            "table.columns",
            f"{path}, line {line}: the column {twice[0]!r} occurs twice.",
            "Give every column its own name.",
        )
