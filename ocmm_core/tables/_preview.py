"""First and last lines of a table with their fate, for an import page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ocmm_core.errors import InputError
from ocmm_core.tables._account import TableAccount, TableOptions
from ocmm_core.tables._grid import read_grid
from ocmm_core.tables._text import bytes_of, text_lines

_ENDS = 8


@dataclass(frozen=True, slots=True)
class PreviewRow:
    """A line of a table."""

    line: int
    """Its number in the file, from 1."""
    cells: tuple[str, ...]
    why: str = ""
    """Reason why it is left out; empty if it is read."""


@dataclass(frozen=True, slots=True)
class TablePreview:
    """First and last lines of a table, and the account of the reader or its error."""

    rows: tuple[PreviewRow, ...]
    hidden: int
    """Lines between the first and the last ones."""
    account: TableAccount | None
    error: InputError | None


def preview_table(
    path: Path, options: TableOptions, outcome: TableAccount | InputError
) -> TablePreview:
    """Return the first and last lines of a table as cells.

    Parameters
    ----------
    outcome
        What the reader returned or raised with these options.

    Raises
    ------
    InputError
        The file cannot be read at all.
    """
    lines = text_lines(path, bytes_of(path))
    account = outcome if isinstance(outcome, TableAccount) else None
    grid = read_grid(path, lines, TableOptions(), has_texts=True)
    if account is not None:
        grid.separator = account.separator
    split, body = grid.splitter(), dict(grid.body)
    why = {
        line: one.why
        for one in (account.skipped if account is not None else grid.log.entries())
        for line in range(one.first, one.last + 1)
    }
    rows = []
    for line, text in enumerate(lines, start=1):
        if line <= _ENDS or line > len(lines) - _ENDS:
            is_row = line in body and text.strip()
            try:
                cells = split(line, text) if is_row else [text.strip()]
            except InputError:
                cells = [text.strip()]
            empty = "" if text.strip() else "empty"
            rows.append(PreviewRow(line, tuple(cells), why.get(line, empty)))
    error = outcome if isinstance(outcome, InputError) else None
    return TablePreview(tuple(rows), max(len(lines) - len(rows), 0), account, error)
