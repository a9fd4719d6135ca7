"""Rebuild of an archive from job files alone."""

from __future__ import annotations

import hashlib
import re
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from ocmm_core.documents import find_files
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.inspection.finished import SUFFIX
from ocmm_shop.archive.records import Delivery, ExtractedJob, Sender, extract_job, snapshot
from ocmm_shop.archive.stores import Archive, stations_by_key

Tell = Callable[[str, float], None]

_AT_ONCE = 50
_KEY = re.compile(r"[0-9a-f]{16,}")
"""Length of a fingerprint as displayed, or more."""


@dataclass(frozen=True, slots=True)
class Rebuilt:
    kept: int
    """Number of jobs now in the archive."""
    unread: tuple[str, ...]
    """Reasons for unread files, a sentence each."""


def rebuild(
    archive: Archive,
    contents: Iterable[tuple[str, bytes]],
    stations: Mapping[str, str],
    tell: Tell = lambda what, share: None,
) -> Rebuilt:
    """Fill an empty archive from job files.

    `contents`: name and bytes of each file; may include all versions of a job. `stations`: name of
    the station by the fingerprint of its key, or a prefix of it. InputError: the archive is not
    empty. StorageError: it cannot be written.
    """
    if archive.query("SELECT 1 FROM job LIMIT 1").rows:
        raise InputError(
            "archive.not_empty",
            f"{archive.place}: there are jobs in it.",
            "Rebuild into a new archive, compare them (ocmm archive verify --against), then use "
            "the new one.",
        )
    box = str(uuid.uuid4())
    unread: list[str] = []
    made: list[tuple[str, ExtractedJob]] = []
    for name, content in contents:
        tell(f"Reading {name}", 0.0)
        try:
            made.append((name, extract_job(content, name, "")))
        except OcmmError as error:
            unread.append(f"{name}: {error.what}")
    # Versions of a job in chronological order: each is compared with the earlier ones.
    made.sort(key=lambda one: (one[1].record.job.changed_utc, one[1].record.job.steps))
    heads: dict[tuple[str, str], dict[int, str]] = {}
    waiting: list[Delivery] = []
    kept = 0
    for number, (name, one) in enumerate(made, start=1):
        job = one.record.job
        station = _named(stations, job.signer)
        known = heads.setdefault((job.job_uuid, station), {})
        again = extract_job(one.content, name, station, known or None)
        if not again.record.job.fault:
            known[job.steps] = job.head
        waiting.append(
            Delivery(
                sender=Sender(outbox=_box(box, station), station=station, machine="", host="",
                              user="rebuild"),
                sequence=number, sent_utc=datetime.now(UTC).isoformat(timespec="milliseconds"),
                record=again.record, content=one.content,
            )
        )  # fmt: skip
        if len(waiting) >= _AT_ONCE or number == len(made):
            archive.put_all(waiting)
            kept += len(waiting)
            waiting = []
            tell(f"Kept {kept} of {len(made)} jobs", kept / len(made))
    return Rebuilt(kept, tuple(unread))


def files_of(folders: Iterable[Path], unread: Callable[[str], None]) -> Iterator[tuple[str, bytes]]:
    """Yield name and bytes of all job files in folders; ``unread`` gets faults."""
    for folder in folders:
        paths, left_out = find_files(folder, SUFFIX) if folder.is_dir() else ([folder], [])
        for one in left_out:
            unread(one.what)
        for path in paths:
            try:
                yield path.name, snapshot(path)
            except OcmmError as error:
                unread(error.what)


def files_in(archive: Archive, unread: Callable[[str], None]) -> Iterator[tuple[str, bytes]]:
    """Yield the job files in an archive, regardless of its rows; ``unread`` gets faults."""
    for (sha256,) in archive.query("SELECT sha256 FROM file ORDER BY sha256").rows:
        try:
            yield f"{str(sha256)[:12]}{SUFFIX}", archive.content(str(sha256))
        except OcmmError as error:
            unread(error.what)


def stations_of(archive: Archive) -> dict[str, str]:
    """Return stations by fingerprint: with proof of the key; in old archives, the first sender."""
    proven = stations_by_key(archive)
    found: dict[str, str] = {}
    rows = archive.query("SELECT signer, key, station FROM job WHERE signer <> '' ORDER BY id").rows
    for signer, key, station in rows:
        own = proven.get(str(key), {str(station)})
        if str(station) in own or str(signer) not in found:
            found.setdefault(str(signer), str(station) if str(station) in own else min(own))
    return found


def key_and_name(text: str) -> tuple[str, str]:
    """Return fingerprint prefix and station of ``KEY=STATION``; InputError otherwise."""
    shown, _, name = text.partition("=")
    key = shown.replace("-", "").lower()
    if not _KEY.fullmatch(key) or not name.strip():
        raise InputError(
            "archive.key",
            f"'{text}' does not name a station: KEY=STATION is expected.",
            "Give the key as 'ocmm key show' prints it on that station.",
        )
    return key, name.strip()


def _named(stations: Mapping[str, str], signer: str) -> str:
    found = [name for key, name in stations.items() if key and signer.startswith(key)]
    if found:
        # Names given by hand override those of an old archive.
        return found[-1]
    return f"key {signer[:8]}" if signer else "unknown station"


def _box(box: str, station: str) -> str:
    """Return an outbox for each station, because the archive keeps one name for each."""
    return str(uuid.UUID(bytes=hashlib.sha256(f"{box} {station}".encode()).digest()[:16]))
