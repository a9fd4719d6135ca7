"""Seal of a chain of events: line count, last hash and signature.

A chain (`chain_file`) reveals every change except lines cut off at its end; the seal records the
end. It is written before each line, with its coming hash, and after it: a crash at any moment
leaves a matching pair; a truncated chain or outdated seal does not match. The last hash covers all
lines, so the signature (`seals`) covers the whole history and needs the station's key.

The folder is locked between processes, and the entries that this program knows are saved if the
file is lost.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from ocmm_core import seals
from ocmm_core.calibration.records._sealed import Stamp, canonical, seal, stamp_of, unseal
from ocmm_core.chain_file import ChainFile
from ocmm_core.documents import read_bytes, write_atomic
from ocmm_core.errors import CalibrationError, OcmmError, StorageError
from ocmm_core.host import HOST
from ocmm_core.named_file import write_rescued

SCHEMA = "ocmm.events-seal/1"
NAME = "events.seal.json"


class ChainSeal(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """End of a chain."""

    schema: str
    count: int
    """Lines on disk."""
    link: str
    """Hash of the last line; empty for an empty chain."""
    coming: str = ""
    """Hash of the line being written, or empty."""


class SignedSeal(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Seal with its station signature; unsigned in earlier versions."""

    end: ChainSeal
    signature: seals.Signature | None = None


def read_seal(folder: Path) -> SignedSeal | None:
    """Return the seal of a folder, or None; StorageError if damaged or unreadable."""
    path = folder / NAME
    if not path.exists():
        return None
    content = read_bytes(path)
    with contextlib.suppress(CalibrationError):
        return unseal(path, content, SignedSeal)
    try:
        return SignedSeal(unseal(path, content, ChainSeal))
    except CalibrationError as error:
        raise StorageError(
            "events.seal",
            f"{path}: the seal of the history was changed after it was written.",
            RESTORE,
        ) from error


def write_seal(
    folder: Path, chain: ChainFile[Any], keys: seals.KeyFolder, coming: str = ""
) -> None:
    """Seal the end of a chain; StorageError if folder or station's key cannot be used."""
    link = chain.links[-1] if chain.links else ""
    end = ChainSeal(schema=SCHEMA, count=len(chain.links), link=link, coming=coming)
    signature = seals.sign(keys.station_key(), seals.Signed.HISTORY, canonical(end))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomic(folder / NAME, seal(SignedSeal(end, signature)))
    except OSError as error:
        raise StorageError(
            "events.seal_unwritable",
            f"{folder / NAME}: the seal of the history could not be written ({error.strerror}).",
            "Free disk space or restore write permission, then repeat.",
        ) from error


def fault_of(chain: ChainFile[Any], end: ChainSeal | None, *, needed: bool) -> StorageError | None:
    """Return the mismatch between a chain and its seal, or None; ``needed``: one must exist."""
    folder = chain.path.parent
    if end is None:
        if not needed:
            return None
        return StorageError(
            "events.seal_missing",
            f"{folder / NAME}: the seal of the history is missing, so it is unknown whether "
            "events were removed.",
            RESTORE,
        )
    count, link = len(chain.links), chain.links[-1] if chain.links else ""
    if (count, link) == (end.count, end.link) and not (chain.torn and not end.coming):
        return None
    if end.coming and (count, link) == (end.count + 1, end.coming) and not chain.torn:
        return None
    if count < end.count:
        are = "is" if end.count - count == 1 else "are"
        what = f"{end.count - count} of {end.count} events {are} missing at the end"
    elif count == end.count and chain.torn:
        what = "data follow the last event"
    else:
        what = f"its end (event {count}) is not the sealed one (event {end.count})"
    return StorageError("events.cut", f"{chain.path}: {what}.", RESTORE)


RESTORE = (
    "Restore the whole folder from a backup. If there is none, move the folder away, then "
    "calibrate and verify again: a new history starts."
)


def signer_of(found: SignedSeal | None, keys: seals.KeyFolder) -> seals.SealState:
    """Return the state of a seal's signature; StorageError if the key ring cannot be read."""
    if found is None:
        return seals.SealState(seals.SealWord.NOT_SIGNED)
    return seals.judge_signature(keys, seals.Signed.HISTORY, canonical(found.end), found.signature)


