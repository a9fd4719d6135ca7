"""Points of a text file: one row a point, x y z, in millimetres unless it names another unit."""

from __future__ import annotations

import errno
import math
import re
import stat
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ocmm_core.documents import shortened
from ocmm_core.errors import InputError
from ocmm_core.geometry import Points3

LARGEST_BYTES = 100_000_000
MOST_POINTS = 300_000
_LONGEST_ROW = 1000
FIELDS = re.compile(r"[\s;,]+")
DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+")
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
FARTHEST_MM = 1e7
"""Ten kilometres: a coordinate beyond is no measurement, and would be fitted badly."""
COMMENT = re.compile(r"(#|%|!|//|\*).*")
COUNT = re.compile(r"(\d{1,9})(\s+(points?|pts|3))?")
"""Of points, also as rows and columns of a table."""
LAST = ("end", "eof")
MM = {
    "mm": 1.0, "millimeter": 1.0, "millimetre": 1.0, "cm": 10.0, "m": 1000.0, "meter": 1000.0,
    "metre": 1000.0, "um": 1e-3, "µm": 1e-3, "inch": 25.4, "inches": 25.4, "in": 25.4,
}  # fmt: skip
"""Units that a file may name, in mm."""
_UNIT = "(" + "|".join(sorted(MM, key=len, reverse=True)) + ")s?"
UNIT = (
    re.compile(rf"\bunits?\b\W*(?:are|is|in)?\W*\b{_UNIT}\b"),
    re.compile(rf"\bx[\s_]*[\[(/_]\s*{_UNIT}\b"),
    re.compile(rf"^\W*{_UNIT}\W*$"),
    re.compile(rf"\b(?:all|coordinates|points|values|dimensions|data)\b.*\bin\s+{_UNIT}\b"),
)
"""How a comment or a heading names the unit."""
NORMAL = 1e-3
"""How far the length of a normal behind a point may be from one."""


@dataclass(frozen=True, slots=True)
class PointsFile:
    """What a file of points holds."""

    points: Points3
    """(n, 3), mm."""
    unit: str = "mm"
    """As the file names it, or mm."""

    @property
    def factor(self) -> float:
        """Return how many mm the unit has."""
        return MM[self.unit]


def read_points(path: Path | str) -> Points3:
    """Return the points (n, 3), mm, of the text file at ``path``; see `read_points_file`.

    For tests: nothing in the product asks for it.
    """
    return read_points_file(path).points


def read_points_file(path: Path | str) -> PointsFile:
    """Return the points of the text file at ``path``, and the unit that it names.

    A row has three numbers with a decimal point, separated by blanks, tabs, semicolons or commas;
    a number or name of the point may stand before them, the unit vector of a normal behind them.
    Empty rows, comments (``#``, ``%``, ``!``, ``//``, ``*``) and headings before the first point
    are passed over; a first row that is nothing but the number of the points, as in reference data
    of NIST, must be right. A unit named in comment or heading ("unit: inch", "x [m]") is heeded.

    Raises
    ------
    InputError
        The file cannot be read, or a row is not a point; the sentence names the line.
    """
    file = Path(path)
    rows: list[tuple[int, str, list[str]]] = []
    count: int | None = None
    unit, begun = "mm", False
    for number, line in enumerate(_lines(file), start=1):
        if len(line) > _LONGEST_ROW:
            raise InputError(
                "points.row",
                f"{file}, line {number}: it has more than {_LONGEST_ROW} characters.",
                "Give one row with x, y and z for every point.",
            )
        whole = line.strip().lstrip("\ufeff")
        text = COMMENT.sub("", whole).strip()
        fields = [field for field in FIELDS.split(text) if field]
        numbers = [field for field in fields if NUMBER.fullmatch(field)]
        # A name may stand before three numbers; fewer behind a word are none of a point.
        bare = not numbers or (fields[0] != numbers[0] and len(numbers) < 3)
        if not begun and (bare or text != whole):
            unit = _unit_of(whole) or unit
        if not fields or (not begun and bare) or text.lower() in LAST:
            continue
        announced = None if begun or count is not None else COUNT.fullmatch(text.lower())
        if announced:
            count = int(announced.group(1))
            continue
        begun = True
        if len(rows) == MOST_POINTS:
            raise InputError(
                "points.count",
                f"{file}, line {number}: more than {MOST_POINTS:,} points.",
                "Give a file with the points of one feature.",
            )
        rows.append((number, text, fields))
    _drop_names(rows)
    points = [_point(file, number, text, fields) for number, text, fields in rows]
    if count is not None and count != len(points):
        raise InputError(
            "points.count",
            f"{file}: the first line declares {count} points, but {len(points)} follow.",
            "Check that the file is complete.",
        )
    if not points:
        raise InputError("points.empty", f"{file}: no points.", "Give rows with x, y and z.")
    return PointsFile(MM[unit] * np.array(points), unit)


