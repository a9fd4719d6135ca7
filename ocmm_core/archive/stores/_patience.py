"""An end to waiting for a server that keeps the connection and says nothing.

Timeouts of the server need a server that looks at its clock, and those of TCP end when the other
system acknowledges, whatever hangs there. So a thread of our own closes the connection.
"""

from __future__ import annotations

import contextlib
import socket
import threading
from typing import Self


class Patience:
    """Shut a connection where one wait lasts too long; each wait is a ``with``.

    Parameters
    ----------
    descriptor
        Of the socket.
    limit_s
        How long a wait may last.
    """

    def __init__(self, descriptor: int, limit_s: float) -> None:
        self.ran_out = False
        self._limit_s = limit_s
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
                elif not self._changed.wait(self._limit_s) and self._waits:
                    self.ran_out = True
                    self._waits = False
                    with contextlib.suppress(OSError):
                        self._socket.shutdown(socket.SHUT_RDWR)