def forgery(folder: Path, found: seals.SealState, *, signed: bool) -> StorageError | None:
    """Return why the signature forbids a history, or None; ``signed``: one must exist."""
    if found.word is seals.SealWord.FORGED:
        what = "the signature of the history does not belong to it"
    elif found.word is seals.SealWord.NOT_SIGNED and signed:
        what = "the signature of the history was removed"
    else:
        return None
    return StorageError("events.forged", f"{folder / NAME}: {what}.", RESTORE)


def stranger(folder: Path, found: seals.SealState) -> StorageError | None:
    """Return why an intact history is not trusted, or None."""
    if found.sound:
        return None
    if found.word is seals.SealWord.NOT_SIGNED:
        return StorageError(
            "events.not_signed",
            f"The history in {folder} is not signed: an earlier version of this program wrote it, "
            "which would not have noticed that somebody wrote it anew.",
            "Verify the calibration or check the tip again: that signs it.",
        )
    return StorageError(
        "events.unknown_key",
        f"The history in {folder} was signed by a station that this computer does not know "
        f"(key {seals.shown_key(found.fingerprint)}).",
        "If that is a station of yours and shows the same key (ocmm key show), type ocmm key "
        "trust; otherwise verify the calibration or check the tip here.",
    )


class KeptHistory:
    """The longest known chain of a folder, compared with the file under its name.

    Additions by other programs, or a backup with all entries, lose nothing.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._chain: ChainFile[Any] | None = None
        self._seal: SignedSeal | None = None
        self._saved_seal: Path | None = None
        self._whole: Stamp | None = None

    def note(self, chain: ChainFile[Any], found: SignedSeal | None) -> None:
        """Keep a chain and its seal, unless known entries are missing in it."""
        kept = self._chain
        if kept is None or kept.links == chain.links[: len(kept.links)]:
            self._chain, self._seal = chain, found

    def loss(self) -> StorageError | None:
        """Return why entries are missing (saved elsewhere with their seal), or None."""
        kept, stamp = self._chain, None
        if kept is None or not kept.links:
            return None
        with contextlib.suppress(OSError, OcmmError):
            stamp = stamp_of(self._path)
            if stamp is not None and stamp != self._whole:
                content = read_bytes(self._path, follow=False)
                self._whole = None if kept.begins(content) is None else stamp
        if stamp is not None and stamp == self._whole:
            return None
        lost = kept.lost("another program has written into it or replaced it")
        if self._seal is not None and self._saved_seal is None:
            self._saved_seal = write_rescued(NAME, seal(self._seal))
        also = f" Its seal is saved in {self._saved_seal}." if self._saved_seal else ""
        return StorageError(
            lost.code,
            lost.what + also,
            f"Copy the saved files back as {self._path.name} and {NAME}, then repeat the last "
            "step.",
        )


_READING_S, _WRITING_S = 5.0, 20.0
"""Longest waits. A write takes milliseconds; many processes may want to write at once."""
_BETWEEN_S = 0.002


@contextmanager
def locked_folder(folder: Path, *, shared: bool = False) -> Iterator[None]:
    """Keep other processes from writing meanwhile; StorageError if one writes for too long."""
    try:
        if not shared:
            folder.mkdir(parents=True, exist_ok=True)
        descriptor = HOST.open_to_lock(folder)
    except OSError as error:
        raise StorageError(
            "events.folder",
            f"{folder}: the folder cannot be opened ({error.strerror}).",
            "Restore it, or give one with read and write permission, then repeat.",
        ) from error
    try:
        _lock(folder, descriptor, shared=shared)
        yield
    finally:
        os.close(descriptor)


def _lock(folder: Path, descriptor: int, *, shared: bool) -> None:
    patience_s = _READING_S if shared else _WRITING_S
    end = time.monotonic() + patience_s
    while time.monotonic() < end:
        try:
            HOST.lock(descriptor, shared=shared)
        except BlockingIOError:
            time.sleep(_BETWEEN_S)
            continue
        except OSError:
            # A file system without locks.
            return
        return
    raise StorageError(
        "events.busy",
        f"{folder}: another program has been writing the history for {patience_s:g} s.",
        "Wait until it has ended, or close it, then repeat.",
    )
