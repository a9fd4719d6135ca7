"""The job file: one SQLite file per job, durable point by point, append-only.

WAL with ``synchronous=FULL``: when `JobFile.append_point` returns, the point is on the disk. An
undo is a new row that annuls the point; the observation stays. The measuring program holds the file
exclusively (``locking_mode=EXCLUSIVE``): another one gets an error. Every transaction ends with a
signature of the station on all stored rows (`_job_seal`).
"""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from ocmm_core.errors import StorageError
from ocmm_core.host import HOST
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.named_file import FileIdentity, NameLoss
from ocmm_core.part_model import PartModel
from ocmm_core.seals import KeyFolder, StationKey
from ocmm_core.storage import _job_seal as job_seal
from ocmm_core.storage import _tables as tables
from ocmm_core.storage._audit import find_faults, insert_audited
from ocmm_core.storage._connection import JobWriter, connection_in_memory, connection_to, make_file
from ocmm_core.storage._faults import FAULTS, not_writable
from ocmm_core.storage._guard import GuardedConnection
from ocmm_core.storage._job_content import read_job
from ocmm_core.storage._job_keeper import JobKeeper
from ocmm_core.storage._job_reader import JobReader
from ocmm_core.storage._rows import JobHead, JobReference, row_from_head

_LOCK_S = 0.1
"""s: longest wait for a running step; its name is compared again after that."""
LEFT_OUT = "left out"
"""Event for content outside complete steps when the job was resumed."""


