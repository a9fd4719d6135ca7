"""Rows that may be no points: codes for missing values, and names unlike all others."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from ocmm_core.tables._grid import fault

_CODE = re.compile(r"[-+]?(?P<nines>9{3,})(?:[.,](?:0*|25))?")
_NUMBERED = re.compile(r"(\D*)\d.*")
_LEAST = 3
"""Rows with names of one kind that make another name suspect."""
_MOST_ODD = 8


def require_no_codes(path: Path, rows: Sequence[tuple[int, Sequence[str]]]) -> None:
    """Raise InputError if a cell such as -9999 stands for a missing value.

    Parameters
    ----------
    rows
        Line and coordinates as texts. A code has fewer decimals than other cells of its column.
    """
    for place in range(len(rows[0][1])):
        found = [(line, row[place]) for line, row in rows if _CODE.fullmatch(row[place])]
        if not found:
            continue
        others = [_decimals(row[place]) for _, row in rows if not _CODE.fullmatch(row[place])]
        for line, text in found:
            # Whole coordinates of three nines, or a quarter more, are no rare measurements.
            is_long = text.strip("+-").startswith("9999")
            least = max(others, default=0) if is_long else min(others, default=0)
            if _decimals(text) < least:
                raise fault(
                    path, line, "number", text, "may be a code for a missing value",
                    "Skip the line, or write the coordinate with all decimals, as the others.",
                )  # fmt: skip


def _decimals(text: str) -> int:
    return len(re.split("[.,]", text)[-1]) if re.search("[.,]", text) else 0


def require_like_names(path: Path, names: Sequence[tuple[int, str]]) -> None:
    """Raise InputError if first or last rows lack the number that all other names have.

    Such rows are often means, limits or nominal values in any language.
    """
    kinds = [found[1] if (found := _NUMBERED.fullmatch(name)) else None for _, name in names]
    odd = [place for place, kind in enumerate(kinds) if kind is None]
    usual = {kind for kind in kinds if kind is not None}
    if len(usual) != 1 or not 0 < len(odd) <= _MOST_ODD or len(kinds) - len(odd) < _LEAST:
        return
    inner = [place for place, kind in enumerate(kinds) if kind is not None]
    if any(inner[0] < place < inner[-1] for place in odd):
        return
    line, name = names[odd[0]]
    raise fault(
        path, line, "row", name or "(no name)", "is not numbered as the other names, and may be no "
        "point",
        "Skip the line, or state the columns if it is a point.",
    )  # fmt: skip
