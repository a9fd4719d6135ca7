"""Client of an I++ DME server, written from the published protocol; it checks all answers.

Each answer is parsed strictly and must come in a legal order: `&` first and once, results in the
order of the commands, nothing behind `%`. A violation is an `AssertionError` that shows the last
lines. The lines of a connection can be saved and replayed against another server.
"""

from __future__ import annotations

import re
import socket
import time
from collections import defaultdict, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tests.host import HANG_S
from tests.serve.ippdme_grammar import (
    Answer,
    AnswerError,
    Call,
    Dialect,
    GrammarError,
    Item,
    parse_answer,
)

FAST = re.compile(r"(AbortE|GetErrStatusE|GetPropE|OnMoveReportE)\b")
"""Commands of the fast queue."""


class ConnectionEndedError(ConnectionError):
    """The server closed the connection, or it broke."""


@dataclass(slots=True, eq=False)
class Transaction:
    tag: str
    text: str
    sent_s: float = 0.0
    acked: bool = False
    done: bool = False
    answered_s: float = 0.0
    """`sent_s`, `answered_s`: monotonic; the second of its first data line or error."""
    data: list[tuple[Item, ...]] = field(default_factory=list)
    errors: list[AnswerError] = field(default_factory=list)

    @property
    def numbers(self) -> list[int]:
        return [error.number for error in self.errors]

    @property
    def only(self) -> tuple[Item, ...]:
        """Return its only data line."""
        assert len(self.data) == 1, (self.text, self.data)
        assert not self.errors, (self.text, self.errors)
        return self.data[0]

    def values(self) -> dict[str, tuple[float, ...]]:
        """Return the numbers of its only data line by name."""
        return {item.name: item.numbers for item in self.only if isinstance(item, Call)}


