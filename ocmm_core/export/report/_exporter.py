"""Interface of report formats, and the profile of their text files.

Tables are written as delimited text by a profile, and read back; cells are never quoted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec

from ocmm_core.documents import Document, load_document, resource
from ocmm_core.errors import InputError
from ocmm_core.export.report import _tables as tables
from ocmm_core.export.report._names import clean_text, spreadsheet_text
from ocmm_core.export.report._report_data import ReportData
from ocmm_core.names import ascii_name, ascii_text, name_fault

SCHEMA = "ocmm.profile/1"

_DELIMITERS = {",": ",", ";": ";", "tab": "\t"}
_LINE_ENDS = {"CRLF": "\r\n", "LF": "\n"}
_MOST_DECIMALS = 9


class TableProfile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    header: bool
    columns: list[str]
    when_needed: list[str] = msgspec.field(default_factory=list)
    """Further columns, written if the job has values for them."""


class Profile(Document, frozen=True, kw_only=True):
    """A profile as stored."""

    name: str
    delimiter: Literal[",", ";", "tab"]
    decimal: Literal[".", ","]
    lengths: Literal["mm", "inch"]
    length_decimals: int
    angle_decimals: int
    vector_decimals: int
    """`length_decimals`, `angle_decimals`, `vector_decimals`: Digits after the decimal sign."""
    encoding: Literal["ascii", "utf-8", "utf-8-sig"]
    """Of the tables; only ASCII characters are written, except with UTF-8."""
    line_end: Literal["CRLF", "LF"]
    points: TableProfile
    features: TableProfile
    report: TableProfile
    centres: bool = False
    """Also write the ball centres, into separate files."""

    @property
    def separator(self) -> str:
        return _DELIMITERS[self.delimiter]

    @property
    def newline(self) -> str:
        return _LINE_ENDS[self.line_end]

    @property
    def units(self) -> tables.Units:
        return tables.Units(
            self.lengths, self.length_decimals, self.angle_decimals, self.vector_decimals
        )


def load_profile(path: Path | str) -> Profile:
    """Return the profile of a document; InputError if malformed, or files were unreadable."""
    path = Path(path)
    profile = load_document(path, Profile, SCHEMA)
    if profile.separator == profile.decimal:
        raise _error(path, "delimiter", f"is {profile.delimiter!r}, and so is the decimal sign")
    for field in ("length_decimals", "angle_decimals", "vector_decimals"):
        count = getattr(profile, field)
        if not 0 <= count <= _MOST_DECIMALS:
            raise _error(path, field, f"is {count}; give 0 to {_MOST_DECIMALS}")
    for field, known in (
        ("points", tables.POINT_COLUMNS),
        ("features", tables.FEATURE_COLUMNS),
        ("report", tables.REPORT_COLUMNS),
    ):
        _check_columns(path, field, getattr(profile, field), known)
    return profile


def polyworks_profile() -> Profile:
    return load_profile(resource("profiles", "polyworks.toml"))


def _check_columns(path: Path, field: str, table: TableProfile, known: tuple[str, ...]) -> None:
    names = [*table.columns, *table.when_needed]
    if not table.columns:
        raise _error(path, f"{field}.columns", "is empty")
    for name in names:
        if name not in known:
            raise _error(path, f"{field}.columns", f"names {name!r}; there are {', '.join(known)}")
        if names.count(name) > 1:
            raise _error(path, f"{field}.columns", f"names {name!r} twice")


def _error(path: Path, field: str, fault: str) -> InputError:
    return InputError(
        "profile.field", f"{path}: field '{field}' {fault}.", "Correct that field of the profile."
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportFormat:
    """Description of a format; all refuse incomplete jobs (`require_complete`)."""

    name: str
    title: str
    purpose: str
    """Audience of the files."""
    suffixes: tuple[str, ...]
    """Endings of its file names, after the name of the job."""
    profile: str
    """What it uses of the profile; may be empty."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Exporter(ReportFormat):
    """A format written by the core."""

    contents: Callable[[Sequence[ReportData], Profile], dict[str, bytes]]
    """The files of jobs, bytes by file name."""
    differences: Callable[[Sequence[ReportData], Profile, Mapping[str, bytes]], list[str]]
    """Differences between files and jobs, in sentences, by a reader independent of the writer."""
    preview: Callable[[Sequence[ReportData], Profile], tuple[tables.ReportTable, ...]]
    batch: bool = False
    """Several jobs go into one file as several values; otherwise one job at a time."""


