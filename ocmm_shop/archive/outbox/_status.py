"""State of the upload in words, for the start page, the Archive page and the terminal."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from ocmm_shop.archive.outbox._outbox import Outbox
from ocmm_shop.archive.outbox._outbox_rows import ConnectionState, Item, ItemState
from ocmm_shop.archive.stores import CLOCK_TELL_S


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
