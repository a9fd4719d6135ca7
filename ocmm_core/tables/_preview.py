"""First and last lines of a table with their fate, for an import page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from ocmm_core.errors import InputError
from ocmm_core.tables._account import TableAccount, TableOptions
from ocmm_core.tables._grid import read_grid
from ocmm_core.tables._text import bytes_of, text_lines

_ENDS = 8


class AccountedTable(Protocol):
    """Content of a table, with the account of its reader."""

    @property
    def account(self) -> TableAccount:
        """Rows read and lines left out."""
        ...


T = TypeVar("T", bound=AccountedTable)
TableReader = Callable[[Path, TableOptions], AccountedTable]


@dataclass(frozen=True, slots=True)
class PreviewRow:
    """A line of a table."""

    line: int
    """Its number in the file, from 1."""
    cells: tuple[str, ...]
    why: str = ""
    """Reason why it is left out; empty if it is read."""


@dataclass(frozen=True, slots=True)
class TablePreview(Generic[T]):
    """First and last lines of a table, and its content or the error of the reader."""

    rows: tuple[PreviewRow, ...]
    hidden: int
    """Lines between the first and the last ones."""
    options: TableOptions
    table: T | None
    error: InputError | None

    @property
    def account(self) -> TableAccount | None:
        """Return the account of the reader; None after an error."""
        return None if self.table is None else self.table.account


def preview_table(
    path: Path, options: TableOptions, read: Callable[[Path, TableOptions], T]
) -> TablePreview[T]:
    """Read a table and return its first and last lines as cells, before anything is accepted.

    InputErrors of ``read``, the reader of such tables, become a part of the result; InputError if
    the file cannot be read at all.
    """
    table: T | None = None
    error: InputError | None = None
    try:
        table = read(path, options)
    except InputError as refused:
        error = refused
    account = None if table is None else table.account
    lines = text_lines(path, bytes_of(path))
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
            empty = "" if text.strip() else "is an empty line"
            rows.append(PreviewRow(line, tuple(cells), why.get(line, empty)))
    return TablePreview(tuple(rows), max(len(lines) - len(rows), 0), options, table, error)
