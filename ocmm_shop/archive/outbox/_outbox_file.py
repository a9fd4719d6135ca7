"""File of an outbox: created, opened, and changed in durable transactions."""

from __future__ import annotations

import contextlib
import os
import sqlite3
import uuid
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Self

from ocmm_core.documents import write_new
from ocmm_core.errors import StorageError
from ocmm_core.named_file import NamedFile
from ocmm_core.side_files import Trusted
from ocmm_core.storage import HeldConnection, database_content, open_in_place
from ocmm_shop.archive.outbox._outbox_rows import APPLICATION_ID, TABLES, VERSION, machine_identity

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
