"""A file of JSON lines that only grows, where every line is bound to the one before by a hash.

Each line is on the disk before `ChainFile.append` returns. A last line without its end was being
written when the power went: nobody was told of it, and it is left out. Any other line that is not
as it was written makes the whole file unusable, because nobody could say what is missing. Cutting
off whole lines at the end is not noticed; a copy of the last hash elsewhere would show it.
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
    """

    def __init__(self, path: Path, kind: type[T]) -> None:
        self.path = path
        self.items: tuple[T, ...] = ()
        self._link = _FIRST_LINK
        self._length = 0
        if not path.exists():
            return
        content = read_bytes(path)
        content = content[: content.rfind(b"\n") + 1]
        items: list[T] = []
        for number, text in enumerate(content.splitlines(keepends=True), start=1):
            try:
                line = msgspec.json.decode(text, type=_Line)
                item = msgspec.json.decode(line.item, type=kind)
            except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
                raise _broken(path, number) from error
            if text != _encode(number, self._link, item):
                raise _broken(path, number)
            self._link = line.sha256
            items.append(item)
        self.items = tuple(items)
        self._length = len(content)

    def is_current(self) -> bool:
        """Return whether the file is as long as it was when it was read or written last."""
        return (self.path.stat().st_size if self.path.exists() else 0) == self._length

    def append(self, item: T) -> None:
        """Add a line and return when it is on the disk.

        Raises
        ------
        StorageError
            It could not be written; the file holds what it held before.
        """
        content = _encode(len(self.items) + 1, self._link, item)
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
                "Free the disk or restore the right to write, then do it again.",
            ) from error
        self._link = msgspec.json.decode(content, type=_Line).sha256
        self._length += len(content)
        self.items = (*self.items, item)


def _encode(number: int, previous: str, item: msgspec.Struct) -> bytes:
    content = msgspec.json.encode(item)
    link = hashlib.sha256(b"%d %s " % (number, previous.encode()) + content).hexdigest()
    return msgspec.json.encode(_Line(number, previous, msgspec.Raw(content), link)) + b"\n"


def _broken(path: Path, number: int) -> StorageError:
    return StorageError(
        "chain.broken",
        f"{path}: line {number} is not as it was written.",
        "Restore the file from a backup; it is not used as it is.",
    )
