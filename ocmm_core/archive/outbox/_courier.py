"""Hands over what waits in an outbox: with growing pauses, and so often until it is acknowledged.

Killed at any moment it loses nothing and doubles nothing: a job is noted as delivered after the
archive has it, and the archive keeps what it knows already only once.
"""

from __future__ import annotations

import contextlib
import getpass
import logging
import random
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime

from ocmm_core.archive.outbox._learn import exchange_heads, learn_marks
from ocmm_core.archive.outbox._outbox import Outbox
from ocmm_core.archive.outbox._outbox_rows import Item, ItemState
from ocmm_core.archive.records import (
    Delivery,
    Extract,
    Sender,
    delivery_claim,
    extract_job,
    shown_text,
    station_claim,
)
from ocmm_core.archive.stores import Remedy, SqlArchive, remedy_of
from ocmm_core.errors import OcmmError
from ocmm_core.failure import contained
from ocmm_core.seals import KeyFolder, Signature, Signed, sign

FIRST_PAUSE_S, LONGEST_PAUSE_S = 1.0, 300.0
_EXCHANGE_S = 600.0
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Handed:
    """What a round came to."""

    sent: int = 0
    aside: int = 0
    again: int = 0
    """`sent`, `aside`, `again`: Jobs that the archive has now; that it cannot take; that it had
    lost and gets again."""
    error: OcmmError | None = None
    """Why the round ended early; None where nothing waits any more."""


def sender_of(outbox: Outbox, station: str) -> Sender:
    """Return who hands over; ``station`` empty is the name of this computer."""
    host = _shown(socket.gethostname()) or "unknown"
    try:
        user = _shown(getpass.getuser())
    except (KeyError, OSError):
        user = ""
    name = station or host
    proof = _signature(Signed.STATION, station_claim(name))
    return Sender(
        outbox=outbox.identity, station=name, machine=outbox.machine, host=host, user=user,
        key=proof.key, proof=proof.value,
    )  # fmt: skip


def _signature(what: Signed, content: bytes) -> Signature:
    """Return the signature of this station; empty if its key cannot be used: the job goes on."""
    with contextlib.suppress(OcmmError):
        return sign(KeyFolder().station_key(), what, content)
    return Signature("", "")


class Courier:
    """Hand over the jobs of an outbox; used by one thread, and one process a box.

    Parameters
    ----------
    outbox
        Where they wait.
    connect
        Opens the archive; called anew after every failure.
    station
        Name of the station; empty is that of this computer.
    extract
        Rows of a job.
    """

    def __init__(
        self,
        outbox: Outbox,
        connect: Callable[[], SqlArchive],
        station: str = "",
        extract: Extract = extract_job,
    ) -> None:
        self._outbox, self._connect, self._extract = outbox, connect, extract
        self._station = station
        self._archive: SqlArchive | None = None
        self._exchange_at = 0.0
        self._again = 0

    def close(self) -> None:
        """Let go of the archive; may be called twice."""
        if self._archive is not None:
            self._archive.close()
            self._archive = None

    def send_waiting(self, stop: Callable[[], bool] = lambda: False) -> Handed:
        """Hand over everything that waits; never raises what an archive or a job is to blame for.

        Raises
        ------
        StorageError
            The outbox itself cannot be read or written.
        """
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
            # Whatever an archive says, the process that hands over lives on and tries again.
            error = contained(caught, "The hand-over to the archive")
            if error.code.startswith("outbox."):
                raise
            self.close()
            self._outbox.note_contact(error)
            return Handed(sent, aside, self._again, error)
        return Handed(sent, aside, self._again)

    def _exchange_heads(self, archive: SqlArchive, *, now: bool) -> None:
        if not now and time.monotonic() < self._exchange_at:
            return
        self._exchange_at = time.monotonic() + _EXCHANGE_S
        try:
            exchange_heads(archive, sender_of(self._outbox, self._station).station)
        except OcmmError as error:
            # An archive whose owner has not run set-up again; jobs are handed over all the same.
            _log.warning("The ends of histories are not in the archive: %s", error)
            self.close()

    def _open(self) -> SqlArchive:
        if self._archive is None:
            self._archive = self._connect()
            self._send_again_what_was_lost(self._archive)
        else:
            # Whether it is still there, and of our version: also where nothing waits.
            self._archive.last_sequence(self._outbox.identity)
        self._outbox.note_contact(None)
        return self._archive

    def _send_again_what_was_lost(self, archive: SqlArchive) -> None:
        """Let wait again what the archive has acknowledged and does not have: it was restored."""
        last = archive.last_sequence(self._outbox.identity)
        lost = self._outbox.sent_after(last)
        if not lost:
            return
        there = archive.arrived(self._outbox.identity, [item.sequence for item in lost])
        for item in lost:
            if item.sequence not in there:
                self._outbox.settle(item, ItemState.WAITING)
                self._again += 1

    def _hand_over(self, archive: SqlArchive, item: Item) -> bool:
        """Hand over one job and say whether the archive has it; raises what stops the round."""
        try:
            made = self._made(archive, item)
            receipt = archive.put(made)
        except OcmmError as error:
            if remedy_of(error) is Remedy.RETRY:
                raise
            self._outbox.settle(item, ItemState.ASIDE, str(error))
            return False
        self._outbox.settle(item, ItemState.SENT)
        self._outbox.note_contact(None, receipt.clock_off_s)
        return True

    def _made(self, archive: SqlArchive, item: Item) -> Delivery:
        sender = sender_of(self._outbox, self._station)
        content = self._outbox.content(item)
        try:
            made = self._extract(content, item.name, sender.station, None)
            # What other stations have sent of it says nothing of this file: readers judge both.
            known = archive.heads(made.record.job.job_uuid, sender.station)
            if known:
                made = self._extract(content, item.name, sender.station, known)
        except OcmmError:
            raise
        except Exception as error:
            # A job that breaks the program must not keep the others from being handed over.
            raise contained(error, f"The reading of {item.name}") from error
        claim = delivery_claim(sender.outbox, item.sequence, made.record.job.sha256)
        return Delivery(
            sender=sender,
            signature=_signature(Signed.DELIVERY, claim).value,
            sequence=item.sequence,
            sent_utc=datetime.now(UTC).isoformat(timespec="milliseconds"),
            record=made.record,
            content=made.content,
        )


class BackOff:
    """Pauses between tries: twice as long after each failure, and never all stations at once.

    Parameters
    ----------
    rng
        Draws a part of each pause.
    """

    def __init__(self, rng: random.Random) -> None:
        self._rng = rng
        self._failures = 0

    def good(self) -> None:
        """Begin anew with the shortest pause."""
        self._failures = 0

    def next_s(self) -> float:
        """Return how long to wait after another failure, s."""
        longest = min(FIRST_PAUSE_S * 2.0**self._failures, LONGEST_PAUSE_S)
        self._failures = min(self._failures + 1, 30)
        return longest * self._rng.uniform(0.5, 1.0)


def _shown(text: str) -> str:
    return shown_text(text, "")[:100]
