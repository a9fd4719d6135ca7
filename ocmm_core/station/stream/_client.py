"""One client of the live stream: what it said, what waits for it, and how far it has come."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field

from ocmm_core.station.stream._log import StreamLog

LONGEST_REQUEST = 4096
MOST_CHATTER = 65536
"""Bytes that a client may say behind its request, where it has nothing to say."""
REQUEST_TIMEOUT_S = 10.0
STALLED_S = 60.0
"""A client that takes nothing for so long is cut off; it may resume."""
MOST_WAITING = 65536
"""Bytes that wait for one client; more are made only when it has read."""


@dataclass(slots=True, eq=False)
class StreamClient:
    """A connection, never waited for."""

    address: str
    since_s: float
    moved_s: float
    """`since_s`, `moved_s`: When it came, and when it last took something or had nothing to take
    (monotonic)."""
    transport: asyncio.Transport | None = None
    """None while it has not shaken hands."""
    heard: bytearray = field(default_factory=bytearray)
    """What it said before its request was whole."""
    said: int = 0
    """Bytes that it said behind its request."""
    begun: bool = False
    ending: bool = False
    """`begun`, `ending`: It gets messages; its last one waits."""
    poses: bool = True
    """It wants poses."""
    next_seq: int = 1
    """Number of the next message that it gets."""
    told_state: int = 0
    """Which change of the state it was told last; 0 for none."""
    told_verdict: int = 0
    """Which verdict it was told last; 0 for none."""
    _waited: int = 0

    @property
    def listens(self) -> bool:
        """Return whether it gets messages."""
        return self.begun and not self.ending

    @property
    def waiting(self) -> int:
        """Return how many bytes wait for it in this program."""
        return 0 if self.transport is None else self.transport.get_write_buffer_size()

    @property
    def has_room(self) -> bool:
        """Return whether more may be made for it."""
        return self.waiting < MOST_WAITING

    def fill(self, log: StreamLog) -> None:
        """Give it what it has not had yet and has room for; OSError where that cannot be read."""
        while self.has_room and self.next_seq <= len(log):
            lines, self.next_seq = log.read(self.next_seq)
            self.write(lines)

    def write(self, lines: bytes) -> None:
        """Give it lines as soon as it takes them."""
        if self.transport is not None:
            self.transport.write(lines)

    def hear(self, said: bytes) -> bytes | None:
        """Take in what it says; return its request once that is whole, else None."""
        if self.begun or self.ending:
            self.said += len(said)
            return None
        self.heard += said[: LONGEST_REQUEST + 1]
        line, newline, _ = self.heard.partition(b"\n")
        return bytes(line) if newline else None

    def note_movement(self, now: float) -> None:
        """Keep when it took something, or had nothing to take."""
        waiting = self.waiting
        if waiting == 0 or waiting < self._waited:
            self.moved_s = now
        self._waited = waiting

    def is_silent(self, now: float) -> bool:
        """Return whether it did not say in time what it wants."""
        return not self.begun and not self.ending and now - self.since_s > REQUEST_TIMEOUT_S

    def is_stalled(self, now: float) -> bool:
        """Return whether it takes nothing any more."""
        return now - self.moved_s > STALLED_S
