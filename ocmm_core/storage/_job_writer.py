"""Transactions on a job file, until its disk fails: then it is given up."""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Iterator
from pathlib import Path

from ocmm_core.storage._connection import checkpoint
from ocmm_core.storage._faults import bad_text, disk_failed, primary_code
from ocmm_core.storage._guard import give_up

_STEPS_A_CHECKPOINT = 256
"""Some 1,500 pages of the log, 6 MB, to be reread after a kill."""


class JobWriter:
    """Writer of one connection; its owner serialises threads."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.failed = False
        """The disk has failed: nothing is written or synced afterwards."""
        self.wrote_file = self.emptied_log = False
        """Whether the last transaction was followed by a checkpoint, and by a complete one."""
        self._steps = 0

    @contextlib.contextmanager
    def transaction(self, db: sqlite3.Connection) -> Iterator[None]:
        """Make the changes durable, or none; StorageError: disk failed before; sqlite3.Error."""
        if self.failed:
            raise disk_failed(self._path)
        try:
            db.execute("BEGIN IMMEDIATE")
            yield
            db.execute("COMMIT")
        except BaseException as error:
            # After a failed sync the kernel may have dropped the pages: a retry could seem to
            # succeed. The job continues in another file instead.
            self._note(error)
            with contextlib.suppress(sqlite3.Error):
                db.execute("ROLLBACK")
            if isinstance(error, UnicodeEncodeError):
                raise bad_text(self._path, error) from error
            raise
        self._steps += 1
        self.wrote_file = self._steps % _STEPS_A_CHECKPOINT == 0
        self.emptied_log = False
        if self.wrote_file:
            try:
                self.emptied_log = checkpoint(db)
            except sqlite3.Error as error:
                # This step is stored; the next one is refused.
                self._note(error)

    def close(self, db: sqlite3.Connection) -> None:
        """Close the connection; after a disk failure, without touching it again."""
        if self.failed:
            give_up(db)
        else:
            db.close()

    def _note(self, error: BaseException) -> None:
        self.failed = self.failed or primary_code(error) == sqlite3.SQLITE_IOERR
