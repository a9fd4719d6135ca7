"""The job file: one SQLite file per job, durable point by point, in which nothing is ever changed.

WAL with ``synchronous=FULL``: when `JobFile.append_point` returns, the point is on the disk. An
undo is a new row that annuls the point; the observation stays. The program that measures holds the
file alone (``locking_mode=EXCLUSIVE``): another one is told so instead of writing between.
"""

from __future__ import annotations

import contextlib
import os
import sqlite3
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import Literal

from ocmm_core.documents import write_atomic
from ocmm_core.errors import StorageError
from ocmm_core.measuring.point import MeasuredPoint
from ocmm_core.storage.audit import AUDITED, digest_row, find_faults, insert_audited, now_utc
from ocmm_core.storage.faults import (
    bad_text,
    damaged,
    disk_failed,
    no_job,
    not_writable,
    primary_code,
    storage_error,
)
from ocmm_core.storage.job_steps import JobStep, read_steps
from ocmm_core.storage.migrations import APPLICATION_ID, bring_up_to_date
from ocmm_core.storage.rows import (
    JobEvent,
    JobHead,
    JobReference,
    head_from_row,
    point_from_row,
    reference_from_row,
    reference_row_from_point,
    row_from_head,
    row_from_point,
    row_from_reference,
    spots_from,
)

_WAIT_S = 1.0
"""How long an open waits for another program to let go of the file."""

