"""Answer of a query: a table, remarks, and charts."""

from __future__ import annotations

import csv
import importlib.util
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError, StorageError
from ocmm_core.inspection.archive import Trend
from ocmm_shop.archive.records import shown_text
from ocmm_shop.archive.stores import Cell, Row
from ocmm_shop.studies import GaugeStudy

_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\uff1d", "\uff0b", "\uff0d", "\uff20")
"""Includes wide forms, which spreadsheets in Japanese treat alike."""


@dataclass(frozen=True, slots=True)
class ArchiveAnswer:
    title: str
    columns: tuple[str, ...]
    rows: tuple[Row, ...]
    """`columns`, `rows`: The table; numbers are numbers, in mm or degrees."""
    notes: tuple[str, ...] = ()
    """Remarks to be known before use, in sentences."""
    trends: tuple[Trend, ...] = ()
    """Charts as on the batch page."""
    study: GaugeStudy | None = None
    """Gauge R&R over stations; None for other queries."""


def export_answer(answer: ArchiveAnswer, path: Path) -> None:
    """Write an answer as CSV or Parquet; InputError: unknown suffix, no pyarrow; StorageError."""
    kind = path.suffix.lower()
    if kind == ".csv":
        content = csv_of(answer.columns, answer.rows)
    elif kind == ".parquet":
        content = parquet_of(answer.columns, answer.rows)
    else:
        raise InputError(
            "archive.export", f"{path}: neither .csv nor .parquet.", "Give it one of these endings."
        )
    try:
        write_atomic(path, content)
    except OSError as error:
        raise StorageError(
            "archive.export",
            f"{path}: the table cannot be written ({error.strerror}).",
            "Choose a folder that is there and that you may write to.",
        ) from error


def csv_of(columns: Sequence[str], rows: Sequence[Row]) -> bytes:
    """Return a table as CSV (RFC 4180, UTF-8): decimal points, formulas escaped."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows([_cell(cell) for cell in row] for row in rows)
    return text.getvalue().encode("utf-8")


def parquet_of(columns: Sequence[str], rows: Sequence[Row]) -> bytes:
    """Return a table as Parquet; InputError if pyarrow is not installed."""
    if importlib.util.find_spec("pyarrow") is None:
        raise InputError(
            "archive.parquet",
            "Parquet needs pyarrow, which is not installed.",
            "Export to CSV, or install it: pip install pyarrow.",
        )
    import pyarrow
    import pyarrow.parquet

    fields = [[shown_cell(row[at]) for row in rows] for at in range(len(columns))]
    table = pyarrow.table(dict(zip(columns, fields, strict=True)))
    sink = pyarrow.BufferOutputStream()
    pyarrow.parquet.write_table(table, sink)
    return bytes(sink.getvalue())


def shown_cell(cell: Cell) -> Cell:
    """Return a cell for display: its text is untrusted."""
    return shown_text(cell) if isinstance(cell, str) else cell


def _cell(cell: Cell) -> object:
    """Return a cell that spreadsheets read as text, not as a formula."""
    if isinstance(cell, float):
        return repr(cell)
    if isinstance(cell, str):
        text = shown_text(cell)
        return f"'{text}" if cell.startswith(_FORMULA) else text
    return "" if cell is None else cell
