"""A server with the protocol of PostgreSQL and arbitrary answers.

Messages and their order: PostgreSQL 15, chapter 55 (frontend/backend protocol).
"""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from ocmm_shop.archive.stores import VERSION

BOOL, INT8, TEXT, FLOAT8, DATE = 16, 20, 25, 701, 1082
_SSL, _GSS = 80877103, 80877104
_WORDS = {
    "server_version": "15.0", "server_encoding": "UTF8", "client_encoding": "UTF8",
    "DateStyle": "ISO, MDY", "integer_datetimes": "on", "standard_conforming_strings": "on",
    "TimeZone": "UTC",
}  # fmt: skip

Pieces = Iterator[bytes]
Lie = Callable[[str], Pieces | None]
"""Returns the pieces sent as the answer to a statement; None: the answer of an empty archive."""


def message(kind: bytes, content: bytes = b"") -> bytes:
    return kind + struct.pack("!i", len(content) + 4) + content


def columns(*kinds: int, binary: bool) -> bytes:
    described = b"".join(
        b"c\0" + struct.pack("!ihihih", 0, 0, kind, -1, -1, int(binary)) for kind in kinds
    )
    return message(b"T", struct.pack("!h", len(kinds)) + described)


def row(*cells: bytes) -> bytes:
    return message(
        b"D",
        struct.pack("!h", len(cells))
        + b"".join(struct.pack("!i", len(cell)) + cell for cell in cells),
    )


def answer(kinds: Sequence[int], *rows: Sequence[bytes], binary: bool = True) -> Pieces:
    """Give an answer with rows whose cells are bytes already."""
    yield columns(*kinds, binary=binary)
    for one in rows:
        yield row(*one)
    yield done("SELECT")


def done(tag: str) -> bytes:
    return message(b"C", tag.encode() + b"\0")


def whole(number: int) -> bytes:
    return struct.pack("!q", number)


class FalseServer:
    """Listen on a socket in a folder.

    Parameters
    ----------
    folder
        Short, and empty.
    lie
        Its answers.
    pause_s
        Between any two bytes.
    """

    def __init__(self, folder: Path, lie: Lie, *, pause_s: float = 0.0) -> None:
        self.address = f"postgresql:///shop?host={folder}&user=station"
        self.asked: list[str] = []
        self._lie, self._pause_s = lie, pause_s
        self._ended = threading.Event()
        self._connections: list[socket.socket] = []
        self._threads: list[threading.Thread] = []
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(str(folder / ".s.PGSQL.5432"))
        self._listener.listen()
        self._begin(self._accept)

    def close(self) -> None:
        self._ended.set()
        for one in (self._listener, *self._connections):
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()
        for thread in self._threads:
            thread.join()

    def _begin(self, run: Callable[..., None], *given: socket.socket) -> None:
        thread = threading.Thread(target=run, args=given, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                connection, _ = self._listener.accept()
                self._connections.append(connection)
                self._begin(self._serve, connection)

    def _serve(self, connection: socket.socket) -> None:
        with contextlib.suppress(OSError, EOFError, struct.error):
            while struct.unpack("!i", self._read(connection)[:4])[0] in (_SSL, _GSS):
                connection.sendall(b"N")
            self._send(connection, message(b"R", struct.pack("!i", 0)))
            for name, value in _WORDS.items():
                self._send(connection, message(b"S", f"{name}\0{value}\0".encode()))
            self._send(connection, message(b"K", bytes(8)) + message(b"Z", b"I"))
            self._answer_all(connection)

    def _answer_all(self, connection: socket.socket) -> None:
        state, sql = b"I", ""
        while True:
            kind = _exactly(connection, 1)
            content = self._read(connection)
            if kind == b"Q":
                sql = content.rstrip(b"\0").decode()
            elif kind == b"P":
                sql = content.split(b"\0")[1].decode()
                self._send(connection, message(b"1"))
                continue
            elif kind == b"B":
                self._send(connection, message(b"2"))
                continue
            elif kind == b"X":
                return
            elif kind == b"S":
                self._send(connection, message(b"Z", state))
                continue
            elif kind != b"E":
                continue
            self.asked.append(sql)
            word = sql.split(None, 1)[0].upper() if sql.strip() else ""
            state = {b"BEGIN": b"T", b"COMMIT": b"I", b"ROLLBACK": b"I"}.get(word.encode(), state)
            for piece in self._lie(sql) or honest(sql, word, binary=kind == b"E"):
                self._send(connection, piece)
            if kind == b"Q":
                self._send(connection, message(b"Z", state))

    def _send(self, connection: socket.socket, content: bytes) -> None:
        if not self._pause_s:
            connection.sendall(content)
            return
        for place in range(len(content)):
            if self._ended.wait(self._pause_s):
                return
            connection.sendall(content[place : place + 1])

    def _read(self, connection: socket.socket) -> bytes:
        (size,) = struct.unpack("!i", _exactly(connection, 4))
        return _exactly(connection, size - 4)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def honest(sql: str, word: str, *, binary: bool) -> Pieces:
    """Return the answers of an empty archive."""
    if "to_regclass" in sql:
        return answer([BOOL], [b"t"], binary=False)
    if "max(version)" in sql:
        return answer([INT8], [str(VERSION).encode()], binary=False)
    if "max(CAST(sequence" in sql:
        return answer([INT8], [whole(0) if binary else b"0"], binary=binary)
    if "to_char(clock" in sql:
        return answer([TEXT], [b"2026-11-26T12:00:00.000+00:00"], binary=False)
    return answer([TEXT]) if word == "SELECT" else iter([done(word)])


def _exactly(connection: socket.socket, size: int) -> bytes:
    found = b""
    while len(found) < size:
        piece = connection.recv(size - len(found))
        if not piece:
            raise EOFError
        found += piece
    return found
