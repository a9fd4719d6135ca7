"""The account of a reader: rows read, unit, columns, and lines left out with the reason."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.documents import shortened
from ocmm_core.errors import InputError

_LISTED = 12
_SEPARATORS = {"\t": "tab", ";": "semicolon", ",": "comma", "|": "bar", " ": "blank"}


@dataclass(frozen=True, slots=True)
class TableOptions:
    """Statements of the user about a table: options of a command, fields of an import page."""

    unit: str = ""
    """Unit of the lengths, which replaces the statements of the file."""
    columns: str = ""
    """Meaning of each column, separated by commas, "-" for one that is not read: ``name,x,y,z``."""
    decimal: str = ""
    """``point`` or ``comma``."""
    skip: str = ""
    """Lines that are not read: ``3`` for the first three, ``4-9,12-12`` for ranges."""

    def skipped(self) -> tuple[range, ...]:
        """Return the lines that are not read, from 1.

        Raises
        ------
        InputError
            The option cannot be understood.
        """
        found = []
        for part in re.split(r"[\s,;]+", self.skip.strip()):
            match = re.fullmatch(r"(?:(\d{1,9})-)?(\d{1,9})", part)
            if part and match is None:
                raise InputError(
                    "table.skip",
                    f"{shortened(self.skip)} does not name lines to skip.",
                    "Give the count of first lines, such as 3, or ranges, such as 4-9,12-12.",
                )
            if match is not None:
                found.append(range(int(match[1] or 1), int(match[2]) + 1))
        return tuple(found)


@dataclass(frozen=True, slots=True)
class SkippedRows:
    """Neighbouring lines that were left out for the same reason."""

    first: int
    """Number of the first line, from 1."""
    last: int
    why: str
    text: str
    """Start of the first line."""

    def sentence(self) -> str:
        """Return the lines and the reason."""
        lines = f"Line {self.first}" if self.first == self.last else (
            f"Lines {self.first} to {self.last}"
        )  # fmt: skip
        return f"{lines} left out: {self.why} ({self.text})."


@dataclass(frozen=True, slots=True)
class TableColumn:
    """A column and its meaning."""

    heading: str
    """As in the file; the number of the column without a heading."""
    role: str
    """Meaning for the reader; empty if the column is not read."""
    unit: str = ""
    """Symbol of the unit in its heading, or empty."""


@dataclass(frozen=True, slots=True)
class TableAccount:
    """What a reader took and left out."""

    path: Path
    form: str
    """Kind of file: text, PLY, OBJ, OFF, STL or PCD."""
    taken: int
    """Rows that were read."""
    lines: tuple[int, int]
    """First and last line that was read; 0 for binary files."""
    columns: tuple[TableColumn, ...]
    unit: str
    """Symbol of the unit of lengths."""
    factor: float
    """Its size in mm."""
    unit_from: str
    """Evidence of the unit; empty if mm is assumed."""
    separator: str = ""
    """Sign between the cells."""
    decimal: str = "."
    decimal_from: str = ""
    """Evidence of the decimal sign; empty if no number needed any."""
    skipped: tuple[SkippedRows, ...] = ()

    def sentences(self, listed: int = _LISTED) -> tuple[str, ...]:
        """Return the account for people, at most ``listed`` entries of left out lines."""
        read = ", ".join(_meaning(one) for one in self.columns if one.role)
        out = ", ".join(repr(one.heading) for one in self.columns if not one.role)
        where = f", lines {self.lines[0]} to {self.lines[1]}" if self.lines[0] else ""
        found = [f"{self.form}: {self.taken} rows read{where}; columns {read}."]
        if out:
            found.append(f"Columns left out: {out}.")
        source = f"from {self.unit_from}" if self.unit_from else "assumed; the file states none"
        found.append(f"Unit {self.unit} ({source}).")
        if self.separator:
            sign = {",": "comma", ".": "point"}.get(self.decimal, "point and comma")
            proof = f" ({self.decimal_from})" if self.decimal_from else ""
            between = _SEPARATORS.get(self.separator, self.separator)
            found.append(f"Decimal {sign}{proof}, separator {between}.")
        found += [one.sentence() for one in self.skipped[:listed]]
        rest = self.skipped[listed:]
        if rest:
            count = sum(one.last - one.first + 1 for one in rest)
            reasons = Counter(one.why for one in rest)
            found.append(f"Also left out, {count} in number: {', '.join(reasons)}.")
        return tuple(found)

    def as_json(self) -> dict[str, object]:
        """Return the account as plain data."""
        return {
            "format": self.form,
            "rows": self.taken,
            "lines": list(self.lines),
            "columns": [
                {"heading": one.heading, "read_as": one.role, "unit": one.unit}
                for one in self.columns
            ],
            "unit": {"symbol": self.unit, "mm": self.factor, "from": self.unit_from or "assumed"},
            "decimal": {"sign": self.decimal, "from": self.decimal_from},
            "separator": self.separator,
            "left_out": [
                {"first": one.first, "last": one.last, "why": one.why, "text": one.text}
                for one in self.skipped
            ],
        }


def _meaning(column: TableColumn) -> str:
    unit = f" [{column.unit}]" if column.unit else ""
    same = column.heading.lower() == column.role or column.heading.isdigit()
    return f"{column.role}{unit}" if same else f"{column.role}{unit} = {column.heading!r}"


class SkippedLog:
    """Collects left out lines; neighbours of one reason become one entry."""

    def __init__(self) -> None:
        self._entries: list[SkippedRows] = []

    def add(self, line: int, text: str, why: str) -> None:
        """Enter a line."""
        self._entries.append(SkippedRows(line, line, why, shortened(text.strip())))

    def entries(self) -> tuple[SkippedRows, ...]:
        """Return the entries in the order of the file."""
        joined: list[SkippedRows] = []
        for one in sorted(self._entries, key=lambda entry: entry.first):
            last = joined[-1] if joined else None
            if last is not None and last.why == one.why and last.last == one.first - 1:
                joined[-1] = SkippedRows(last.first, one.last, one.why, last.text)
            else:
                joined.append(one)
        return tuple(joined)
