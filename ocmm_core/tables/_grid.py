"""Lines of a table as cells: comments, separators, skipped lines.

The preview for an import page has the first and last lines, with their fate.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from ocmm_core.documents import shortened
from ocmm_core.errors import InputError
from ocmm_core.tables._account import SKIPPED_BY_USER, SkippedLog, TableAccount, TableOptions
from ocmm_core.tables._numbers import BLANKS, is_number, plain_signs
from ocmm_core.tables._text import bytes_of, text_lines
from ocmm_core.units import find_unit

_CODE = re.compile(r"[-+]?(?P<nines>9{3,})(?:[.,](?:0*|25))?")
LEAST = 3
"""Rows of one kind that make another one suspect."""


def require_no_codes(path: Path, rows: Sequence[tuple[int, Sequence[str]]]) -> None:
    """Raise InputError if a cell such as -9999 stands for a missing value.

    ``rows``: line, texts of coordinates. A code has fewer decimals than the rest of its column, or
    is far beyond it.
    """
    for place in range(len(rows[0][1])):
        found = [(line, row[place]) for line, row in rows if _CODE.fullmatch(row[place])]
        if not found:
            continue
        rest = [row[place] for _, row in rows if not _CODE.fullmatch(row[place])]
        others, digits = [_decimals(text) for text in rest], max(map(_digits, rest), default=9)
        for line, text in found:
            # Whole coordinates of three nines, or a quarter more, are no rare measurements.
            is_long = text.strip("+-").startswith("9999")
            least = max(others, default=0) if is_long else min(others, default=0)
            if _decimals(text) < least or (is_long and _digits(text) > digits):
                raise fault(
                    path, line, "number", text, "may be a code for a missing value",
                    "Skip the line, or write the coordinate with all decimals, as the others.",
                )  # fmt: skip


def _decimals(text: str) -> int:
    return len(re.split("[.,]", text)[-1]) if re.search("[.,]", text) else 0


def _digits(text: str) -> int:
    """Return the number of digits before the decimal sign."""
    return len(re.split("[.,]", text)[0].strip("+-"))


def require_whole(path: Path, rows: Sequence[tuple[int, Sequence[str]]]) -> None:
    """Raise InputError if the last number may be cut off: it alone has fewer decimals.

    ``rows`` as of `require_no_codes`, of a file whose last line has no end.
    """
    last, others = _decimals(rows[-1][1][-1]), {_decimals(row[-1]) for _, row in rows[:-1]}
    if len(rows) > LEAST and len(others) == 1 and last < min(others):
        raise fault(
            path, rows[-1][0], "number", rows[-1][1][-1], "may be cut off: the file ends behind it",
            "Copy the file again; if it is complete, end its last line.",
        )  # fmt: skip


LONGEST_ROW = 4000
_SEP = re.compile(r'"?sep=(.)"?[;,]*', re.IGNORECASE)
_COMMENT = re.compile(r"\s*(#|%|!|//|\$\$|'|;|\*)")
_TRAILING = re.compile(r"(?:(?<=[\s;,])|(?<=\d))(?:#|%|!|//|\$\$)[^;,\d].*$")
_RULE = re.compile(r"[\s\-=_+|:*~.;,]*")
_LINE = re.compile(r"([-=_*~])\1\1")
_TEXT_NUMBER = re.compile(r"""(?:=\s*"?|')([^"'=]*)["']?""")
_ODD_BLANK = re.compile(f"[{BLANKS}]")


@dataclass(slots=True)
class TextGrid:
    """Lines of a table that may be rows, and those that cannot be."""

    path: Path
    separator: str
    """Sign between cells; a blank means any run of blanks and tabs."""
    body: list[tuple[int, str]]
    """Line number and text without comments."""
    comments: list[tuple[int, str]] = field(default_factory=list)
    behind: list[tuple[int, str]] = field(default_factory=list)
    log: SkippedLog = field(default_factory=SkippedLog)
    rules: list[int] = field(default_factory=list)
    """Lines such as "-----" below the first line."""
    gaps: list[int] = field(default_factory=list)
    """Empty lines below the first line, the last one of several."""
    is_declared: bool = False
    """The file names its separator itself."""

    def splitter(self) -> Callable[[int, str], list[str]]:
        """Return the function that splits a line into cells."""
        return _by_blanks if self.separator == " " else self._by_sign

    def _by_sign(self, line: int, text: str) -> list[str]:
        separator = self.separator
        if separator == "|":
            text = text.strip().strip("|")
        if '"' not in text:
            cells = [cell.strip() for cell in text.split(separator)]
            return [_constant(cell) for cell in cells] if "=" in text or "'" in text else cells
        try:
            (row,) = csv.reader([text], delimiter=separator, skipinitialspace=True, strict=True)
        except (csv.Error, ValueError):
            if text.count('"') % 2 and re.search(rf'(?:^|{re.escape(separator)})\s*"', text):
                raise InputError(
                    "table.quote",
                    f"{self.path}, line {line}: a quotation mark is not closed; the table is not "
                    "complete.",
                    "Save the table again; a cell may not have several lines.",
                ) from None
            row = text.split(separator)
        return [_constant(cell.strip()) for cell in row]


def read_grid(
    path: Path, lines: Sequence[str], options: TableOptions, *, has_texts: bool = False
) -> TextGrid:
    """Return the lines of a table, without comments and lines that the user skips.

    ``has_texts``: cells are free text: a comment needs a separate line. InputError if a line is
    longer than any row, or --skip cannot be understood.
    """
    grid = TextGrid(path, " ", [])
    skipped = options.skipped()
    declared = ""
    for number, raw in enumerate(lines, start=1):
        text = raw.strip().lstrip("\ufeff")
        if not text:
            if grid.body:
                if grid.gaps[-1:] == [number - 1]:
                    grid.gaps.pop()
                grid.gaps.append(number)
            continue
        if any(number in rows for rows in skipped):
            grid.log.add(number, text, SKIPPED_BY_USER)
            continue
        if len(text) > LONGEST_ROW:
            raise InputError(
                "table.row",
                f"{path}, line {number}: it has more than {LONGEST_ROW} characters.",
                "Give one row for every point or feature.",
            )
        if not declared and not grid.body and (sign := _SEP.fullmatch(text)) is not None:
            declared = sign[1]
            grid.log.add(number, text, "names the separator")
        elif is_comment(text) if not has_texts else _is_head(text):
            grid.comments.append((number, text))
        elif _RULE.fullmatch(text):
            grid.log.add(number, text, "has no values")
            if grid.body and _LINE.search(text):
                grid.rules.append(number)
        else:
            if not has_texts and (found := _TRAILING.search(text)) is not None:
                grid.behind.append((number, found[0]))
                text = text[: found.start()].rstrip()
            # Tabs at both ends are empty cells.
            ends = has_texts * (len(raw) - len(raw.rstrip("\t")))
            grid.body.append((number, "\t" * (raw[:1] == "\t") + text + "\t" * ends))
    grid.is_declared = bool(declared)
    grid.separator = declared or separator_of([text for _, text in grid.body])
    return grid


def _is_head(text: str) -> bool:
    """Return whether a line of a table with texts is a comment; spreadsheets quote it."""
    return text.lstrip('" ').startswith(("#", "//")) and is_comment(text.lstrip('" '))


def is_comment(text: str) -> bool:
    """Return whether a line is a comment and not a row."""
    found = _COMMENT.match(text)
    if found is None:
        return False
    rest = text[found.end() :]
    if found[1] == ";":
        return ";" not in rest
    if found[1] == "*":
        return not any(is_number(part) for part in rest.split()[-3:])
    if found[1] == "'":
        return not re.match(r"[^']*'", rest)
    # "#;x;y;z": a column of numbers.
    return not (found[1] == "#" and re.match(r"[;,\t|]", rest))


def separator_of(lines: Iterable[str]) -> str:
    """Return the sign between the cells of most lines; a blank for blanks and tabs."""
    data = [text for text in lines if any(sign.isdigit() for sign in text)] or list(lines)
    half = len(data) / 2.0
    counts = {sign: sum(sign in text for text in data) for sign in ";|\t,"}
    for sign in ";|":
        if counts[sign] > half:
            return sign
    if counts["\t"] > half:
        widths = {text.count("\t") for text in data if "\t" in text}
        blanks = any(re.search(r"\d +[\d+-]", text) for text in data)
        blanks = blanks or all("\t\t" in text for text in data)
        return "\t" if len(widths) <= 2 and not blanks else " "
    if counts[","] <= half:
        return " "
    return " " if sum(map(_has_commas_inside, data)) > half else ","


def _has_commas_inside(text: str) -> bool:
    """Return whether blanks separate the numbers, and commas are signs in them."""
    parts = [part for part in text.split() if any(sign.isdigit() for sign in part)]
    inner = [part for part in parts if "," in part]
    return len(parts) >= 2 and bool(inner) and all(
        is_number(part) and not part.endswith(",") and not part.startswith(",") for part in inner
    )  # fmt: skip


def _by_blanks(_line: int, text: str) -> list[str]:
    if text.isascii():
        parts = text.split()
    else:
        parts = []
        for part in re.split(r"[ \t\f\v]+", text.strip()):
            # A thin space separates thousands, or columns.
            whole = is_number(part) or not _ODD_BLANK.search(part)
            parts += [part] if whole else part.split()
    return parts if all(map(_starts_number, parts)) else _with_units(parts)


def _starts_number(text: str) -> bool:
    return text[0] in "+-.0123456789"


def _with_units(parts: list[str]) -> list[str]:
    """Join a number and the unit behind it: "12.5 mm" is one cell."""
    joined: list[str] = []
    for part in parts:
        if joined and is_number(joined[-1]) and find_unit(part, "length") is not None:
            joined[-1] += f" {part}"
        else:
            joined.append(part)
    return joined


def heading_cells(text: str, separator: str) -> list[str]:
    """Return the cells of a line that may name the columns."""
    plain = plain_signs(text) if separator == " " else text
    if separator not in (" ", "\t") and separator in text:
        return [_unquoted(cell) for cell in plain.split(separator)]
    if separator == "\t" and "\t" in text:
        return [_unquoted(cell) for cell in text.split("\t")]
    plain = re.sub(
        r"\s*/\s*", "/", re.sub(r"\s*([\[({])\s*([^\])}]*?)\s*([\])}])", r"\1\2\3", text)
    )
    plain = re.sub(r"[\[({][^\])}]*[\])}]", lambda found: found[0].replace(" ", "\0"), plain)
    found: list[str] = []
    for part in re.split(r"[\s,;|]+", plain.strip(" \t,;|")):
        cell = part.replace("\0", " ")
        if found and find_unit(cell, "length") is not None and not is_number(cell):
            found[-1] += f" {cell}"
        else:
            found.append(cell)
    return found


def _constant(cell: str) -> str:
    """Return the number that a spreadsheet wrote as a text or formula: =1,5, ="1,5" and '1,5."""
    found = _TEXT_NUMBER.fullmatch(cell)
    return found[1] if found is not None and is_number(found[1]) else cell


