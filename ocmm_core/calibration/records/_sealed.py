"""Write-once records sealed by a hash, and by a signature if no chain names them.

One JSON file of canonical text (sorted fields, no blanks) with its SHA-256. A recomputed hash is
revealed by the signed chain of events (`calibration.records._record_store`). A record without one
(acceptance test, study, recall) carries the station's signature.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from ocmm_core.documents import read_bytes, write_atomic
from ocmm_core.errors import CalibrationError
from ocmm_core.seals import KeyFolder, SealState, SealWord, Signature, Signed, judge_signature, sign

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


def unseal_signed(
    path: Path, content: bytes, kind: type[R], signed: Signed, keys: KeyFolder | None = None
) -> SignedRecord[R]:
    """Return the record in ``content`` with the state of its signature.

    CalibrationError as `unseal`, and if the signature does not belong to the record.
    """
    record, signature = _opened(path, content, kind)
    state = judge_signature(keys or KeyFolder(), signed, canonical(record), signature)
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
        record = msgspec.json.decode(sealed.content, type=kind)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
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


def load_signed(
    path: Path, kind: type[R], signed: Signed, keys: KeyFolder | None = None
) -> SignedRecord[R]:
    """Return a record and the state of its signature; errors as `unseal_signed`."""
    return unseal_signed(path, read_bytes(path), kind, signed, keys)


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
