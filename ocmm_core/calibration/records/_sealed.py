"""Write-once records sealed by a hash, and by a signature if no chain names them.

One JSON file of canonical text (sorted fields, no blanks) with its SHA-256. A recomputed hash is
revealed by the signed chain of events (`calibration.records._record_store`). A record without one
(acceptance test, study, recall) carries the station's signature.

The files behind a status must exist and be unchanged. Records are named by their hash; events name
session files by the SHA-256 of their bytes. A file with unchanged inode, length and times is not
re-read every time, but one in turn is, every `PATROL_S`, to detect edits that preserve all of them.
In large stores each check covers the newest files and a moving window of the others.
"""

from __future__ import annotations

import hashlib
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from ocmm_core.chain_file import USE_ITS_OWN
from ocmm_core.documents import read_bytes, write_atomic
from ocmm_core.errors import CalibrationError
from ocmm_core.seals import KeyFolder, SealState, SealWord, Signature, Signed, judge_signature, sign
from ocmm_core.side_files import LARGEST_JOB, read_guarded

R = TypeVar("R", bound=msgspec.Struct)


class _Sealed(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    content: msgspec.Raw
    sha256: str
    signature: Signature | None = None


@dataclass(frozen=True, slots=True)
class SignedRecord(Generic[R]):
    """A record with the state of its signature."""

    record: R
    signer: SealState


def canonical(record: msgspec.Struct) -> bytes:
    """Return the canonical text of a record, the input of its hash."""
    return msgspec.json.encode(record, order="sorted")


def seal(record: msgspec.Struct) -> bytes:
    """Return the file content of a record."""
    return _sealed(record, None)


def seal_signed(record: msgspec.Struct, kind: Signed) -> bytes:
    """Return the file content of a record, signed by this station; errors as `sign`."""
    return _sealed(record, sign(KeyFolder().station_key(), kind, canonical(record)))


def _sealed(record: msgspec.Struct, signature: Signature | None) -> bytes:
    return msgspec.json.encode(
        _Sealed(msgspec.Raw(canonical(record)), record_hash(record), signature)
    )


def record_hash(record: msgspec.Struct) -> str:
    """Return the hash that names a record."""
    return hashlib.sha256(canonical(record)).hexdigest()


def unseal(path: Path, content: bytes, kind: type[R]) -> R:
    """Return the record in ``content``; CalibrationError if changed or of another kind."""
    record, signature = _opened(path, content, kind)
    if signature is not None:
        raise _changed(path, "its content does not match its hash")
    return record


def unseal_signed(path: Path, content: bytes, kind: type[R], signed: Signed) -> SignedRecord[R]:
    """Return the record in ``content`` with the state of its signature.

    CalibrationError as `unseal`, and if the signature does not belong to the record.
    """
    record, signature = _opened(path, content, kind)
    state = judge_signature(KeyFolder(), signed, canonical(record), signature)
    if state.word is SealWord.FORGED:
        raise CalibrationError(
            "record.forged",
            f"{path}: the signature of this record does not belong to it.",
            "Restore the file from a backup; it is not used.",
        )
    return SignedRecord(record, state)


def _opened(path: Path, content: bytes, kind: type[R]) -> tuple[R, Signature | None]:
    try:
        sealed = msgspec.json.decode(content, type=_Sealed)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise _changed(path, f"it cannot be read ({error})") from error
    try:
        record = msgspec.json.decode(sealed.content, type=kind)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        if is_sealed_as(content, sealed.sha256):
            raise CalibrationError(
                "record.kind",
                f"{path}: this record is of another kind, or of a later version.",
                USE_ITS_OWN,
            ) from error
        raise _changed(path, f"it cannot be read ({error})") from error
    if _sealed(record, sealed.signature) != content:
        raise _changed(path, "its content does not match its hash")
    return record, sealed.signature


def is_sealed_as(content: bytes, digest: str) -> bool:
    """Return whether a file is exactly the record with a hash, of any kind."""
    try:
        found = msgspec.json.decode(content, type=_Sealed)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return False
    return (
        found.sha256 == digest
        and hashlib.sha256(bytes(found.content)).hexdigest() == digest
        and msgspec.json.encode(found) == content
    )


def save(folder: Path, record: msgspec.Struct, signed: Signed | None = None) -> Path:
    """Write a record under its hash, signed as a kind if one is given, and return the file.

    CalibrationError if the folder cannot be written, StorageError if the key cannot be used.
    """
    content = seal(record) if signed is None else seal_signed(record, signed)
    path = folder / f"{record_hash(record)}.json"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomic(path, content)
    except OSError as error:
        raise CalibrationError(
            "record.unwritable",
            f"{path}: the record cannot be written ({error.strerror}).",
            "Free disk space or give a writable folder, then store it again.",
        ) from error
    return path


def load(path: Path, kind: type[R]) -> R:
    """Return the record of a file; raise CalibrationError if it was changed."""
    return unseal(path, read_bytes(path), kind)


def load_signed(path: Path, kind: type[R], signed: Signed) -> SignedRecord[R]:
    """Return a record and the state of its signature; errors as `unseal_signed`."""
    return unseal_signed(path, read_bytes(path), kind, signed)


def load_named(folder: Path, digest: str, kind: type[R]) -> R:
    """Return a record by its hash; CalibrationError if missing, changed or misnamed."""
    path = folder / f"{digest}.json"
    if not path.exists():
        raise CalibrationError(
            "record.missing",
            f"Record {digest[:12]} in {folder} is missing.",
            "Restore the file from a backup, or calibrate again.",
        )
    record = load(path, kind)
    if record_hash(record) != digest:
        raise CalibrationError(
            "record.exchanged",
            f"{path}: this is not the record its name indicates.",
            "Restore the file from a backup, or calibrate again; it is not used.",
        )
    return record


def _changed(path: Path, how: str) -> CalibrationError:
    return CalibrationError(
        "record.changed",
        f"{path}: this calibration record was changed after it was written: {how}.",
        "Restore the file from a backup, or calibrate again; it is not used.",
    )


PATROL_S = 1.0
"""Interval between re-reads of files that appear unchanged, s."""
AT_A_LOOK = 40
"""Number of newest files, and of others in turn, inspected by each check."""

Stamp = tuple[int, int, int, int]
"""Inode, length, and times of the last change of content and of anything else, ns."""


class KeptFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A file in the folder of a store."""

    name: str
    """Below the folder, with forward slashes."""
    sha256: str
    """Hash of the bytes; for a record (``<hash>.json``), of its content, which names it."""

    @property
    def is_record(self) -> bool:
        """Return whether the name is the hash of the content."""
        return self.name == f"{self.sha256}.json"

    def summary(self, folder: Path) -> str:
        """Return kind and path for messages; records with a shortened hash."""
        if self.is_record:
            return f"Record {self.sha256[:12]} in {folder}"
        path = folder / self.name
        return f"Session {path.name} in {path.parent}"


def record_file(digest: str) -> KeptFile:
    return KeptFile(f"{digest}.json", digest)


def session_files(folder: Path, session: Path | None) -> tuple[KeptFile, ...]:
    """Return a session file below the store's folder; CalibrationError if unreadable."""
    if session is None or not session.resolve().is_relative_to(folder.resolve()):
        return ()
    name = session.resolve().relative_to(folder.resolve()).as_posix()
    try:
        return (KeptFile(name, hashlib.sha256(read_guarded(session, LARGEST_JOB)).hexdigest()),)
    except OSError as error:
        raise CalibrationError(
            "evidence.unreadable",
            f"{session}: the session cannot be read ({error.strerror}).",
            "Restore read permission, then accept the result again.",
        ) from error


class EvidenceCheck:
    """Verifies the files of a folder; thread-safe."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._lock = threading.Lock()
        self._good: dict[KeptFile, Stamp] = {}
        self._bad: set[KeptFile] = set()
        self._begun = False
        self._window = 0
        self._turn = 0
        self._patrolled = time.monotonic()

    def defect(self, wanted: Sequence[KeptFile], *, thorough: bool) -> tuple[KeptFile, str] | None:
        """Return the first changed or missing file with its defect; ``thorough`` reads all."""
        with self._lock:
            if thorough:
                self._good.clear()
            elif wanted and time.monotonic() - self._patrolled >= PATROL_S:
                self._patrolled, self._turn = time.monotonic(), self._turn + 1
                self._good.pop(wanted[self._turn % len(wanted)], None)
            for one in wanted if thorough or not self._begun else self._chosen(wanted):
                what = self._check(one)
                if what:
                    return one, what
            # After a defect, the files behind it have not been read yet.
            self._begun = True
        return None

    def lost(self, wanted: Sequence[KeptFile]) -> tuple[str, ...]:
        """Return the names of the files that are not as they were; reads all of them."""
        with self._lock:
            self._good.clear()
            return tuple(one.name for one in wanted if self._check(one))

    def _chosen(self, wanted: Sequence[KeptFile]) -> list[KeptFile]:
        """Return the files to inspect now: defective ones, the newest, a window of the others."""
        old, new = wanted[:-AT_A_LOOK], wanted[-AT_A_LOOK:]
        self._window = self._window + AT_A_LOOK if self._window + AT_A_LOOK < len(old) else 0
        window = old[self._window : self._window + AT_A_LOOK]
        wrong = [one for one in old if one in self._bad] if self._bad else []
        return [*wrong, *window, *new]

    def _check(self, wanted: KeptFile) -> str:
        """Return and remember the defect of a file; empty if it is intact."""
        what = self._what_is_wrong(wanted)
        if what:
            self._bad.add(wanted)
        else:
            self._bad.discard(wanted)
        return what

    def _what_is_wrong(self, wanted: KeptFile) -> str:
        path = self._folder / wanted.name
        try:
            stamp = stamp_of(path)
            if stamp is None:
                return "is missing"
            if self._good.get(wanted) == stamp:
                return ""
            content = read_guarded(path, LARGEST_JOB, follow=False)
        except OSError as error:
            return f"cannot be read ({error.strerror})"
        if wanted.is_record:
            whole = is_sealed_as(content, wanted.sha256)
        else:
            whole = hashlib.sha256(content).hexdigest() == wanted.sha256
        if not whole:
            return "was changed after it was written"
        self._good[wanted] = stamp
        return ""


def stamp_of(path: Path) -> Stamp | None:
    """Return the file's stamp, None if missing; OSError if it cannot be inspected."""
    try:
        found = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns
