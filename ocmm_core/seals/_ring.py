"""Ring of trusted keys in addition to the one in force."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError, StorageError
from ocmm_core.leftovers import hold
from ocmm_core.seals._private_file import guarded_content, unwritable
from ocmm_core.seals._public import fingerprint_of, public_from_text
from ocmm_core.side_files import SIDE_FILES, Trusted, open_guarded

_RING = "known_keys.json"
_LARGEST = SIDE_FILES[Trusted.KEYS][0].most
_LOCK = ".changing"
_SCHEMA = "ocmm.keys/1"
_NAME_LENGTH = 60
_PATIENCE_S = 5.0


class KnownKey(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Trusted key."""

    public: str
    """Base64 of its bytes."""
    name: str
    since_utc: str
    until_utc: str = ""
    """Time at which this station replaced it; empty for the key of another station."""
    who: str
    reason: str
    """Person who added it, and the reason."""

    @property
    def public_bytes(self) -> bytes:
        """Return the key itself; InputError if invalid."""
        return public_from_text(self.public)

    @property
    def fingerprint(self) -> str:
        return fingerprint_of(self.public_bytes)


class _Ring(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    schema: str
    keys: tuple[KnownKey, ...] = ()


def read_ring(folder: Path) -> tuple[KnownKey, ...]:
    """Return the trusted keys; StorageError if damaged, unreadable or writable by others."""
    path = folder / _RING
    content = guarded_content(path, "list of known keys")
    if content is None:
        return ()
    try:
        ring = msgspec.json.decode(content, type=_Ring)
        for key in ring.keys:
            _ = key.public_bytes
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError, InputError) as error:
        raise StorageError(
            "key.ring",
            f"{path}: the list of known keys cannot be read ({error}).",
            "Restore it from a backup, or move it away and trust the keys again.",
        ) from error
    return ring.keys


def add_to_ring(folder: Path, added: KnownKey) -> None:
    """Add or replace a key, the folder locked by `changing`; StorageError for the ring."""
    keys = [key for key in read_ring(folder) if key.public != added.public] + [added]
    _write(folder, keys)


@contextlib.contextmanager
def changing(folder: Path) -> Iterator[None]:
    """Lock the folder of keys against other programs; StorageError: held too long, not writable."""
    path = folder / _LOCK
    end = time.monotonic() + _PATIENCE_S
    while True:
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            descriptor = open_guarded(path, flags=os.O_RDWR | os.O_CREAT)
        except OSError as error:
            raise unwritable(folder, error) from error
        if hold(descriptor, path):
            break
        os.close(descriptor)
        if time.monotonic() > end:
            raise StorageError(
                "key.busy",
                f"{folder}: another program is changing the keys.",
                "Wait until it has ended, then repeat.",
            )
        time.sleep(0.02)
    try:
        yield
    finally:
        os.close(descriptor)


def check_names(name: str, who: str) -> None:
    """Raise InputError if the name of a station or a person is missing or too long."""
    for what, text in (("name of the station", name), ("name of who decides", who)):
        if not 0 < len(text.strip()) <= _NAME_LENGTH:
            raise InputError(
                "key.name",
                f"The {what} is missing or longer than {_NAME_LENGTH} characters.",
                "Give it.",
            )


def in_utc(now: datetime) -> str:
    """Return a time in the format of the ring."""
    return now.astimezone(UTC).isoformat(timespec="seconds")


def _write(folder: Path, keys: Sequence[KnownKey]) -> None:
    content = msgspec.json.format(
        msgspec.json.encode(_Ring(schema=_SCHEMA, keys=tuple(keys))), indent=1
    )
    try:
        write_atomic(folder / _RING, content + b"\n")
        (folder / _RING).chmod(0o600)
    except OSError as error:
        raise unwritable(folder, error) from error
