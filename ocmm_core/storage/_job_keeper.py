"""Acknowledged steps of an open job, and their rescue from memory if its file is lost."""

from __future__ import annotations

import contextlib
import logging
import sqlite3
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

from ocmm_core.errors import StorageError
from ocmm_core.host import HOST
from ocmm_core.named_file import NamedFile, NameLoss, write_rescued
from ocmm_core.seals import StationKey
from ocmm_core.storage._connection import checkpoint, connection_in_memory, job_bytes, opened_bytes
from ocmm_core.storage._faults import FAULTS, disk_failed, lost_name
from ocmm_core.storage._job_content import read_job
from ocmm_core.storage._job_seal import insert_seal, remember_job
from ocmm_core.storage._tables import insert_event

_log = logging.getLogger(__name__)

RESCUED = "rescued"
"""Event in a new file with the steps of a job whose own file was lost."""

Insert = tuple[str, tuple[object, ...]]


class JobKeeper:
    """Compare a job's name and file, rescue steps; thread-safe; `db` with empty log; OSError."""

    def __init__(self, path: Path, job_uuid: str, db: sqlite3.Connection) -> None:
        self._path, self._uuid = path.absolute(), job_uuid
        self._file = NamedFile(path)
        self._log_path = path.resolve().with_name(f"{path.resolve().name}-wal")
        self._log: NamedFile | None = None
        # Some files made by other programs are written without a log.
        self._has_log = db.execute("PRAGMA journal_mode").fetchone()[0] == "wal"
        self._lock = threading.Lock()
        self._base, self._steps = b"", list[Sequence[Insert]]()
        self._last: tuple[int, str] | None = None
        self._loss: NameLoss | None = None
        self._disk = self._tried = False
        self.key: StationKey | None = None
        """Signs the rescued job; None before the first step."""
        self.saved_in: Path | None = self._path
        """The file with all acknowledged steps; None while no folder accepts them."""
        self.renew(db)
        self.note_log()

    @property
    def error(self) -> StorageError | None:
        """Return why nothing is stored any longer; None if it is."""
        if self._loss is None:
            return None
        saved = None if self.saved_in == self._path else self.saved_in
        if self._disk:
            return disk_failed(self._path, saved)
        return lost_name(self._path, self._loss.words, saved, tried=self._tried)

    def renew(self, db: sqlite3.Connection, *, whole: bool = True) -> None:
        """Reread all stored data, after a checkpoint.

        `whole`: the checkpoint was complete; if not, the file is not compared until it is.
        """
        if not whole:
            self._file.forget_content()
            return
        if self._has_log or not self._base:
            self._base = db.serialize()
            self._steps.clear()
        self._file.note_content()

    def note_log(self) -> None:
        """Note the state of the log as left by the program itself."""
        if not self._has_log:
            self._file.note_content()
            return
        if self._log is None:
            with contextlib.suppress(OSError):
                self._log = NamedFile(self._log_path)
        if self._log is not None:
            self._log.note_content()

    def acknowledge(self, inserts: Sequence[Insert], last: tuple[int, str] | None) -> None:
        """Keep a committed step; `last`: number, hash of its last audit row, if signed.

        StorageError if the name means another file: then it counts nowhere.
        """
        loss = self.name_loss()
        # A concurrent detection of the loss rescues this step also, or it is refused.
        with self._lock:
            if self._loss is None and loss is None:
                self._steps.append(inserts)
                self._last = last or self._last
                return
        self.lose(loss or NameLoss(""))
        raise self.error or AssertionError

    def name_loss(self) -> NameLoss | None:
        """Return why the names of file and log no longer mean them; None if they do."""
        loss = self._file.loss()
        if loss is None and self._log is None and self._has_log:
            return NameLoss(f"its log {self._log_path.name} cannot be found")
        if loss is None and self._log is not None:
            loss = self._log.loss()
            words = "" if loss is None else loss.words
            return loss and NameLoss(f"its log {self._log_path.name}: {words}")
        return loss

    def is_write_protected(self) -> bool:
        return HOST.is_write_protected(self._path)

    def lose_if_write_protected(self) -> None:
        """Give the file up if the file system has become read-only."""
        if self._loss is None and self.is_write_protected():
            self.lose(NameLoss("its file system has become read-only"))

    @property
    def is_as_noted(self) -> bool:
        """Return whether file and log are unchanged by others, by their times."""
        return self._file.is_as_noted() and (self._log is None or self._log.is_as_noted())

    def content_loss(self, *, with_log: bool) -> NameLoss | None:
        """Return which file others have written, or None; `with_log`: also compare the log."""
        if with_log and self._log is not None and not self._log.is_as_noted():
            return NameLoss(f"another program has written into its log {self._log_path.name}")
        if self._file.is_as_noted():
            return None
        if self._file.has_noted_size() and HOST.content_of(self._path, len(self._base)) in (
            self._base,
            None,
        ):
            # Only its time was changed.
            self._file.note_content()
            return None
        return NameLoss("another program has written into it")

    def lose(
        self,
        loss: NameLoss,
        *,
        disk: bool = False,
        on_loss: Callable[[StorageError], object] = lambda _error: None,
    ) -> None:
        """Give the file up, and write all acknowledged steps to a new one; may be repeated.

        `on_loss`: called with the loss of a name before the steps are written; a disk may be slow.
        """
        if self._loss is None:
            with self._lock:
                if self._loss is None:
                    self._loss, self._disk, self.saved_in = loss, disk, None
        if self.error is not None and not (self._disk or self._tried):
            on_loss(self.error)
        with self._lock:
            if self.saved_in is None:
                with contextlib.suppress(sqlite3.Error, StorageError):
                    self.saved_in = write_rescued(self._path.name, self._content)
                self._tried = True

    def complete_moved(self, db: sqlite3.Connection) -> None:
        """Checkpoint a moved file, so that it is complete without its log."""
        if self._loss is not None and self._loss.moved_to is not None:
            with contextlib.suppress(sqlite3.Error):
                checkpoint(db)

    def remove(self) -> bool:
        """Remove the file of a job without points, before it is closed; return whether it did.

        A file that another program put under its name stays.
        """
        if self.name_loss() is not None:
            return False
        try:
            return self._file.remove()
        except OSError as error:
            # A leftover empty file is harmless.
            _log.warning("%s was not removed: %s", self._path, error.strerror)
            return False

    def remove_stray_log(self, *, removed: bool) -> None:
        """Remove the log of a removed or rescued job: a later file would be read with it."""
        rescued = self._loss is not None and self.saved_in is not None and not self._disk
        if (removed or rescued) and self._log is not None:
            with contextlib.suppress(OSError):
                self._log.remove()

    def require_closed(self) -> None:
        """Detect a loss after closing: the file must hold the last step."""
        if self._loss is not None:
            return
        loss = self._file.loss()
        if loss is None and not self._log_path.exists() and not self._holds_last():
            loss = NameLoss("another program has written into it")
        if loss is not None:
            self.lose(loss)

    def close(self) -> None:
        """Close the descriptors; may be called twice."""
        self._file.close()
        if self._log is not None:
            self._log.close()

    def _holds_last(self) -> bool:
        try:
            content = read_job(self._path).file
            with connection_in_memory(self._path, content) as db, contextlib.closing(db):
                found = db.execute(
                    "SELECT sequence, hash FROM audit ORDER BY sequence DESC LIMIT 1"
                ).fetchone()
        except (*FAULTS, StorageError):
            return False
        return self._last is None or tuple(found) == self._last

    def _content(self, path: Path) -> bytes:
        with contextlib.closing(opened_bytes(self._base)) as db:
            db.execute("BEGIN")
            for step in self._steps:
                for statement, values in step:
                    db.execute(statement, values)
            if self.key is not None and self._loss is not None:
                insert_event(db, RESCUED, f"Rescued from {self._path}: {self._loss.words}.")
                insert_seal(db, self.key)
            if self._last is not None:
                # Without the event: a moved file that is found again is not an older copy.
                remember_job(self._uuid, *self._last, path)
            db.execute("COMMIT")
            return job_bytes(db)