_INSTEAD = {",": ";", ";": ",", "\t": " "}
"""Replacements of the delimiter in text."""


def delimited(table: tables.ReportTable, profile: Profile, shape: TableProfile) -> bytes:
    has_keys = _has_keys(table)
    lines = [[_cell(cell, profile, has_keys) for cell in row] for row in table.rows]
    if shape.header:
        lines.insert(0, list(table.columns))
    text = "".join(profile.separator.join(line) + profile.newline for line in lines)
    return text.encode(profile.encoding, "replace")


def compare_delimited(
    name: str, content: bytes, table: tables.ReportTable, profile: Profile, shape: TableProfile
) -> list[str]:
    """Return the differences of a file read back from the table, in sentences."""
    try:
        text = content.decode(profile.encoding)
    except UnicodeDecodeError as error:
        return [f"{name}: byte {error.start} is not text."]
    lines = text.split(profile.newline)
    if lines.pop() != "":
        return [f"{name}: the last line does not end."]
    found = [line.split(profile.separator) for line in lines]
    if shape.header and (not found or found.pop(0) != list(table.columns)):
        return [f"{name}: the first line does not hold the names of the columns."]
    if len(found) != len(table.rows):
        return [f"{name}: there are {len(found)} rows instead of {len(table.rows)}."]
    differences = []
    has_keys = _has_keys(table)
    for index, (row, cells) in enumerate(zip(table.rows, found, strict=True), start=1):
        if len(cells) != len(row):
            differences.append(f"{name}: row {index} has {len(cells)} cells, not {len(row)}.")
            continue
        differences += [
            f"{name}: row {index}, {column}: {cell!r} instead of {wanted!r}."
            for column, wanted, cell in zip(table.columns, row, cells, strict=True)
            if not _is_told(wanted, cell, profile, has_keys)
        ]
    return differences


def same_number(wanted: tables.Number, text: str, decimal: str = ".") -> bool:
    """Return whether text equals a number to its last digit."""
    try:
        found = float(text.replace(decimal, "."))
    except ValueError:
        return False
    if decimal != "." and "." in text:
        return False
    half = 0.5 * 10.0**-wanted.decimals
    return abs(found - wanted.value) <= half * (1.0 + 1e-6) + 1e-12 * abs(wanted.value)


def _has_keys(table: tables.ReportTable) -> bool:
    """Return whether cells are names by which programs find items; a list of facts has none."""
    return table.columns != ("Item", "Value")


def cell_text(text: str, profile: Profile, has_keys: bool = True) -> str:
    """Return text as a cell can hold it; names that are keys stay different from each other."""
    plain = clean_text(text).replace(profile.separator, _INSTEAD[profile.separator])
    plain = plain.replace('"', "'")
    if profile.encoding == "ascii":
        is_key = has_keys and not name_fault(plain)
        plain = ascii_name(plain) if is_key else ascii_text(plain)
    return spreadsheet_text(plain)


def _cell(cell: tables.Cell, profile: Profile, has_keys: bool) -> str:
    if cell is None:
        return ""
    if isinstance(cell, tables.Number):
        return cell.text(profile.decimal)
    return cell_text(cell, profile, has_keys) if isinstance(cell, str) else str(cell)


def _is_told(wanted: tables.Cell, found: str, profile: Profile, has_keys: bool) -> bool:
    if isinstance(wanted, tables.Number):
        return same_number(wanted, found, profile.decimal)
    if isinstance(wanted, int):
        return found == str(wanted)
    return found == ("" if wanted is None else cell_text(wanted, profile, has_keys))
