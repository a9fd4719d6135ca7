"""The job file: one SQLite file per job, durable point by point, in which nothing is ever changed.

WAL with ``synchronous=FULL``: when `JobFile.append_point` returns, the point is on the disk. An
undo is a new row that annuls the point; the observation stays. The program that measures holds the
file alone (``locking_mode=EXCLUSIVE``): another one is told so instead of writing between.
"""

from __future__ import annotations

import contextlib
import sqlite3
import threading
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType, TracebackType

from ocmm_core.documents import write_atomic
from ocmm_core.errors import StorageError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage._audit import find_faults, insert_audited
from ocmm_core.storage._connection import connection_to, new_connection
from ocmm_core.storage._faults import (
    bad_text,
    disk_failed,
    not_writable,
    primary_code,
    storage_error,
)
from ocmm_core.storage._job_steps import JobStep, read_steps
from ocmm_core.storage._rows import JobEvent, JobHead, JobReference, row_from_head
from ocmm_core.storage._tables import (
    insert_annulment,
    insert_event,
    insert_point,
    insert_reference,
    next_number,
    stored_head,
    stored_points,
    stored_reference,
)


class JobFile:
    """An open job file; make it with `create` or `open`, and close it or use it in ``with``.

    Every method may be called from any thread: one lock guards the connection, so that the thread
    that takes points and the window that undoes them do not meet. A call waits at most for one
    commit of another thread (milliseconds; as long as the disk takes).

    Attributes
    ----------
    path
        Where the file is.
    head
        What the job says about itself.
    """

    def __init__(
        self, path: Path, db: sqlite3.Connection, head: JobHead, *, read_only: bool
    ) -> None:
        self.path = path
        self.head = head
        self._read_only = read_only
        self._db: sqlite3.Connection | None = db
        self._lock = threading.Lock()
        self._disk_failed = False

    @classmethod
    def create(cls, path: Path | str, head: JobHead) -> JobFile:
        """Make a new job file and return it open.

        Raises
        ------
        StorageError
            There is such a file already, or it cannot be written; nothing is left behind then.
        """
        path = Path(path)
        with new_connection(path) as db:
            db.execute("BEGIN IMMEDIATE")
            insert_audited(db, "head", row_from_head(head))
            db.execute("COMMIT")
            return cls(path, db, head, read_only=False)

    @classmethod
    def open(cls, path: Path | str, *, read_only: bool = False) -> JobFile:
        """Open a job file.

        Raises
        ------
        StorageError
            The file is missing, no job file, newer than this program, damaged, cannot be read or
            written, or is in use by another program.
        """
        path = Path(path)
        with connection_to(path, read_only=read_only) as db:
            return cls(path, db, stored_head(db, path), read_only=read_only)

    def append_point(self, point: MeasuredPoint) -> None:
        """Store a point; it is on the disk when this returns.

        For tests: nothing in the product asks for it.

        Raises
        ------
        StorageError
            The point cannot be stored; all earlier ones are, and this one may be given again.
        """
        with self._transaction() as db:
            insert_point(db, self.path, point)

    def annul_point(self, number: int, reason: str) -> None:
        """Take a point out of `points`, and say why; the observation stays in the file.

        For tests: nothing in the product asks for it.

        Raises
        ------
        StorageError
            There is no such point, it is annulled already, or the file cannot be written.
        """
        with self._transaction() as db:
            insert_annulment(db, self.path, number, reason)

    def append_event(self, kind: str, text: str) -> None:
        """Store something that happened; it is on the disk when this returns."""
        with self._transaction() as db:
            insert_event(db, kind, text)

    def change(
        self,
        *,
        annul: Mapping[int, str] = MappingProxyType({}),
        append: Sequence[MeasuredPoint] = (),
        events: Sequence[tuple[str, str]] = (),
    ) -> None:
        """Annul points, each for its reason, store new ones and what happened: all or nothing.

        Raises
        ------
        StorageError
            As `annul_point`, `append_point` and `append_event`; nothing is changed then.
        """
        with self._transaction() as db:
            for number, reason in annul.items():
                insert_annulment(db, self.path, number, reason)
            for point in append:
                insert_point(db, self.path, point)
            for kind, text in events:
                insert_event(db, kind, text)

    def points(self) -> list[MeasuredPoint]:
        """Return the points that are not annulled, in the order in which they were taken.

        Raises
        ------
        StorageError
            An observation is not the one that was stored; `verify` says more.
        """
        with self._reading() as db:
            return stored_points(db, self.path, annulled=False)

    def annulled(self) -> list[tuple[MeasuredPoint, str]]:
        """Return the points that are annulled, and why each is; StorageError as `points`."""
        with self._reading() as db:
            points = stored_points(db, self.path, annulled=True)
            reasons = dict(db.execute("SELECT number, reason FROM annulment").fetchall())
        return [(point, reasons[point.number]) for point in points]

    def steps(self, after: int = 0, most: int = 256) -> list[JobStep]:
        """Return what became durable after audit row ``after``, oldest first: see `read_steps`."""
        with self._reading() as db:
            return read_steps(db, self.path, after, most)

    def store_reference(self, reference: JobReference) -> None:
        """Store the reference body of the job and its first place; on the disk when this returns.

        Raises
        ------
        StorageError
            The job has one already, or the file cannot be written.
        """
        with self._transaction() as db:
            insert_reference(db, self.path, reference)

    def reference(self) -> JobReference | None:
        """Return the reference body that the points are relative to, or None.

        Raises
        ------
        StorageError
            It is not the one that was stored; `verify` says more.
        """
        with self._reading() as db:
            return stored_reference(db, self.path)

    def taken_utc(self) -> dict[int, str]:
        """Return when each point was stored, also annulled ones: ISO 8601 text by number."""
        with self._reading() as db:
            rows = db.execute(
                "SELECT key, time_utc FROM audit WHERE subject = 'observation' ORDER BY key"
            ).fetchall()
        return {int(number): text for number, text in rows}

    def events(self) -> list[JobEvent]:
        """Return what happened, oldest first."""
        with self._reading() as db:
            rows = db.execute("SELECT time_utc, kind, text FROM event ORDER BY id").fetchall()
        return [JobEvent(*row) for row in rows]

    def next_number(self) -> int:
        """Return the number of the next point; numbers of annulled points are not used again."""
        with self._reading() as db:
            return next_number(db)

    def verify(self) -> list[str]:
        """Return one sentence for every fault of the file against its audit chain."""
        with self._reading() as db:
            return find_faults(db)

    def backup(self, path: Path | str) -> None:
        """Write a complete copy; works also after the disk of the job has failed.

        For tests: nothing in the product asks for it.

        Raises
        ------
        StorageError
            There is such a file already, or it cannot be written.
        """
        path = Path(path)
        if path.exists():
            raise StorageError(
                "job.exists",
                f"{path}: this file already exists.",
                "Choose another name for the backup.",
            )
        with self._reading() as db:
            content = db.serialize()
        try:
            write_atomic(path, content)
        except OSError as error:
            raise not_writable(path, error.strerror or str(error)) from error

    def close(self) -> None:
        """Close the file; may be called twice."""
        with self._lock:
            if self._db is not None:
                self._db.close()
                self._db = None

    def __enter__(self) -> JobFile:
        """Return the open job file."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the file."""
        self.close()

    @contextlib.contextmanager
    def _reading(self) -> Iterator[sqlite3.Connection]:
        with self._lock:
            if self._db is None:
                raise StorageError(
                    "job.closed", f"{self.path}: the job is closed.", "Open the job again."
                )
            try:
                yield self._db
            except sqlite3.Error as error:
                raise storage_error(self.path, error) from error

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        with self._reading() as db:
            if self._read_only:
                raise StorageError(
                    "job.read_only",
                    f"{self.path}: the job was opened read-only.",
                    "Open it for measuring to add to it.",
                )
            if self._disk_failed:
                raise disk_failed(self.path)
            try:
                db.execute("BEGIN IMMEDIATE")
                yield db
                db.execute("COMMIT")
            except BaseException as error:
                # After a failed sync the kernel may have dropped the pages: trying again could
                # seem to succeed. The job goes on in another file instead.
                self._disk_failed = primary_code(error) == sqlite3.SQLITE_IOERR
                with contextlib.suppress(sqlite3.Error):
                    db.execute("ROLLBACK")
                if isinstance(error, UnicodeEncodeError):
                    raise bad_text(self.path, error) from error
                raise
