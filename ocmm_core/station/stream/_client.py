"""One client of the live stream: its request, its buffer, and its position.

Messages are numbered, complete and in order, for late clients. The latest lines are in memory,
older ones in an unnamed file that vanishes with the program, so that memory is bounded. If that
cannot be written, they stay in memory.
"""

from __future__ import annotations

import asyncio
import logging
import tempfile
import threading
from array import array
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

_log = logging.getLogger(__name__)

IN_MEMORY = 1024
"""Number of latest lines in memory."""
BLOCK = 64
"""Block size for finding and reading older lines."""


class StreamLog:
    """Lines by sequence number, from 1; thread-safe. Older lines are in a file in `folder`."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._latest: deque[bytes] = deque()
        self._file: IO[bytes] | None = None
        self._starts = array("Q")
        """Offset of every block in the file: eight bytes for 64 messages."""
        self._filed = 0
        self._filed_bytes = 0
        self._file_failed = False
        self._lock = threading.Lock()

    def __len__(self) -> int:
        """Return the number of the latest line."""
        with self._lock:
            return self._filed + len(self._latest)

    @property
    def in_memory(self) -> int:
        """Return how many lines are in memory; for tests."""
        with self._lock:
            return len(self._latest)

    def append(self, line: Callable[[int], bytes]) -> None:
        """Append the line that ``line`` makes of its number; it ends with its only line feed."""
        with self._lock:
            self._latest.append(line(self._filed + len(self._latest) + 1))
            while len(self._latest) > IN_MEMORY and self._put_away(self._latest[0]):
                self._latest.popleft()

    def read(self, number: int) -> tuple[bytes, int]:
        """Return lines from ``number`` on, at most `BLOCK`, and the next number; OSError."""
        with self._lock:
            if number > self._filed:
                first = number - self._filed - 1
                lines = [
                    self._latest[index]
                    for index in range(first, min(first + BLOCK, len(self._latest)))
                ]
            else:
                lines = self._read_block((number - 1) // BLOCK)[(number - 1) % BLOCK :]
        return b"".join(lines), number + len(lines)

    def close(self) -> None:
        with self._lock:
            if self._file is not None:
                self._file.close()
                self._file = None

    def _put_away(self, line: bytes) -> bool:
        """Append a line to the file; return whether that succeeded."""
        if self._file_failed:
            return False
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(buffering=0, dir=self._folder)  # noqa: SIM115 - ends in `close`
            self._file.seek(self._filed_bytes)
            if self._file.write(line) != len(line):
                raise OSError("the disk is full")
        except OSError as error:
            self._file_failed = True
            _log.warning("Older lines of the stream stay in memory: %s.", error)
            return False
        if self._filed % BLOCK == 0:
            self._starts.append(self._filed_bytes)
        self._filed += 1
        self._filed_bytes += len(line)
        return True

    def _read_block(self, block: int) -> list[bytes]:
        if self._file is None:
            raise OSError("the file of older lines was closed")
        last = block + 1 == len(self._starts)
        end = self._filed_bytes if last else self._starts[block + 1]
        self._file.seek(self._starts[block])
        return self._file.read(end - self._starts[block]).splitlines(keepends=True)


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
