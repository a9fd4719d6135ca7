"""Meaning of the columns of points: by --columns, by the heading, or by their count."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.documents import shortened
from ocmm_core.errors import InputError
from ocmm_core.tables._grid import LEAST, TextGrid, fault, heading_cells
from ocmm_core.tables._headings import is_summary, role_of
from ocmm_core.tables._numbers import NUMBER, is_number, plain_signs
from ocmm_core.units import find_unit, heading_unit, unit_statement

AXES = ("x", "y", "z")
NORMAL = ("i", "j", "k")
_ROLES = (*AXES, *NORMAL, "name", "sigma", "unit")
_MOST_TEXTS = 30_000
_UNIT_VECTOR = 1e-3
_COORDINATE = re.compile(
    r"(?:[a-zα-ω]|phi|theta|rho|lat|lon|long|latitude|longitude|radius|azimuth|angle|range|dist|"
    r"distance)(?![a-zα-ω])"
)
_MARK = re.compile(
    r"(?:is[ _]?)?(?:valid|status|state|ok|used?|active|enabled|flag|quality|excluded?|rejected|"
    r"outlier|include[ds]?|gültig|benutzt|verwendet|aktiv|ausreißer|zustand|result|ergebnis)"
)
"""Headings of columns that mark rows to be left out."""
_NUMBERED = re.compile(r"(\D*)\d.*")
_MOST_ODD = 8
_OTHER = "the points below may belong to another feature"
_ONE = "Give the points of one feature, or state the columns."
_ASK = "State the columns, such as name,x,y,z or x,y,z,-."


@dataclass(frozen=True, slots=True)
class ColumnPlan:
    """Headings and roles of the columns, in the order of the file."""

    headings: tuple[str, ...]
    roles: tuple[str, ...]
    """Empty for a column that is not read."""
    line: int = 0
    """Line of the heading; 0 without a heading."""
    unit_row: tuple[str, ...] = ()
    """Cells of a line below the heading that states units."""

    def index(self, role: str) -> int:
        """Return the place of a role, or -1."""
        return self.roles.index(role) if role in self.roles else -1

    def units(self, path: Path, roles: Sequence[str]) -> dict[str, tuple[int, str]]:
        """Return line and text of the unit of each of ``roles`` that has one of its own."""
        named = zip(self.headings, self.roles, strict=True)
        own = {role: heading_unit(heading)[1] for heading, role in named}
        above = {role: (self.line, text) for role, text in own.items() if text}
        below = dict(zip(self.roles, self.unit_row, strict=False))
        found = with_units_below(path, above, self.line, below)
        return {role: unit for role, unit in found.items() if role in roles}


def with_units_below(
    path: Path, above: Mapping[str, tuple[int, str]], line: int, below: Mapping[str, str]
) -> dict[str, tuple[int, str]]:
    """Return the units in headings and in the row below them; InputError if they differ."""
    units = dict(above)
    for name, cell in below.items():
        text = cell.strip(" []()<>{}")
        if not name or text in ("", "-"):
            continue
        if name in units and find_unit(units[name][1]) != find_unit(text):
            raise InputError(
                "table.unit",
                f"{path}, line {line}: the unit {shortened(text)} contradicts the unit "
                f"{shortened(units[name][1])} in the heading.",
                "State the unit of all lengths, such as mm.",
            )
        units.setdefault(name, (line, text))
    return units


def stated_columns(text: str) -> tuple[str, ...]:
    """Return the roles of ``--columns``; InputError if unknown, duplicate or missing."""
    words = [word.strip().lower() for word in text.replace(";", ",").split(",")]
    roles = tuple("" if word in ("-", "_", "") else word for word in words)
    unknown = [role for role in roles if role and role not in _ROLES]
    twice = [role for role in roles if role and roles.count(role) > 1]
    missing = [axis for axis in AXES if axis not in roles]
    if unknown or twice or missing:
        what = (
            f"{shortened(unknown[0])} is unknown" if unknown
            else f"{twice[0]!r} occurs twice" if twice else f"{missing[0]!r} is missing"
        )  # fmt: skip
        raise InputError(
            "table.columns",
            f"Stated columns {shortened(text)}: {what}.",
            f"Name each column once, with x, y and z, and '-' for a column that is not read; known "
            f"are {', '.join(_ROLES)}.",
        )
    return roles


def heading_roles(cells: Sequence[str]) -> tuple[str, ...] | None:
    """Return the roles of a line that names columns; None if it does not."""
    if len(cells) < 2 or any(is_number(cell) for cell in cells):
        return None
    roles = [role_of(cell) for cell in cells]
    short = [cell.casefold().split("[")[0].split("(")[0].strip() for cell in cells]
    if {"e", "n"} <= set(short):
        roles = [{"e": "x", "n": "y", "h": "z"}.get(word, role)
                 for word, role in zip(short, roles, strict=True)]  # fmt: skip
    elif "h" in short and "z" not in roles and {"x", "y"} <= set(roles):
        roles[short.index("h")] = "z"
    coordinates = [role for role in roles if role[-1:] in AXES]
    return tuple(roles) if len(set(coordinates)) >= 2 else None


def check_texts(path: Path, count: int) -> None:
    """Raise InputError if a file has more comments and titles than are searched for units."""
    if count > _MOST_TEXTS:
        raise InputError(
            "table.lines",
            f"{path}: more than {_MOST_TEXTS:,} lines that are not points.",
            "Give a file with the points of one feature.",
        )


def find_heading(grid: TextGrid) -> tuple[int, list[str], tuple[str, ...]] | None:
    """Return line, cells and roles of the last heading above the rows, or None."""
    split = grid.splitter()
    found: tuple[int, str, list[str]] | None = None
    first: list[str] = []
    comments = [(line, text.lstrip("#%!;/*' \t"), text) for line, text in grid.comments]
    lines = sorted([*comments, *((line, text, text) for line, text in grid.body)])
    for place, (line, text, raw) in enumerate(lines):
        check_texts(grid.path, place)
        cells = heading_cells(text, grid.separator)
        if heading_roles(cells) is not None:
            found = (line, raw, cells)
        elif text is raw:
            first = split(line, text)
            words = [cell for cell in first if not is_number(cell)]
            if len(first) - len(words) >= len(AXES) and not is_summary(words):
                break
    if found is None:
        _refuse_unknown_heading(grid, lines, first)
        return None
    line, raw, cells = found
    while len(first) > len(cells) and not first[-1]:
        first.pop()
    if len(cells) > len(first) > 1:
        cells = _joined(cells)
    if len(cells) == len(first) - 1 and (raw.startswith("#") or not is_number(first[0])):
        cells = ["name", *cells] if "name" not in map(role_of, cells) else cells
    return line, cells, heading_roles(cells) or ()


def _refuse_unknown_heading(
    grid: TextGrid, lines: Sequence[tuple[int, str, str]], first: Sequence[str]
) -> None:
    """Raise InputError if the line above the rows names columns other than x, y and z."""
    split = grid.splitter()
    above: tuple[int, list[str], bool] | None = None
    for line, text, raw in lines:
        if text is raw and split(line, text) == first:
            break
        above = (line, heading_cells(text, grid.separator), text is raw)
    if above is None or len(above[1]) != len(first) or any(map(is_number, above[1])):
        return
    line, cells, is_row = above
    coordinates = sum(_COORDINATE.match(cell.casefold()) is not None for cell in cells)
    if coordinates >= 2 or (is_row and grid.separator != " "):
        raise InputError(
            "table.columns",
            f"{grid.path}, line {line}: the heading {shortened(' '.join(cells))} does not name x, "
            "y and z.",
            _ASK,
        )


def require_one_set(
    grid: TextGrid, plan: ColumnPlan, rows: Sequence[tuple[int, list[str]]]
) -> None:
    """Raise InputError if some rows may not be points, or belong to another feature.

    Signs are names unlike the others, marks such as "rejected", names of axes, and comments, empty
    lines or lines such as "-----" between some rows.
    """
    path = grid.path
    if "name" in plan.roles:
        names = [(line, cells[plan.index("name")]) for line, cells in rows]
        require_like_names(path, names)
        if not plan.line and len({role_of(name) for _, name in names} & {*AXES}) > 1:
            raise fault(
                path, *names[0][:1], "row", names[0][1], "names an axis, not a point",
                "Give one row with x, y and z for every point.",
            )  # fmt: skip
    for place, heading in enumerate(plan.headings):
        marks = {cells[place].casefold(): line for line, cells in reversed(rows)}
        # Also a remark next to some rows only.
        is_partial = not plan.roles[place] and "" in marks and not all(map(is_number, marks))
        if len(marks) > 1 and (is_partial or _MARK.fullmatch(heading.casefold())):
            line = max(marks.values())
            raise fault(
                path, line, "row", heading, f"has {len(marks)} different marks; some rows may not "
                "be points",
                "Skip the rows that are not points, or state the columns.",
            )  # fmt: skip
    first, last = rows[0][0], rows[-1][0]
    inner = [line for line in grid.rules if first < line < last]
    if 0 < len(inner) < len(rows) - 1:
        raise fault(
            path, inner[0], "row", "---", "separates rows; those below may be no points",
            "Skip the rows that are not points, or the line.",
        )  # fmt: skip
    between = [(line, text) for line, text in grid.comments if first < line < last]
    for line, text in between:
        # A row may be taken out by a sign in front of it.
        if unit_statement(text) is None and sum(map(is_number, text[1:].split())) < len(AXES):
            raise fault(path, line, "row", text, "stands between rows; " + _OTHER, _ONE)
    gaps = [line for line in grid.gaps if first < line < last]
    if 0 < len(gaps) < len(rows) - 1:
        raise InputError("table.row", f"{path}, line {gaps[0]}: it is empty; {_OTHER}.", _ONE)


def require_like_names(path: Path, names: Sequence[tuple[int, str]]) -> None:
    """Raise InputError if first or last rows lack the number that all other names have.

    Such rows are often means, limits or nominal values in any language. Names that repeat belong to
    several features.
    """
    count = Counter(name for _, name in names)
    if 1 < len(count) <= len(names) / LEAST:
        line, name = next((line, name) for line, name in names if name != names[0][1])
        raise fault(
            path, line, "row", name, f"is another name than {shortened(names[0][1])} above; the "
            "points may belong to several features",
            _ONE,
        )  # fmt: skip
    kinds = [found[1] if (found := _NUMBERED.fullmatch(name)) else None for _, name in names]
    usual = {kind for kind in kinds if kind}
    # "3s" below P1 to P9 is as odd as "Mean".
    odd = [place for place, kind in enumerate(kinds) if kind is None or (usual and not kind)]
    usual = usual or {kind for kind in kinds if kind is not None}
    if len(usual) != 1 or not 0 < len(odd) <= _MOST_ODD or len(kinds) - len(odd) < LEAST:
        return
    inner = [place for place, kind in enumerate(kinds) if kind is not None and place not in odd]
    if any(inner[0] < place < inner[-1] for place in odd):
        return
    line, name = names[odd[0]]
    raise fault(
        path, line, "row", name or "(no name)", "is not numbered as the other names, and may be no "
        "point",
        "Skip the line, or state the columns if it is a point.",
    )  # fmt: skip


def _joined(cells: Sequence[str]) -> list[str]:
    """Return headings of several words each: "Point No X Coord" has two."""
    joined: list[str] = []
    for cell in cells:
        last = role_of(joined[-1]) if joined else ""
        own, both = role_of(cell), role_of(f"{joined[-1]} {cell}") if joined else ""
        continues = both == last and (not own or own == last == "name")
        if joined and (continues or (not last and both)):
            joined[-1] += f" {cell}"
        else:
            joined.append(cell)
    return joined


def checked_roles(
    path: Path, line: int, headings: Sequence[str], roles: Sequence[str]
) -> tuple[str, ...]:
    """Return the roles of a heading with x, y and z once, all of a kind; or raise InputError."""
    nominal = [head for head, role in zip(headings, roles, strict=True) if "nominal" in role]
    twice = [role for role in roles if role in (*AXES, *NORMAL, "unit") and roles.count(role) > 1]
    missing = [axis for axis in AXES if axis not in roles]
    where = f"{path}, line {line}: the heading"
    if nominal:
        what = f"names nominal coordinates ({', '.join(map(shortened, nominal[:3]))})"
    elif twice:
        what = f"names {twice[0]} twice"
    elif missing:
        what = f"does not name {' and '.join(missing)}"
    else:
        first = roles.index("name") if "name" in roles else -1
        return tuple(
            "" if role == "name" and place != first else role for place, role in enumerate(roles)
        )
    remedy = _ASK if len(headings) > 2 else "Give a file with x, y and z of every point."
    raise InputError("table.columns", f"{where} {what}.", remedy)


def counted_roles(path: Path, rows: Sequence[tuple[int, list[str]]]) -> tuple[str, ...]:
    """Return the roles of columns without a heading; InputError if they are ambiguous.

    Three numbers are x, y and z, six whose last three form unit vectors also a normal; texts before
    or behind them are names. Anything else has to be stated.
    """
    width = len(rows[0][1])
    texts = [
        place for place in range(width) if not any(is_number(cells[place]) for _, cells in rows)
    ]
    numbers = [place for place in range(width) if place not in texts]
    line, first = rows[0]
    row = shortened(" ".join(first))
    if texts and numbers and numbers != list(range(numbers[0], numbers[-1] + 1)):
        what = f"{row} has texts between its numbers, and no heading names the columns"
        raise InputError("table.columns", f"{path}, line {line}: {what}.", _ASK)
    if len(numbers) < len(AXES):
        raise InputError(
            "table.columns",
            f"{path}, line {line}: {row} has {len(numbers)} number(s), not three.",
            "Give one row with x, y and z for every point.",
        )
    roles = [""] * width
    if texts:
        roles[texts[0]] = "name"
    if texts == [0] and len(numbers) == len(AXES) + 1 and _are_numbered([c for _, c in rows]):
        numbers = numbers[1:]
    for place, role in zip(numbers, (*AXES, *NORMAL), strict=False):
        roles[place] = role
    if len(numbers) == 2 * len(AXES) and _are_normals(rows, numbers):
        return tuple(roles)
    if len(numbers) != len(AXES):
        raise InputError(
            "table.columns",
            f"{path}, line {line}: {row} has {len(numbers)} numbers, and no heading names the "
            "columns.",
            _ASK,
        )
    if not texts and _is_running([cells for _, cells in rows]):
        raise InputError(
            "table.columns",
            f"{path}, line {line}: the first of three numbers counts the rows, and no heading "
            "names the columns.",
            _ASK,
        )
    return tuple(roles)


def _are_normals(rows: Sequence[tuple[int, list[str]]], numbers: Sequence[int]) -> bool:
    def lengths(places: Sequence[int]) -> list[float]:
        return [math.hypot(*(_simple(cells[place]) for place in places)) for _, cells in rows]

    ones = [abs(length - 1.0) < _UNIT_VECTOR for length in lengths(numbers[3:])]
    others = [abs(length - 1.0) < _UNIT_VECTOR for length in lengths(numbers[:3])]
    # Whole numbers may be halves of numbers with decimal commas.
    has_decimals = any("." in cells[p] or "," in cells[p] for _, cells in rows for p in numbers)
    return all(ones) and not all(others) and has_decimals


def _simple(text: str) -> float:
    plain = plain_signs(text).replace(",", ".")
    return float(plain.replace("d", "e").replace("D", "e")) if NUMBER.fullmatch(plain) else math.nan


def _are_numbered(rows: Sequence[list[str]]) -> bool:
    """Return whether each row starts with "Point" and a whole number."""
    return all(role_of(cells[0]) == "name" and cells[1].isdecimal() for cells in rows)


def _is_running(rows: Sequence[list[str]]) -> bool:
    if len(rows) < 3:
        return False
    first = [cells[0] for cells in rows]
    counts = any(first == [str(start + row) for row in range(len(rows))] for start in (0, 1))
    return counts and all("." in cell or "," in cell for cells in rows for cell in cells[1:])


def are_units(cells: Sequence[str]) -> bool:
    """Return whether a line below the heading states the unit of each column."""
    stripped = [cell.strip(" []()<>{}") for cell in cells]
    filled = [cell for cell in stripped if cell not in ("", "-", "1")]
    return bool(filled) and all(
        find_unit(cell) is not None and not is_number(cell) for cell in filled
    )
