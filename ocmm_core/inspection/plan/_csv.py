"""Features of a plan from a table in text, e.g. from a spreadsheet.

The first line names the columns, in any order: ``name``, ``shape``, ``x``, ``y``, ``z`` are
required, those of `OPTIONAL` are not. Headings may state units ("x [inch]"); the default is mm, s
and degrees.
Encodings, separators and decimal signs: `ocmm_core.tables`.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core import tables
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature, Shape, shape_fault
from ocmm_core.inspection.plan._edit import add_feature, usual_points
from ocmm_core.inspection.plan._plan import Plan
from ocmm_core.inspection.plan._requirements import Requirement, source_of, with_requirements
from ocmm_core.names import name_fault, normal_name
from ocmm_core.units import named_unit, scaled

NEEDED = ("name", "shape", "x", "y", "z")
OPTIONAL = (
    "i", "j", "k", "diameter", "length", "width", "angle", "side", "points", "text", "projection",
    "compensation", "scan", "spacing", "interval", "turn", "gate_i", "gate_j", "gate_k", "sheet",
    "sheet_limit",
)  # fmt: skip
_SIZES = ("diameter", "length", "width", "spacing", "sheet", "sheet_limit")
_LENGTHS = ("x", "y", "z", *_SIZES)
_ANGLES = {"angle": "angle_deg", "turn": "turn_deg"}
_WAYS = {("i", "j", "k"): "direction", ("gate_i", "gate_j", "gate_k"): "gates"}
_NUMBERS = (*_LENGTHS, *_ANGLES, *(name for names in _WAYS for name in names), "interval")
_WORDS = {
    "side": ("outer", "inner"),
    "compensation": ("", "approach", "pulled", "shank", "nominal"),
    "scan": ("", "ring", "spiral", "raster"),
}
_SECONDS = {"s": 1.0, "sec": 1.0, "ms": 1e-3}
LARGEST_BYTES = 2_000_000
_LARGEST = 1e15
MOST_FEATURES = 1000
_UNIT_VECTOR = 5e-3
"""Tolerance of the length of a direction with two decimals, such as (0.71, 0.71, 0)."""

_SHAPES = {re.sub("[^a-z]", "", shape.value.lower()): shape for shape in Shape}


@dataclass(frozen=True, slots=True)
class FeatureTable:
    """Features of a table, and the account of the reader."""

    features: tuple[NominalFeature, ...]
    account: tables.TableAccount
    sha256: str
    heading_line: int
    lines: tuple[int, ...]

    def requirements(self) -> list[Requirement]:
        """Return the account for the plan: each row, and each line skipped by the user."""
        found = []
        for one, line in zip(self.features, self.lines, strict=True):
            asks, reference = _nominal_text(one), f"line {line}"
            found.append(
                Requirement(
                    group="feature", label=one.name, asks=asks, reference=reference,
                    nominals=[one.name],
                )
            )  # fmt: skip
        for rows in self.account.skipped:
            first = max(rows.first, self.heading_line + 1)
            for line in range(first, rows.last + 1) if rows.why == tables.SKIPPED_BY_USER else ():
                asks, at = rows.text if line == rows.first else "", f"line {line}"
                found.append(
                    Requirement(group="feature", label=at, asks=asks, reference=at, why=rows.why)
                )
        return found

    def added_to(self, plan: Plan) -> Plan:
        """Return the plan with these features and their account; InputError as `add_feature`."""
        for feature in self.features:
            plan = add_feature(plan, feature)
        source = source_of("table", self.account.path, self.sha256)
        return with_requirements(plan, source, self.requirements())


@dataclass(frozen=True, slots=True)
class _Cell:
    path: Path
    line: int
    column: str
    text: str

    def fault(self, what: str, remedy: str) -> InputError:
        # Without control characters; the marks tell where it ends.
        shown = repr(self.text[:60])[1:-1]
        return InputError(
            "plan.csv",
            f"{self.path}, line {self.line}, column '{self.column}': '{shown}' {what}.",
            remedy,
        )


def feature_table(path: Path | str, options: tables.TableOptions | None = None) -> FeatureTable:
    """Return the features of a table, and the account of the reader.

    InputError, with line and column, if the file or a cell cannot be used.
    """
    wanted = tables.NamedColumns(NEEDED, _NUMBERS, (*NEEDED, *OPTIONAL))
    table = tables.read_table(path, wanted, options, LARGEST_BYTES)
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
    for column, (line, text) in table.units.items():
        if column in _ANGLES:
            scales[column] = named_unit(text, "angle", table.path, line).factor
        elif column == "interval":
            if text not in _SECONDS:
                wrong = _Cell(table.path, line, column, text)
                raise wrong.fault("is not a unit of time", f"Use one of {', '.join(_SECONDS)}.")
            scales[column] = _SECONDS[text]
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
    return FeatureTable(
        tuple(found), table.account(unit), table.sha256, table.heading_line, tuple(lines.values())
    )


def _feature(
    table: tables.TextTable, row: tables.TextRow, scales: dict[str, float]
) -> NominalFeature:
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
        column: scaled(_number(table, cells.get(column)), scales.get(column, 1.0))
        for column in _NUMBERS
    }
    ways: dict[str, tuple[float, float, float]] = {}
    for columns, field in _WAYS.items():
        x, y, z = (values[column] for column in columns)
        stated = any(column in cells and cells[column].text for column in columns)
        # Many programs write zeros for the direction that a sphere has not.
        if any((x, y, z)) or (stated and columns[0] == "i" and shape is not Shape.SPHERE):
            ways[field] = (x, y, z)
            _check_unit_vector(table, row, columns, ways[field])
    feature = NominalFeature(
        name=name.text,
        shape=shape,
        points=_points(cells.get("points"), shape),
        point=(values["x"], values["y"], values["z"]),
        text=_text(cells.get("text")),
        projection=normal_name(_text(cells.get("projection"))),
        interval=values["interval"],
    )
    sizes = {name: values[name] for name in _SIZES}
    angles = {field: values[name] for name, field in _ANGLES.items()}
    words = {name: _word(cells.get(name), allowed) for name, allowed in _WORDS.items()}
    made = msgspec.structs.replace(feature, **sizes, **angles, **ways, **words)
    if wrong := shape_fault(made):
        field, what = wrong
        column = {field: column for column, field in _ANGLES.items()}.get(field, field)
        # Others, such as the direction of a slot, follow later.
        if column in OPTIONAL:
            cell = cells.get(column) or _Cell(table.path, row.line, column, "")
            raise cell.fault(what, "Correct the cell, or the shape.")
    return made


def _check_unit_vector(
    table: tables.TextTable, row: tables.TextRow, columns: tuple[str, ...],
    way: tuple[float, float, float],
) -> None:  # fmt: skip
    if abs(math.hypot(*way) - 1.0) > _UNIT_VECTOR:
        shown = ", ".join(f"{value:g}" for value in way)
        raise InputError(
            "plan.csv",
            f"{table.path}, line {row.line}, columns {', '.join(columns)}: the direction ({shown}) "
            f"has the length {math.hypot(*way):.4g}, not 1.",
            "Give the direction as a unit vector, such as 0, 0, 1.",
        )


def _nominal_text(one: NominalFeature) -> str:
    place = ", ".join(f"{value:g}" for value in one.point)
    size = f", diameter {one.diameter:g}" if one.diameter else ""
    return f"{one.shape.value} at {place}{size} mm"


def _number(table: tables.TextTable, cell: _Cell | None) -> float:
    if cell is None or not cell.text:
        return 0.0
    value = table.grammar.value(cell.text)
    # NaN compares as false.
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


def _word(cell: _Cell | None, words: tuple[str, ...]) -> str:
    text = "" if cell is None else cell.text.lower()
    if cell is None or not text or text in words:
        return text or words[0]
    raise cell.fault("is not known", f"Use one of {', '.join(filter(None, words))}.")


def _text(cell: _Cell | None) -> str:
    if cell is None:
        return ""
    if not cell.text.isprintable():
        raise cell.fault("contains non-printing characters", "Use plain text.")
    return cell.text
