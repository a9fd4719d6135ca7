"""Tables and views of an archive, and their migrations: forward only.

The SQL is in `resources/archive`, one text for both stores; words in braces are store-specific.
Released migrations are never changed. An archive of a later version is not opened, neither to write
nor to read.
"""

from __future__ import annotations

import contextlib
import functools
import sqlite3
from collections.abc import Mapping
from dataclasses import asdict, dataclass

from ocmm_core.documents import sql_statements

_OWN = "(SELECT count(*) FROM station_key k WHERE k.station = {0}.station AND k.key = {0}.key)"
_PARTS = {
    # A mark holds until a later one of its kind lifts it.
    "held": """EXISTS (SELECT 1 FROM mark m WHERE m.job_uuid = j.job_uuid AND m.holds = 1
        AND NOT EXISTS (SELECT 1 FROM mark l WHERE l.job_uuid = m.job_uuid
            AND l.kind = m.kind AND l.id > m.id))""",
    "own_m": _OWN.format("m"),
    "own_j": _OWN.format("j"),
    "first_id": """(SELECT min(f.id) FROM job f WHERE f.job_uuid = j.job_uuid
        AND f.station = j.station AND f.signer = j.signer AND f.sound = j.sound)""",
    "others": """(SELECT count(*) FROM job o WHERE o.job_uuid = j.job_uuid AND o.id <> j.id
        AND (o.station <> j.station OR o.signer <> j.signer OR o.sound = 0))""",
    "limits": "part, characteristic, simulated, unit, low, high",
}
"""Parts of the views."""

APPLICATION_ID = 0x4F434D41  # "OCMA"
SIGNATURES_SINCE = 3
"""First version with the signature of a job's head."""


@dataclass(frozen=True, slots=True)
class Dialect:
    """SQL words of a store."""

    id: str
    """Type of a column with automatic numbers."""
    text: str
    real: str
    whole: str
    blob: str
    """`text`, `real`, `whole`, `blob`: Types; texts are compared byte by byte."""
    who: str
    now: str
    """`who`, `now`: Defaults: login, and time by the clock of the store, UTC, ISO 8601."""
    hash_check: str
    """A condition on table ``file``; empty if the store cannot compute SHA-256."""


SQLITE = Dialect(
    id="INTEGER PRIMARY KEY",
    text="TEXT",
    real="REAL",
    whole="INTEGER",
    blob="BLOB",
    who="'local'",
    now="(strftime('%Y-%m-%dT%H:%M:%f+00:00', 'now'))",
    hash_check="",
)
POSTGRESQL = Dialect(
    id="bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY",
    text='text COLLATE "C"',
    real="double precision",
    whole="bigint",
    blob="bytea",
    who="SESSION_USER",
    now="to_char(clock_timestamp() AT TIME ZONE 'UTC', 'YYYY-MM-DD\"T\"HH24:MI:SS.MS+00:00')",
    hash_check=", CHECK (sha256 = encode(sha256(content), 'hex'))",
)


_VIEWS = sql_statements("archive", "views")
VIEW_NAMES = tuple(statement.split()[2] for statement in _VIEWS)
_VIEWS_BEFORE = tuple(f"DROP VIEW IF EXISTS {name}" for name in reversed(VIEW_NAMES))
"""The last step makes all views; earlier steps no longer do."""
VERSION = 4
"""The version of an archive is the number of its steps."""


def statements(step: int, dialect: Dialect) -> tuple[str, ...]:
    """Return the statements that bring an archive from ``step`` to the next version."""
    own = sql_statements("archive", str(step + 1))
    if step == 2:
        store = "3_sqlite" if dialect is SQLITE else "3_postgresql"
        own = (*_VIEWS_BEFORE, *sql_statements("archive", store), *own)
    elif step == 3:
        own = (*_VIEWS_BEFORE, *own, *_VIEWS)
    words = asdict(dialect) | _PARTS
    return tuple(text for one in own if (text := one.format(**words)))


_TIMES = ("created_utc", "changed_utc", "received_utc", "sent_utc", "used_utc")


@functools.cache
def column_kinds() -> Mapping[str, str]:
    """Return the type of each column of tables and views: TEXT, INTEGER, REAL, BLOB or TIME.

    A name has the same type everywhere. Computed columns are missing.
    """
    return {
        name: "TIME" if name in _TIMES else kind
        for _, name, kind, _ in (*columns_of("table"), *columns_of("view"))
        if kind in ("TEXT", "INTEGER", "REAL", "BLOB")
    }


@functools.cache
def columns_of(what: str) -> tuple[tuple[str, str, str, bool], ...]:
    """Return the columns of each table or each view: its name, theirs, type, may be NULL."""
    with contextlib.closing(made_in_memory()) as made:
        return tuple(
            (table, name, kind, not (filled or key))
            for (table,) in made.execute("SELECT name FROM sqlite_master WHERE type = ?", (what,))
            for _, name, kind, filled, _, key in made.execute(f"PRAGMA table_info({table})")
        )


def made_in_memory() -> sqlite3.Connection:
    """Return an empty archive of this version in memory."""
    made = sqlite3.connect(":memory:")
    for step in range(VERSION):
        for statement in statements(step, SQLITE):
            made.execute(statement)
    return made
