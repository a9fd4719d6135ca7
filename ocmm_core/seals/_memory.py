"""Memory of the station: last recorded end of each chain, and the latest time seen.

A cut chain or an older copy carries a good signature. This user's memory holds the last end of each
chain by the identity of its thing (job, history, cameras, probe), never by a path. Everything that
this station signs is in it before it is signed; see `_anchor`.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

import msgspec
import platformdirs

from ocmm_core.cleanup import temporary_file
from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.host import HOST
from ocmm_core.seals._private_file import guarded_content

MEMORY = "memory of the station"
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


def memory_folder() -> Path:
    return platformdirs.user_state_path("ocmm") / "histories"


def memory_file(name: str) -> Path:
    """Return the path of the memory of a thing, by its identity."""
    digest = hashlib.sha256(name.encode("utf-8", "surrogateescape")).hexdigest()[:32]
    return memory_folder() / f"{digest}.json"


def recall(name: str) -> KnownEnd | None:
    """Return the last recorded end of a chain; None if the station has never seen it.

    Raises StorageError if the memory is damaged, unreadable, or writable by others.
    """
    _migrate(memory_folder())
    return _read(memory_file(name), name)


def remember(seen: KnownEnd, *, sync: bool = True) -> None:
    """Store the end of a chain. Failures are ignored: the missing memory is reported later.

    `sync`: flush to disk, as a new file always is; otherwise it may lag behind after a power cut.
    """
    path = memory_file(seen.name)
    try:
        known = recall(seen.name)
    except StorageError:
        # Overwriting would hide that the memory was damaged.
        return
    if known == seen:
        return
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        write_private(path, msgspec.json.encode(seen), sync=sync or known is None)


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


def _read(path: Path, name: str) -> KnownEnd | None:
    content = guarded_content(path, MEMORY)
    if content is None:
        return None
    try:
        seen = msgspec.json.decode(content, type=KnownEnd)
        if (
            seen.name != name
            or seen.count < 0
            or (seen.utc and datetime.fromisoformat(seen.utc).tzinfo is None)
        ):
            raise ValueError("it is about something else")
    except (ValueError, RecursionError) as error:
        why = "it is empty" if not content else str(error)
        raise StorageError(
            "memory.damaged",
            f"{path}: the station's memory is damaged ({why}).",
            "Restore the file from a backup. If there is none, move it to another folder and keep "
            "it. What it was about is then in doubt, until you answer for it by name: verify the "
            "calibration, check the tip, or ocmm audit adopt.",
        ) from error
    return seen


def write_private(path: Path, content: bytes, *, sync: bool) -> None:
    """Replace a file of the memory; OSError."""
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
    """Convert a memory of version 0.1, which was keyed by path, once.

    It kept the end of the history for each folder and for each history. A history whose folder
    holds another one now was replaced.
    """
    clock = memory_file(_CLOCK)
    if clock.exists() or not folder.is_dir():
        return
    known: dict[Path, KnownEnd] = {}
    for path in sorted(folder.glob("*.json")):
        with contextlib.suppress(OcmmError, ValueError, RecursionError):
            seen = msgspec.json.decode(guarded_content(path, MEMORY) or b"", type=KnownEnd)
            if path == memory_file(seen.name):
                known[path] = seen
    places = {seen.place: seen for seen in known.values() if seen.name.startswith(_PLACE)}
    with contextlib.suppress(OSError):
        for path, seen in known.items():
            there = places.get(seen.place)
            if seen.name.startswith(_HISTORY) and there is not None and there.link != seen.link:
                late = msgspec.structs.replace(seen, replaced_by=seen.place)
                write_private(path, msgspec.json.encode(late), sync=True)
        latest = max((seen.utc for seen in known.values()), default="", key=order_of)
        write_private(
            clock,
            msgspec.json.encode(KnownEnd(name=_CLOCK, count=0, link="", utc=latest)),
            sync=True,
        )
        for path, seen in known.items():
            if seen.name.startswith(_PLACE):
                path.unlink()


def order_of(utc: str) -> float:
    with contextlib.suppress(ValueError):
        return datetime.fromisoformat(utc).timestamp()
    return -float("inf")
