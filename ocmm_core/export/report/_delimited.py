"""Tables as delimited text by a profile, and back; cells are never quoted."""

from __future__ import annotations

from ocmm_core.export.report._names import clean_text, spreadsheet_text
from ocmm_core.export.report._profile import Profile, TableProfile
from ocmm_core.export.report._tables import Cell, Number, ReportTable
from ocmm_core.names import ascii_name, ascii_text, name_fault

_INSTEAD = {",": ";", ";": ",", "\t": " "}
"""Replacements of the delimiter in text."""


def delimited(table: ReportTable, profile: Profile, shape: TableProfile) -> bytes:
    has_keys = _has_keys(table)
    lines = [[_cell(cell, profile, has_keys) for cell in row] for row in table.rows]
    if shape.header:
        lines.insert(0, list(table.columns))
    text = "".join(profile.separator.join(line) + profile.newline for line in lines)
    return text.encode(profile.encoding, "replace")


def compare_delimited(
    name: str, content: bytes, table: ReportTable, profile: Profile, shape: TableProfile
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


def same_number(wanted: Number, text: str, decimal: str = ".") -> bool:
    """Return whether text equals a number to its last digit."""
    try:
        found = float(text.replace(decimal, "."))
    except ValueError:
        return False
    if decimal != "." and "." in text:
        return False
    half = 0.5 * 10.0**-wanted.decimals
    return abs(found - wanted.value) <= half * (1.0 + 1e-6) + 1e-12 * abs(wanted.value)


def _has_keys(table: ReportTable) -> bool:
    """Return whether cells are names by which programs find items; a list of facts has none."""
    return table.columns != ("Item", "Value")


def told(text: str, profile: Profile, has_keys: bool = True) -> str:
    """Return text as a cell can hold it; names that are keys stay different from each other."""
    plain = clean_text(text).replace(profile.separator, _INSTEAD[profile.separator])
    plain = plain.replace('"', "'")
    if profile.encoding == "ascii":
        is_key = has_keys and not name_fault(plain)
        plain = ascii_name(plain) if is_key else ascii_text(plain)
    return spreadsheet_text(plain)


def _cell(cell: Cell, profile: Profile, has_keys: bool) -> str:
    if cell is None:
        return ""
    if isinstance(cell, Number):
        return cell.text(profile.decimal)
    return told(cell, profile, has_keys) if isinstance(cell, str) else str(cell)


def _is_told(wanted: Cell, found: str, profile: Profile, has_keys: bool) -> bool:
    if isinstance(wanted, Number):
        return same_number(wanted, found, profile.decimal)
    if isinstance(wanted, int):
        return found == str(wanted)
    return found == ("" if wanted is None else told(wanted, profile, has_keys))
