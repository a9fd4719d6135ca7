"""Tables of spots in pixels: recorded spots of known points, shots and sweeps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ocmm_core.documents import shortened
from ocmm_core.errors import InputError
from ocmm_core.tables._account import TableAccount, TableOptions
from ocmm_core.tables._named import NamedColumns, TextRow, TextTable, read_table
from ocmm_core.tables._unit_choice import PIXELS, statements_in

_UV = ("u", "v")
_PIXEL_WORDS = ("px", "pixel", "pixels")


@dataclass(frozen=True, slots=True)
class PixelTable:
    """Rows with a spot each, the uncertainty of a spot, and the account of the reader."""

    table: TextTable
    sigma_px: float
    """Standard deviation of a spot, px per axis; above zero."""
    account: TableAccount

    def uv(self, row: TextRow) -> tuple[float, float]:
        """Return the place of a spot, px; InputError if a cell is not a number."""
        return self.table.number(row, "u"), self.table.number(row, "v")


def read_pixels(
    path: Path | str, columns: tuple[str, ...], options: TableOptions | None = None
) -> PixelTable:
    """Return a table of spots; ``columns`` are all its columns, with ``u`` and ``v`` in pixels.

    Raises
    ------
    InputError
        As `read_table`; or the header lacks ``sigma``, or the file states a unit of length.
    """
    table = read_table(path, NamedColumns(columns, _UV), options)
    stated = [(line, text) for name, (line, text) in table.units.items() if name in _UV]
    if "unit" in table.head:
        stated.append(table.head["unit"])
    others = [one for one in stated if one[1].casefold().strip(" []().") not in _PIXEL_WORDS]
    if "unit" not in table.head:
        others += [(line, one.text) for line, one in statements_in(table.comments)]
    if others:
        line, text = others[0]
        raise InputError(
            "table.unit",
            f"{table.path}, line {line}: the unit is {shortened(text)}, but spots are in px.",
            "Give u and v in pixels of the full sensor, with the heading u, v or u [px], v [px].",
        )
    line, text, sigma = table.head_number("sigma", "the uncertainty of a spot, in px")
    if not sigma > 0.0:
        raise InputError(
            "table.value",
            f"{table.path}, line {line}: 'sigma' is {text}, but must be greater than zero.",
            "State its value.",
        )
    return PixelTable(table, sigma, table.account(PIXELS))
