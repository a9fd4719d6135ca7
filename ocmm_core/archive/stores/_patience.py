"""An end to waiting for a server that keeps the connection and says nothing, or never ends.

Timeouts of the server need a server that looks at its clock, and those of TCP end when the other
system acknowledges, whatever hangs there. libpq keeps all that comes as one answer, however much,
also to a statement that has none. So a thread of our own closes the connection.
"""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from enum import Enum
from typing import Self

from ocmm_core.host import HOST

_LOOK_S = 0.1
"""How often is looked at what an answer takes; most are there sooner."""


class GaveUp(Enum):
    """Why a connection was shut."""

    SILENT = "silent"
    FLOODED = "flooded"


class Patience:
    """Shut a connection where one wait lasts too long; each wait is a ``with``.

    Parameters
    ----------
    limit_s
        How long a wait may last.
    limit_bytes
        How much this process may grow meanwhile.
    """

    def __init__(self, descriptor: int, limit_s: float, limit_bytes: int) -> None:
        self.gave_up: GaveUp | None = None
        self._limit_s, self._limit_bytes = limit_s, limit_bytes
        self._until, self._had = 0.0, -1
        # A descriptor of its own: that of the connection may belong to something else by then.
        self._socket = socket.socket(fileno=socket.dup(descriptor))
        self._changed = threading.Condition()
        self._waits = self._ended = False
        self._thread = threading.Thread(target=self._watch, name="patience", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End; may be called twice."""
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._thread.join()
        self._socket.close()

    def __enter__(self) -> Self:
        """Begin to wait."""
        with self._changed:
            self._waits = True
            self._until, self._had = time.monotonic() + self._limit_s, -1
            self._changed.notify()
        return self

    def __exit__(self, *_: object) -> None:
        """Something was answered."""
        with self._changed:
            self._waits = False
            self._changed.notify()

    def _watch(self) -> None:
        with self._changed:
            while not self._ended:
                if not self._waits:
                    self._changed.wait()
                    continue
                left = self._until - time.monotonic()
                if not self._changed.wait(max(min(left, _LOOK_S), 0.0)) and self._waits:
                    self._look()

    def _look(self) -> None:
        has = HOST.resident_bytes()
        self._had = has if self._had < 0 else self._had
        if has - self._had > self._limit_bytes:
            self.gave_up = GaveUp.FLOODED
        elif time.monotonic() >= self._until:
            self.gave_up = GaveUp.SILENT
        else:
            return
        self._waits = False
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
