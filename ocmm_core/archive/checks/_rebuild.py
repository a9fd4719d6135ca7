"""An archive made anew from job files alone, and one that is held against its own files.

Rows follow from a file (`_extract`), so that both are the same comparison: what is in the archive
against what its files say.
"""

from __future__ import annotations

import hashlib
import re
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from ocmm_core.archive.records import (
    Delivery,
    Extract,
    ExtractedJob,
    JobRecord,
    MarkRow,
    Sender,
    extract_job,
    snapshot,
)
from ocmm_core.archive.stores import Archive
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.inspection.archive import SUFFIX

Tell = Callable[[str, float], None]

_AT_ONCE = 50
_KEY = re.compile(r"[0-9a-f]{16,}")
"""As much of a fingerprint as people are shown, or more."""


@dataclass(frozen=True, slots=True)
class Rebuilt:
    """What became of the files."""

    kept: int
    """How many jobs are in the archive now."""
    unread: tuple[str, ...]
    """Why files are not, a sentence each."""


@dataclass(frozen=True, slots=True)
class Checked:
    """What an archive and its files say of each other."""

    looked_at: int
    """How many jobs."""
    faults: tuple[tuple[str, str], ...]
    """Identity of a job, and what is wrong with it in a sentence."""


def rebuild(
    archive: Archive,
    contents: Iterable[tuple[str, bytes]],
    stations: Mapping[str, str],
    tell: Tell = lambda what, share: None,
    extract: Extract = extract_job,
) -> Rebuilt:
    """Fill an empty archive from job files.

    Parameters
    ----------
    contents
        Name and bytes of each file; all versions of a job may be among them.
    stations
        Name of the station by the fingerprint of the key that signed, or by its beginning.

    Raises
    ------
    InputError
        The archive is not empty.
    StorageError
        It cannot be written.
    """
    if archive.ask("SELECT 1 FROM job LIMIT 1").rows:
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
            made.append((name, extract(content, name, "", None)))
        except OcmmError as error:
            unread.append(f"{name}: {error.what}")
    # Versions of a job in the order in which they came to be: each is held against those before.
    made.sort(key=lambda one: (one[1].record.job.changed_utc, one[1].record.job.steps))
    heads: dict[str, dict[int, str]] = {}
    waiting: list[Delivery] = []
    kept = 0
    for number, (name, one) in enumerate(made, start=1):
        job = one.record.job
        station = _named(stations, job.signer)
        known = heads.setdefault(job.job_uuid, {})
        again = extract(one.content, name, station, known or None)
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
    """Give name and bytes of all job files in folders; ``unread`` is told of those it cannot."""
    for folder in folders:
        for path in sorted(folder.rglob(f"*{SUFFIX}")) if folder.is_dir() else [folder]:
            try:
                yield path.name, snapshot(path)
            except OcmmError as error:
                unread(error.what)


def files_in(archive: Archive) -> Iterator[tuple[str, bytes]]:
    """Give the job files that an archive keeps, whatever its rows say."""
    for (sha256,) in archive.ask("SELECT sha256 FROM file ORDER BY sha256").rows:
        yield f"{str(sha256)[:12]}{SUFFIX}", archive.content(str(sha256))


def stations_of(archive: Archive) -> dict[str, str]:
    """Return the name of the station by the fingerprint of the key that signed its jobs."""
    rows = archive.ask("SELECT DISTINCT signer, station FROM job WHERE signer <> ''").rows
    return {str(signer): str(station) for signer, station in rows}


def records_of(archive: Archive) -> Iterator[JobRecord]:
    """Give the rows of all jobs in an order that does not depend on how they came in."""
    rows = archive.ask("SELECT id FROM job ORDER BY job_uuid, steps, head, sound").rows
    for (number,) in rows:
        yield archive.record(int(str(number)))


