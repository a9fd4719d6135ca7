"""Memory of the station: last recorded end of each chain, and the latest time seen.

A chain that was cut at its end, or replaced by an older copy, carries a good signature. The memory
of this user on this computer holds the last end of each chain, keyed by the identity of the thing
(job, history, cameras, probe), never by a path. A copy is recognized in any folder. Everything that
this station signs is in its memory before it is signed. So a missing memory is recognized by the
signature, except for files from before a `start_memory` by name.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import platformdirs

from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.host import HOST
from ocmm_core.leftovers import temporary_file
from ocmm_core.seals._key import THIS_STATION, KeyFolder
from ocmm_core.seals._private_file import guarded_content
from ocmm_core.seals._ring import check_names
from ocmm_core.seals._signature import Signature, Signed, judge_signature, sign

_WHAT = "memory of the station"
_CLOCK = "clock"
_PLACE = "folder "
_HISTORY = "history "


class KnownEnd(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Last recorded end of a chain."""

    name: str
    """Identity of the chain or of its thing."""
    count: int
    link: str
    """Number of lines, and hash of the last one; 0 before the first is written."""
    utc: str = ""
    """Latest time at which the chain was checked, ISO 8601 text; empty if unknown."""
    place: str = ""
    """Last path, for messages."""
    first: str = ""
    """Hash of the first line; only for things with a history."""
    moment: str = ""
    """Time of the last line, ISO 8601 text; only for things with a history."""
    thing: str = ""
    """Name under which the thing of this history is kept; only for histories."""
    replaced_by: str = ""
    """Path of the history that replaced this one; only from memories of version 0.1."""

    def holds_in(self, links: Sequence[str]) -> bool:
        """Return whether a chain still contains its last recorded line."""
        return not self.count or (len(links) >= self.count and links[self.count - 1] == self.link)