_POINT_COLUMNS = ",".join(AUDITED["observation"])


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
        try:
            path.open("xb").close()
        except FileExistsError as error:
            raise StorageError(
                "job.exists",
                f"{path}: there is a file of that name already.",
                "Choose another name for the job; an existing file is never overwritten.",
            ) from error
        except OSError as error:
            raise not_writable(path, error.strerror or str(error)) from error
        try:
            with _closing_on_error(path, _connect(path, "rw", alone=True)) as db:
                db.execute("PRAGMA journal_mode = WAL")
                bring_up_to_date(db, path, read_only=False)
                db.execute("BEGIN IMMEDIATE")
                insert_audited(db, "head", row_from_head(head))
                db.execute("COMMIT")
                return cls(path, db, head, read_only=False)
        except BaseException:
            for name in (path.name, f"{path.name}-wal", f"{path.name}-journal"):
                path.with_name(name).unlink(missing_ok=True)
            raise

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
        if not path.is_file():
            raise StorageError(
                "job.missing", f"{path}: there is no such file.", "Check the name and the folder."
            )
        mode = "rw"
        if not read_only and not (os.access(path, os.W_OK) and os.access(path.parent, os.W_OK)):
            raise not_writable(path, "the file or its folder is write-protected")
        if read_only and not os.access(path.parent, os.W_OK):
            # SQLite needs a writable folder even to read a WAL. A finished file has none and can
            # be read as it is, e.g. from an archive that nobody can write to.
            mode = "ro" if path.with_name(f"{path.name}-wal").exists() else "ro&immutable=1"
        with _closing_on_error(path, _connect(path, mode, alone=not read_only)) as db:
            if int(db.execute("PRAGMA application_id").fetchone()[0]) != APPLICATION_ID:
                raise no_job(path)
            bring_up_to_date(db, path, read_only=read_only)
            fault = db.execute("PRAGMA quick_check(1)").fetchone()[0]
            if fault != "ok":
                raise damaged(path, " ".join(fault.split()))
            statement = f"SELECT {','.join(AUDITED['head'])} FROM head"  # noqa: S608 - constants
            row = db.execute(statement).fetchone()
            if row is None:
                raise damaged(path, "it has no head")
            return cls(path, db, head_from_row(row), read_only=read_only)

    def append_point(self, point: MeasuredPoint) -> None:
        """Store a point; it is on the disk when this returns.

        Raises
        ------
        StorageError
            The point cannot be stored; all earlier ones are, and this one may be given again.
        """
        with self._transaction() as db:
            self._insert_point(db, point)

    def annul_point(self, number: int, reason: str) -> None:
        """Take a point out of `points`, and say why; the observation stays in the file.

        Raises
        ------
        StorageError
            There is no such point, it is annulled already, or the file cannot be written.
        """
        with self._transaction() as db:
            self._insert_annulment(db, number, reason)

    def append_event(self, kind: str, text: str) -> None:
        """Store something that happened; it is on the disk when this returns."""
        with self._transaction() as db:
            _insert_event(db, kind, text)

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
                self._insert_annulment(db, number, reason)
            for point in append:
                self._insert_point(db, point)
            for kind, text in events:
                _insert_event(db, kind, text)

    def points(self) -> list[MeasuredPoint]:
        """Return the points that are not annulled, in the order in which they were taken.

        Raises
        ------
        StorageError
            An observation is not the one that was stored; `verify` says more.
        """
        return self._points("NOT IN")

    def annulled(self) -> list[tuple[MeasuredPoint, str]]:
        """Return the points that are annulled, and why each is; StorageError as `points`."""
        points = self._points("IN")
        with self._reading() as db:
            reasons = dict(db.execute("SELECT number, reason FROM annulment").fetchall())
        return [(point, reasons[point.number]) for point in points]

    def _points(self, among: Literal["IN", "NOT IN"]) -> list[MeasuredPoint]:
        with self._reading() as db:
            rows = db.execute(
                f"SELECT {_POINT_COLUMNS}, content_sha256 FROM observation "  # noqa: S608 - constants
                "LEFT JOIN audit ON subject = 'observation' AND key = number "
                f"WHERE number {among} (SELECT number FROM annulment) ORDER BY number"
            ).fetchall()
            beside = db.execute(
                "SELECT number, spots_shape, spots, content_sha256 FROM reference_observation "
                "LEFT JOIN audit ON subject = 'reference_observation' AND key = number"
            ).fetchall()
        for *row, content in (*rows, *beside):
            if digest_row(row) != content:
                raise damaged(self.path, f"point {row[0]} is not as it was stored")
        spots = {number: spots_from(shape, blob) for number, shape, blob, _ in beside}
        points = [point_from_row(row) for *row, _ in rows]
        return [replace(point, reference_spots=spots.get(point.number)) for point in points]

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
            if db.execute("SELECT count(*) FROM reference").fetchone()[0]:
                raise StorageError(
                    "job.reference",
                    f"{self.path}: the job has a reference body already.",
                    "Begin a new job for another one.",
                )
            insert_audited(db, "reference", row_from_reference(reference))

    def reference(self) -> JobReference | None:
        """Return the reference body that the points are relative to, or None.

        Raises
        ------
        StorageError
            It is not the one that was stored; `verify` says more.
        """
        with self._reading() as db:
            row = db.execute(
                f"SELECT {','.join(AUDITED['reference'])}, content_sha256 FROM reference "  # noqa: S608 - constants
                "LEFT JOIN audit ON subject = 'reference' AND key = id"
            ).fetchone()
        if row is None:
            return None
        *stored, content = row
        if digest_row(stored) != content:
            raise damaged(self.path, "the reference body is not as it was stored")
        return reference_from_row(stored)

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
            return _next_number(db)

    def verify(self) -> list[str]:
        """Return one sentence for every fault of the file against its audit chain."""
        with self._reading() as db:
            return find_faults(db)

    def backup(self, path: Path | str) -> None:
        """Write a complete copy; works also after the disk of the job has failed.

        Raises
        ------
        StorageError
            There is such a file already, or it cannot be written.
        """
        path = Path(path)
        if path.exists():
            raise StorageError(
                "job.exists",
                f"{path}: there is a file of that name already.",
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

    def _insert_point(self, db: sqlite3.Connection, point: MeasuredPoint) -> None:
        expected = _next_number(db)
        if point.number < expected:
            raise StorageError(
                "job.number",
                f"{self.path}: point number {point.number} comes after number {expected - 1}.",
                "Take the point again; every point needs a new number.",
            )
        insert_audited(db, "observation", row_from_point(point))
        beside = reference_row_from_point(point)
        if beside is not None:
            insert_audited(db, "reference_observation", beside)

    def _insert_annulment(self, db: sqlite3.Connection, number: int, reason: str) -> None:
        known = db.execute(
            "SELECT (SELECT count(*) FROM observation WHERE number = ?1),"
            " (SELECT count(*) FROM annulment WHERE number = ?1)",
            (int(number),),
        ).fetchone()
        if known != (1, 0):
            fault = "is annulled already" if known[0] else "is not in the job"
            raise StorageError(
                "job.annulled", f"{self.path}: point {number} {fault}.", "Choose another point."
            )
        insert_audited(db, "annulment", (int(number), now_utc(), reason))

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
                    f"{self.path}: the job was opened for reading.",
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


def _connect(path: Path, mode: str, *, alone: bool) -> sqlite3.Connection:
    address = f"{path.resolve().as_uri()}?mode={mode}"
    try:
        db = sqlite3.connect(
            address, uri=True, timeout=_WAIT_S, isolation_level=None, check_same_thread=False
        )
    except sqlite3.Error as error:
        raise storage_error(path, error) from error
    with _closing_on_error(path, db):
        db.execute("PRAGMA locking_mode = EXCLUSIVE" if alone else "PRAGMA query_only = ON")
        db.execute("PRAGMA synchronous = FULL")
        db.execute("PRAGMA foreign_keys = ON")
    return db


@contextlib.contextmanager
def _closing_on_error(path: Path, db: sqlite3.Connection) -> Iterator[sqlite3.Connection]:
    try:
        yield db
    except sqlite3.Error as error:
        db.close()
        raise storage_error(path, error) from error
    except UnicodeEncodeError as error:
        db.close()
        raise bad_text(path, error) from error
    except BaseException:
        db.close()
        raise


def _insert_event(db: sqlite3.Connection, kind: str, text: str) -> None:
    number = db.execute("SELECT coalesce(max(id), 0) + 1 FROM event").fetchone()[0]
    insert_audited(db, "event", (number, now_utc(), kind, text))


def _next_number(db: sqlite3.Connection) -> int:
    return int(db.execute("SELECT coalesce(max(number), 0) + 1 FROM observation").fetchone()[0])
