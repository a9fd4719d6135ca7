"""One client of the live stream: what it said, what waits for it, and how far it has come."""

from __future__ import annotations

import socket
import time
from dataclasses import dataclass, field

from ocmm_core.station.stream._log import StreamLog

LONGEST_REQUEST = 4096
REQUEST_TIMEOUT_S = 10.0
STALLED_S = 60.0
"""A client that takes nothing for so long is cut off; it may resume."""
MOST_WAITING = 65536
"""Bytes that wait for one client; more are made only when it has read."""


@dataclass(slots=True, eq=False)
class StreamClient:
    """A connection, never waited for.

    Attributes
    ----------
    connection
        Does not block.
    since_s, moved_s
        When it came, and when it last took something or had nothing to take (monotonic).
    heard, waiting
        What it said before its request was whole, and what it has not taken yet.
    begun, ending
        It gets messages; its last one waits.
    poses
        It wants poses.
    next_seq
        Number of the next message that it gets.
    told_state
        Which change of the state it was told last; 0 for none.
    told_verdict
        Which verdict it was told last; 0 for none.
    """

    connection: socket.socket
    since_s: float
    moved_s: float
    heard: bytearray = field(default_factory=bytearray)
    waiting: bytearray = field(default_factory=bytearray)
    begun: bool = False
    ending: bool = False
    poses: bool = True
    next_seq: int = 1
    told_state: int = 0
    told_verdict: int = 0

    @property
    def listens(self) -> bool:
        """Return whether it gets messages."""
        return self.begun and not self.ending

    @property
    def has_room(self) -> bool:
        """Return whether more may be made for it."""
        return len(self.waiting) < MOST_WAITING

    def fill(self, log: StreamLog) -> None:
        """Put what it has not had yet behind what waits; OSError where that cannot be read."""
        while self.has_room and self.next_seq <= len(log):
            lines, self.next_seq = log.read(self.next_seq)
            self.waiting += lines

    def write(self) -> None:
        """Give it as much as it takes now; OSError where it is gone."""
        try:
            sent = self.connection.send(self.waiting)
        except BlockingIOError:
            return
        if sent:
            del self.waiting[:sent]
            self.moved_s = time.monotonic()

    def is_silent(self, now: float) -> bool:
        """Return whether it did not say in time what it wants."""
        return not self.begun and now - self.since_s > REQUEST_TIMEOUT_S

    def is_stalled(self, now: float) -> bool:
        """Return whether it takes nothing any more."""
        return now - self.moved_s > STALLED_S
