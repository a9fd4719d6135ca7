"""Features of a plan from a table in text, e.g. out of a spreadsheet.

The first line names the columns, in any order: ``name``, ``shape``, ``x``, ``y``, ``z`` are needed;
``i``, ``j``, ``k``, ``diameter``, ``length``, ``width``, ``angle``, ``side``, ``points`` and
``text`` may be left out. Headings may state units ("x [inch]"); lengths are mm and angles degrees
without one. Encodings, separators and decimal signs: `ocmm_core.tables`.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan._edit import usual_points
from ocmm_core.names import name_fault, normal_name
from ocmm_core.tables import (
    NamedColumns,
    TableAccount,
    TableOptions,
    TablePreview,
    TextRow,
    TextTable,
    preview_table,
    read_table,
)
from ocmm_core.units import named_unit

NEEDED = ("name", "shape", "x", "y", "z")
OPTIONAL = (
    "i", "j", "k", "diameter", "length", "width", "angle", "side", "points", "text",
)  # fmt: skip
_LENGTHS = ("x", "y", "z", "diameter", "length", "width")
_NUMBERS = (*_LENGTHS, "i", "j", "k", "angle")
LARGEST_BYTES = 2_000_000
_LARGEST = 1e15
MOST_FEATURES = 1000
_UNIT_VECTOR = 5e-3
"""Of the length of a direction with two decimals, such as (0.71, 0.71, 0)."""

_SHAPES = {re.sub("[^a-z]", "", shape.value.lower()): shape for shape in Shape}


@dataclass(frozen=True, slots=True)
class FeatureTable:
    """Features of a table, and the account of the reader."""

    features: tuple[NominalFeature, ...]
    account: TableAccount


@dataclass(frozen=True, slots=True)
class FeaturePreview:
    """Lines of a table for an import page, and its features if the reader takes them."""

    preview: TablePreview
    table: FeatureTable | None
    options: TableOptions
    """With which it was read."""


@dataclass(frozen=True, slots=True)
class _Cell:
    """A cell and its place."""

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
    """Return the features of a table, see `feature_table`."""
    return feature_table(path).features


def preview_features(path: Path, options: TableOptions) -> FeaturePreview:
    """Return the lines of a table, with its features or the error of the reader.

    Raises
    ------
    InputError
        The file cannot be read at all.
    """
    try:
        table = feature_table(path, options)
    except InputError as error:
        return FeaturePreview(preview_table(path, options, error), None, options)
    return FeaturePreview(preview_table(path, options, table.account), table, options)


def feature_table(path: Path | str, options: TableOptions | None = None) -> FeatureTable:
    """Return the features of a table, and the account of the reader.

    Raises
    ------
    InputError
        The file cannot be read, or a cell cannot be used; the sentence names line and column.
    """
    wanted = NamedColumns(NEEDED, _NUMBERS, (*NEEDED, *OPTIONAL))
    table = read_table(path, wanted, options, LARGEST_BYTES)
    if len(table.rows) > MOST_FEATURES:
        raise InputError(
            "plan.csv",
            f"{table.path}: the table has {len(table.rows)} features.",
            f"Allowed: 1 to {MOST_FEATURES}, one per line below the column names.",
        )
    present = tuple(name for name in _LENGTHS if name in table.columns)
    unit = table.unit(present, options)
    factors = np.broadcast_to(unit.factors, (1, len(present))).ravel().tolist()
    scales = dict(zip(present, factors, strict=True))
    if "angle" in table.units:
        line, text = table.units["angle"]
        scales["angle"] = named_unit(text, "angle", f"{table.path}, line {line}").factor
    found: list[NominalFeature] = []
    lines: dict[str, int] = {}
    for row in table.rows:
        feature = _feature(table, row, scales)
        if feature.name in lines:
            name = _Cell(table.path, row.line, "name", feature.name)
            raise name.fault(
                f"is already the name in line {lines[feature.name]}", "Use each feature name once."
            )
        lines[feature.name] = row.line
        found.append(feature)
    return FeatureTable(tuple(found), table.account(unit))


def _feature(table: TextTable, row: TextRow, scales: dict[str, float]) -> NominalFeature:
    cells = {name: _Cell(table.path, row.line, name, text) for name, text in row.cells.items()}
    name = replace(cells["name"], text=normal_name(cells["name"].text))
    if fault := name_fault(name.text):
        raise name.fault(f"is not a valid name: it {fault}", "Correct the name.")
    word = cells["shape"]
    shape = _SHAPES.get(re.sub("[^a-z]", "", word.text.lower()))
    if shape is None:
        raise word.fault("is not a shape", f"Shapes are {', '.join(s.value for s in Shape)}.")
    for column in ("x", "y", "z"):
        if not cells[column].text:
            raise cells[column].fault("is empty", "Give the place of the feature.")
    values = {
        column: scales.get(column, 1.0) * _number(table, cells.get(column)) for column in _NUMBERS
    }
    direction = (values["i"], values["j"], values["k"])
    if any(direction) and abs(math.hypot(*direction) - 1.0) > _UNIT_VECTOR:
        shown = ", ".join(f"{value:g}" for value in direction)
        raise InputError(
            "plan.csv",
            f"{table.path}, line {row.line}, columns i, j, k: the direction ({shown}) has the "
            f"length {math.hypot(*direction):.4g}, not 1.",
            "Give the direction as a unit vector, such as 0, 0, 1.",
        )
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


def _number(table: TextTable, cell: _Cell | None) -> float:
    if cell is None or not cell.text:
        return 0.0
    value = table.grammar.value(cell.text)
    # Not a number compares as false.
    if not abs(value) <= _LARGEST:
        hint = "12,5" if table.grammar.decimal == "," else "12.5"
        raise cell.fault("is not a number", f"Write it as {hint}, like the other numbers.")
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
