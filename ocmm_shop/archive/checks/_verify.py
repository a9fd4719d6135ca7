"""Verification of an archive against its own files, job files, and another archive.

Every column is recomputed from the file; each difference is named.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from ocmm_core.errors import OcmmError
from ocmm_core.inspection.finished import SUFFIX
from ocmm_core.seals import Signed
from ocmm_core.storage import JobFile
from ocmm_shop.archive import records
from ocmm_shop.archive.checks._rebuild import Tell, files_of
from ocmm_shop.archive.stores import Archive, Cell, stations_by_key, verifies

_ROUNDING = 1e-9
"""Other processors round otherwise: 1e-9 of a number, or of a millimetre."""
_MOST_NAMED = 8
"""Maximum number of named differences of one job."""
_OFF = (
    # Columns that repeat the job's, for their indices.
    ("a result has the part or the start of another job",
     "EXISTS (SELECT 1 FROM result r WHERE r.job = j.id"
     " AND (r.part <> j.part OR r.created_utc <> j.created_utc))"),
    ("a use has the start of another job",
     "EXISTS (SELECT 1 FROM used u WHERE u.job = j.id AND u.created_utc <> j.created_utc)"),
    ("no delivery brought it", "NOT EXISTS (SELECT 1 FROM delivery d WHERE d.job = j.id)"),
    ("its delivery came by another login",
     "NOT EXISTS (SELECT 1 FROM delivery d WHERE d.job = j.id AND d.role = j.role)"),
)  # fmt: skip
"""Rows that contradict their job, regardless of its file."""


@dataclass(frozen=True, slots=True)
class Checked:
    looked_at: int
    faults: tuple[tuple[str, str], ...]
    """Identity of a job, empty for none, and its fault in a sentence."""
    suspect: frozenset[str] = frozenset()
    """Jobs whose valid version is faulty; foreign copies displace nothing."""


@dataclass(slots=True)
class _Versions:
    """The sound versions of a job by station, from their files."""

    heads: dict[str, dict[int, str]] = field(default_factory=lambda: defaultdict(dict))
    longest: tuple[int, str] = (0, "")
    """Steps and file of the longest version."""


def verify_archive(
    archive: Archive, *, deep: bool = True, tell: Tell = lambda what, share: None
) -> Checked:
    """Compare every row with its job file: its hash, and if `deep` its recomputed rows."""
    rows = archive.query("SELECT id, job_uuid, sha256, station FROM job ORDER BY id").rows
    faults: list[_Fault] = []
    jobs: dict[str, _Versions] = defaultdict(_Versions)
    for done, (number, job, sha256, station) in enumerate(rows, start=1):
        tell(f"Checked {done} of {len(rows)} jobs", done / len(rows))
        try:
            content = archive.content(str(sha256))
            if not deep:
                continue
            known = jobs[str(job)].heads[str(station)]
            stored = archive.record(int(str(number)))
            # A fault begins with the file name at its station, which is not part of the fact.
            name = stored.job.fault.partition(":")[0]
            name = name if name.endswith(SUFFIX) else f"{str(sha256)[:12]}{SUFFIX}"
            made = records.extract_job(content, name, str(station), known or None).record
        except OcmmError as error:
            faults.append((number, str(job), error.what))
            continue
        if made.job.fault:
            faults.append((number, str(job), made.job.fault))
        elif made.job.job_uuid == job:
            known[made.job.steps] = made.job.head
            jobs[str(job)].longest = max(jobs[str(job)].longest, (made.job.steps, str(sha256)))
        if why := _differs(stored, made):
            faults.append((number, str(job), why))
    if deep:
        faults += [*_forked(archive, jobs), *_beside(archive), *_claims(archive)]
        faults += [(None, "", why) for why in archive.malformed()]
    counts = {row[0] for row in archive.query("SELECT job_id FROM archived_job").rows}
    return Checked(
        len(rows),
        tuple(dict.fromkeys((job, why) for _, job, why in faults)),
        frozenset(job for number, job, _ in faults if number in counts),
    )


_Fault = tuple[Cell, str, str]
"""Number of a row of ``job``, None for none, identity of the job, and a sentence."""


def _differs(stored: records.JobRecord, made: records.JobRecord) -> str:
    """Return in a sentence the differences of a row from its file; empty if there are none."""
    named = [
        f"{name} {_shown(one)}, by the file {_shown(other)}"
        for name, one, other in _fields(stored.job, made.job)
    ]
    for what, ours, theirs in (
        ("result", stored.results, made.results), ("use", stored.uses, made.uses),
    ):  # fmt: skip
        if len(ours) != len(theirs):
            named.append(f"{len(ours)} {what}s, by the file {len(theirs)}")
        for at, (one, other) in enumerate(zip(ours, theirs, strict=False)):
            named += [
                f"{what} {at + 1} {name} {_shown(a)}, by the file {_shown(b)}"
                for name, a, b in _fields(one, other)
            ]
    if not named:
        return ""
    more = f"; {len(named) - _MOST_NAMED} more" if len(named) > _MOST_NAMED else ""
    return f"Altered in the archive: {'; '.join(named[:_MOST_NAMED])}{more}."


def _fields(one: msgspec.Struct, other: msgspec.Struct) -> Iterator[tuple[str, object, object]]:
    for name in one.__struct_fields__:
        a, b = getattr(one, name), getattr(other, name)
        if not _alike(a, b):
            yield name, a, b


def _alike(one: object, other: object) -> bool:
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=_ROUNDING, abs_tol=_ROUNDING)
    return one == other


def _shown(value: object) -> str:
    text = records.shown_text(f"'{value}'" if isinstance(value, str) else str(value))
    return text if len(text) <= 80 else f"{text[:80]}…"


def _forked(archive: Archive, jobs: Mapping[str, _Versions]) -> Iterator[_Fault]:
    """Yield jobs of which two stations sent versions that do not continue one another."""
    for job, versions in jobs.items():
        sent = {station: heads for station, heads in versions.heads.items() if heads}
        if len(sent) < 2:
            continue
        content = archive.content(versions.longest[1])
        with JobFile.in_memory(Path(f"{versions.longest[1][:12]}{SUFFIX}"), content) as file:
            links = file.links()
        off = sorted(
            station for station, heads in sent.items()
            if any(links.get(steps) != head for steps, head in heads.items())
        )  # fmt: skip
        if off:
            names = ", ".join(map(_shown, sorted(sent)))
            why = f"Several stations sent versions that do not continue one another: {names}."
            yield None, job, why


def _beside(archive: Archive) -> Iterator[_Fault]:
    """Yield rows that contradict their job."""
    for why, off in _OFF:
        for number, job in archive.query(f"SELECT j.id, j.job_uuid FROM job j WHERE {off}").rows:  # noqa: S608
            yield number, str(job), f"Altered in the archive: {why}."
    for outbox, sequence in archive.query(
        "SELECT d.outbox, d.sequence FROM delivery d"
        " WHERE NOT EXISTS (SELECT 1 FROM job j WHERE j.id = d.job) ORDER BY 1, 2"
    ).rows:
        why = f"The job of delivery {sequence!s} of outbox {str(outbox)[:8]} was removed."
        yield None, "", f"Altered in the archive: {why}"


def _claims(archive: Archive) -> Iterator[_Fault]:
    """Yield keys and deliveries with a wrong signature, and jobs of other stations."""
    stations = stations_by_key(archive)
    for claimant, key in archive.query("SELECT station, key FROM archive_station_key").rows:
        if str(claimant) not in stations.get(str(key), ()):
            yield None, "", f"Station {_shown(claimant)} did not prove that a key is its own."
    for outbox, sequence, sha256, signature, station, number, job in archive.query(
        "SELECT d.outbox, d.sequence, d.sha256, d.signature, j.station, j.id, j.job_uuid"
        " FROM delivery d JOIN job j ON j.id = d.job WHERE d.signature <> ''"
    ).rows:
        claim = records.delivery_claim(str(outbox), int(str(sequence)), str(sha256))
        own = [key for key, names in stations.items() if str(station) in names]
        if not any(verifies(Signed.DELIVERY, claim, key, str(signature)) for key in own):
            why = f"Delivery {sequence!s} was not signed by station {_shown(station)}."
            yield number, str(job), why
    # A copy of a job that its own station also sent is harmless.
    for number, job, station, key in archive.query(
        "SELECT j.id, j.job_uuid, j.station, j.key FROM job j WHERE j.sound = 1 AND NOT EXISTS"
        " (SELECT 1 FROM job o JOIN station_key k ON k.station = o.station AND k.key = o.key"
        " WHERE o.job_uuid = j.job_uuid AND o.sha256 = j.sha256 AND o.sound = 1)"
    ).rows:
        proven = stations.get(str(key), set())
        if proven and str(station) not in proven:
            names = ", ".join(map(_shown, sorted(proven)))
            why = f"Sent as station {_shown(station)}, signed by the key of {names}."
            yield number, str(job), why


def verify_files(archive: Archive, folders: Iterable[Path]) -> Checked:
    """Compare job files with archived versions; one without the archived step was altered."""
    faults: list[tuple[str, str]] = []
    looked = 0
    for name, content in files_of(folders, lambda why: faults.append(("", why))):
        looked += 1
        try:
            job = records.extract_job(content, name, "").record.job
            known = {
                int(str(steps)): str(head)
                for steps, head in archive.query(
                    "SELECT steps, head FROM archived_job WHERE job_uuid = :job AND fault = ''",
                    {"job": job.job_uuid},
                ).rows
            }
            job = records.extract_job(content, name, "", known).record.job if known else job
        except OcmmError as error:
            faults.append(("", f"{name}: {error.what}"))
            continue
        if job.fault:
            faults.append((job.job_uuid, f"{name}: {job.fault}"))
        elif not known:
            faults.append((job.job_uuid, f"{name}: not in the archive."))
        elif max(known) > job.steps:
            faults.append((job.job_uuid, f"{name}: an older copy of what is in the archive."))
    return Checked(looked, tuple(faults), frozenset(job for job, _ in faults if job))


def mark_altered(archive: Archive, checked: Checked, who: str) -> int:
    """Exclude faulty jobs from statistics by signed marks; return how many."""
    utc = datetime.now(UTC).isoformat(timespec="milliseconds")
    marks = [
        records.MarkRow(job_uuid=job, kind="altered", holds=True, why=why[:3000], who=who, utc=utc)
        for job, why in checked.faults
        if job in checked.suspect and records.is_identity(job)
    ]
    if marks:
        archive.add_finding("verify", archive.place[:300], "{}", who, utc, marks)
    return len(marks)


def records_of(archive: Archive, unread: Callable[[str], None]) -> Iterator[records.JobRecord]:
    """Yield the rows of all jobs independent of their arrival; ``unread`` gets faults."""
    rows = archive.query("SELECT id FROM job ORDER BY job_uuid, steps, head, sound, station").rows
    for (number,) in rows:
        try:
            yield archive.record(int(str(number)))
        except OcmmError as error:
            unread(error.what)


def differences(first: Archive, second: Archive, most: int = 100) -> list[str]:
    """Return the differences between two archives' rows in sentences; empty if none."""
    found: list[str] = []
    one, two = (
        {_key(r): r for r in records_of(archive, found.append)} for archive in (first, second)
    )
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
            fields = [name for name, _, _ in _fields(one[key].job, two[key].job)]
            fields += [
                n for n in ("results", "uses") if getattr(one[key], n) != getattr(two[key], n)
            ]
            found.append(f"{job} differs in {', '.join(fields)}.")
    return found


def _key(record: records.JobRecord) -> tuple[str, int, str, bool, str]:
    job = record.job
    return job.job_uuid, job.steps, job.head, not job.fault, job.station
