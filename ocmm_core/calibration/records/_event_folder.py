"""A folder with the chain of what happened to the records in it, and its seal.

The chain (`chain_file`) shows every changed line, its seal (`_chain_seal`) every line that is
missing at the end, and the memory of this computer (`_chain_seal`) a folder that was set back as
a whole. The files that the events name are the matter of `record_store`.
"""

from __future__ import annotations

import fcntl
import os
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from ocmm_core.calibration.records._chain_seal import (
    NAME,
    RESTORE,
    fault_of,
    read_seal,
    recall,
    remember,
    write_seal,
)
from ocmm_core.calibration.records._evidence import KeptFile, Stamp, stamp_of
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import OcmmError, StorageError


class StoredEvent(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What every line of a chain of events has.

    Attributes
    ----------
    utc
        ISO 8601 text.
    sealed
        It was written together with a seal; False in chains of earlier versions.
    files
        Session files that it rests on.
    lost
        Names of files of earlier events that were missing or damaged, and that what was done now
        makes up for; they are not asked for any more.
    who, reason
        For people.
    """

    utc: str
    sealed: bool = False
    files: tuple[KeptFile, ...] = ()
    lost: tuple[str, ...] = ()
    who: str
    reason: str


T = TypeVar("T", bound=StoredEvent)

_PATIENCE_S = 5.0
"""Another process writes within milliseconds; one that hangs is not waited for."""
_BETWEEN_S = 0.005
_REREAD_S = 10.0
"""Chain and seal are read again after so long, although they look unchanged."""


class EventFolder(ABC, Generic[T]):
    """The folder; its methods may be called from any thread, and by several processes.

    Parameters
    ----------
    folder
        Made at the first write.
    kind
        Of the events.

    Raises
    ------
    StorageError
        The chain of events is broken, or does not fit its seal.
    """

    def __init__(self, folder: Path, kind: type[T]) -> None:
        self._folder = folder
        self._kind = kind
        self._lock = threading.Lock()
        self._stamps: tuple[Stamp | None, Stamp | None] = (None, None)
        self._fault: StorageError | None = None
        seen = recall(folder)
        self._seen: tuple[int, str] = (0, "") if seen is None else (seen.count, seen.link)
        self._chain: ChainFile[T]
        self._read_at = -float("inf")
        self._unfinished = False
        self._read()

    @property
    def folder(self) -> Path:
        """Return where it is."""
        return self._folder

    @property
    def events(self) -> tuple[T, ...]:
        """Return what happened, oldest first."""
        return self._chain.items

    def refresh(self) -> None:
        """Take in what another process appended; raise StorageError where the chain is broken."""
        with self._lock:
            self._refresh()

    @property
    def exchanged(self) -> StorageError | None:
        """Return that the history is not the one that was seen here before; None where it is."""
        count, link = self._seen
        links = self._chain.links
        if not count or (len(links) >= count and links[count - 1] == link):
            return None
        return StorageError(
            "events.exchanged",
            f"The history in {self._folder} was rolled back or replaced: event {count}, which "
            "this computer has seen there, is missing.",
            "Restore the newest backup of that folder. If there is none, verify the calibration "
            "or check the tip again.",
        )

    @abstractmethod
    def _doubts(self, reason: str, utc: str) -> Sequence[T]:
        """Return the events that put everything in doubt."""

    def _append_event(self, event: T) -> None:
        """Add an event and return when it is on the disk; StorageError where it is not."""
        with self._lock, self._locked(fcntl.LOCK_EX):
            # The lines of another process must not be written over.
            self._refresh(writing=True)
            exchanged = self.exchanged
            if exchanged is not None and self.events:
                # From here on it is in the history, and not only in the memory of this computer.
                for doubt in self._doubts(exchanged.what, event.utc):
                    self._write_line(doubt)
            self._write_line(event)
            self._remember()

    def _write_line(self, event: T) -> None:
        write_seal(self._folder, self._chain, coming=self._chain.link_with(event))
        self._chain.append(event)
        write_seal(self._folder, self._chain)
        self._stamps = self._stamps_now()

    @contextmanager
    def _locked(self, how: int) -> Iterator[None]:
        """Keep other processes from writing meanwhile."""
        try:
            if how == fcntl.LOCK_EX:
                self._folder.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(self._folder, os.O_RDONLY | os.O_DIRECTORY)
        except OSError as error:
            raise StorageError(
                "events.folder",
                f"{self._folder}: the folder cannot be opened ({error.strerror}).",
                "Restore it, or give one with read and write permission, then repeat.",
            ) from error
        try:
            _lock(descriptor, how)
            yield
        finally:
            os.close(descriptor)

    def _refresh(self, *, writing: bool = False) -> None:
        late = time.monotonic() - self._read_at >= _REREAD_S
        if late or self._stamps_now() != self._stamps:
            self._read(writing=writing)
        elif self._fault is not None:
            raise StorageError(self._fault.code, self._fault.what, self._fault.remedy)

    def _read(self, *, writing: bool = False) -> None:
        try:
            self._chain = self._read_whole() if writing else self._read_between_writes()
        except StorageError as error:
            self._fault = error
            raise
        self._fault = None
        if self._unfinished and not writing:
            self._finish()
        if self._chain.links and self.exchanged is None:
            self._remember()

    def _finish(self) -> None:
        """Seal what a program wrote that ended before it could: then it cannot be cut off."""
        try:
            with self._locked(fcntl.LOCK_EX):
                self._chain = self._read_whole()
                if self._unfinished:
                    write_seal(self._folder, self._chain)
                    self._stamps = self._stamps_now()
        except StorageError:
            # What was read fitted; if it does no more, the next look says so.
            self._stamps = (None, None)

    def _read_between_writes(self) -> ChainFile[T]:
        """Return the chain as `_read_whole`, also where another process writes just now."""
        try:
            return self._read_whole()
        except StorageError:
            # Chain and seal are two files, and maybe one of them was read too soon.
            with self._locked(fcntl.LOCK_SH):
                return self._read_whole()

    def _read_whole(self) -> ChainFile[T]:
        """Return the chain, or raise StorageError where it is broken or does not fit its seal."""
        self._read_at = time.monotonic()
        try:
            self._stamps = self._stamps_now()
            chain = ChainFile(self._folder / "events.jsonl", self._kind)
            needed = any(event.sealed for event in chain.items)
            end = read_seal(self._folder)
            fault = fault_of(chain, end, needed=needed)
        except OcmmError as error:
            raise StorageError(error.code, error.what, error.remedy) from error
        if fault is not None:
            raise fault
        # The rest of a line that was torn goes when the next one is written.
        self._unfinished = end is not None and bool(end.coming) and not chain.torn
        return chain

    def _remember(self) -> None:
        links = self._chain.links
        if self._seen != (len(links), links[-1]):
            remember(self._folder, links)
            self._seen = len(links), links[-1]

    def _stamps_now(self) -> tuple[Stamp | None, Stamp | None]:
        try:
            return stamp_of(self._folder / "events.jsonl"), stamp_of(self._folder / NAME)
        except OSError as error:
            raise StorageError(
                "events.unreadable",
                f"{self._folder}: the history cannot be read ({error.strerror}).",
                f"Restore read permission. {RESTORE}",
            ) from error


def _lock(descriptor: int, how: int) -> None:
    end = time.monotonic() + _PATIENCE_S
    while time.monotonic() < end:
        try:
            fcntl.flock(descriptor, how | fcntl.LOCK_NB)
        except BlockingIOError:
            time.sleep(_BETWEEN_S)
            continue
        except OSError:
            # A disk without locks: as it was before there were any.
            return
        return
