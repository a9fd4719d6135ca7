"""Points of a text file: one row a point, x y z, in millimetres."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from ocmm_core.errors import InputError
from ocmm_core.geometry import Points3

LARGEST_BYTES = 100_000_000
FIELDS = re.compile(r"[\s;,]+")
DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+")
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
FARTHEST_MM = 1e7
"""Ten kilometres: a coordinate beyond is no measurement, and would be fitted badly."""


def read_points(path: Path | str) -> Points3:
    """Return the points (n, 3), mm, of the text file at ``path``.

    A row has three numbers with a decimal point, separated by blanks, tabs, semicolons or commas.
    Empty rows, rows that begin with ``#``, and a first row of names are passed over; a first row
    that is nothing but the number of the points, as in reference data of NIST, must be right.

    Raises
    ------
    InputError
        The file cannot be read, or a row is not a point; the sentence names the line.
    """
    file = Path(path)
    lines = _lines(file)
    points: list[list[float]] = []
    count: int | None = None
    begun = False
    for number, line in enumerate(lines, start=1):
        text = line.strip().lstrip("\ufeff")
        if not text or text.startswith("#"):
            continue
        first, begun = not begun, True
        fields = [field for field in FIELDS.split(text) if field]
        if first and len(fields) == 1 and fields[0].isdigit():
            count = int(fields[0])
            continue
        if first and fields and not any(character.isdigit() for character in fields[0]):
            continue
        points.append(_point(file, number, text, fields))
    if count is not None and count != len(points):
        raise InputError(
            "points.count",
            f"{file}: the first line announces {count} points, but {len(points)} follow.",
            "Check whether the file is whole.",
        )
    if not points:
        raise InputError(
            "points.empty", f"{file}: there are no points.", "Give rows with x, y and z."
        )
    return np.array(points)


def _lines(file: Path) -> list[str]:
    try:
        if file.stat().st_size > LARGEST_BYTES:
            raise InputError(
                "points.size",
                f"{file}: is larger than {LARGEST_BYTES // 1_000_000} MB.",
                "Give a file with the points of one feature.",
            )
        return file.read_text(encoding="utf-8").splitlines()
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


def _point(file: Path, number: int, text: str, fields: list[str]) -> list[float]:
    commas = [field for field in re.split(r"[\s;]+", text) if field]
    if len(commas) == 3 and any(DECIMAL_COMMA.fullmatch(field) for field in commas):
        raise InputError(
            "points.decimal_comma",
            f"{file}, line {number}: '{text}' has decimal commas.",
            "Write the numbers with a decimal point; a comma may only separate them.",
        )
    if len(fields) == 6 and "," in text:
        raise InputError(
            "points.decimal_comma",
            f"{file}, line {number}: '{text}' could be three numbers with decimal commas or six.",
            "Write the numbers with a decimal point, three in a row.",
        )
    if len(fields) != 3:
        raise InputError(
            "points.fields",
            f"{file}, line {number}: '{text}' has {len(fields)} number(s), not three.",
            "Give one row with x, y and z for every point.",
        )
    values = []
    for field in fields:
        value = float(field) if NUMBER.fullmatch(field) else math.nan
        if not abs(value) < FARTHEST_MM:
            raise InputError(
                "points.number",
                f"{file}, line {number}: '{field}' is not a coordinate in mm.",
                "Give numbers with a decimal point, such as 12.345 or -1.2e-3.",
            )
        values.append(value)
    return values
