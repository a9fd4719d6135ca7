"""A file of JSON lines that only grows, where every line is bound to the one before by a hash.

Each line is on the disk before `ChainFile.append` returns. A last line without its end was being
written when the power went: nobody was told of it, and it is left out. Any other line that is not
as it was written makes the whole file unusable, because nobody could say what is missing. Cutting
off whole lines at the end does not show in the file itself: `ChainFile.links` is for who keeps a
copy of the last hash elsewhere (`calibration.event_folder` does).
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from ocmm_core.documents import read_bytes
from ocmm_core.errors import StorageError

T = TypeVar("T", bound=msgspec.Struct)

_FIRST_LINK = "0" * 64


class _Line(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    number: int
    previous: str
    item: msgspec.Raw
    sha256: str


class ChainFile(Generic[T]):
    """The file, open for reading and growing; one process writes at a time.

    Parameters
    ----------
    path
        Made, with its folder, at the first append.
    kind
        What every line holds.

    Raises
    ------
    StorageError
        A line is not as it was written, or holds something else.

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

    def __init__(self, path: Path, kind: type[T]) -> None:
        self.path = path
        self.items: tuple[T, ...] = ()
        self.links: tuple[str, ...] = ()
        self.torn = False
        self._length = 0
        if not path.exists():
            return
        whole = read_bytes(path)
        content = whole[: whole.rfind(b"\n") + 1]
        links: list[str] = []
        items: list[T] = []
        for number, text in enumerate(content.splitlines(keepends=True), start=1):
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
        self._length = len(content)

    @property
    def _link(self) -> str:
        return self.links[-1] if self.links else _FIRST_LINK

    def link_with(self, item: T) -> str:
        """Return the hash that the next line would end with if it held ``item``."""
        return _link_of(len(self.items) + 1, self._link, msgspec.json.encode(item))

    def append(self, item: T) -> None:
        """Add a line and return when it is on the disk.

        Raises
        ------
        StorageError
            It could not be written; the file holds what it held before.
        """
        link = self.link_with(item)
        content = _encode(len(self.items) + 1, self._link, msgspec.json.encode(item))
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(self.path, os.O_WRONLY | os.O_CREAT, 0o644)
            try:
                # What a failed or torn append may have left behind goes first.
                os.ftruncate(descriptor, self._length)
                if os.pwrite(descriptor, content, self._length) != len(content):
                    raise OSError(0, "only a part was written")
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
        except OSError as error:
            raise StorageError(
                "chain.unwritable",
                f"{self.path}: a line could not be stored ({error.strerror}).",
                "Free disk space or restore write permission, then repeat.",
            ) from error
        self._length += len(content)
        self.torn = False
        self.links = (*self.links, link)
        self.items = (*self.items, item)


def _encode(number: int, previous: str, item: bytes) -> bytes:
    line = _Line(number, previous, msgspec.Raw(item), _link_of(number, previous, item))
    return msgspec.json.encode(line) + b"\n"


def _link_of(number: int, previous: str, item: bytes) -> str:
    return hashlib.sha256(b"%d %s " % (number, previous.encode()) + item).hexdigest()


def _broken(path: Path, number: int) -> StorageError:
    return StorageError(
        "chain.broken",
        f"{path}: line {number} was changed after it was written.",
        "Restore the file from a backup; it is not used in this state.",
    )
