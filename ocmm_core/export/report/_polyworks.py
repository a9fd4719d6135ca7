"""Points, cloud, features, report and a macro for PolyWorks|Inspector, by a profile.

With the default profile: pure ASCII, CR LF, decimal point in every locale, millimetres with four
decimals, unit vectors with six. Names are checked, never quoted or escaped: a name that would need
it is refused. The file formats are our own proposal; no public description of PolyWorks' text
import was found (docs/quality/exports.md).

Points are compensated surface points; their vector leaves the material, so that the ball centre is
``xyz + radius * ijk``. Ball centres are written only on request of the profile, into files named
accordingly. The verdict on the part is first in ``_job.csv``. The states of the job (simulated,
incomplete) are in the names of all files, and in a column of every table with a header, in every
profile.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ocmm_core.export.report import _exporter as exporter
from ocmm_core.export.report._report_data import ReportData
from ocmm_core.export.report._tables import (
    FLAG,
    HELD_BACK,
    JOB_STATE,
    Number,
    ReportTable,
    features_table,
    head_table,
    points_table,
    report_table,
)

_PLACE = ("X", "Y", "Z", "I", "J", "K")
_HEAD = exporter.TableProfile(header=True, columns=["Item", "Value"])
_NEWLINE = "\r\n"
_VERSION = 'version "5.0"'
_CREATE = re.compile(
    r'FEATURE PRIMITIVE POINT CREATE \( (\S+), (\S+), (\S+), "Nominal", "([^"$]{1,70})", \)'
)


@dataclass(frozen=True, slots=True)
class _Text:
    """A delimited file to be written."""

    table: ReportTable
    shape: exporter.TableProfile


def _contents(jobs: Sequence[ReportData], profile: exporter.Profile) -> dict[str, bytes]:
    (data,) = jobs
    files = {
        name: exporter.delimited(text.table, profile, text.shape)
        for name, text in _texts(data, profile).items()
    }
    for name, table in _clouds(data, profile).items():
        lines = (" ".join(_numbers(row)) + _NEWLINE for row in table.rows)
        files[name] = "".join(lines).encode("ascii")
    files[f"{data.stem}_import.pwmacro"] = _macro(_points(data, profile))
    return files


def _differences(
    jobs: Sequence[ReportData], profile: exporter.Profile, files: Mapping[str, bytes]
) -> list[str]:
    (data,) = jobs
    found = []
    for name, text in _texts(data, profile).items():
        found += exporter.compare_delimited(name, files[name], text.table, profile, text.shape)
    for name, table in _clouds(data, profile).items():
        lines = [line.split(" ") for line in files[name].decode("ascii", "replace").splitlines()]
        found += _compare_lines(name, lines, table)
    name = f"{data.stem}_import.pwmacro"
    return found + _compare_macro(name, files[name], _points(data, profile))


def _preview(jobs: Sequence[ReportData], profile: exporter.Profile) -> tuple[ReportTable, ...]:
    (data,) = jobs
    return tuple(text.table for text in _texts(data, profile).values())


def _texts(data: ReportData, profile: exporter.Profile) -> dict[str, _Text]:
    stem, units = data.stem, profile.units
    tables = {
        f"{stem}_job.csv": (head_table(data), _HEAD),
        f"{stem}_points.csv": (points_table(data, units), profile.points),
        f"{stem}_features.csv": (features_table(data, units), profile.features),
        f"{stem}_report.csv": (report_table(data, units), profile.report),
    }
    if profile.centres:
        centres = points_table(data, units, centres=True)
        tables[f"{stem}_points_centres.csv"] = (centres, profile.points)
    return {name: _Text(_chosen(table, shape), shape) for name, (table, shape) in tables.items()}


def _chosen(table: ReportTable, shape: exporter.TableProfile) -> ReportTable:
    """Return a table with the columns of the profile, and the states if it has a header."""
    needed = shape.when_needed
    told = (*shape.columns, *needed)
    if shape.header and JOB_STATE in table.columns and JOB_STATE not in told:
        needed = [*needed, JOB_STATE]
    return table.chosen(shape.columns, needed)


def _clouds(data: ReportData, profile: exporter.Profile) -> dict[str, ReportTable]:
    """Return the clouds by name; they have fixed delimiter and decimal sign."""
    clouds = {f"{data.stem}_cloud.asc": points_table(data, profile.units)}
    if profile.centres:
        centres = points_table(data, profile.units, centres=True)
        clouds[f"{data.stem}_cloud_centres.asc"] = centres
    return {name: _usable(table).chosen(_PLACE) for name, table in clouds.items()}


def _points(data: ReportData, profile: exporter.Profile) -> ReportTable:
    return _usable(points_table(data, profile.units)).chosen(("X", "Y", "Z", "Name"))


def _usable(points: ReportTable) -> ReportTable:
    """Return the points that are not held back: a cloud or a macro has no place for the flag."""
    flag = points.columns.index(FLAG)
    rows = tuple(row for row in points.rows if HELD_BACK not in str(row[flag]))
    return replace(points, rows=rows)


def _macro(points: ReportTable) -> bytes:
    """Return a macro that makes every point; names contain neither ``$`` nor ``"``."""
    lines = [_VERSION]
    for *place, name in points.rows:
        x, y, z = _numbers(place)
        lines.append(f'FEATURE PRIMITIVE POINT CREATE ( {x}, {y}, {z}, "Nominal", "{name}", )')
    return "".join(line + _NEWLINE for line in lines).encode("utf-16-le").join((b"\xff\xfe", b""))


def _compare_macro(name: str, content: bytes, points: ReportTable) -> list[str]:
    if not content.startswith(b"\xff\xfe"):
        return [f"{name}: it does not start with the UTF-16 byte order mark."]
    lines = content[2:].decode("utf-16-le", "replace").split(_NEWLINE)
    if lines[0] != _VERSION or lines[-1] != "":
        return [f"{name}: its first or its last line is missing."]
    commands = [_CREATE.fullmatch(line) for line in lines[1:-1]]
    if any(command is None for command in commands):
        return [f"{name}: it contains something other than points."]
    found = [list(command.groups()) for command in commands if command is not None]
    return _compare_lines(name, found, points)


def _compare_lines(name: str, found: Sequence[Sequence[str]], table: ReportTable) -> list[str]:
    if len(found) != len(table.rows):
        return [f"{name}: there are {len(found)} points instead of {len(table.rows)}."]
    return [
        f"{name}: point {index} is not the one that was measured."
        for index, (cells, row) in enumerate(zip(found, table.rows, strict=True), start=1)
        if len(cells) != len(row)
        or any(
            not (exporter.same_number(cell, text) if isinstance(cell, Number) else cell == text)
            for cell, text in zip(row, cells, strict=True)
        )
    ]


def _numbers(cells: Sequence[object]) -> list[str]:
    return [cell.text() for cell in cells if isinstance(cell, Number)]


POLYWORKS = exporter.Exporter(
    name="polyworks",
    title="PolyWorks|Inspector",
    purpose="PolyWorks|Inspector, spreadsheets",
    suffixes=(
        "_job.csv", "_points.csv", "_features.csv", "_report.csv", "_cloud.asc", "_import.pwmacro",
        "_points_centres.csv", "_cloud_centres.asc",
    ),
    profile="everything", contents=_contents, differences=_differences, preview=_preview,
)  # fmt: skip