def _unquoted(cell: str) -> str:
    """Return a cell without the quotation marks around it; a mark alone is the unit inch."""
    text = cell.strip()
    return text[1:-1].strip() if len(text) > 1 and text[0] == text[-1] == '"' else text


def fault(path: Path, line: int, code: str, text: str, what: str, remedy: str) -> InputError:
    return InputError(f"table.{code}", f"{path}, line {line}: {shortened(text)} {what}.", remedy)


_ENDS = 8


class AccountedTable(Protocol):
    """Content of a table, with the account of its reader."""

    @property
    def account(self) -> TableAccount:
        """Rows read and lines left out."""
        ...


T = TypeVar("T", bound=AccountedTable)
TableReader = Callable[[Path, TableOptions], AccountedTable]


@dataclass(frozen=True, slots=True)
class PreviewRow:
    """A line of a table."""

    line: int
    """Its number in the file, from 1."""
    cells: tuple[str, ...]
    why: str = ""
    """Reason why it is left out; empty if it is read."""


@dataclass(frozen=True, slots=True)
class TablePreview(Generic[T]):
    """First and last lines of a table, and its content or the error of the reader."""

    rows: tuple[PreviewRow, ...]
    hidden: int
    """Lines between the first and the last ones."""
    options: TableOptions
    table: T | None
    error: InputError | None

    @property
    def account(self) -> TableAccount | None:
        """Return the account of the reader; None after an error."""
        return None if self.table is None else self.table.account