def differences(first: Archive, second: Archive, most: int = 100) -> list[str]:
    """Return in sentences where two archives do not hold the same rows; empty where they do."""
    found: list[str] = []
    one, two = ({_key(r): r for r in records_of(archive)} for archive in (first, second))
    for key in sorted(one.keys() | two.keys()):
        if len(found) >= most:
            found.append("There are more differences.")
            break
        job = f"Job {key[0][:8]} at step {key[1]}"
        if key not in one:
            found.append(f"{job} is only in {second.place}.")
        elif key not in two:
            found.append(f"{job} is only in {first.place}.")
        elif one[key] != two[key]:
            fields = [
                name
                for name in one[key].job.__struct_fields__
                if getattr(one[key].job, name) != getattr(two[key].job, name)
            ]
            fields += [
                n for n in ("results", "uses") if getattr(one[key], n) != getattr(two[key], n)
            ]
            found.append(f"{job} differs in {', '.join(fields)}.")
    return found


def verify_archive(
    archive: Archive,
    *,
    deep: bool = True,
    tell: Tell = lambda what, share: None,
    extract: Extract = extract_job,
) -> Checked:
    """Hold every job in an archive against its own file.

    Parameters
    ----------
    deep
        Compute its rows again; otherwise only the hash of the file.
    """
    rows = archive.ask(
        "SELECT id, job_uuid, sha256, station, steps, sound FROM job ORDER BY job_uuid, steps, id"
    ).rows
    faults: list[tuple[str, str]] = []
    heads: dict[str, dict[int, str]] = {}
    for done, (number, job_uuid, sha256, station, _steps, _sound) in enumerate(rows, start=1):
        tell(f"Checked {done} of {len(rows)} jobs", done / len(rows))
        try:
            content = archive.content(str(sha256))
            if not deep:
                continue
            stored = archive.record(int(str(number)))
            name = f"{str(sha256)[:12]}{SUFFIX}"
            known = heads.setdefault(str(job_uuid), {})
            made = extract(content, name, str(station), known or None).record
        except OcmmError as error:
            faults.append((str(job_uuid), error.what))
            continue
        if not stored.job.fault:
            known[stored.job.steps] = stored.job.head
        if bool(made.job.fault) != bool(stored.job.fault):
            why = made.job.fault or "The archive names a fault that its file does not have."
            faults.append((str(job_uuid), why))
        elif not made.job.fault and made != stored:
            faults.append(
                (str(job_uuid), "Rows in the archive are not those of the job file: altered there.")
            )
    return Checked(len(rows), tuple(faults))


def verify_files(archive: Archive, folders: Iterable[Path]) -> Checked:
    """Hold job files in folders against what was archived of them.

    One whose audit does not hold the archived step as it was then was altered after that.
    """
    faults: list[tuple[str, str]] = []
    looked = 0
    for name, content in files_of(folders, lambda why: faults.append(("", why))):
        looked += 1
        try:
            found = extract_job(content, name, "")
            job = found.record.job
            known = archive.heads(job.job_uuid)
            job = extract_job(content, name, "", known).record.job if known else job
        except OcmmError as error:
            faults.append(("", f"{name}: {error.what}"))
            continue
        if job.fault:
            faults.append((job.job_uuid, f"{name}: {job.fault}"))
        elif not known:
            faults.append((job.job_uuid, f"{name}: not in the archive."))
        elif max(known) > job.steps:
            faults.append((job.job_uuid, f"{name}: an older copy of what is in the archive."))
    return Checked(looked, tuple(faults))


def mark_altered(archive: Archive, checked: Checked, who: str) -> int:
    """Take jobs with faults out of statistics by marks that name them; return how many."""
    utc = datetime.now(UTC).isoformat(timespec="milliseconds")
    marks = [
        MarkRow(job_uuid=job, kind="altered", holds=True, why=why[:3000], who=who, utc=utc)
        for job, why in checked.faults
        if job
    ]
    if marks:
        archive.add_finding("verify", archive.place[:300], "{}", who, utc, marks)
    return len(marks)


def _key(record: JobRecord) -> tuple[str, int, str, bool]:
    job = record.job
    return job.job_uuid, job.steps, job.head, not job.fault


def key_and_name(text: str) -> tuple[str, str]:
    """Return the beginning of a fingerprint, and the station, of ``KEY=STATION``.

    Raises
    ------
    InputError
        It is something else.
    """
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
        # What was named last by hand comes after what an old archive says.
        return found[-1]
    return f"key {signer[:8]}" if signer else "unknown station"


def _box(box: str, station: str) -> str:
    """Return an outbox for each station, as the archive keeps one name for each."""
    return str(uuid.UUID(bytes=hashlib.sha256(f"{box} {station}".encode()).digest()[:16]))