def _unit_of(text: str) -> str | None:
    for pattern in UNIT:
        found = pattern.search(text.lower())
        if found:
            return found.group(1)
    return None


def _drop_names(rows: list[tuple[int, str, list[str]]]) -> None:
    """Take the names or running numbers before, and the unit normals behind, all points off."""
    fields = [row[2] for row in rows]
    if fields and all(len(row) == 6 and "," not in text for _, text, row in rows):
        parts = [[number_of(x) for x in row[3:]] for row in fields]
        if all(abs(math.hypot(*part) - 1.0) < NORMAL for part in parts):
            for row in fields:
                del row[3:]
    if not fields or any(len(row) != 4 for row in fields):
        return
    running = [row[0] for row in fields]
    names = not any(NUMBER.fullmatch(name) for name in running)
    if names or (len(rows) > 1 and any(
        running == [str(first + i) for i in range(len(rows))] for first in (0, 1)
    )):  # fmt: skip
        for row in fields:
            del row[0]


def _lines(file: Path) -> list[str]:
    try:
        found = file.stat()
        if not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):
            raise OSError(errno.EINVAL, "it is a pipe or a device")
        if found.st_size > LARGEST_BYTES:
            raise InputError(
                "points.size",
                f"{file}: is larger than {LARGEST_BYTES // 1_000_000} MB.",
                "Give a file with the points of one feature.",
            )
        return decoded(file).splitlines()
    except OSError as error:
        raise InputError(
            "points.unreadable",
            f"{file}: cannot be read ({error.strerror}).",
            "Check the path and the rights.",
        ) from error
    except UnicodeDecodeError as error:
        raise InputError(
            "points.not_text", f"{file}: is not a text file.", "Give a text file with x y z rows."
        ) from error


def decoded(file: Path) -> str:
    """Return the text of ``file`` in UTF-8, in UTF-16 with its mark, or in an old Western code.

    Raises
    ------
    OSError, UnicodeDecodeError
        It cannot be read, or is no text.
    """
    content = file.read_bytes()
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        if b"\0" in content:
            raise
        return content.decode("cp1252")


def number_of(field: str) -> float:
    """Return the number that ``field`` is, not a number where it is none; 1.5D+02 is one."""
    return float(re.sub("[dD]", "e", field)) if NUMBER.fullmatch(field) else math.nan


def _point(file: Path, number: int, text: str, fields: list[str]) -> list[float]:
    commas = [field for field in re.split(r"[\s;]+", text) if field]
    if len(commas) == 3 and any(DECIMAL_COMMA.fullmatch(field) for field in commas):
        raise InputError(
            "points.decimal_comma",
            f"{file}, line {number}: {shortened(text)} has decimal commas.",
            "Write the numbers with a decimal point; a comma may only separate them.",
        )
    if len(fields) == 6 and "," in text:
        raise InputError(
            "points.decimal_comma",
            f"{file}, line {number}: {shortened(text)} could be three numbers with decimal commas "
            "or six.",
            "Write the numbers with a decimal point, three in a row.",
        )
    if len(fields) != 3:
        raise InputError(
            "points.fields",
            f"{file}, line {number}: {shortened(text)} has {len(fields)} number(s), not three.",
            "Give one row with x, y and z for every point.",
        )
    values = []
    for field in fields:
        value = number_of(field)
        if not abs(value) < FARTHEST_MM:
            raise InputError(
                "points.number",
                f"{file}, line {number}: {shortened(field)} is not a coordinate in mm.",
                "Give numbers with a decimal point, such as 12.345 or -1.2e-3.",
            )
        values.append(value)
    return values
