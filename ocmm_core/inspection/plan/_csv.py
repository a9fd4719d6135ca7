"""Features of a plan from a table in text, e.g. out of a spreadsheet.

The first line names the columns, in any order: ``name``, ``shape``, ``x``, ``y``, ``z`` are needed;
``i``, ``j``, ``k``, ``diameter``, ``length``, ``width``, ``angle``, ``side``, ``points`` and
``text`` may be left out. Columns are parted by commas, semicolons or tabulators. A decimal point is
always taken, a decimal comma where columns are not parted by commas; there are no signs between
thousands. Lengths are millimetres.
"""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan._edit import usual_points
from ocmm_core.inspection.plan._plan import NAME_PATTERN

NEEDED = ("name", "shape", "x", "y", "z")
OPTIONAL = (
    "i", "j", "k", "diameter", "length", "width", "angle", "side", "points", "text",
)  # fmt: skip
LARGEST_BYTES = 2_000_000
_LARGEST = 1e15
MOST_FEATURES = 1000

_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d{1,2})?")
_SHAPES = {re.sub("[^a-z]", "", shape.value.lower()): shape for shape in Shape}


@dataclass(frozen=True, slots=True)
class _Cell:
    """A cell, and where it stands."""

    path: Path
    line: int
    column: str
    text: str

    def fault(self, what: str, remedy: str) -> InputError:
        return InputError(
            "plan.csv",
            f"{self.path}, line {self.line}, column '{self.column}': {self.text[:60]!r} {what}.",
            remedy,
        )


def features_from_csv(path: Path | str) -> tuple[NominalFeature, ...]:
    """Return the features of a table.

    Raises
    ------
    InputError
        The file cannot be read, or a cell cannot be used; the sentence names line and column.
    """
    path = Path(path)
    raw = read_bytes(path)
    if len(raw) > LARGEST_BYTES:
        raise InputError(
            "plan.csv",
            f"{path}: the file has {len(raw)} bytes and is not a feature table.",
            f"At most {MOST_FEATURES} features are allowed.",
        )
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            "plan.csv",
            f"{path}: byte {error.start} is not UTF-8 text.",
            "Save the table as CSV UTF-8.",
        ) from error
    first = text.split("\n", 1)[0]
    delimiter = next((sign for sign in ("\t", ";") if sign in first), ",")
    try:
        rows = list(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True))
    except csv.Error as error:
        raise InputError(
            "plan.csv", f"{path}: the table is not complete: {error}.", "Save it as CSV again."
        ) from error
    if not rows:
        raise InputError("plan.csv", f"{path}: the file is empty.", "Choose a feature table.")
    columns = _columns(path, rows[0])
    found: list[NominalFeature] = []
    lines: dict[str, int] = {}
    for line, row in enumerate(rows[1:], start=2):
        if not any(cell.strip() for cell in row):
            continue
        if len(row) != len(columns):
            hint = " A decimal comma needs semicolons between the columns." * (delimiter == ",")
            raise InputError(
                "plan.csv",
                f"{path}, line {line}: it has {len(row)} columns, the first line {len(columns)}.",
                f"Every line needs the same columns.{hint}",
            )
        cells = {
            column: _Cell(path, line, column, text.strip())
            for column, text in zip(columns, row, strict=True)
        }
        feature = _feature(cells, comma=delimiter != ",")
        if feature.name in lines:
            raise cells["name"].fault(
                f"is already the name in line {lines[feature.name]}", "Use each feature name once."
            )
        lines[feature.name] = line
        found.append(feature)
    if not 0 < len(found) <= MOST_FEATURES:
        raise InputError(
            "plan.csv",
            f"{path}: the table has {len(found)} features.",
            f"Allowed: 1 to {MOST_FEATURES}, one per line below the column names.",
        )
    return tuple(found)


def number(text: str, *, comma: bool = True) -> float | None:
    """Return a number with a decimal point or, where ``comma``, a decimal comma; None if none."""
    if not _NUMBER.fullmatch(text) or ("," in text and not comma):
        return None
    value = float(text.replace(",", "."))
    # Digits without end make infinity.
    return value if abs(value) <= _LARGEST else None


def _columns(path: Path, row: list[str]) -> list[str]:
    columns = [cell.strip().lower() for cell in row]
    for column in columns:
        if column not in (*NEEDED, *OPTIONAL):
            raise InputError(
                "plan.csv",
                f"{path}, line 1: there is no column {column[:60]!r}.",
                f"Columns are {', '.join((*NEEDED, *OPTIONAL))}.",
            )
    missing = [column for column in NEEDED if column not in columns]
    twice = [column for column in columns if columns.count(column) > 1]
    if missing or twice:
        what = f"column '{missing[0]}' is missing" if missing else f"'{twice[0]}' is there twice"
        raise InputError(
            "plan.csv", f"{path}, line 1: {what}.", f"Required, once each: {', '.join(NEEDED)}."
        )
    return columns


def _feature(cells: dict[str, _Cell], *, comma: bool) -> NominalFeature:
    name = cells["name"]
    if not NAME_PATTERN.fullmatch(name.text):
        raise name.fault(
            "is not a valid name",
            "A name has 1 to 60 letters, digits, spaces, '_', '.' or '-' and starts with a "
            "letter, a digit or '_'.",
        )
    word = cells["shape"]
    shape = _SHAPES.get(re.sub("[^a-z]", "", word.text.lower()))
    if shape is None:
        raise word.fault("is not a shape", f"Shapes are {', '.join(s.value for s in Shape)}.")
    values = {
        column: _number(cells[column], comma=comma) if column in cells else 0.0
        for column in ("x", "y", "z", "i", "j", "k", "diameter", "length", "width", "angle")
    }
    for column in ("x", "y", "z"):
        if not cells[column].text:
            raise cells[column].fault("is empty", "Give the place of the feature.")
    direction = (values["i"], values["j"], values["k"])
    return NominalFeature(
        name=name.text,
        shape=shape,
        points=_points(cells.get("points"), shape),
        point=(values["x"], values["y"], values["z"]),
        direction=direction if any(direction) else (0.0, 0.0, 1.0),
        diameter=values["diameter"],
        length=values["length"],
        width=values["width"],
        angle_deg=values["angle"],
        side=_side(cells.get("side")),
        text=_text(cells.get("text")),
    )


def _number(cell: _Cell, *, comma: bool) -> float:
    if not cell.text:
        return 0.0
    value = number(cell.text, comma=comma)
    if value is None:
        raise cell.fault(
            "is not a number", "Write it as 12.5, or 12,5 if semicolons separate the columns."
        )
    return value


def _points(cell: _Cell | None, shape: Shape) -> int:
    if cell is None or not cell.text:
        return usual_points(shape)
    if not re.fullmatch(r"\d{1,4}", cell.text):
        raise cell.fault("is not a number of points", "Give a whole number.")
    return int(cell.text)


def _side(cell: _Cell | None) -> Literal["outer", "inner"]:
    if cell is None or cell.text.lower() in ("", "outer"):
        return "outer"
    if cell.text.lower() != "inner":
        raise cell.fault("is not a side", "Write outer (shaft, ball, face) or inner (bore).")
    return "inner"


def _text(cell: _Cell | None) -> str:
    if cell is None:
        return ""
    if not cell.text.isprintable():
        raise cell.fault("contains non-printing characters", "Use plain text.")
    return cell.text
