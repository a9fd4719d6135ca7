"""Append-only file of JSON lines, each bound to the previous one by a hash.

Each line is on the disk before `ChainFile.append` returns. A changed line makes the file unusable;
an incomplete last line was never acknowledged and is left out (`ChainFile.torn`). The station
remembers the end (`seals`), because removed lines do not show. A chain with a kind (`Signed`) has a
signature on the hash of each line; histories (`calibration.records`) have a seal instead.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import time
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from ocmm_core import seals
from ocmm_core.documents import read_bytes
from ocmm_core.errors import StorageError
from ocmm_core.host import HOST
from ocmm_core.named_file import NamedFile, write_rescued
from ocmm_core.side_files import open_guarded

T = TypeVar("T", bound=msgspec.Struct)

USE_ITS_OWN = "Use the command for files of its kind, or the version that wrote it."
_FIRST_LINK = "0" * 64
_PATIENCE_S = 4.0


class _Line(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    number: int
    previous: str
    item: msgspec.Raw
    sha256: str
    signature: seals.Signature | None = None


class ChainFile(Generic[T]):
    """An open chain.

    ``path``: made at the first append; ``kind``: type of every line; ``signed``: kind of content,
    None without signatures; ``remembered``: this station remembers its end; ``known``: an earlier
    reading, whose lines are not decoded again. StorageError if a line or signature was changed, or
    lines are missing at the end.
    """

    def __init__(
        self,
        path: Path,
        kind: type[T],
        *,
        signed: seals.Signed | None = None,
        remembered: bool = False,
        known: ChainFile[T] | None = None,
    ) -> None:
        self.path = path
        self._signed, self._remembered = signed, remembered
        self._key: seals.StationKey | None = None
        self._signatures: tuple[seals.Signature | None, ...] = ()
        self._end = _FIRST_LINK
        self.items: tuple[T, ...] = ()
        """Contents of the lines, oldest first."""
        self.links: tuple[str, ...] = ()
        """The hash that ends each line."""
        self.signer = seals.SealState(seals.SealWord.NOT_SIGNED)
        """The state of the whole chain: of its last line, if the first is signed as well."""
        self.torn = False
        """The last line is followed by the beginning of another one."""
        self._length = self._size = 0
        self._disk_failed = False
        self._digest = hashlib.sha256()
        self._pieces: list[bytes] = []
        self._name: NamedFile | None = None
        self._lost: StorageError | None = None
        if not os.path.lexists(path):
            return
        self._load(kind, known)
        if not (remembered and self.links):
            return
        seen = seals.recall(_name(self.links))
        if seen is not None and not seen.holds_in(self.links):
            # Another program may have appended: what it remembered before this reading is there.
            self._load(kind, None)
        self._require_all(seen)

    def _load(self, kind: type[T], known: ChainFile[T] | None) -> None:
        self._end, self._digest = _FIRST_LINK, hashlib.sha256()
        whole = read_bytes(self.path, follow=False)
        self._name = NamedFile(self.path)
        content = whole[: whole.rfind(b"\n") + 1]
        links: list[str] = []
        items: list[T] = []
        signatures: list[seals.Signature | None] = []
        begin = 0
        on = None if known is None or self._signed is not None else known.begins(content)
        if known is not None and on is not None:
            links, items = list(known.links), list(known.items)
            self._end = links[-1] if links else _FIRST_LINK
            begin, self._digest = on
        lines = content[begin:].splitlines(keepends=True)
        for number, text in enumerate(lines, start=len(links) + 1):
            try:
                line = msgspec.json.decode(text, type=_Line)
            except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
                raise _broken(self.path, number) from error
            # Compare bytes: a line of an earlier version lacks newer fields of the item.
            signature = None if self._signed is None else line.signature
            if text != _encode(_line(number, self._end, bytes(line.item), signature)):
                raise _broken(self.path, number)
            try:
                item = msgspec.json.decode(line.item, type=kind)
            except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
                raise StorageError(
                    "chain.kind",
                    f"{self.path}: line {number} is of another kind of file, or of a later "
                    "version.",
                    USE_ITS_OWN,
                ) from error
            self._end = _end_of(line)
            signatures.append(signature)
            links.append(line.sha256)
            items.append(item)
        self.items = tuple(items)
        self.links = tuple(links)
        self.torn = len(whole) != len(content)
        self._digest.update(memoryview(content)[begin:])
        self._length, self._size = len(content), len(whole)
        self._pieces = [content]
        self._signatures = tuple(signatures)
        self.signer = self._judged()

    def _require_all(self, seen: seals.KnownEnd | None) -> None:
        """Raise StorageError if the memory of this station contradicts the chain, or is missing."""
        if seen is None:
            if self.signer.station == seals.THIS_STATION:
                utc = str(getattr(self.items[-1], "utc", ""))
                lost = seals.memory_loss(_name(self.links), utc, seals.KeyFolder())
                if lost is not None:
                    raise StorageError(lost.code, f"{self.path}: {lost.what}", lost.remedy)
        elif not seen.holds_in(self.links):
            raise StorageError(
                "chain.cut",
                f"{self.path}: line {seen.count}, which this computer has seen, is missing or "
                "another one.",
                "Restore the newest copy of the file. If there is none, start a new one.",
            )

    def require_signed(self, remedy: str) -> None:
        """Raise StorageError if no trusted station signed all lines; an empty chain passes."""
        if self.items and not self.signer.sound:
            raise StorageError(
                "chain.signer", f"{self.path} cannot be trusted. {self.signer.fault}", remedy
            )

    def signers(self) -> tuple[seals.SealState, ...]:
        """Return the states of the lines' signatures, oldest first; StorageError if one is bad."""
        return tuple(self._signer_of(index) for index in range(len(self._signatures)))

    def _signer_of(self, index: int) -> seals.SealState:
        if self._signed is None:
            return seals.SealState(seals.SealWord.NOT_SIGNED)
        content, signature = self.links[index].encode(), self._signatures[index]
        state = seals.judge_signature(seals.KeyFolder(), self._signed, content, signature)
        if state.word is seals.SealWord.FORGED:
            raise _forged(self.path, index + 1)
        return state

    def _judged(self) -> seals.SealState:
        # Lines are added to a sound chain only: a sound last line vouches for all before it.
        for index, (one, after) in enumerate(pairwise(self._signatures), start=2):
            if one is not None and after is None:
                raise _forged(self.path, index)
        if not self._signatures or self._signatures[-1] is None:
            return seals.SealState(seals.SealWord.NOT_SIGNED)
        last = self._signer_of(len(self._signatures) - 1)
        return seals.SealState(seals.SealWord.NOT_SIGNED) if self._signatures[0] is None else last

    def require_name(self) -> None:
        """Raise StorageError if the path no longer means this file; cheap, also for a timer.

        The lines are then saved in another file.
        """
        if self._lost is not None:
            raise self._lost
        loss = None if self._name is None else self._name.loss()
        if loss is not None:
            raise self.lost(loss.words)

    def lost(self, words: str) -> StorageError:
        """Save all lines in another file, once; return the error, with ``words`` on this file."""
        if self._lost is not None:
            return self._lost
        loss = None if self._name is None else self._name.loss()
        saved = write_rescued(self.path.name, b"".join(self._pieces))
        where = f"The {len(self.links)} entries before are saved in {saved}."
        lost = StorageError(
            "chain.lost",
            f"{self.path}: {words if loss is None else loss.words}. "
            f"{where if saved else 'No other folder takes its entries.'}",
            "Copy the saved file back to that path, then repeat the last step.",
        )
        # If no folder took them, the next call tries again.
        self._lost = None if saved is None else lost
        return lost

    def begins(self, content: bytes) -> tuple[int, hashlib._Hash] | None:
        """Return the length and the hash of this chain if ``content`` begins with it."""
        begin = hashlib.sha256(memoryview(content)[: self._length])
        return (self._length, begin) if begin.digest() == self._digest.digest() else None

    def link_with(self, item: T) -> str:
        """Return the hash that the next line would end with if it held ``item``."""
        return _link_of(len(self.items) + 1, self._end, msgspec.json.encode(item))

    def append(self, item: T) -> None:
        """Add a line and return when it is on the disk.

        StorageError, with the file as before, if it could not be written, or another program has
        written. After a failed sync it is not written again. The lines of a lost file are saved in
        another one.
        """
        self.require_name()
        if self._disk_failed:
            raise _given_up(self.path)
        if self.signer.word is seals.SealWord.UNKNOWN_KEY:
            self.require_signed("If that station is yours, trust its key first: ocmm key trust.")
        line = _line(len(self.items) + 1, self._end, msgspec.json.encode(item), None)
        if self._signed is not None:
            self._key = self._key or seals.KeyFolder().station_key()
            signature = seals.sign(self._key, self._signed, line.sha256.encode())
            line = msgspec.structs.replace(line, signature=signature)
        link, content = line.sha256, _encode(line)
        if self._remembered and not self.links:
            seals.expect(_name([link]), self.path.resolve())
        try:
            made = 0 if self._length else os.O_CREAT
            if made:
                self.path.parent.mkdir(parents=True, exist_ok=True)
            flags = os.O_WRONLY | made
            descriptor = open_guarded(self.path, follow=False, flags=flags, mode=0o644)
            try:
                # Two that read the same end would each write a line there.
                _lock(self.path, descriptor)
                if os.fstat(descriptor).st_size not in (self._size, self._length):
                    raise StorageError(
                        "chain.elsewhere",
                        f"{self.path}: another program has written to this file meanwhile.",
                        "Close the other one, then open this again.",
                    )
                # Remove the remains of a failed or torn append.
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
                if made:
                    HOST.sync_folder(self.path.parent)
                    self._name = NamedFile(self.path)
            finally:
                os.close(descriptor)
            self.require_name()
        except OSError as error:
            with contextlib.suppress(OSError):
                self._size = self.path.stat().st_size
            raise StorageError(
                "chain.unwritable",
                f"{self.path}: a line could not be stored ({error.strerror}).",
                "Free disk space or restore write permission, then repeat.",
            ) from error
        self._length += len(content)
        self._pieces.append(content)
        self._digest.update(content)
        self._size = self._length
        self.torn = False
        self.links = (*self.links, link)
        self.items = (*self.items, item)
        self._end = _end_of(line)
        self._signatures = (*self._signatures, line.signature)
        if self._key is not None and self._signatures[0] is not None:
            self.signer = seals.SealState(
                seals.SealWord.SEALED, seals.THIS_STATION, self._key.fingerprint
            )
        if self._remembered:
            name, place = _name(self.links), str(self.path.resolve())
            seals.remember(
                seals.KnownEnd(name=name, count=len(self.links), link=link, place=place), sync=False
            )


def _line(number: int, previous: str, item: bytes, signature: seals.Signature | None) -> _Line:
    return _Line(number, previous, msgspec.Raw(item), _link_of(number, previous, item), signature)


def _encode(line: _Line) -> bytes:
    return msgspec.json.encode(line) + b"\n"


def _end_of(line: _Line) -> str:
    """Return the hash of a line with its signature, to which the next line is bound."""
    if line.signature is None:
        return line.sha256
    return hashlib.sha256(f"{line.sha256} {line.signature.value}".encode()).hexdigest()


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


def _forged(path: Path, number: int) -> StorageError:
    return StorageError(
        "chain.forged",
        f"{path}: the signature of line {number} does not belong to it, or was removed.",
        "Restore the file from a backup; it is not used in this state.",
    )


def _name(links: Sequence[str]) -> str:
    """Return the name of a chain in the memory of the station: its first line is unique."""
    return f"chain {links[0]}"


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