class _Start(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    utc: str
    who: str
    reason: str


class _SignedStart(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    start: _Start
    signature: Signature


def recall(name: str) -> KnownEnd | None:
    """Return the last recorded end of a chain, or None; StorageError: untrustworthy memory."""
    folder = memory_folder()
    _migrate(folder)
    return _read(folder / _file_name(name), name)


def remember(seen: KnownEnd, *, sync: bool = True) -> None:
    """Store the end of a chain. Failures are ignored: the missing memory is reported later.

    `sync`: flush to disk. Without it the memory may lag behind the chain after a power cut, never
    be ahead of it; a new file is flushed always, because a power cut could leave it empty.
    """
    path = memory_folder() / _file_name(seen.name)
    try:
        known = recall(seen.name)
    except StorageError:
        # Overwriting would hide that the memory was damaged.
        return
    if known == seen:
        return
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        _write(path, msgspec.json.encode(seen), sync=sync or known is None)


def expect(name: str, place: Path) -> None:
    """Create the memory of a chain that is about to get its first line."""
    with contextlib.suppress(StorageError):
        if recall(name) is None:
            remember(KnownEnd(name=name, count=0, link="", place=str(place)))


def station_clock() -> str:
    """Return the latest time of checking any history, or empty; StorageError as `recall`."""
    seen = recall(_CLOCK)
    return "" if seen is None else seen.utc


def set_station_clock(utc: str) -> None:
    remember(KnownEnd(name=_CLOCK, count=0, link="", utc=utc))


def memory_loss(name: str, last_utc: str, keys: KeyFolder) -> StorageError | None:
    """Return why a chain signed here is not remembered, or None; `last_utc`: ISO 8601 or ""."""
    start = _read_start(keys)
    if start is not None and _order(last_utc) <= _order(start.utc):
        return None
    return StorageError(
        "memory.missing",
        f"This station signed it, but its memory of it is missing in {memory_folder()} "
        f"({_file_name(name)}): a removed end would not be noticed.",
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
    """Accept everything signed up to now without memory, by name; return the time as stored.

    For a key that was moved to another computer or user without the memory. InputError: name or
    reason is missing. StorageError: the memory cannot be written, or the station has no key.
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


def memory_folder() -> Path:
    return platformdirs.user_state_path("ocmm") / "histories"


def _start_path() -> Path:
    return memory_folder() / "start.signed"


def _content(start: _Start) -> bytes:
    return msgspec.json.encode(start)


def _read_start(keys: KeyFolder) -> _Start | None:
    """Return the start of the memory if this station signed it."""
    try:
        content = guarded_content(_start_path(), _WHAT)
        if content is None:
            return None
        found = msgspec.json.decode(content, type=_SignedStart)
        state = judge_signature(keys, Signed.MEMORY, _content(found.start), found.signature)
        datetime.fromisoformat(found.start.utc)
    except (OcmmError, ValueError, RecursionError):
        return None
    return found.start if state.sound and state.station == THIS_STATION else None


def _read(path: Path, name: str) -> KnownEnd | None:
    content = guarded_content(path, _WHAT)
    if content is None:
        return None
    try:
        seen = msgspec.json.decode(content, type=KnownEnd)
        if seen.name != name or seen.count < 0 or (seen.utc and not _is_time(seen.utc)):
            raise ValueError("it is about something else")
    except (ValueError, RecursionError) as error:
        why = "it is empty" if not content else str(error)
        raise StorageError(
            "memory.damaged",
            f"{path}: the station's memory is damaged ({why}).",
            "Restore the file from a backup. If there is none, delete it and answer for what it "
            "was about by name: verify the calibration, check the tip, or ocmm audit adopt.",
        ) from error
    return seen


def _is_time(text: str) -> bool:
    return datetime.fromisoformat(text).tzinfo is not None


def _write(path: Path, content: bytes, *, sync: bool) -> None:
    descriptor, temporary = temporary_file(path)
    try:
        try:
            temporary.chmod(0o600)
            os.write(descriptor, content)
            if sync:
                os.fsync(descriptor)
        finally:
            # Windows replaces no file that is open.
            os.close(descriptor)
        temporary.replace(path)
        if sync:
            HOST.sync_folder(path.parent)
    finally:
        temporary.unlink(missing_ok=True)


def _migrate(folder: Path) -> None:
    """Convert a memory of version 0.1, which was keyed by path, once."""
    clock = folder / _file_name(_CLOCK)
    if clock.exists() or not folder.is_dir():
        return
    known: dict[Path, KnownEnd] = {}
    for path in sorted(folder.glob("*.json")):
        with contextlib.suppress(OcmmError, ValueError, RecursionError):
            seen = msgspec.json.decode(guarded_content(path, _WHAT) or b"", type=KnownEnd)
            if path.name == _file_name(seen.name):
                known[path] = seen
    places = {seen.place: seen for seen in known.values() if seen.name.startswith(_PLACE)}
    with contextlib.suppress(OSError):
        for path, seen in known.items():
            there = places.get(seen.place)
            if seen.name.startswith(_HISTORY) and there is not None and there.link != seen.link:
                late = msgspec.structs.replace(seen, replaced_by=seen.place)
                _write(path, msgspec.json.encode(late), sync=True)
        latest = max((seen.utc for seen in known.values()), default="", key=_order)
        _write(
            clock,
            msgspec.json.encode(KnownEnd(name=_CLOCK, count=0, link="", utc=latest)),
            sync=True,
        )
        for path, seen in known.items():
            if seen.name.startswith(_PLACE):
                path.unlink()


def _order(utc: str) -> float:
    with contextlib.suppress(ValueError):
        return datetime.fromisoformat(utc).timestamp()
    return -float("inf")


def _file_name(name: str) -> str:
    digest = hashlib.sha256(name.encode("utf-8", "surrogateescape")).hexdigest()[:32]
    return f"{digest}.json"
