"""Signed list of the ends in the memory, kept outside this computer (an archive, a disk).

Trusting computers learn ends from it; the station detects that its memory was set back. A missing
memory is detected by its signature, or accepted by name.
"""

from __future__ import annotations

import contextlib
from collections.abc import Container, Iterable, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.seals import _memory as memory
from ocmm_core.seals._key import THIS_STATION, KeyFolder
from ocmm_core.seals._private_file import guarded_content
from ocmm_core.seals._public import check_names, public_text
from ocmm_core.seals._signature import Signature, Signed, judge_signature, sign
from ocmm_core.side_files import SIDE_FILES, Trusted, read_guarded

_MOST_MEMORY = SIDE_FILES[Trusted.MEMORY][0].most

JOB = "job "
"""Prefix of the names of jobs in the memory."""
_INDEX, _LARGEST_INDEX = "ends.index", 1 << 26
_PAGE, _MET = 500, 20
"""Ends in a list; a long memory makes several. Latest jobs after which all earlier are listed."""


class _Heads(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    heads: tuple[memory.KnownEnd, ...] = ()
    jobs: tuple[memory.KnownEnd, ...] = ()
    """A list has either the ends of histories, or those of jobs."""


class _SignedHeads(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    content: _Heads
    signature: Signature


def signed_heads(keys: KeyFolder, kept: Iterable[str] = ()) -> list[str]:
    """Return lists of the signed ends of all histories in the memory, without those in `kept`.

    StorageError: the key of the station cannot be used.
    """
    known = (one for one in known_ends() if one.thing or one.first)
    new = _pages(sorted(known, key=lambda one: one.name))
    for content in _own_lists(keys, kept) if new else ():
        new = [page for page in new if page != content.heads]
        if not new:
            break
    return [_signed(_Heads(heads=page), keys) for page in new]


def signed_job_heads(keys: KeyFolder, kept: Iterable[str] = ()) -> list[str]:
    """Return lists of the signed ends of jobs in no list ``kept``; errors as `signed_heads`.

    `kept`: newest first, read until it has enough of the latest ends. The earliest of the result
    are first: a list that could not be stored is made again.
    """
    latest = [one for one in known_ends() if one.name.startswith(JOB)]
    before: set[memory.KnownEnd] = set()
    met: list[int] = []
    for content in _own_lists(keys, kept) if latest else ():
        before.update(content.jobs)
        met = [place for place, one in enumerate(latest) if one in before][_MET - 1 : _MET]
        if met:
            break
    new = [one for one in latest[: met[0] if met else None] if one not in before]
    return [_signed(_Heads(jobs=page), keys) for page in _pages(new[::-1])]


def _pages(ends: Sequence[memory.KnownEnd]) -> list[tuple[memory.KnownEnd, ...]]:
    return [tuple(ends[first : first + _PAGE]) for first in range(0, len(ends), _PAGE)]


def _signed(content: _Heads, keys: KeyFolder) -> str:
    signature = sign(keys.station_key(), Signed.MEMORY, msgspec.json.encode(content))
    return msgspec.json.encode(_SignedHeads(content, signature)).decode("ascii")


def _own_lists(keys: KeyFolder, kept: Iterable[str]) -> Iterator[_Heads]:
    own = public_text(keys.station_key().public)
    for text in kept:
        with contextlib.suppress(ValueError, RecursionError, StorageError):
            known = msgspec.json.decode(text, type=_SignedHeads)
            content = msgspec.json.encode(known.content)
            if (
                known.signature.key == own
                and judge_signature(keys, Signed.MEMORY, content, known.signature).sound
            ):
                yield known.content


def learn_heads(
    text: str, place: str, keys: KeyFolder, known: Container[memory.KnownEnd] = ()
) -> int:
    """Add ends beyond those in the memory, return their number; StorageError: not trusted.

    `known`: ends of `known_ends`, which are not read again.
    """
    try:
        found = msgspec.json.decode(text, type=_SignedHeads)
    except (ValueError, RecursionError) as error:
        raise _refused(place, "it is damaged") from error
    content = msgspec.json.encode(found.content)
    state = judge_signature(keys, Signed.MEMORY, content, found.signature)
    if not state.sound:
        raise _refused(place, f"its signature is {state.word.value}")
    learned = 0
    for seen in (*found.content.heads, *found.content.jobs):
        if seen in known:
            continue
        job = seen.name.startswith(JOB)
        # Other stations may not change the ends of this station's own jobs.
        foreign = job and state.station != THIS_STATION
        with contextlib.suppress(StorageError, ValueError):
            learned += _learn(msgspec.structs.replace(seen, place=place), foreign=foreign)
    return learned


def _learn(seen: memory.KnownEnd, *, foreign: bool) -> bool:
    known = memory.recall(seen.name)
    if known is not None and not _is_later(seen, known):
        return False
    if known is not None and foreign and known.place != seen.place:
        return False
    memory.remember(seen if known is None else msgspec.structs.replace(seen, utc=known.utc))
    return True


def _is_later(seen: memory.KnownEnd, known: memory.KnownEnd) -> bool:
    if seen.moment and known.moment:
        return datetime.fromisoformat(seen.moment) > datetime.fromisoformat(known.moment)
    return seen.count > known.count


class _IndexedEnd(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    changed_ns: int
    inode: int
    """When the file was read: another content, owner or mode changes one of them."""
    end: memory.KnownEnd


def known_ends() -> list[memory.KnownEnd]:
    """Return all ends in the memory, latest first, without times and places.

    Only files that changed since the last call are read; an index keeps the others.
    """
    folder = memory.memory_folder()
    before = _read_index(folder / _INDEX)
    now: dict[str, _IndexedEnd] = {}
    written: dict[str, float] = {}
    for path in folder.glob("*.json"):
        with contextlib.suppress(OSError, ValueError, OcmmError, RecursionError):
            state, one = path.stat(), before.get(path.stem)
            if one is None or (one.changed_ns, one.inode) != (state.st_ctime_ns, state.st_ino):
                content = read_guarded(path, _MOST_MEMORY, follow=False)
                seen = memory.recall(msgspec.json.decode(content, type=memory.KnownEnd).name)
                if seen is None:
                    continue
                bare = msgspec.structs.replace(seen, utc="", place="")
                one = _IndexedEnd(state.st_ctime_ns, state.st_ino, bare)
            now[path.stem], written[path.stem] = one, state.st_mtime
    if now != before:
        with contextlib.suppress(OSError):
            memory.write_private(folder / _INDEX, msgspec.json.encode(now), sync=False)
    latest = sorted(now, key=written.__getitem__, reverse=True)
    return [now[name].end for name in latest if now[name].end.count]


def _read_index(path: Path) -> dict[str, _IndexedEnd]:
    """Return the index, empty if it cannot be used: then all files are read."""
    with contextlib.suppress(OcmmError, ValueError, RecursionError):
        content = guarded_content(path, memory.MEMORY, most=_LARGEST_INDEX)
        if content is not None:
            return msgspec.json.decode(content, type=dict[str, _IndexedEnd])
    return {}


def _refused(place: str, why: str) -> StorageError:
    return StorageError(
        "memory.heads",
        f"{place}: the list of known ends is not taken over ({why}).",
        "If a station of yours wrote it, trust its key first: ocmm key trust.",
    )


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
    if start is not None and memory.order_of(last_utc) <= memory.order_of(start.utc):
        return None
    return StorageError(
        "memory.missing",
        f"This station signed it, but its memory of it is missing in {memory.memory_folder()} "
        f"({memory.memory_file(name).name}): a removed end would not be noticed.",
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
    return memory.memory_folder() / "start.signed"


def _content(start: _Start) -> bytes:
    return msgspec.json.encode(start)


def _read_start(keys: KeyFolder) -> _Start | None:
    """Return the start of the memory if this station signed it."""
    try:
        content = guarded_content(_start_path(), memory.MEMORY)
        if content is None:
            return None
        found = msgspec.json.decode(content, type=_SignedStart)
        state = judge_signature(keys, Signed.MEMORY, _content(found.start), found.signature)
        datetime.fromisoformat(found.start.utc)
    except (OcmmError, ValueError, RecursionError):
        return None
    return found.start if state.sound and state.station == THIS_STATION else None
