"""The account of a reader: rows read, unit, columns, and lines left out with the reason."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.documents import shortened
from ocmm_core.errors import InputError

SKIPPED_BY_USER = "skipped as stated"
COUNT_OF_POINTS = "number of points"
_LISTED = 12
_SEPARATED = {
    "\t": "Cells are separated by tabs.", ";": "Cells are separated by semicolons.",
    ",": "Cells are separated by commas.", "|": "Cells are separated by bars.",
    " ": "Cells are separated by blanks.",
}  # fmt: skip
_PROOF = re.compile(r"(?:^|, )(.+?) in line (\d+)")
"""Number and line in the evidence of a decimal sign."""


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
        """Return the lines that are not read, from 1; InputError if the option is invalid."""
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
    factor: float
    """`unit`: Symbol of the unit of lengths; `factor`: Its size in mm."""
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
        first, last = self.lines
        found = [
            f"{self.taken} rows read, lines {first} to {last}." if first
            else f"{self.form}: {self.taken} vertices read."
        ]  # fmt: skip
        found.append(f"Columns: {', '.join(_meaning(one) for one in self.columns if one.role)}.")
        out = ", ".join(repr(one.heading) for one in self.columns if not one.role)
        if out:
            found.append(f"Columns left out: {out}.")
        found.append(self._unit_sentence())
        if self.separator:
            found += [self._decimal_sentence(), self._separator_sentence()]
        found += [one.sentence() for one in self.skipped[:listed]]
        more: Counter[str] = Counter()
        for one in self.skipped[listed:]:
            more[one.why] += one.last - one.first + 1
        found += [
            f"1 line left out: {why}." if count == 1 else f"{count} lines left out: {why}."
            for why, count in more.items()
        ]
        return tuple(found)

    def _unit_sentence(self) -> str:
        match self.unit_from:
            case "":
                return f"Unit {self.unit}, assumed: the file states none."
            case "your statement":
                return f"Unit {self.unit}, as you stated."
            case "the kind of table":
                return f"Unit {self.unit}, by the kind of table."
            case "each row":
                return f"Unit {self.unit}, stated in each row."
            case "the heading":
                return f"Unit {self.unit}, stated in the heading."
            case place:
                line = place.removeprefix("line ")
                return f"Unit {self.unit}, stated in line {line}."

    def _separator_sentence(self) -> str:
        known = _SEPARATED.get(self.separator)
        return known or f"Cells are separated by {self.separator!r}."

    def _decimal_sentence(self) -> str:
        proofs = _PROOF.findall(self.decimal_from)
        if len(proofs) == 2:
            (one, line), (other, below) = proofs
            return f"Decimal point and comma, as in {one} (line {line}) and {other} (line {below})."
        if not proofs:
            return "Decimal comma." if self.decimal == "," else "Decimal point."
        text, line = proofs[0]
        if self.decimal == ",":
            return f"Decimal comma, as in {text} (line {line})."
        return f"Decimal point, as in {text} (line {line})."

    def as_json(self) -> dict[str, object]:
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
