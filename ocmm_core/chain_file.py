"""A file of JSON lines that only grows, where every line is bound to the one before by a hash.

Each line is on the disk before `ChainFile.append` returns. Any line that is not as it was written
makes the whole file unusable, because nobody could say what is missing. A last line without its end
was being written when the power went: nobody was told of it, and it is left out and told
(`ChainFile.torn`). That a line was cut by somebody does not show in the file itself. So this
station remembers how far it went (`seals`): a file that holds less than it did was cut. Who keeps
a seal of its own beside the file (`calibration.records`) does not need that.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from ocmm_core.documents import read_bytes
from ocmm_core.errors import StorageError
from ocmm_core.host import HOST
from ocmm_core.seals import Seen, recall, remember
from ocmm_core.side_files import open_guarded

T = TypeVar("T", bound=msgspec.Struct)

_FIRST_LINK = "0" * 64
_PATIENCE_S = 4.0


class _Line(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    number: int
    previous: str
    item: msgspec.Raw
    sha256: str


class ChainFile(Generic[T]):
    """The file, open for reading and growing; whoever reads an old end writes nothing.

    Parameters
    ----------
    path
        Made, with its folder, at the first append.
    kind
        What every line holds.
    remembered
        This station remembers how far it goes.
    known
        What was read of this file before: lines that are still those bytes are not decoded again,
        so that reading on costs what came since.

    Raises
    ------
    StorageError
        A line is not as it was written, or holds something else, or lines are missing at the end.

    Attributes
    ----------
    path
        Where it is.
    items
        What the lines hold, oldest first.
    links
        The hash that ends each line, oldest first.
    torn
        Behind the last line stands the beginning of another one.
    """

    def __init__(
        self,
        path: Path,
        kind: type[T],
        *,
        remembered: bool = False,
        known: ChainFile[T] | None = None,
    ) -> None:
        self.path = path
        self._remembered = remembered
        self.items: tuple[T, ...] = ()
        self.links: tuple[str, ...] = ()
        self.torn = False
        self._length = self._size = 0
        self._disk_failed = False
        self._digest = hashlib.sha256()
        if not os.path.lexists(path):
            return
        whole = read_bytes(path, follow=False)
        content = whole[: whole.rfind(b"\n") + 1]
        links: list[str] = []
        items: list[T] = []
        begin = 0
        on = None if known is None else known.begins(content)
        if known is not None and on is not None:
            links, items = list(known.links), list(known.items)
            begin, self._digest = on
        lines = content[begin:].splitlines(keepends=True)
        for number, text in enumerate(lines, start=len(links) + 1):
            try:
                line = msgspec.json.decode(text, type=_Line)
                item = msgspec.json.decode(line.item, type=kind)
            except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
                raise _broken(path, number) from error
            # The bytes as they stand: a line of an earlier version lacks what has come since.
            if text != _encode(number, links[-1] if links else _FIRST_LINK, bytes(line.item)):
                raise _broken(path, number)
            links.append(line.sha256)
            items.append(item)
        self.items = tuple(items)
        self.links = tuple(links)
        self.torn = len(whole) != len(content)
        self._digest.update(memoryview(content)[begin:])
        self._length, self._size = len(content), len(whole)
        if remembered and links:
            _require_all(path, links)

    @property
    def _link(self) -> str:
        return self.links[-1] if self.links else _FIRST_LINK

    def begins(self, content: bytes) -> tuple[int, hashlib._Hash] | None:
        """Return the length and the hash of this chain where a content begins with it."""
        begin = hashlib.sha256(memoryview(content)[: self._length])
        return (self._length, begin) if begin.digest() == self._digest.digest() else None

    def link_with(self, item: T) -> str:
        """Return the hash that the next line would end with if it held ``item``."""
        return _link_of(len(self.items) + 1, self._link, msgspec.json.encode(item))

    def append(self, item: T) -> None:
        """Add a line and return when it is on the disk.

        Raises
        ------
        StorageError
            It could not be written, or another program has written meanwhile; the file holds what
            it held before. After a sync that failed it is not written again: that might seem to
            succeed.
        """
        if self._disk_failed:
            raise _given_up(self.path)
        link = self.link_with(item)
        content = _encode(len(self.items) + 1, self._link, msgspec.json.encode(item))
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            descriptor = open_guarded(
                self.path, follow=False, flags=os.O_WRONLY | os.O_CREAT, mode=0o644
            )
            try:
                # Two that read the same end would each write a line there.
                _lock(self.path, descriptor)
                if os.fstat(descriptor).st_size not in (self._size, self._length):
                    raise _elsewhere(self.path)
                # What a failed or torn append may have left behind goes first.
                os.ftruncate(descriptor, self._length)
                if HOST.write_at(descriptor, content, self._length) != len(content):
                    raise OSError(0, "only a part was written")
                try:
                    os.fsync(descriptor)
                except OSError as error:
                    self._disk_failed = True
                    with contextlib.suppress(OSError):
                        os.ftruncate(descriptor, self._length)
                    raise _given_up(self.path) from error
            finally:
                os.close(descriptor)
        except OSError as error:
            with contextlib.suppress(OSError):
                self._size = self.path.stat().st_size
            raise StorageError(
                "chain.unwritable",
                f"{self.path}: a line could not be stored ({error.strerror}).",
                "Free disk space or restore write permission, then repeat.",
            ) from error
        self._length += len(content)
        self._digest.update(content)
        self._size = self._length
        self.torn = False
        self.links = (*self.links, link)
        self.items = (*self.items, item)
        if self._remembered:
            name, place = _name(self.links), str(self.path.resolve())
            remember(Seen(name=name, count=len(self.links), link=link, place=place))


def _encode(number: int, previous: str, item: bytes) -> bytes:
    line = _Line(number, previous, msgspec.Raw(item), _link_of(number, previous, item))
    return msgspec.json.encode(line) + b"\n"


def _link_of(number: int, previous: str, item: bytes) -> str:
    return hashlib.sha256(b"%d %s " % (number, previous.encode()) + item).hexdigest()


def _lock(path: Path, descriptor: int) -> None:
    """Lock a chain; StorageError if another program keeps it for seconds."""
    end = time.monotonic() + _PATIENCE_S
    while True:
        try:
            return HOST.lock(descriptor)
        except BlockingIOError as error:
            if time.monotonic() > end:
                raise StorageError(
                    "chain.locked",
                    f"{path}: another program keeps this file locked.",
                    "Close it there and repeat.",
                ) from error
            time.sleep(0.01)


def _elsewhere(path: Path) -> StorageError:
    return StorageError(
        "chain.elsewhere",
        f"{path}: another program has written to this file meanwhile.",
        "Close the other one, then open this again.",
    )


def _name(links: Sequence[str]) -> str:
    """Return what a chain is remembered by: its first line is like no other's."""
    return f"chain {links[0]}"


def _require_all(path: Path, links: Sequence[str]) -> None:
    seen = recall(_name(links))
    if seen is None or (len(links) >= seen.count and links[seen.count - 1] == seen.link):
        return
    raise StorageError(
        "chain.cut",
        f"{path}: line {seen.count}, which this computer has seen, is missing or another one.",
        "Restore the newest copy of the file. If there is none, start a new one.",
    )


def _given_up(path: Path) -> StorageError:
    return StorageError(
        "chain.disk",
        f"{path}: the disk failed and the last line was not stored; everything before it is.",
        "Check the disk, open the job again and repeat.",
    )


def _broken(path: Path, number: int) -> StorageError:
    return StorageError(
        "chain.broken",
        f"{path}: line {number} was changed after it was written.",
        "Restore the file from a backup; it is not used in this state.",
    )
