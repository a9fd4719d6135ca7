"""Delivery of an outbox, with growing pauses, until acknowledged; findings that come back.

Safe against kills: marked as delivered after the archive has it, which stores each job once. The
station holds jobs by later findings from the archive.
"""

from __future__ import annotations

import contextlib
import getpass
import hashlib
import logging
import random
import socket
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from ocmm_core import seals
from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.failure import contained
from ocmm_core.storage import HeldJobs, read_held_jobs, write_held_jobs
from ocmm_shop.archive import records
from ocmm_shop.archive.outbox._outbox import Outbox
from ocmm_shop.archive.outbox._outbox_file import Item, ItemState
from ocmm_shop.archive.stores import HEADS, Archive, Cell, Remedy, remedy_of

_PAGE, _LONGEST = 50, 1_000_000
_SETTLED = timedelta(hours=1)
"""Lists that arrived later are read again: another computer may still be storing an earlier one."""
_JOBS = "".join(('{"content":', '{"jobs":'))
"""Start of a list of `signed_job_heads`."""


def learn_marks(archive: Archive, path: Path | None = None) -> int:
    """Store new marks in `path` (None: this user's), return how many; StorageError."""
    known = read_held_jobs(path)
    # Another archive numbers its marks from 1; holds of the former one are not final.
    after = known.after if known.archive in ("", archive.place) else 0
    newest = archive.query("SELECT id FROM archive_mark ORDER BY id DESC LIMIT 1", {}, int).rows
    if not newest or int(str(newest[0][0])) < after:
        # It was restored from a backup, and continues numbering from there.
        after = 0
    marks = archive.marks(after)
    if not marks:
        return 0
    jobs = {job: dict(kinds) for job, kinds in known.jobs.items()}
    for number, mark in marks:
        after = max(after, number)
        kinds = jobs.setdefault(mark.job_uuid, {})
        if mark.holds:
            kinds[mark.kind] = f"{mark.why} ({mark.who}, {mark.utc[:10]})"
        else:
            kinds.pop(mark.kind, None)
        if not kinds:
            del jobs[mark.job_uuid]
    write_held_jobs(HeldJobs(archive=archive.place, after=after, jobs=jobs), path)
    return len(marks)


def exchange_heads(archive: Archive, station: str) -> None:
    """Store the ends of this station's histories and jobs in the archive, and read others'.

    Thus a second computer, or this one after a loss of memory, recognises older copies. Raises
    StorageError if the archive cannot be read or written, or this station has no key.
    """
    keys = seals.KeyFolder()
    _learn_lists(archive, keys)
    for which, signed in (("<>", seals.signed_heads), ("=", seals.signed_job_heads)):
        own = _lists(
            archive,
            f"SELECT id FROM finding WHERE subject = :me AND substr(document, 1, :n) {which} :jobs",  # noqa: S608
            {"me": station, "n": len(_JOBS), "jobs": _JOBS},
        )  # fmt: skip
        for text in signed(keys, (document for _, document, _ in own)):
            archive.add_finding(HEADS, station, text, station, datetime.now(UTC).isoformat())


def _learn_lists(archive: Archive, keys: seals.KeyFolder) -> None:
    """Read every list since the last one read; all if the trusted keys or that list changed."""
    name, trusted = f"lists {archive.place}", repr(sorted(keys.believed()))
    known = seals.recall(name)
    after = 0
    if known is not None:
        there = _lists(archive, "SELECT id FROM finding WHERE id = :id", {"id": known.count})
        if any(_digest(trusted, text) == known.link for _, text, _ in there):
            after = known.count
    settled = (archive.now() - _SETTLED).isoformat(timespec="milliseconds")
    last: seals.KnownEnd | None = None
    ends = frozenset(seals.known_ends())
    for number, text, received in _lists(
        archive, "SELECT id FROM finding WHERE id > :after", {"after": after}
    ):
        # Untrusted stations are ignored.
        with contextlib.suppress(StorageError):
            seals.learn_heads(text, archive.place, keys, ends)
        if last is None and received < settled:
            last = seals.KnownEnd(name=name, count=number, link=_digest(trusted, text))
    if last is not None:
        seals.remember(last)


def _lists(
    archive: Archive, chosen: str, values: Mapping[str, Cell]
) -> Iterator[tuple[int, str, str]]:
    """Yield number, text and arrival of all lists of ends in a selection, newest first."""
    before = (1 << 63) - 1
    while rows := archive.query(
        f"SELECT id, document, received_utc FROM finding WHERE id IN ({chosen})"  # noqa: S608 - constants
        f" AND kind = '{HEADS}' AND length(document) < {_LONGEST} AND id < :before"
        f" ORDER BY id DESC LIMIT {_PAGE}",
        {"before": before, **values},
    ).rows:
        for number, text, received in rows:
            before = int(str(number))
            yield before, str(text), str(received)


def _digest(trusted: str, text: str) -> str:
    return hashlib.sha256(f"{trusted} {text}".encode("utf-8", "replace")).hexdigest()


FIRST_PAUSE_S, LONGEST_PAUSE_S = 1.0, 300.0
_EXCHANGE_S = 600.0
_log = logging.getLogger(__name__)


def lost_deliveries(outbox: Outbox, archive: Archive, after: int = 0) -> list[Item]:
    """Return the acknowledged jobs numbered above ``after`` that the archive lacks."""
    sent = outbox.sent_after(after)
    there = archive.arrived(outbox.identity, [item.sequence for item in sent]) if sent else ()
    return [item for item in sent if item.sequence not in there]


