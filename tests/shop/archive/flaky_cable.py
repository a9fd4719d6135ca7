"""A cable between a station and the real server, which can be pulled or held."""

from __future__ import annotations

import contextlib
import socket
import threading
from pathlib import Path
from types import TracebackType
from typing import Self

_PIECE = 65536


class FlakyCable:
    """Pass on what goes to the socket of a server; that of this cable is in another folder.

    Parameters
    ----------
    folder
        Where its socket is; short, and empty.
    server
        Folder with the socket of the server.
    """

    def __init__(self, folder: Path, server: Path) -> None:
        self._target = str(server / ".s.PGSQL.5432")
        self.held = threading.Event()
        """While it is set nothing is passed on, without a message."""
        self._pairs: list[socket.socket] = []
        self._threads: list[threading.Thread] = []
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(str(folder / ".s.PGSQL.5432"))
        self._listener.listen()
        self._begin(self._accept)

    def pull(self) -> None:
        """Cut all connections and refuse new ones."""
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for one in self._pairs:
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """End all of it."""
        self.held.clear()
        self.pull()
        for thread in self._threads:
            thread.join()
        for one in self._pairs:
            one.close()

    def _begin(self, run: object, *given: socket.socket) -> None:
        thread = threading.Thread(target=run, args=given, daemon=True)  # type: ignore[arg-type]
        self._threads.append(thread)
        thread.start()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._listener.accept()
            except OSError:
                return
            far = socket.socket(socket.AF_UNIX)
            far.connect(self._target)
            self._pairs += [near, far]
            self._begin(self._pass_on, near, far)
            self._begin(self._pass_on, far, near)

    def _pass_on(self, source: socket.socket, target: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while piece := source.recv(_PIECE):
                while self.held.is_set():
                    if source.fileno() < 0 or self._listener.fileno() < 0:
                        return
                    threading.Event().wait(0.02)
                target.sendall(piece)
        with contextlib.suppress(OSError):
            target.shutdown(socket.SHUT_RDWR)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
