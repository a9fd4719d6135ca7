"""Outbox of a station: queued jobs, durable before they are acknowledged, and its state.

Measuring programs queue complete job files; a separate process delivers them. Files are kept until
acknowledged, and a copy for some time after that, for an archive that is restored from a backup.
Files are named by their SHA-256. A row is written after its file, so that no row lacks a file, and
a file without a row is a leftover. The start page, the Archive page and the terminal show the state
of the upload in words.
"""

from __future__ import annotations

import contextlib
import hashlib
import sqlite3
import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import platformdirs

from ocmm_core.documents import write_atomic
from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.side_files import LARGEST_JOB, read_guarded
from ocmm_shop.archive.outbox._outbox_file import (
    ConnectionState,
    Item,
    ItemState,
    OutboxFile,
    machine_identity,
    utc_now,
)
from ocmm_shop.archive.records import snapshot
from ocmm_shop.archive.stores import CLOCK_TELL_S

KEPT = timedelta(days=30)
"""Retention of delivered copies, for an archive that is restored from a backup."""


def default_outbox() -> Path:
    return platformdirs.user_data_path("ocmm") / "outbox"


class Outbox(OutboxFile):
    """Queued jobs; one thread, many processes; StorageError: unreadable, damaged, or newer."""

    def put(self, path: Path) -> Item | None:
        """Queue a job in its current state; durable on return.

        Returns None if the identical job was queued before. Raises StorageError if the job cannot
        be read, or the outbox cannot be written.
        """
        return self.put_content(snapshot(path), path)

    def put_content(self, content: bytes, path: Path) -> Item | None:
        """Queue the content of a job file; as `put`."""
        sha256 = hashlib.sha256(content).hexdigest()
        place = str(path.absolute())
        try:
            with self._transaction() as db:
                last = db.execute(
                    "SELECT sha256 FROM item WHERE path = ? ORDER BY sequence DESC LIMIT 1",
                    (place,),
                ).fetchone()
            if last is not None and last[0] == sha256:
                return None
            self._keep(sha256, content)
            with self._transaction() as db:
                # Another process may prune at this moment; the row must have its file.
                if not self._file(sha256).exists():
                    self._keep(sha256, content)
                put_utc = utc_now()
                sequence = db.execute(
                    "INSERT INTO item (sha256, name, path, put_utc, state)"
                    " VALUES (?, ?, ?, ?, 'waiting') RETURNING sequence",
                    (sha256, path.name, place, put_utc),
                ).fetchone()[0]
        except (sqlite3.Error, OSError) as error:
            raise self._fault(error) from error
        return Item(sequence, sha256, path.name, place, put_utc, ItemState.WAITING, "")

    def waiting(self) -> list[Item]:
        """Return the waiting jobs, oldest first."""
        return self._items("state = 'waiting' ORDER BY sequence LIMIT ?", (100,))

    def aside(self) -> list[Item]:
        """Return the jobs refused by the archive, newest first."""
        return self._items("state = 'aside' ORDER BY sequence DESC LIMIT ?", (1000,))

    def sent_after(self, sequence: int) -> list[Item]:
        """Return the delivered jobs with a higher number, oldest first."""
        return self._items("state = 'sent' AND sequence > ? ORDER BY sequence", (sequence,))

    def count(self, state: ItemState) -> int:
        with self._reading() as db:
            (found,) = db.execute(
                "SELECT count(*) FROM item WHERE state = ?", (state.value,)
            ).fetchone()
        return int(found)

    def content(self, item: Item) -> bytes:
        """Return the queued or current file of a job; StorageError: none, or a damaged copy."""
        file = self._file(item.sha256)
        try:
            content = read_guarded(file, LARGEST_JOB, follow=False)
        except FileNotFoundError:
            return snapshot(Path(item.path))
        except OSError as error:
            raise self._fault(error) from error
        if hashlib.sha256(content).hexdigest() != item.sha256:
            # The job itself may still exist; its content is verified when it is opened.
            with contextlib.suppress(OcmmError):
                return snapshot(Path(item.path))
            raise StorageError(
                "job.copy",
                f"{file}: the copy of {item.name} in the outbox is damaged, and {item.path} cannot "
                "be read.",
                "Restore the job file from a backup, then: ocmm archive send FILE.",
            )
        return content

    def settle(self, item: Item, state: ItemState, said: str = "") -> None:
        """Note the result of a job; durable on return."""
        with self._writing() as db:
            db.execute(
                "UPDATE item SET state = ?, said = ?, sent_utc = ? WHERE sequence = ?",
                (state.value, said, utc_now() if state is ItemState.SENT else "", item.sequence),
            )

    def note_contact(self, error: OcmmError | None, clock_off_s: float | None = None) -> None:
        with self._writing() as db:
            if error is None:
                db.execute(
                    "UPDATE contact SET code = '', said = '', since_utc = '', good_utc = ?,"
                    " clock_off_s = coalesce(?, clock_off_s)",
                    (utc_now(), clock_off_s),
                )
            else:
                db.execute(
                    "UPDATE contact SET code = ?, said = ?, since_utc ="
                    " CASE WHEN since_utc = '' THEN ? ELSE since_utc END",
                    (error.code, str(error), utc_now()),
                )

    def contact(self) -> ConnectionState:
        with self._reading() as db:
            row = db.execute(
                "SELECT code, said, since_utc, good_utc, clock_off_s FROM contact"
            ).fetchone()
        return ConnectionState(*row)

    def prune(self, now: datetime | None = None) -> int:
        """Remove expired copies, none while the archive's clock differs; return how many."""
        if abs(self.contact().clock_off_s) > CLOCK_TELL_S:
            return 0
        before = ((now or datetime.now(UTC)) - KEPT).isoformat(timespec="milliseconds")
        removed = 0
        # Under the write lock, so that the same file is not queued meanwhile.
        with self._writing() as db:
            needed = {
                row[0]
                for row in db.execute(
                    "SELECT sha256 FROM item WHERE state <> 'sent' OR sent_utc >= ?", (before,)
                )
            }
            known = {row[0] for row in db.execute("SELECT DISTINCT sha256 FROM item")}
            for file in self._files.glob("*/*"):
                if file.name in known and file.name not in needed:
                    file.unlink(missing_ok=True)
                    removed += 1
        return removed

    def queue_unlisted(self) -> int:
        """Queue the kept files without a row, e.g. of a lost outbox; return how many.

        The archive recognizes jobs that it has by their content. Errors as `put`.
        """
        with self._reading() as db:
            known = {row[0] for row in db.execute("SELECT DISTINCT sha256 FROM item")}
        files = [one for one in self._files.glob("*/*") if one.name not in known]
        for file in files:
            self.put_content(snapshot(file), file)
        return len(files)

    def try_aside_again(self) -> None:
        """Requeue everything that was set aside."""
        with self._writing() as db:
            db.execute("UPDATE item SET state = 'waiting', said = '' WHERE state = 'aside'")

    def renew(self) -> None:
        """Give a new identity, for a copied disk; all is sent again, known by content."""
        with self._writing() as db:
            identity, machine = str(uuid.uuid4()), machine_identity()
            db.execute("UPDATE box SET outbox = ?, machine = ?", (identity, machine))
            db.execute("UPDATE item SET state = 'waiting', said = '' WHERE state <> 'waiting'")
        self.identity, self.machine = identity, machine

    def _keep(self, sha256: str, content: bytes) -> None:
        file = self._file(sha256)
        if file.exists() and file.stat().st_size == len(content):
            return
        file.parent.mkdir(exist_ok=True)
        write_atomic(file, content)

    def _file(self, sha256: str) -> Path:
        return self._files / sha256[:2] / sha256

    def _items(self, where: str, values: Sequence[object]) -> list[Item]:
        with self._reading() as db:
            rows = db.execute(
                "SELECT sequence, sha256, name, path, put_utc, state, said FROM item WHERE "  # noqa: S608 - our own words
                + where,
                values,
            ).fetchall()
        return [
            Item(sequence, sha256, name, path, put_utc, ItemState(state), said)
            for sequence, sha256, name, path, put_utc, state, said in rows
        ]


