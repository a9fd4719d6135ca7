"""Whether the tables of a job file are those that this program makes: no other, and no other text.

A view in the place of a table, a trigger or a column that is computed would run on our side when
the file is read. So every word of the schema is compared before anything is asked of a table.
"""

from __future__ import annotations

import contextlib
import sqlite3
from functools import cache
from pathlib import Path

from ocmm_core.storage._faults import damaged
from ocmm_core.storage._migrations import MIGRATIONS, require_known

_SCHEMA = "SELECT type, name, tbl_name, sql FROM sqlite_master LIMIT ?"


def require_schema(db: sqlite3.Connection, path: Path) -> None:
    """Check the schema of an open job file against that of its version.

    Raises
    ------
    StorageError
        The file is newer than this program, or something in its schema is not of its version.
    """
    version = require_known(db, path)
    if version < 1:
        raise damaged(path, f"it has the file version {version}")
    expected = _expected(version)
    found = set(db.execute(_SCHEMA, (len(expected) + 1,)).fetchall())
    # A trigger that was dropped runs nothing. What was changed without it, the audit names.
    missing = {row for row in expected - found if row[0] != "trigger"}
    odd = sorted({str(row[1])[:60] for row in (found - expected) | missing})
    if odd:
        raise damaged(path, f"its table definitions were changed: {', '.join(map(repr, odd))}")


@cache
def _expected(version: int) -> frozenset[tuple[str, str, str, str]]:
    """Return the rows of the schema of a version, as its steps make them."""
    with contextlib.closing(sqlite3.connect(":memory:")) as db:
        for step in MIGRATIONS[:version]:
            step(db)
        return frozenset(db.execute(_SCHEMA, (-1,)).fetchall())
