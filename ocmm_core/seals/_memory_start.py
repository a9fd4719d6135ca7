"""Missing memory of the station: detected by its signature, or accepted by name."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import msgspec

from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.seals._key import THIS_STATION, KeyFolder
from ocmm_core.seals._memory import MEMORY, memory_file, memory_folder, order_of
from ocmm_core.seals._private_file import guarded_content
from ocmm_core.seals._ring import check_names
from ocmm_core.seals._signature import Signature, Signed, judge_signature, sign


class _Start(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    utc: str
    who: str
    reason: str


class _SignedStart(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    start: _Start
    signature: Signature


def memory_loss(name: str, last_utc: str, keys: KeyFolder) -> StorageError | None:
    """Return why a chain that this station signed is not in its memory; None if that is in order.

    `last_utc`: time of its last line, ISO 8601 text; empty if unknown.
    """
    start = _read_start(keys)
    if start is not None and order_of(last_utc) <= order_of(start.utc):
        return None
    return StorageError(
        "memory.missing",
        f"This station signed it, but its memory of it is missing in {memory_folder()} "
        f"({memory_file(name).name}): a removed end would not be noticed.",
        "Restore that folder from a backup. If the key was brought to this computer or user "
        "without it, type ocmm key restored, with your name and the reason.",
    )


def memory_start(keys: KeyFolder) -> str:
    """Return who accepted that files are not in the memory, as a sentence; empty without one."""
    start = _read_start(keys)
    return (
        ""
        if start is None
        else (
            f"The memory of this station starts at {start.utc[:19]} UTC, by {start.who}: "
            f"{start.reason}. An end that was removed before is not noticed."
        )
    )


def start_memory(keys: KeyFolder, who: str, reason: str, now: datetime) -> str:
    """Accept everything signed until now, for a key that was moved; return the stored time.

    InputError: name or reason is missing; StorageError: the memory cannot be written, or no key.
    """
    check_names(THIS_STATION, who)
    if not reason.strip():
        raise InputError("memory.reason", "The reason is missing.", "Give it.")
    utc = now.astimezone(UTC).isoformat(timespec="microseconds")
    start = _Start(utc=utc, who=who.strip(), reason=reason)
    signed = _SignedStart(start, sign(keys.station_key(), Signed.MEMORY, _content(start)))
    path = _start_path()
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        write_atomic(path, msgspec.json.encode(signed))
    except OSError as error:
        raise StorageError(
            "memory.unwritable",
            f"{path}: the memory of the station cannot be stored ({error.strerror}).",
            "Free disk space or restore write permission, then repeat.",
        ) from error
    return start.utc


def _start_path() -> Path:
    return memory_folder() / "start.signed"


def _content(start: _Start) -> bytes:
    return msgspec.json.encode(start)


def _read_start(keys: KeyFolder) -> _Start | None:
    """Return the start of the memory if this station signed it."""
    try:
        content = guarded_content(_start_path(), MEMORY)
        if content is None:
            return None
        found = msgspec.json.decode(content, type=_SignedStart)
        state = judge_signature(keys, Signed.MEMORY, _content(found.start), found.signature)
        datetime.fromisoformat(found.start.utc)
    except (OcmmError, ValueError, RecursionError):
        return None
    return found.start if state.sound and state.station == THIS_STATION else None
