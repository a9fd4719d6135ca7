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
"""Some 1,500 pages of the log, 6 MB: what has to be read again after a kill."""


class JobWriter:
    """What writes one connection; its owner sees to it that one thread at a time does."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.failed = False
        """The disk has failed: nothing is written or synced any more."""
        self.wrote_file = self.emptied_log = False
        """Whether the last transaction was followed by writing the log into the file, and whether
        that was done completely."""
        self._steps = 0

    @contextlib.contextmanager
    def transaction(self, db: sqlite3.Connection) -> Iterator[None]:
        """Make what the body stores durable, or nothing of it.

        Raises
        ------
        StorageError
            The disk failed before, or a text is none.
        sqlite3.Error
            It could not be stored.
        """
        if self.failed:
            raise disk_failed(self._path)
        try:
            db.execute("BEGIN IMMEDIATE")
            yield
            db.execute("COMMIT")
        except BaseException as error:
            # After a failed sync the kernel may have dropped the pages: trying again could
            # seem to succeed. The job goes on in another file instead.
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
        """Close the connection; where the disk failed, without touching it again."""
        if self.failed:
            give_up(db)
        else:
            db.close()

    def _note(self, error: BaseException) -> None:
        self.failed = self.failed or primary_code(error) == sqlite3.SQLITE_IOERR