@dataclass(frozen=True, slots=True)
class HandOver:
    waiting: int
    """Jobs that the archive does not have yet."""
    aside: tuple[Item, ...]
    """Jobs refused by it, newest first, with reasons."""
    contact: ConnectionState

    @property
    def needs_attention(self) -> bool:
        return bool(self.aside or self.contact.code or abs(self.contact.clock_off_s) > CLOCK_TELL_S)

    @property
    def line(self) -> str:
        """Return all sentences in a line; empty if nothing waits and nothing is wrong."""
        return " ".join(self.sentences)

    @property
    def sentences(self) -> tuple[str, ...]:
        """Return the sentences, the most important first."""
        found = []
        if self.waiting:
            wait = "1 job waits" if self.waiting == 1 else f"{self.waiting} jobs wait"
            since = _local(self.contact.since_utc)
            why = f"; {_WORDS.get(self.contact.code, 'it failed')} since {since}" if since else ""
            found.append(f"{wait} for the archive{why}.")
        elif self.contact.code:
            found.append(
                f"Archive: {_WORDS.get(self.contact.code, 'it failed')} since "
                f"{_local(self.contact.since_utc)}."
            )
        if self.contact.code:
            found.append(self.contact.said)
        if self.aside:
            count = len(self.aside)
            jobs = "1 job" if count == 1 else f"{count} jobs"
            found.append(
                f"{jobs} cannot be archived, {self.aside[0].name} last: {self.aside[0].said}"
            )
        off = self.contact.clock_off_s
        if abs(off) > CLOCK_TELL_S:
            found.append(
                f"The clock of this computer is {abs(off) / 60.0:.0f} min "
                f"{'ahead of' if off > 0.0 else 'behind'} that of the archive: set it, or jobs are "
                "listed on the wrong day."
            )
        return tuple(found)


_WORDS = {
    "archive.lost": "archive file missing",
    "archive.unreachable": "server not reached",
    "archive.slow": "server too slow",
    "archive.full": "disk of the archive full",
    "archive.login": "login refused",
    "archive.rights": "rights missing",
    "archive.tls": "no trusted connection",
    "archive.newer": "archive newer than this program",
    "archive.older": "archive older than this program",
    "archive.version": "archive of another version",
    "archive.admitted": "login not admitted as this station",
    "archive.station": "name of the station taken",
    "archive.read_only": "server takes no writing",
    "archive.shop": "program part missing",
    "archive.not_set_up": "archive not set up",
    "archive.too_large": "answer without an end",
    "archive.not_understood": "answer not understood",
    "archive.not_kept": "server keeps nothing",
    "archive.changes": "server changes values",
}


def hand_over(folder: Path) -> HandOver:
    """Return the state of an outbox, empty if there is none; StorageError if unreadable."""
    if not Outbox.is_in(folder):
        return HandOver(0, (), ConnectionState())
    with Outbox(folder) as outbox:
        return HandOver(outbox.count(ItemState.WAITING), tuple(outbox.aside()), outbox.contact())


def _local(utc: str) -> str:
    """Return a local time; with the date if not today."""
    if not utc:
        return ""
    at = datetime.fromisoformat(utc).astimezone()
    same = at.date() == datetime.now(at.tzinfo).date()
    return at.strftime("%H:%M" if same else "%Y-%m-%d %H:%M")
