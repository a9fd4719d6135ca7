"""Files of known points and their spots.

Reference positions, from a CMM::

    # ocmm reference points
    # unit: mm
    # uncertainty: 0.0017
    # length uncertainty: 3e-6
    # frame: CMM machine frame
    name;x;y;z
    P001;-200,0;-7,5;-200,0

``unit`` is one of `ocmm_core.units`; ``uncertainty`` is the standard uncertainty (k = 1) of one
coordinate in that unit, independent between points; the optional ``length uncertainty`` is that of
all lengths together, as a ratio: 3 um/m is 3e-6. ``frame`` describes the coordinate system, which
becomes the world frame. Without a column ``name`` the points are numbered from 1. Headings may have
the words of other programs, such as ``Point`` or ``X-Koordinate``.

Spots, the mean of many exposures at each point::

    # ocmm spots
    # sigma: 0.0105
    point,serial,u,v
    P001,20330001,312.4471,1766.0312

``sigma`` is the standard deviation of one mean, px per axis. A point unseen by a camera has no row
for it. Separators and decimal signs: `ocmm_core.tables`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ocmm_core import tables
from ocmm_core.errors import InputError
from ocmm_core.geometry import Pixels, Points3
from ocmm_core.units import named_unit, scaled

MAX_COORDINATE_MM = 1e5

_AXES = ("x", "y", "z")
_LENGTH = "length uncertainty"

MAX_LENGTH_SIGMA = 1e-3
"""Larger values indicate a wrong unit."""


@dataclass(frozen=True, slots=True)
class KnownPoints:
    """Reference positions."""

    names: tuple[str, ...]
    positions_world: Points3
    """(n, 3), mm."""
    sigma: float
    """Standard uncertainty of one coordinate, mm."""
    frame: str
    """Description of the coordinate system."""
    length_sigma: float = 0.0
    """Relative standard uncertainty common to all distances."""


@dataclass(frozen=True, slots=True)
class SpotTable:
    """Averaged spots of every camera at the reference points."""

    serials: tuple[int, ...]
    uv: Pixels
    """(C, n, 2), px, in the order of the reference points; NaN if unseen."""
    sigma_px: float
    """Standard deviation of one averaged spot, px per axis."""
    account: tables.TableAccount | None = None
    """Of the reader of a file."""


@dataclass(frozen=True, slots=True)
class ReferenceList:
    """Reference points, and the account of the reader."""

    points: KnownPoints
    account: tables.TableAccount


def read_reference_points(path: Path, options: tables.TableOptions | None = None) -> ReferenceList:
    """Return the reference points of a list, and the account of the reader.

    The unit of ``options`` replaces that of the header, also for the uncertainty. InputError: not
    such a list, no unit, uncertainty or frame, unknown unit, length uncertainty above
    `MAX_LENGTH_SIGMA`, duplicate name, cell without a number, or a coordinate over 100 m.
    """
    options = options or tables.TableOptions()
    table = tables.read_table(
        path, tables.NamedColumns(_AXES, _AXES, optional=("name", "unit")), options
    )
    if not options.unit:
        line, stated = table.value("unit", "the unit of the coordinates")
        named_unit(stated, "length", table.path, line)
    unit = table.unit(_AXES, options)
    what = "the uncertainty of the points"
    sigma = scaled(_positive(table, "uncertainty", what, zero=True), unit.factor)
    _, frame = table.value("frame", "the reference of the coordinates")
    rows = [[table.number(row, axis) for axis in _AXES] for row in table.rows]
    positions = unit.in_mm(np.array(rows))
    far = np.abs(positions).max(axis=1) > MAX_COORDINATE_MM
    if far.any():
        row = table.rows[int(np.argmax(far))]
        raise InputError(
            "reference_points.unit",
            f"{table.path}, line {row.line}: a coordinate is more than 100 m.",
            f"Check the unit {unit.symbol!r} of the list.",
        )
    points = KnownPoints(_names(table), positions, sigma, frame, _length_sigma(table))
    return ReferenceList(points, table.account(unit))


def load_spots(
    path: Path | str, points: KnownPoints, options: tables.TableOptions | None = None
) -> SpotTable:
    """Return the spots of the table at ``path`` in the order of the reference points.

    InputError: not such a table, no sigma, a point outside the list, two rows for a point and
    camera, or a cell without a number.
    """
    read = tables.read_pixels(path, ("point", "serial", "u", "v"), options)
    table = read.table
    index_of = {name: index for index, name in enumerate(points.names)}
    spots: dict[int, Pixels] = {}
    seen_in: dict[tuple[int, int], int] = {}
    for row in table.rows:
        name, serial_text = row.cells["point"], row.cells["serial"]
        index = index_of.get(name)
        if index is None:
            raise InputError(
                "spots.unknown_point",
                f"{table.path}, line {row.line}: the point {name!r} is not in the list of "
                f"reference points.",
                "Use the same names in both files.",
            )
        if not serial_text.isdecimal() or int(serial_text) == 0:
            raise InputError(
                "spots.serial",
                f"{table.path}, line {row.line}: {serial_text!r} is not the serial number of a "
                f"camera.",
                "Write the number that the camera reports.",
            )
        serial = int(serial_text)
        before = seen_in.setdefault((serial, index), row.line)
        if before != row.line:
            raise InputError(
                "spots.twice",
                f"{table.path}, line {row.line}: camera {serial} and point {name!r} occur in line "
                f"{before} already.",
                "Keep one of the two rows.",
            )
        camera = spots.setdefault(serial, np.full((len(points.names), 2), np.nan))
        camera[index] = read.uv(row)
    serials = tuple(sorted(spots))
    uv = np.stack([spots[serial] for serial in serials])
    return SpotTable(serials, uv, read.sigma_px, read.account)


def _positive(table: tables.TextTable, key: str, what: str, zero: bool = False) -> float:
    line, text, value = table.head_number(key, what)
    if value < 0.0 or (value == 0.0 and not zero):
        raise InputError(
            "table.value",
            f"{table.path}, line {line}: '{key}' is {text}, but must be greater than zero.",
            "State its value.",
        )
    return value


def _length_sigma(table: tables.TextTable) -> float:
    if _LENGTH not in table.head:
        return 0.0
    ratio = _positive(table, _LENGTH, "the uncertainty of lengths", zero=True)
    if ratio > MAX_LENGTH_SIGMA:
        line, text = table.head[_LENGTH]
        raise InputError(
            "table.value",
            f"{table.path}, line {line}: '{_LENGTH}' is {text}, but is a ratio below "
            f"{MAX_LENGTH_SIGMA:g}.",
            "Write 3 um/m as 3e-6.",
        )
    return ratio


def _names(table: tables.TextTable) -> tuple[str, ...]:
    if "name" not in table.columns:
        return tuple(str(number) for number in range(1, len(table.rows) + 1))
    first: dict[str, int] = {}
    tables.require_like_names(table.path, [(row.line, row.cells["name"]) for row in table.rows])
    for row in table.rows:
        name = row.cells["name"]
        if not name:
            raise InputError(
                "reference_points.name",
                f"{table.path}, line {row.line}: the point has no name.",
                "Name every point, or omit the column.",
            )
        if name in first:
            raise InputError(
                "reference_points.name",
                f"{table.path}, line {row.line}: the point {name!r} occurs in line {first[name]} "
                f"already.",
                "Give every point its own name.",
            )
        first[name] = row.line
    return tuple(first)