class DmeClient:
    """One connection; a context manager. Every wait ends after `patience_s`."""

    def __init__(
        self, address: tuple[str, int], dialect: Dialect = "1.4", *, patience_s: float = HANG_S
    ) -> None:
        self.dialect: Dialect = dialect
        self.log: list[str] = []
        """Lines of both directions, `> ` and `< ` in front."""
        self.events: list[Answer] = []
        """Messages with the tag E0000, oldest first."""
        self.daemons: dict[str, list[Answer]] = {}
        self.at_each: Callable[[str], None] = lambda line: None
        """Receives each line of the server."""
        self._open: dict[str, Transaction] = {}
        self._number = self._event_number = 0
        self._buffer = bytearray()
        self._socket = socket.create_connection(address, timeout=patience_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def __enter__(self) -> DmeClient:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._socket.close()

    def break_off(self) -> None:
        """End the connection by a reset, as a client that was killed."""
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        self._socket.close()

    def next_tag(self, text: str) -> str:
        if FAST.match(text):
            self._event_number = self._event_number % 9999 + 1
            return f"E{self._event_number:04d}"
        # Long sessions use every tag again; a transaction that waits keeps its own.
        while True:
            self._number = self._number % 99_999 + 1
            tag = f"{self._number:05d}"
            if tag not in self._open:
                return tag

    def send(self, line: str | bytes) -> None:
        """Send a line as it is, with its line end."""
        said = line if isinstance(line, bytes) else line.encode("latin-1")
        self.log.append("> " + said.decode("latin-1"))
        try:
            self._socket.sendall(said + b"\r\n")
        except OSError as error:
            raise ConnectionEndedError(str(error)) from error

    def start(self, text: str, tag: str = "") -> Transaction:
        """Send a command without waiting."""
        made = Transaction(tag or self.next_tag(text), text, time.monotonic())
        assert made.tag not in self._open
        self._open[made.tag] = made
        self.send(f"{made.tag} {text}")
        return made

    def send_whole(self, line: bytes) -> AnswerError | None:
        """Send a line that may be unreadable; return the error of its answer.

        The answer is an error with the tag E0000 alone, or a transaction with the tag of the line.
        """
        before = len(self.events)
        made = Transaction(line[:5].decode("latin-1"), line[6:].decode("latin-1"))
        if re.fullmatch(r"\d{5}|E\d{4}", made.tag):
            self._open[made.tag] = made
        self.send(line)

        def unasked() -> list[AnswerError]:
            return [one.error for one in self.events[before:] if one.error is not None]

        self.pump(lambda: made.done or (not made.acked and unasked()))
        self._open.pop(made.tag, None)
        return next(iter(made.errors if made.done else unasked()), None)

    def call(self, text: str, tag: str = "") -> Transaction:
        """Send a command and wait for its end."""
        return self.finish(self.start(text, tag))

    def good(self, text: str) -> Transaction:
        """Send a command that must not fail."""
        done = self.call(text)
        assert done.errors == [], self._story(text)
        return done

    def acknowledged(self, made: Transaction) -> Transaction:
        self.pump(lambda: made.acked)
        return made

    def finish(self, made: Transaction) -> Transaction:
        self.pump(lambda: made.done)
        return made

    def pump(self, until: Callable[[], object]) -> None:
        """Read lines until a condition holds."""
        while not until():
            self._handle(self.line())

    def poll(self, seconds: float) -> None:
        """Read unsolicited messages for a time."""
        end = time.monotonic() + seconds
        patience = self._socket.gettimeout()
        try:
            while (left := end - time.monotonic()) > 0.0:
                self._socket.settimeout(left)
                try:
                    self._handle(self.line())
                except TimeoutError:
                    return
        finally:
            self._socket.settimeout(patience)

    def line(self) -> str:
        """Return the next line, unchecked but for its end."""
        while (end := self._buffer.find(b"\n")) < 0:
            try:
                more = self._socket.recv(65_536)
            except TimeoutError:
                raise
            except OSError as error:
                raise ConnectionEndedError(str(error)) from error
            if not more:
                raise ConnectionEndedError("closed by the server")
            self._buffer += more
        line = bytes(self._buffer[: end + 1])
        del self._buffer[: end + 1]
        assert line.endswith(b"\r\n"), self._story(repr(line))
        text = line[:-2].decode("latin-1")
        self.log.append("< " + text)
        self.at_each(text)
        return text

    def _handle(self, line: str) -> None:
        try:
            answer = parse_answer(line, self.dialect)
        except GrammarError as error:
            raise AssertionError(self._story(f"{line!r}: {error}")) from error
        if answer.tag == "E0000":
            self.events.append(answer)
            return
        made = self._open.get(answer.tag)
        if made is None:
            assert answer.tag in self.daemons, self._story(f"no transaction: {line}")
            assert answer.kind == "#", self._story(f"a daemon answers: {line}")
            self.daemons[answer.tag].append(answer)
            return
        if answer.kind == "&":
            assert not made.acked, self._story(f"acknowledged twice: {line}")
            made.acked = True
            return
        assert made.acked, self._story(f"not acknowledged: {line}")
        if not FAST.match(made.text):
            first = next(one for one in self._open.values() if not FAST.match(one.text))
            assert made is first, self._story(f"before its turn: {line}")
        if answer.kind == "%":
            made.done = True
            del self._open[made.tag]
            self._note_daemons(made)
            return
        made.answered_s = made.answered_s or time.monotonic()
        if answer.error is not None:
            made.errors.append(answer.error)
        else:
            made.data.append(answer.items)

    def _note_daemons(self, made: Transaction) -> None:
        if made.errors:
            return
        if made.text.startswith("OnMoveReportE"):
            self.daemons[made.tag] = []
        elif made.text.startswith(("StopAllDaemons", "EndSession", "StartSession")):
            self.daemons.clear()
        elif stopped := re.fullmatch(r"StopDaemon\((E\d{4})\)", made.text):
            # No line may follow.
            self.daemons.pop(stopped[1], None)

    def _story(self, what: str) -> str:
        return "\n".join([what, *self.log[-12:]])

    def save(self, path: Path) -> None:
        """Write the lines of this connection, for `replay`."""
        path.write_text("".join(line + "\n" for line in self.log), encoding="latin-1")


def replay(path: Path, address: tuple[str, int], dialect: Dialect = "1.4") -> list[str]:
    """Repeat a saved session; return the answers whose form differs from the recorded ones.

    Measured numbers may differ. Messages that came unasked are not compared.
    """
    different: list[str] = []
    ended: set[str] = set()
    with DmeClient(address, dialect) as client:
        came: dict[str, deque[str]] = defaultdict(deque)
        for entry in path.read_text(encoding="latin-1").splitlines():
            way, line = entry[:2], entry[2:]
            tag = line[:5]
            if way == "> ":
                client.send(line)
                ended.discard(tag)
            elif not (tag == "E0000" and line[6:7] == "#") and tag not in ended:
                while not came[tag]:
                    read = client.line()
                    came[read[:5]].append(read)
                read = came[tag].popleft()
                if form_of(read) != form_of(line):
                    different.append(f"{read}   recorded: {line}")
                if line[6:7] == "%":
                    # Lines of a daemon come when the probe moves.
                    ended.add(tag)
    return different


def form_of(line: str) -> str:
    """Return an answer without the values of measured numbers."""
    if '"' in line or "X(" not in line:
        return line
    return re.sub(r"[+-]?\d+\.?\d*(?:[eE][+-]?\d+)?", "0", line[7:])


@contextmanager
def session(address: tuple[str, int], dialect: Dialect = "1.4") -> Iterator[DmeClient]:
    """Open a session, and end it if the connection is still there."""
    with DmeClient(address, dialect) as client:
        client.good("StartSession()")
        yield client
        client.good("EndSession()")
