"""The unit of a table: by the user, by its rows, by its headings, or by a statement."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ocmm_core.documents import shortened
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.tables._account import TableOptions
from ocmm_core.units import (
    MeasureUnit,
    UnitStatement,
    find_unit,
    named_unit,
    scaled,
    unit_statement,
    units_of_name,
)

_REMEDY = "State the unit of all lengths, such as mm."
_SAME = 1e-9


@dataclass(frozen=True, slots=True)
class UnitChoice:
    """Units of the coordinates of a table."""

    symbol: str
    factor: float
    """mm; of the first coordinate if they differ."""
    evidence: str
    """Empty if mm is assumed."""
    factors: Float
    """Broadcasts over (n, 3): mm of each coordinate or row."""
    of_column: Mapping[str, str] = field(default_factory=dict)
    """Symbols by role, if the columns have different units."""

    def in_mm(self, values: Float) -> Float:
        if bool(np.all(self.factors == 1.0)):
            return values
        return np.asarray(np.vectorize(scaled, otypes=[np.float64])(values, self.factors))


PIXELS = UnitChoice("px", 1.0, "the kind of table", np.array([1.0]))
"""Unit of spots; they have no length."""


def statements_in(lines: Iterable[tuple[int, str]]) -> list[tuple[int, UnitStatement]]:
    """Return the statements of units in comments and titles, with their lines."""
    found = ((line, unit_statement(text)) for line, text in lines)
    return sorted(
        ((line, statement) for line, statement in found if statement is not None),
        key=lambda item: item[0],
    )


def _require_above(
    path: Path, statements: Sequence[tuple[int, UnitStatement]], first: int, last: int
) -> None:
    """Raise InputError if the unit is stated between the rows only, whose unit it may be."""
    line, unit = next(((line, one.unit) for line, one in statements if one.unit), (0, None))
    if unit is not None and unit.factor != 1.0 and first < line < last:
        raise InputError(
            "table.unit",
            f"{path}, line {line}: the unit {unit.symbol} is stated below the first points.",
            "State the unit of all lengths above them.",
        )


def choose_unit(
    path: Path,
    statements: Sequence[tuple[int, UnitStatement]],
    columns: Mapping[str, tuple[int, str]],
    options: TableOptions,
    rows: Sequence[tuple[int, str]] = (),
    roles: Sequence[str] = ("x", "y", "z"),
    between: tuple[int, int] = (0, 0),
) -> UnitChoice:
    """Return the unit of the lengths; InputError if one is unknown or two statements contradict.

    `columns`: Line and text of the unit of a column, by its role.
    `rows`: Line and text of the unit of each row; empty if rows have none.
    `roles`: Columns that are lengths.
    `between`: First and last line of the table.

    Raises InputError if a unit is unknown, or two statements contradict each other; also the name
    of the file is one.
    """
    if options.unit:
        unit = named_unit(options.unit, "length")
        return UnitChoice(unit.symbol, unit.factor, "your statement", np.array([unit.factor]))
    if not (columns or rows):
        _require_above(path, statements, *between)
    found = _stated_unit(path, statements, columns, rows, roles)
    _check_name(path, found)
    return found


def _check_name(path: Path, found: UnitChoice) -> None:
    """Raise InputError if the name of the file has another unit: ``bore_inch.csv`` with mm."""
    named = [one for one in units_of_name(path.name) if not (one.is_mention and found.evidence)]
    factors = np.array([one.unit.factor for one in named if one.unit is not None])
    agree = np.isclose(found.factors.ravel(), factors[:, np.newaxis], rtol=_SAME).any(axis=1)
    if agree.all() or (found.evidence and agree.any()):
        return
    stated = f"the unit is {found.symbol}" if found.evidence else "the file states no unit"
    text = named[int(agree.argmin())].text
    raise InputError(
        "table.unit",
        f"{path}: {stated}, but the name of the file contains {shortened(text)}.",
        "State the unit of all lengths, such as mm, or rename the file.",
    )


def _stated_unit(
    path: Path,
    statements: Sequence[tuple[int, UnitStatement]],
    columns: Mapping[str, tuple[int, str]],
    rows: Sequence[tuple[int, str]],
    roles: Sequence[str],
) -> UnitChoice:
    """Return the unit that the content of a file states; mm if none."""
    stated: tuple[int, MeasureUnit] | None = None
    has_unit = bool(columns or rows) or any(one.unit for _, one in statements)
    for line, statement in statements:
        if statement.is_mention and has_unit:
            continue
        if statement.unit is None:
            raise _unknown(path, line, statement.text)
        stated = _agreed(path, stated, (line, statement.unit))
    own = {role: (line, _known(path, line, text)) for role, (line, text) in columns.items()}
    distinct = {unit.factor for _, unit in own.values()}
    of_column: dict[str, str] = {}
    is_partial = len(own) < len(roles) and stated is None
    if len(distinct) > 1 or (is_partial and distinct - {1.0}):
        return _by_column(path, own, stated, rows, roles)
    for line, unit in own.values():
        of_column = dict.fromkeys(own, unit.symbol) if len(own) < len(roles) else {}
        stated = _agreed(path, stated, (line, unit))
    if rows:
        return _by_row(path, stated, rows)
    if stated is None:
        return UnitChoice("mm", 1.0, "", np.array([1.0]))
    line, unit = stated
    evidence = f"line {line}" if line else "the heading"
    return UnitChoice(unit.symbol, unit.factor, evidence, np.array([unit.factor]), of_column)


def _by_column(
    path: Path,
    own: Mapping[str, tuple[int, MeasureUnit]],
    stated: tuple[int, MeasureUnit] | None,
    rows: Sequence[tuple[int, str]],
    roles: Sequence[str],
) -> UnitChoice:
    line = next(iter(own.values()))[0]
    if stated is not None or rows or len(own) < len(roles):
        names = ", ".join(f"{role} {unit.symbol}" for role, (_, unit) in own.items())
        raise InputError(
            "table.unit",
            f"{path}, line {line}: the columns have several units ({names}), and others or the "
            "file have none or another one.",
            _REMEDY,
        )
    units = [own[role][1] for role in roles]
    factors = np.array([unit.factor for unit in units])
    symbols = {role: own[role][1].symbol for role in roles}
    return UnitChoice(units[0].symbol, units[0].factor, f"line {line}", factors, symbols)


def _by_row(
    path: Path, stated: tuple[int, MeasureUnit] | None, rows: Sequence[tuple[int, str]]
) -> UnitChoice:
    """Return the units that the rows state themselves."""
    units: dict[str, MeasureUnit] = {}
    factors = np.empty((len(rows), 1))
    for place, (line, text) in enumerate(rows):
        if text not in units:
            units[text] = _known(path, line, text)
            if stated is not None:
                _agreed(path, stated, (line, units[text]))
        factors[place] = units[text].factor
    first = units[rows[0][1]]
    symbol = first.symbol if len(units) == 1 else "several"
    return UnitChoice(symbol, first.factor, "each row", factors)


def _known(path: Path, line: int, text: str) -> MeasureUnit:
    unit = find_unit(text, "length")
    if unit is None:
        raise _unknown(path, line, text)
    return unit


def _unknown(path: Path, line: int, text: str) -> InputError:
    return InputError(
        "table.unit",
        f"{path}, line {line}: {shortened(text)} is not a clear unit of length.",
        _REMEDY,
    )


def _agreed(
    path: Path, stated: tuple[int, MeasureUnit] | None, other: tuple[int, MeasureUnit]
) -> tuple[int, MeasureUnit]:
    """Return the statement of two that agree."""
    if stated is None:
        return other
    if abs(stated[1].factor / other[1].factor - 1.0) > _SAME:
        raise InputError(
            "table.unit",
            f"{path}, line {other[0]}: the unit {other[1].symbol} contradicts the unit "
            f"{stated[1].symbol} in line {stated[0]}.",
            _REMEDY,
        )
    return stated
