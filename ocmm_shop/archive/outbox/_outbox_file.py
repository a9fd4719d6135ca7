"""File and tables of an outbox: its jobs, and the state of the connection.

The file is created, opened, and changed in durable transactions.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import sqlite3
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import Enum
from pathlib import Path
from typing import Self

from ocmm_core.documents import write_new
from ocmm_core.errors import StorageError
from ocmm_core.named_file import NamedFile
from ocmm_core.side_files import Trusted
from ocmm_core.storage import HeldConnection, database_content, open_in_place

APPLICATION_ID = 0x4F434F42  # "OCOB"
VERSION = 1

TABLES = (
    """CREATE TABLE box (id INTEGER PRIMARY KEY CHECK (id = 1), outbox TEXT NOT NULL,
        machine TEXT NOT NULL, made_utc TEXT NOT NULL)""",
    # AUTOINCREMENT: numbers are never reused, even if rows were removed.
    """CREATE TABLE item (sequence INTEGER PRIMARY KEY AUTOINCREMENT, sha256 TEXT NOT NULL,
        name TEXT NOT NULL, path TEXT NOT NULL, put_utc TEXT NOT NULL,
        state TEXT NOT NULL CHECK (state IN ('waiting', 'sent', 'aside')),
        said TEXT NOT NULL DEFAULT '', sent_utc TEXT NOT NULL DEFAULT '')""",
    "CREATE INDEX item_by_state ON item (state, sequence)",
    "CREATE INDEX item_by_path ON item (path, sequence)",
    """CREATE TABLE contact (id INTEGER PRIMARY KEY CHECK (id = 1), code TEXT NOT NULL,
        said TEXT NOT NULL, since_utc TEXT NOT NULL, good_utc TEXT NOT NULL,
        clock_off_s REAL NOT NULL)""",
    "INSERT INTO contact VALUES (1, '', '', '', '', 0.0)",
)


class ItemState(Enum):
    WAITING = "waiting"
    SENT = "sent"
    ASIDE = "aside"
    """Refused by the archive; kept and named."""


@dataclass(frozen=True, slots=True)
class Item:
    """A queued job."""

    sequence: int
    """From 1."""
    sha256: str
    name: str
    path: str
    """`sha256`, `name`, `path`: Of the file as queued; display name; place of the job file then."""
    put_utc: str
    state: ItemState
    said: str
    """`state`, `said`: State; why it was set aside."""


@dataclass(frozen=True, slots=True)
class ConnectionState:
    code: str = ""
    said: str = ""
    """`code`, `said`: Error of the last try; empty if it succeeded."""
    since_utc: str = ""
    """Start of the failures; empty if none."""
    good_utc: str = ""
    """Last success; empty if none."""
    clock_off_s: float = 0.0
    """Lead of the local clock over the archive's."""


def machine_identity() -> str:
    """Return the hashed identity of this computer's installation."""
    for place in ("/etc/machine-id", "/var/lib/dbus/machine-id"):
        with contextlib.suppress(OSError):
            text = Path(place).read_text("ascii", "replace").strip()
            if text:
                # The machine id itself must stay confidential (machine-id(5)).
                return hashlib.sha256(f"ocmm archive {text}".encode()).hexdigest()[:32]
    return hashlib.sha256(f"ocmm archive node {uuid.getnode()}".encode()).hexdigest()[:32]


_WAIT_S = 5.0
_FILE = "outbox.sqlite"


class OutboxFile:
    """Open or create the file of an outbox; StorageError: unusable, damaged, or a later version."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._files = folder / "files"
        self._db: sqlite3.Connection | None = None
        self._name: NamedFile | None = None
        try:
            self._files.mkdir(parents=True, exist_ok=True)
            path = folder / _FILE
            if not os.path.lexists(path):
                with contextlib.suppress(FileExistsError):
                    write_new(path, database_content(_fill))
            self._db = open_in_place(path, HeldConnection, Trusted.DATABASE, wait_s=_WAIT_S)
            self._prepare(self._db)
            self._name = NamedFile(path)
        except (sqlite3.Error, OSError) as error:
            self.close()
            raise self._fault(error) from error
        except BaseException:
            self.close()
            raise

    @staticmethod
    def is_in(folder: Path) -> bool:
        return (folder / _FILE).exists()

    def _prepare(self, db: sqlite3.Connection) -> None:
        # No effect on files of this program; others are converted once.
        db.execute("PRAGMA journal_mode = WAL").fetchall()
        db.execute("PRAGMA synchronous = FULL")
        found = int(db.execute("PRAGMA user_version").fetchone()[0])
        application = int(db.execute("PRAGMA application_id").fetchone()[0])
        if application != APPLICATION_ID or found != VERSION:
            raise StorageError(
                "outbox.version",
                f"{self.folder}: this is no outbox of this version of the program.",
                "Send what waits there with the program that made it, or move the folder away.",
            )
        self.identity, self.machine = db.execute("SELECT outbox, machine FROM box").fetchone()

    def close(self) -> None:
        """Close the file; may be called twice."""
        if self._db is not None:
            self._db.close()
            self._db = None

    def _open(self) -> sqlite3.Connection:
        if self._db is None:
            raise StorageError(
                "outbox.closed", f"{self.folder}: the outbox is closed.", "Open it again."
            )
        return self._db

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        db = self._open()
        db.execute("BEGIN IMMEDIATE")
        try:
            yield db
            db.execute("COMMIT")
            loss = None if self._name is None else self._name.loss()
            if loss is not None:
                raise StorageError(
                    "outbox.lost",
                    f"{self.folder / _FILE}: {loss.words}.",
                    "The job files are safe: put them in again with ocmm archive send FILE.",
                )
        except BaseException:
            with contextlib.suppress(sqlite3.Error):
                db.execute("ROLLBACK")
            raise

    @contextlib.contextmanager
    def _writing(self) -> Iterator[sqlite3.Connection]:
        try:
            with self._transaction() as db:
                yield db
        except (sqlite3.Error, OSError) as error:
            raise self._fault(error) from error

    @contextlib.contextmanager
    def _reading(self) -> Iterator[sqlite3.Connection]:
        try:
            yield self._open()
        except sqlite3.Error as error:
            raise self._fault(error) from error

    def _fault(self, error: Exception) -> StorageError:
        said = getattr(error, "strerror", None) or str(error)
        if there := getattr(error, "filename", None):
            said = f"{Path(there).name}: {said}"
        return StorageError(
            "outbox.failed",
            f"{self.folder}: the outbox of the archive cannot be read or written ({said}).",
            "Free disk space or check the rights of the folder. The job file itself is safe: put "
            "it in later with ocmm archive send FILE.",
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _fill(db: sqlite3.Connection) -> None:
    for statement in TABLES:
        db.execute(statement)
    db.execute(
        "INSERT INTO box VALUES (1, ?, ?, ?)", (str(uuid.uuid4()), machine_identity(), utc_now())
    )
    db.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    db.execute(f"PRAGMA user_version = {VERSION}")


def utc_now() -> str:
    """Return the current time in the format of an outbox."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")