def preview_table(
    path: Path, options: TableOptions, read: Callable[[Path, TableOptions], T]
) -> TablePreview[T]:
    """Read a table and return its first and last lines as cells, before anything is accepted.

    InputErrors of ``read``, the reader of such tables, become a part of the result; InputError if
    the file cannot be read at all.
    """
    table: T | None = None
    error: InputError | None = None
    try:
        table = read(path, options)
    except InputError as refused:
        error = refused
    account = None if table is None else table.account
    lines = text_lines(path, bytes_of(path))
    grid = read_grid(path, lines, TableOptions(), has_texts=True)
    if account is not None:
        grid.separator = account.separator
    split, body = grid.splitter(), dict(grid.body)
    why = {
        line: one.why
        for one in (account.skipped if account is not None else grid.log.entries())
        for line in range(one.first, one.last + 1)
    }
    rows = []
    for line, text in enumerate(lines, start=1):
        if line <= _ENDS or line > len(lines) - _ENDS:
            is_row = line in body and text.strip()
            try:
                cells = split(line, text) if is_row else [text.strip()]
            except InputError:
                cells = [text.strip()]
            empty = "" if text.strip() else "is an empty line"
            rows.append(PreviewRow(line, tuple(cells), why.get(line, empty)))
    return TablePreview(tuple(rows), max(len(lines) - len(rows), 0), options, table, error)
