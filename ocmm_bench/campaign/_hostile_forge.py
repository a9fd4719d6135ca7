"""Forging of job files: any value in any row with a fitting audit; only content reveals it."""

from __future__ import annotations

import contextlib
import hashlib
import shutil
import sqlite3
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

DEEP = "[" * 100_000
LONG_DIGITS = "9" * 5_000
MARKUP = "<b>x</b>[/12]"
TABLES: dict[str, tuple[str, ...]] = {
    "head": (
        "id", "job_uuid", "created_utc", "software_version", "operator", "part", "serial",
        "plan_text", "plan_sha256", "rig_text", "rig_sha256", "probe_text", "probe_sha256",
    ),
    "observation": (
        "number", "feature", "time_s", "first_frame", "last_frame", "n_frames", "tip_world",
        "random_covariance", "direction", "tip_radius", "rotation_world_from_probe",
        "spots_shape", "spots", "chi2_per_dof", "approach",
    ),
    "annulment": ("number", "time_utc", "reason"),
    "event": ("id", "time_utc", "kind", "text"),
    "seal": ("sequence", "key", "signature"),
}  # fmt: skip

Edit = Callable[[sqlite3.Connection], object]


@dataclass(frozen=True, slots=True)
class Forgery:
    name: str
    make: Callable[[Path, Path], None]
    """Writes it to a path, from a good one: ``make(good, path)``."""
    harmless: bool = False
    """The file may be used: only a name or a remark is odd."""


@contextlib.contextmanager
def forged(good: Path, path: Path) -> Iterator[sqlite3.Connection]:
    """Yield a copy of a job whose rows may hold anything; audit and schema fit at the end."""
    shutil.copyfile(good, path)
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as db:
        db.execute("PRAGMA synchronous = OFF")
        db.execute("PRAGMA journal_mode = MEMORY")
        rows = "SELECT type, name, sql FROM sqlite_master"
        triggers = {n: sql for kind, n, sql in db.execute(rows) if kind == "trigger"}
        tables = {n: sql for kind, n, sql in db.execute(rows) if kind == "table"}
        for name in triggers:
            db.execute(f"DROP TRIGGER {name}")
        _set_schema(db, {name: _loosened(sql) for name, sql in tables.items()})
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as db:
        db.execute("PRAGMA synchronous = OFF")
        db.execute("PRAGMA ignore_check_constraints = ON")
        db.text_factory = bytes
        yield db
        _set_schema(db, tables)
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as db:
        db.execute("PRAGMA synchronous = OFF")
        db.text_factory = bytes
        db.execute("BEGIN")
        _chain_anew(db)
        db.execute("COMMIT")
        for sql in triggers.values():
            db.execute(sql)


def _loosened(sql: str) -> str:
    columns = sql.replace(") STRICT", ")").replace(" NOT NULL", "")
    while " CHECK (" in columns:
        start = columns.index(" CHECK (")
        depth, at = 1, start + len(" CHECK (")
        while depth:
            depth += {"(": 1, ")": -1}.get(columns[at], 0)
            at += 1
        columns = columns[:start] + columns[at:]
    for kind in ("TEXT", "REAL", "BLOB"):
        columns = columns.replace(f" {kind}", "")
    return columns


def _set_schema(db: sqlite3.Connection, texts: dict[str, str]) -> None:
    db.execute("PRAGMA writable_schema = ON")
    for name, sql in texts.items():
        db.execute("UPDATE sqlite_master SET sql = ? WHERE name = ?", (sql, name))
    db.execute("PRAGMA writable_schema = OFF")


def _chain_anew(db: sqlite3.Connection) -> None:
    links = db.execute("SELECT sequence, time_utc, subject, key FROM audit ORDER BY 1").fetchall()
    previous = "0" * 64
    for sequence, time_utc, subject, key in links:
        table = subject.decode("utf-8", "replace")
        # Texts and blobs look alike here: query their types.
        columns = ",".join(f"{c}, typeof({c})" for c in TABLES.get(table, ()))
        content = _digest_link(())
        if columns:
            row = db.execute(
                f"SELECT {columns} FROM {table} WHERE {TABLES[table][0]} = ?",  # noqa: S608 - constants
                (key,),
            ).fetchone()
            if row is not None:
                content = _digest_typed(row)
        link = _digest_link((sequence, time_utc, subject, key, content, previous))
        db.execute(
            "UPDATE audit SET content_sha256 = ?, previous = ?, hash = ? WHERE sequence = ?",
            (content, previous, link, sequence),
        )
        previous = link


def _digest_typed(row: tuple[Any, ...]) -> str:
    parts = []
    for value, kind in zip(row[::2], row[1::2], strict=True):
        code = {b"integer": b"i", b"real": b"f", b"text": b"s", b"blob": b"b"}.get(kind, b"n")
        content: bytes = value or b""
        if code in b"if":
            content = struct.pack("<q" if code == b"i" else "<d", value)
        parts += [code, struct.pack("<Q", len(content)), content]
    return hashlib.sha256(b"".join(parts)).hexdigest()


def _digest_link(link: tuple[Any, ...]) -> str:
    parts = []
    for value in link:
        raw = value.encode() if isinstance(value, str) else value
        code = b"i" if isinstance(raw, int) else b"s"
        content = struct.pack("<q", raw) if isinstance(raw, int) else raw or b""
        parts += [code, struct.pack("<Q", len(content)), content]
    return hashlib.sha256(b"".join(parts)).hexdigest()
