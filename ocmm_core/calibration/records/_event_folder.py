"""Folder with the sealed chain of events of the records in it.

The chain (`chain_file`) reveals every changed line, its signed seal (`_chain_seal`) lines missing
at the end and foreign histories, and the memory of this station (`seals`), keyed by history and
subject, not by path, histories set back or replaced as a whole.
"""

from __future__ import annotations

import contextlib
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from ocmm_core import seals
from ocmm_core.calibration.records import _chain_seal as chain_seal
from ocmm_core.calibration.records._sealed import KeptFile, Stamp, stamp_of
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import OcmmError, StorageError


class StoredEvent(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Common fields of all events."""

    utc: str
    """ISO 8601 text."""
    sealed: bool = False
    """Written together with a seal; False in chains of earlier versions."""
    signed: bool = False
    """Written together with a signature of the station."""
    files: tuple[KeptFile, ...] = ()
    """Session files that it rests on."""
    lost: tuple[str, ...] = ()
    """Names of missing or damaged files of earlier events that this event makes unnecessary."""
    who: str
    reason: str
    """`who`, `reason`: For people."""


T = TypeVar("T", bound=StoredEvent)

_REREAD_S = 10.0
"""Interval after which chain and seal are re-read although they appear unchanged, s."""


class EventFolder(ABC, Generic[T]):
    """Folder with a chain of events, created at the first write; for any thread or process.

    StorageError if the chain is broken, or does not fit its seal.
    """

    def __init__(self, folder: Path, kind: type[T]) -> None:
        self._folder = folder
        self._kind = kind
        self._lock = threading.Lock()
        self._stamps: tuple[Stamp | None, Stamp | None] = (None, None)
        self._fault: StorageError | None = None
        self._keys = seals.KeyFolder()
        self._signer = seals.SealState(seals.SealWord.NOT_SIGNED)
        self._seal: chain_seal.SignedSeal | None = None
        self._seen: seals.KnownEnd | None = None
        self._chain: ChainFile[T]
        self._known: ChainFile[T] | None = None
        self._kept = chain_seal.KeptHistory(folder / "events.jsonl")
        self._read_at = -float("inf")
        self._unfinished = False
        self._read()

    @property
    def folder(self) -> Path:
        return self._folder

    @property
    def events(self) -> tuple[T, ...]:
        return self._chain.items

    def refresh(self) -> None:
        """Read lines appended by other processes; raise StorageError if the chain is broken."""
        with self._lock:
            self._refresh()

    def check_name(self) -> StorageError | None:
        """Return why known entries, now saved elsewhere, are gone, or None. Cheap: for a timer."""
        with self._lock:
            return self._kept.loss()

    @property
    def signer(self) -> seals.SealState:
        """Return the state of the signature on the history."""
        return self._signer

    @property
    def seen_utc(self) -> str:
        """Return the latest time this station recorded, of any history, ISO 8601 text, or empty."""
        own = self._seen
        with contextlib.suppress(StorageError):
            own = seals.recall(_identity(self._chain.links)) if self._chain.links else None
            return max("" if own is None else own.utc, seals.station_clock(), key=_time)
        return "" if own is None else own.utc

    @property
    def exchanged(self) -> StorageError | None:
        """Return why an unbroken history is not trusted, or None.

        The station has a record of a later end or a later history of the same subject, has lost its
        memory of it, or does not recognise the signer.
        """
        links = self._chain.links
        if not links:
            last = self._seen
            return None if last is None else self._older(_missing(last.count), last.place)
        try:
            seals.station_clock()
            seen = seals.recall(_identity(links))
            latest = seals.recall(self._thing(seen))
        except StorageError as error:
            return error
        if seen is None and self._signer.station == seals.THIS_STATION:
            lost = seals.memory_loss(_identity(links), self.events[-1].utc, self._keys)
            if lost is not None:
                return lost
        if seen is not None and seen.replaced_by:
            return self._older("another one took its place", seen.replaced_by)
        if seen is not None and not seen.holds_in(links):
            # Another program may have appended since the chain was read.
            with contextlib.suppress(StorageError):
                self._chain = self._read_whole()
            links = self._chain.links
        if seen is not None and not seen.holds_in(links):
            return self._older(_missing(seen.count), seen.place)
        if (
            latest is not None
            and latest.first != links[0]
            and _time(latest.moment) > _time(self.events[-1].utc)
        ):
            return self._older(f"a later one of the same {latest.name} exists", latest.place)
        return chain_seal.stranger(self._folder, self._signer)

    def _older(self, why: str, place: str) -> StorageError:
        return StorageError(
            "events.exchanged",
            f"The history in {self._folder} is an older copy or another history: {why}, which this "
            f"computer has seen in {place}.",
            "Restore the newest backup of the folder. If there is none, or this is the history to "
            "continue, verify the calibration or check the tip again.",
        )

    @abstractmethod
    def _identity_of_thing(self) -> str:
        """Return the identity of the cameras or probe; empty if unknown."""

    def _thing(self, seen: seals.KnownEnd | None) -> str:
        """Return the name in the memory; the folder tells virtual probes, which share documents."""
        known = "" if seen is None else seen.thing
        thing = self._identity_of_thing()
        if not thing:
            return known
        realm = known or self._folder.resolve().parent.name
        return f"virtual {thing}" if realm.startswith("virtual") else thing

    @abstractmethod
    def _doubts(self, reason: str, utc: str) -> Sequence[T]:
        """Return the events that make everything suspect."""

    def _looked(self, utc: str) -> None:
        with self._lock:
            if self._chain.links and self.exchanged is None:
                self._remember(utc)

    def _append_event(self, event: T, *, at: str = "") -> None:
        """Append an event, on disk before returning; ``at`` becomes the latest recorded time."""
        with self._lock:
            self._require_kept()
            with chain_seal.locked_folder(self._folder):
                self._append_locked(event, at)

    def _require_kept(self) -> None:
        lost = self._kept.loss()
        if lost is not None:
            raise lost

    def _append_locked(self, event: T, at: str) -> None:
        # The lines of another process must not be written over.
        self._refresh(writing=True)
        self._require_kept()
        exchanged = self.exchanged
        if exchanged is not None and self.events:
            # From here on the history itself holds it, not only the memory of this station.
            for doubt in self._doubts(exchanged.what, event.utc):
                self._write_line(doubt)
        self._write_line(event)
        self._remember(at)

    def _write_line(self, event: T) -> None:
        event = msgspec.structs.replace(event, sealed=True, signed=True)
        if not self._chain.links:
            # Killed after the signature and before `_remember`, the memory would seem to be lost.
            seals.expect(_identity((self._chain.link_with(event),)), self._folder.resolve())
        chain_seal.write_seal(
            self._folder, self._chain, self._keys, coming=self._chain.link_with(event)
        )
        self._chain.append(event)
        chain_seal.write_seal(self._folder, self._chain, self._keys)
        found = chain_seal.read_seal(self._folder)
        self._kept.note(self._chain, found)
        self._signer = chain_seal.signer_of(found, self._keys)
        self._stamps = self._stamps_now()

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
        self._kept.note(self._chain, self._seal)
        # Signing a foreign history would vouch for it.
        if self._unfinished and not writing and self._signer.sound:
            self._finish()
        if self._chain.links and self.exchanged is None:
            self._remember()

    def _finish(self) -> None:
        """Seal the last line of a program that ended before it could: it cannot be cut off then."""
        try:
            with chain_seal.locked_folder(self._folder):
                self._chain = self._read_whole()
                if self._unfinished:
                    chain_seal.write_seal(self._folder, self._chain, self._keys)
                    self._stamps = self._stamps_now()
        except StorageError:
            # The chain was sound; if that changes, the next check reports it.
            self._stamps = (None, None)

    def _read_between_writes(self) -> ChainFile[T]:
        try:
            return self._read_whole()
        except StorageError:
            # Chain and seal are two files, and maybe one of them was read too soon.
            with chain_seal.locked_folder(self._folder, shared=True):
                return self._read_whole()

    def _read_whole(self) -> ChainFile[T]:
        """Return the chain; raise StorageError if it is broken or does not fit its seal."""
        self._read_at = time.monotonic()
        try:
            self._stamps = self._stamps_now()
            # If another program keeps appending, each check reads only the new lines.
            chain = ChainFile(self._folder / "events.jsonl", self._kind, known=self._known)
            self._known = chain
            needed = any(event.sealed for event in chain.items)
            found = chain_seal.read_seal(self._folder)
            end = None if found is None else found.end
            signer = chain_seal.signer_of(found, self._keys)
            signed = any(event.signed for event in chain.items)
            fault = chain_seal.fault_of(chain, end, needed=needed) or chain_seal.forgery(
                self._folder, signer, signed=signed
            )
        except OcmmError as error:
            raise StorageError(error.code, error.what, error.remedy) from error
        if fault is not None:
            raise fault
        # The rest of a line that was torn goes when the next one is written.
        self._unfinished = end is not None and bool(end.coming) and not chain.torn
        self._signer, self._seal = signer, found
        return chain

    def _remember(self, utc: str = "") -> None:
        """Store the end of the history and the check time; empty keeps the stored time."""
        links, last = self._chain.links, self.events[-1]
        with contextlib.suppress(StorageError):
            known = seals.recall(_identity(links))
            thing, place = self._thing(known), str(self._folder.resolve())
            seen = seals.KnownEnd(
                name=_identity(links), count=len(links), link=links[-1], place=place, thing=thing,
                utc=utc or ("" if known is None else known.utc),
            )  # fmt: skip
            self._seen = seen
            if seen != known:
                seals.remember(seen)
            if thing:
                latest = msgspec.structs.replace(
                    seen, name=thing, first=links[0], moment=last.utc, thing="", utc=""
                )
                seals.remember(latest)
            if utc:
                seals.set_station_clock(utc)

    def _stamps_now(self) -> tuple[Stamp | None, Stamp | None]:
        try:
            return stamp_of(self._folder / "events.jsonl"), stamp_of(self._folder / chain_seal.NAME)
        except OSError as error:
            raise StorageError(
                "events.unreadable",
                f"{self._folder}: the history cannot be read ({error.strerror}).",
                f"Restore read permission. {chain_seal.RESTORE}",
            ) from error


def _identity(links: Sequence[str]) -> str:
    """Return the name of a history: its first line is unique."""
    return f"history {links[0]}"


def _missing(event: int) -> str:
    return f"event {event} of it is missing"


def _time(utc: str) -> float:
    return datetime.fromisoformat(utc).timestamp() if utc else -float("inf")
