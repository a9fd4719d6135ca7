"""Records that are written once, sealed by a hash.

A record is one JSON file that is written once. Its text is canonical (sorted fields, no blanks),
and the SHA-256 over the content stands beside it, so that any single changed byte is noticed:
either the hash no longer fits, or the text is no longer the canonical one. This reveals damage
and casual change; somebody who computes a new hash is revealed by the chain of events that names
the hashes (`calibration.history`, `calibration.probe_store`).
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TypeVar

import msgspec

from ocmm_core.documents import read_bytes, write_atomic
from ocmm_core.errors import CalibrationError

R = TypeVar("R", bound=msgspec.Struct)
"""Kinds of records."""


class _Sealed(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    content: msgspec.Raw
    sha256: str


def canonical(record: msgspec.Struct) -> bytes:
    """Return the one way to write a record down, which its hash is of."""
    return msgspec.json.encode(record, order="sorted")


def seal(record: msgspec.Struct) -> bytes:
    """Return the file content of a record."""
    sealed = _Sealed(msgspec.Raw(canonical(record)), record_hash(record))
    return msgspec.json.encode(sealed)


def record_hash(record: msgspec.Struct) -> str:
    """Return the hash that names a record."""
    return hashlib.sha256(canonical(record)).hexdigest()


def unseal(path: Path, content: bytes, kind: type[R]) -> R:
    """Return the record in ``content``; ``path`` is for messages.

    Raises
    ------
    CalibrationError
        It is no record of this kind, or a byte of it is not as it was written.
    """
    try:
        record = msgspec.json.decode(msgspec.json.decode(content, type=_Sealed).content, type=kind)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise _changed(path, f"it cannot be read ({error})") from error
    if seal(record) != content:
        raise _changed(path, "its content does not match its hash")
    return record


def is_sealed_as(content: bytes, digest: str) -> bool:
    """Return whether a file holds, byte for byte, the record with a hash, of whatever kind."""
    try:
        found = msgspec.json.decode(content, type=_Sealed)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return False
    return (
        found.sha256 == digest
        and hashlib.sha256(bytes(found.content)).hexdigest() == digest
        and msgspec.json.encode(found) == content
    )


def save(folder: Path, record: msgspec.Struct) -> Path:
    """Write a record under its hash and return the file.

    Raises
    ------
    CalibrationError
        The folder cannot be written.
    """
    path = folder / f"{record_hash(record)}.json"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomic(path, seal(record))
    except OSError as error:
        raise CalibrationError(
            "record.unwritable",
            f"{path}: the record cannot be written ({error.strerror}).",
            "Free disk space or give a writable folder, then store it again.",
        ) from error
    return path


def load(path: Path, kind: type[R]) -> R:
    """Return the record of a file; raise CalibrationError where it was changed."""
    return unseal(path, read_bytes(path), kind)


def load_named(folder: Path, digest: str, kind: type[R]) -> R:
    """Return the record with a hash from the folder of its store.

    Raises
    ------
    CalibrationError
        It is missing, was changed, or is another one than its name says.
    """
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
