"""Forged job files, real commands in separate processes, and forbidden outcomes.

A forgery sets any value in any row with a fitting audit; only its content reveals it.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import runpy
import shutil
import signal
import sqlite3
import struct
import sys
import time
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


@dataclass(frozen=True, slots=True)
class Forgery:
    name: str
    make: Callable[[Path, Path], object]
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


LONGEST_S, LONGEST_CLOCK_S, MOST_MB = 5.0, 120.0, 512.0
REFUSED = 2
_LONGEST_ANSWER = 4000
_NOBODY = 65534


@dataclass(frozen=True, slots=True)
class CommandResult:
    """Result of a command: exit code, CPU and wall time, memory, output."""

    code: int
    cpu_s: float
    clock_s: float
    memory_mb: float
    words: str

    def fault(self, kind: Forgery, usual_s: float) -> str:
        """Return the forbidden outcome or "": a good file takes ``usual_s`` of CPU time."""
        if self.code == -signal.SIGKILL or self.cpu_s > 2.0 * usual_s + LONGEST_S:
            return "hang"
        if self.code not in (0, 1, REFUSED) or "Traceback" in self.words:
            return "traceback"
        if self.memory_mb > MOST_MB:
            return "memory"
        said = self.words.partition("ocmm: ")[2]
        if self.code == REFUSED and not 10 < len(said) < _LONGEST_ANSWER:
            return "no sentence"
        return "" if kind.harmless or self.code == REFUSED else "accepted"


def run_here(arguments: list[str]) -> None:
    """Run a command in this process, so that forked children have everything loaded."""
    before, sys.argv = sys.argv, ["ocmm", *arguments]
    try:
        with contextlib.suppress(SystemExit):
            _run()
    finally:
        sys.argv = before


def ordinary_user() -> int | None:
    """Return a user without rights if this is root, and that user can run this program."""
    if os.getuid() != 0:
        return None
    child = os.fork()
    if child == 0:
        _give_up_rights(_NOBODY)
        os._exit(int(not all(os.access(one, os.R_OK) for one in (__file__, contextlib.__file__))))
    return _NOBODY if os.waitpid(child, 0)[1] == 0 else None


def _give_up_rights(user: int) -> None:
    os.setgroups([])
    os.setgid(user)
    os.setuid(user)


def run_aside(
    arguments: list[str], words: Path, most_s: float = LONGEST_CLOCK_S, user: int | None = None
) -> CommandResult:
    """Run a command as ``user`` (None: this one), killed after ``most_s``; prints to ``words``."""
    sys.stdout.flush()
    sys.stderr.flush()
    begun = time.perf_counter()
    child = os.fork()
    if child == 0:
        _become(arguments, words, user)
    while True:
        done, status, used = os.wait4(child, os.WNOHANG)
        if done:
            break
        if time.perf_counter() - begun > most_s:
            os.kill(child, signal.SIGKILL)
        time.sleep(0.005)
    text = words.read_text("utf-8", "replace") if words.exists() else ""
    return CommandResult(
        os.waitstatus_to_exitcode(status),
        used.ru_utime + used.ru_stime,
        time.perf_counter() - begun,
        used.ru_maxrss / 1024.0,
        text,
    )


def _become(arguments: list[str], words: Path, user: int | None) -> None:
    """Become the command; never returns."""
    target = os.open(words, os.O_WRONLY | os.O_CREAT, 0o600)
    os.dup2(target, 1)
    os.dup2(target, 2)
    if user is not None:
        _give_up_rights(user)
    sys.argv = ["ocmm", *arguments]
    code = 0
    try:
        _run()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException as error:
        sys.stderr.write(f"Traceback {error!r}\n")
        code = 3
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def _run() -> None:
    # As a user starts it; no package of commands knows all of them.
    runpy.run_module("ocmm_cli", run_name="__main__")