@dataclass(frozen=True, slots=True)
class Handed:
    """Result of a round."""

    sent: int = 0
    aside: int = 0
    again: int = 0
    """`sent`, `aside`, `again`: jobs delivered; refused; requeued as lost by the archive."""
    error: OcmmError | None = None
    """Why the round ended early; None if nothing waits."""


def sender_of(outbox: Outbox, station: str) -> records.Sender:
    """Return the sender; an empty ``station`` is the name of this computer."""
    host = _shown(socket.gethostname()) or "unknown"
    try:
        user = _shown(getpass.getuser())
    except (KeyError, OSError):
        user = ""
    name = station or host
    proof = _signature(seals.Signed.STATION, records.station_claim(name))
    return records.Sender(
        outbox=outbox.identity, station=name, machine=outbox.machine, host=host, user=user,
        key=proof.key, proof=proof.value,
    )  # fmt: skip


def _signature(what: seals.Signed, content: bytes) -> seals.Signature:
    """Return the signature of this station; empty if its key cannot be used: delivery continues."""
    with contextlib.suppress(OcmmError):
        return seals.sign(seals.KeyFolder().station_key(), what, content)
    return seals.Signature("", "")


class Courier:
    """Deliver jobs of an outbox; one thread and process. `connect`: again after failures."""

    def __init__(
        self,
        outbox: Outbox,
        connect: Callable[[], Archive],
        station: str = "",
        extract: records.Extract = records.extract_job,
    ) -> None:
        self._outbox, self._connect, self._extract = outbox, connect, extract
        self._station = station
        self._archive: Archive | None = None
        self._exchange_at = 0.0
        self._again = 0

    def close(self) -> None:
        """Close the connection; may be called twice."""
        if self._archive is not None:
            self._archive.close()
            self._archive = None

    def send_waiting(self, stop: Callable[[], bool] = lambda: False) -> Handed:
        """Deliver all that waits, returning faults; StorageError only for the outbox itself."""
        sent = aside = 0
        self._again = 0
        try:
            archive = self._open()
            while not stop():
                items = self._outbox.waiting()
                if not items:
                    break
                for item in items:
                    if stop():
                        break
                    if self._hand_over(archive, item):
                        sent += 1
                    else:
                        aside += 1
            learn_marks(archive)
            self._exchange_heads(archive, now=sent > 0)
        except Exception as caught:
            # Regardless of the archive's errors, the process survives and retries.
            error = contained(caught, "The hand-over to the archive")
            if error.code.startswith("outbox."):
                raise
            self.close()
            self._outbox.note_contact(error)
            return Handed(sent, aside, self._again, error)
        return Handed(sent, aside, self._again)

    def _exchange_heads(self, archive: Archive, *, now: bool) -> None:
        if not now and time.monotonic() < self._exchange_at:
            return
        self._exchange_at = time.monotonic() + _EXCHANGE_S
        try:
            exchange_heads(archive, sender_of(self._outbox, self._station).station)
        except OcmmError as error:
            # The owner of the archive has not run set-up again; delivery continues.
            _log.warning("The ends of histories are not in the archive: %s", error)
            self.close()

    def _open(self) -> Archive:
        if self._archive is None:
            self._archive = self._connect()
            self._send_again_what_was_lost(self._archive)
        else:
            # Check existence and version, even if nothing waits.
            self._archive.last_sequence(self._outbox.identity)
        self._outbox.note_contact(None)
        return self._archive

    def _send_again_what_was_lost(self, archive: Archive) -> None:
        """Requeue acknowledged jobs that the archive lacks, after a restore from backup."""
        last = archive.last_sequence(self._outbox.identity)
        for item in lost_deliveries(self._outbox, archive, last):
            self._outbox.settle(item, ItemState.WAITING)
            self._again += 1

    def _hand_over(self, archive: Archive, item: Item) -> bool:
        """Deliver one job; return whether the archive has it; raises what stops the round."""
        try:
            receipt = archive.put(self._made(archive, item))
        except OcmmError as error:
            if remedy_of(error) is Remedy.RETRY:
                raise
            self._outbox.settle(item, ItemState.ASIDE, str(error))
            return False
        self._outbox.settle(item, ItemState.SENT)
        self._outbox.note_contact(None, receipt.clock_off_s)
        return True

    def _made(self, archive: Archive, item: Item) -> records.Delivery:
        sender = sender_of(self._outbox, self._station)
        content = self._outbox.content(item)
        try:
            made = self._extract(content, item.name, sender.station, None)
            # Versions from other stations do not affect this file: readers judge both.
            known = archive.heads(made.record.job.job_uuid, sender.station)
            if known:
                made = self._extract(content, item.name, sender.station, known)
        except OcmmError:
            raise
        except Exception as error:
            # A job that crashes the reader must not block the others.
            raise contained(error, f"The reading of {item.name}") from error
        claim = records.delivery_claim(sender.outbox, item.sequence, made.record.job.sha256)
        return records.Delivery(
            sender=sender,
            signature=_signature(seals.Signed.DELIVERY, claim).value,
            sequence=item.sequence,
            sent_utc=datetime.now(UTC).isoformat(timespec="milliseconds"),
            record=made.record,
            content=made.content,
        )


class BackOff:
    """Randomised exponential pauses between retries."""

    def __init__(self, rng: random.Random) -> None:
        self._rng = rng
        self._failures = 0

    def good(self) -> None:
        self._failures = 0

    def next_s(self) -> float:
        """Return the pause after another failure, s."""
        longest = min(FIRST_PAUSE_S * 2.0**self._failures, LONGEST_PAUSE_S)
        self._failures = min(self._failures + 1, 30)
        return longest * self._rng.uniform(0.5, 1.0)


def _shown(text: str) -> str:
    return records.shown_text(text, "")[:100]
