"""One client of the live stream: its request, its buffer, and its position."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field

from ocmm_core.station.stream._log import StreamLog

LONGEST_REQUEST = 4096
MOST_CHATTER = 65536
"""Bytes tolerated after its request, which should be none."""
REQUEST_TIMEOUT_S = 10.0
STALLED_S = 60.0
"""s: a client that reads nothing for as long is disconnected; it may resume."""
MOST_WAITING = 65536
"""Limit of bytes buffered for one client."""


@dataclass(slots=True, eq=False)
class StreamClient:
    """A connection, never waited for."""

    address: str
    since_s: float
    moved_s: float
    """`since_s`, `moved_s`: connected; last read, or nothing to read (monotonic)."""
    transport: asyncio.Transport | None = None
    """None before the handshake."""
    heard: bytearray = field(default_factory=bytearray)
    """Received bytes of an incomplete request."""
    said: int = 0
    """Bytes received after its request."""
    begun: bool = False
    ending: bool = False
    """`begun`, `ending`: It gets messages; its last one is queued."""
    poses: bool = True
    next_seq: int = 1
    told_state: int = 0
    """Last state change sent; 0 for none."""
    told_verdict: int = 0
    """Last verdict sent; 0 for none."""
    _waited: int = 0

    @property
    def listens(self) -> bool:
        return self.begun and not self.ending

    @property
    def waiting(self) -> int:
        """Return the number of bytes in its buffer."""
        return 0 if self.transport is None else self.transport.get_write_buffer_size()

    @property
    def has_room(self) -> bool:
        return self.waiting < MOST_WAITING

    def fill(self, log: StreamLog) -> None:
        """Send pending messages that fit into its buffer; OSError if they cannot be read."""
        while self.has_room and self.next_seq <= len(log):
            lines, self.next_seq = log.read(self.next_seq)
            self.write(lines)

    def write(self, lines: bytes) -> None:
        if self.transport is not None:
            self.transport.write(lines)

    def hear(self, said: bytes) -> bytes | None:
        """Process received bytes; return its request once complete, else None."""
        if self.begun or self.ending:
            self.said += len(said)
            return None
        self.heard += said[: LONGEST_REQUEST + 1]
        line, newline, _ = self.heard.partition(b"\n")
        return bytes(line) if newline else None

    def note_movement(self, now: float) -> None:
        """Note the time when it read something, or had nothing to read."""
        waiting = self.waiting
        if waiting == 0 or waiting < self._waited:
            self.moved_s = now
        self._waited = waiting

    def is_silent(self, now: float) -> bool:
        """Return whether its request is overdue."""
        return not self.begun and not self.ending and now - self.since_s > REQUEST_TIMEOUT_S

    def is_stalled(self, now: float) -> bool:
        """Return whether it has stopped reading."""
        return now - self.moved_s > STALLED_S