class JobFile(JobReader):
    """An open job file from `create` or `open`; close it or use ``with``. Thread-safe."""

    def __init__(
        self,
        path: Path,
        db: GuardedConnection,
        head: JobHead,
        *,
        read_only: bool = False,
        scratch: bool = False,
    ) -> None:
        super().__init__(path, db, head)
        self.identity: FileIdentity | None = None
        """The file on the disk, if from `read`."""
        self._read_only, self._scratch = read_only, scratch
        self._writer = JobWriter(path)
        self._key: StationKey | None = None
        self._closing = False
        self._keeper: JobKeeper | None = None
        if not (read_only or scratch):
            self._keeper = JobKeeper(path, head.job_uuid, db)
            db.inserts = []

    @property
    def given_up(self) -> StorageError | None:
        """Return why nothing is stored any longer, None if it is; never None again after that."""
        return None if self._keeper is None else self._keeper.error

    @property
    def saved_in(self) -> Path | None:
        """Return the file with all acknowledged steps; None if they are only in memory."""
        return self.path if self._keeper is None else self._keeper.saved_in

    def check_name(
        self, on_loss: Callable[[StorageError], object] = lambda _error: None
    ) -> StorageError | None:
        """Return why the job is not on the disk under its name; None if it is.

        If it is not, all acknowledged steps are written to a new file and nothing is stored
        afterwards. Cheap: for a timer, and before each report. `on_loss`: called with the loss
        before that, which takes longer.
        """
        keeper = self._keeper
        if keeper is None or self._closing:
            return self.given_up
        if keeper.error is not None:
            if keeper.saved_in is None:
                keeper.lose(NameLoss(""), on_loss=on_loss)
            return keeper.error
        loss = keeper.name_loss()
        if loss is not None and not self._closing:
            # Without the lock: a step that is being written is rescued also, or refused.
            keeper.lose(loss, on_loss=on_loss)
        if loss is not None or (keeper.is_as_noted and not keeper.is_write_protected()):
            return keeper.error
        # The program itself may be writing or closing now; a disk may hang.
        if self._lock.acquire(timeout=_LOCK_S):
            try:
                if self._db is not None:
                    self._note_loss(with_log=True, on_loss=on_loss)
                    keeper.lose_if_write_protected()
            finally:
                self._lock.release()
        return keeper.error

    def require_name(self) -> None:
        """Raise StorageError if the job is not on the disk under its name."""
        error = self.check_name()
        if error is not None:
            raise error

    @classmethod
    def create(cls, path: Path | str, head: JobHead) -> JobFile:
        """Make a new job file and return it open.

        Raises StorageError if it exists already, cannot be written, or this station has no key to
        sign it; nothing is left behind then.
        """
        path, key = Path(path), KeyFolder().station_key()

        def fill(db: sqlite3.Connection) -> None:
            insert_audited(db, "head", row_from_head(head))
            job_seal.insert_seal(db, key)

        job_seal.expect_job(head.job_uuid, path)
        make_file(path, fill)
        made = cls.open(path)
        seal = made.seal()
        job_seal.remember_job(head.job_uuid, seal.steps, seal.head, path)
        return made

    @classmethod
    def open(cls, path: Path | str, *, read_only: bool = False) -> JobFile:
        """Open a job file for writing, or by `read` if ``read_only``.

        Raises StorageError if the file is missing, no job file, newer than this program, damaged,
        cannot be read or written, is in use by another program, or a file next to it is refused.
        """
        path = Path(path)
        if read_only:
            return cls.read(path, read_only=True)
        with connection_to(path) as db:
            head = tables.stored_head(db, path)
            try:
                return cls(path, db, head)
            except OSError as error:
                raise not_writable(path, error.strerror or str(error)) from error

    @classmethod
    def read(cls, path: Path, *, read_only: bool = False) -> JobFile:
        """Return the current job at ``path`` in memory; its file is not touched again.

        Additions go to this copy alone, unless it is ``read_only``. Raises StorageError as
        `read_job`, or if it is damaged.
        """
        made = cls._copied(path, read_only=read_only)
        with contextlib.suppress(StorageError):
            # Damaged memory is reported with the seal. Another program may store steps: those that
            # it remembered before the job is read are in it, later ones need not be.
            end = made.known_end()
            made.known_end = lambda: end
            if end is not None and end.count and not made.steps(end.count - 1, 1):
                made = cls._copied(path, read_only=read_only)
                made.known_end = lambda: end
        return made

    @classmethod
    def _copied(cls, path: Path, *, read_only: bool) -> JobFile:
        content = read_job(path)
        made = cls.in_memory(path, content.file, content.left_out, read_only=read_only)
        made.identity = content.identity
        return made

    @classmethod
    def in_memory(
        cls, path: Path, content: bytes, left_out: str = "", *, read_only: bool = False
    ) -> JobFile:
        """Open the bytes of a job without a log, touching no disk; StorageError if invalid."""
        with connection_in_memory(path, content) as db:
            made = cls(path, db, tables.stored_head(db, path), read_only=read_only, scratch=True)
            made.left_out = left_out
            return made

    def append_point(self, point: MeasuredPoint) -> None:
        """Store a point, for tests; StorageError if only the earlier ones are stored."""
        with self._transaction() as db:
            tables.insert_point(db, self.path, point)

    def append_event(self, kind: str, text: str) -> None:
        """Store an event; it is on the disk when this returns."""
        with self._transaction() as db:
            tables.insert_event(db, kind, text)

    def change(
        self,
        *,
        annul: Mapping[int, str] = MappingProxyType({}),
        append: Sequence[MeasuredPoint] = (),
        events: Sequence[tuple[str, str]] = (),
    ) -> None:
        """Annul points, each for its reason, store new ones and events, in one transaction.

        Raises StorageError as `append_event`; nothing is changed then.
        """
        with self._transaction() as db:
            for number, reason in annul.items():
                tables.insert_annulment(db, self.path, number, reason)
            for point in append:
                tables.insert_point(db, self.path, point)
            for kind, text in events:
                tables.insert_event(db, kind, text)

    def store_reference(self, reference: JobReference) -> None:
        """Store the reference body of the job and its first pose, durably.

        Raises StorageError if the job has one already, or the file cannot be written.
        """
        with self._transaction() as db:
            tables.insert_reference(db, self.path, reference)

    def store_part(self, part: PartModel) -> None:
        """Store the nominal part of the CAD model, durably.

        Raises StorageError if the job has one already, or the file cannot be written; InputError if
        it is inconsistent, or too large.
        """
        with self._transaction() as db:
            tables.insert_part(db, self.path, part)

    def adopt(self, who: str, reason: str) -> None:
        """Adopt unsigned steps by name; every reader sees person, reason and content.

        Only for a job of a version that did not sign, for an older copy if no newer one is left, or
        for a job that this station signed and has no memory of; StorageError as
        `require_adoptable`.
        """
        with self._reading() as db:
            seal = self._sealed(db)
            job_seal.require_adoptable(seal, self.path, find_faults(db))
        self._key = KeyFolder().station_key()
        suspect = " ".join(seal.doubts)
        text = f"Steps 1 to {seal.steps} were taken over by {who}: {reason}. {suspect}"
        self.append_event(job_seal.ADOPTED, text)

    def close(self, *, remove: bool = False) -> None:
        """Close the file; may be called twice. Afterwards `given_up` is set if it was lost.

        `remove`: Also remove it, while no other program can open it for writing.
        """
        self.check_name()
        with contextlib.suppress(StorageError):
            # The name remains available after closing.
            _ = self.name
        keeper = self._keeper
        self._closing = True
        with self._lock:
            if self._db is None:
                return
            # Elsewhere an open file cannot be removed.
            removed = remove and not HOST.closes_before_rename
            removed = removed and keeper is not None and keeper.remove()
            if keeper is not None and keeper.error is not None:
                # A moved file gets its last steps from the log, which stays behind.
                keeper.complete_moved(self._db)
                self._writer.failed = True
            self._writer.close(self._db)
            self._db = None
            if keeper is not None:
                if not removed:
                    keeper.require_closed()
                    removed = remove and HOST.closes_before_rename and keeper.remove()
                keeper.remove_stray_log(removed=removed)
                keeper.close()

    def __enter__(self) -> JobFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        with self._reading() as db:
            if self._read_only:
                raise StorageError(
                    "job.read_only",
                    f"{self.path}: the job was opened read-only.",
                    "Open it for measuring to add to it.",
                )
            self._note_loss(with_log=True)
            keeper = self._keeper
            if keeper is not None and keeper.error is not None:
                raise keeper.error
            if self._key is None and not self._scratch:
                job_seal.require_sealed(self._sealed(db), self.path)
                self._key = KeyFolder().station_key()
            sealed = None
            try:
                with self._writer.transaction(db):
                    if db.inserts is not None:
                        db.inserts.clear()
                    tables.note_clock(db)
                    if db.left_out:
                        tables.insert_event(db, LEFT_OUT, db.left_out)
                    yield db
                    if self._key is not None:
                        sealed = job_seal.insert_seal(db, self._key)
            except FAULTS as error:
                self._note_loss(with_log=False)
                if self.given_up is not None:
                    raise self.given_up from error
                raise
            finally:
                if keeper is not None:
                    keeper.note_log()
            db.left_out = ""
            if keeper is not None:
                keeper.key = self._key
                keeper.acknowledge(tuple(db.inserts or ()), sealed)
                if self._writer.wrote_file:
                    keeper.renew(db, whole=self._writer.emptied_log)
                self._note_loss(with_log=False)
            if sealed is not None:
                job_seal.remember_job(self.head.job_uuid, *sealed, self.path)

    def _note_loss(
        self, *, with_log: bool, on_loss: Callable[[StorageError], object] = lambda _error: None
    ) -> None:
        """Give the file up if changed by others; caller locks. `with_log`: not within a step."""
        keeper = self._keeper
        if keeper is None or keeper.error is not None:
            return
        loss = keeper.name_loss() or keeper.content_loss(with_log=with_log)
        if loss is None and self._writer.failed:
            keeper.lose(NameLoss("the disk failed"), disk=True)
        elif loss is not None:
            keeper.lose(loss, on_loss=on_loss)
