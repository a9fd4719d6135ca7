"""Recalls: later findings applied to all archived jobs of all stations.

In: an archive, the histories of the stations' calibrations, a finding. Out: a recall of all
affected jobs; marks in the archive that exclude jobs from statistics and hold them at stations.

Histories of stations are sibling folders; the one with the calibration of a job decides, else
CANNOT BE KNOWN. Artefacts and tips: the archive's records of use. The document of the recall and
its marks are written to the archive in one transaction.

It must not know a running station: stations learn by the marks (`archive.learn_marks`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import msgspec

from ocmm_core.build import build_version
from ocmm_core.calibration.records import seal
from ocmm_core.cluster import HERE, Site
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.inspection.finished import (
    SCHEMA,
    SUFFIX,
    Outcome,
    RecalledCharacteristic,
    RecalledJob,
    RecalledValue,
    RecallRecord,
)
from ocmm_core.inspection.recall import DoubtedJob, Doubting, headline, recall_doubted
from ocmm_shop.archive.records import JobRecord, MarkRow, shown_text
from ocmm_shop.archive.stores import CLOCK_TELL_S, MALFORMED, Archive, Cell, open_archive, time_of

Tell = Callable[[str, float], None]

_LOOKING = 0.1
_JOBS = (
    "SELECT job_id, job_uuid, sha256, station, part, serial, created_utc, rig, calibration,"
    " simulated, fault FROM archived_job ORDER BY created_utc, job_uuid"
)
_USED = (
    "SELECT job_id FROM archived_use WHERE used_kind = :kind"
    " AND (identity = :identity OR name = :identity) AND created_utc >= :since"
)

_USED_LATE = (
    "SELECT u.job_id, d.sent_utc, d.received_utc FROM archived_use u JOIN delivery d ON d.job = "
    "u.job_id WHERE u.used_kind = :kind AND (u.identity = :identity OR u.name = :identity) AND "
    "u.created_utc < :since AND d.received_utc >= :since"
)


@dataclass(frozen=True, slots=True)
class ShopPlaces:
    """Places of archive and histories of the shop."""

    address: str
    calibrations: tuple[Path, ...]
    """Folders with the histories of stations, one folder per rig in each."""
    probes: Path | None = None
    """One folder per probe; None is the folder of this user."""
    password: Path | None = None


@dataclass(frozen=True, slots=True)
class ArchiveFinding:
    """Faulty equipment that jobs used."""

    kind: str
    """``artefact``, ``tip``, ``calibration`` or another kind of the archive's ``used``."""
    identity: str
    """Its serial number, hash or name."""
    since: datetime

    @property
    def sentence(self) -> str:
        """Return the finding as a sentence."""
        since = self.since.date().isoformat()
        return f"{self.kind.capitalize()} {self.identity} was found to be wrong since {since}."


@dataclass(frozen=True, slots=True)
class _Archived:
    job_id: int
    job_uuid: str
    sha256: str
    station: str
    part: str
    serial: str
    created_utc: str
    rig: str
    calibration: str
    simulated: bool
    fault: str

    @property
    def path(self) -> Path:
        """Return a display path; no such file exists on this computer."""
        words = [one for one in (self.part, self.serial, self.job_uuid[:8]) if one]
        name = " ".join(words).replace("/", "-").replace("\\", "-")
        return Path(self.station.replace("/", "-")) / f"{name}{SUFFIX}"


def recall_archive(
    places: ShopPlaces,
    now: datetime,
    tell: Tell = lambda what, share: None,
    site: Site = HERE,
    finding: ArchiveFinding | None = None,
) -> RecallRecord:
    """Return the outcome of all suspect archived jobs; changes nothing.

    `site`: where jobs are computed. Workers receive bytes and never access the archive. `finding`:
    a finding in addition to the histories; None: histories alone. InputError or StorageError: the
    archive or the site cannot be used, or the archive has no job.
    """
    with open_archive(places.address, password=places.password, read_only=True) as archive:
        table = archive.query(_JOBS)
        rows = [
            _archived(row, MALFORMED if at in table.malformed else "")
            for at, row in enumerate(table.rows)
        ]
        if not rows:
            raise InputError(
                "recall.no_jobs", f"No job in {archive.place}.", "Hand jobs over first."
            )
        used = _users(archive, finding)
        doubtings = [Doubting(one, places.probes, now) for one in places.calibrations]
        touched: list[DoubtedJob] = []
        hashes: dict[Path, str] = {}
        lost: list[RecalledJob] = []
        unread: list[str] = []
        elsewhere: dict[tuple[str, str, str], int] = {}
        for done, row in enumerate(rows):
            tell(f"Checking {row.path.name}", _LOOKING * done / len(rows))
            try:
                found = _touched(archive, row, doubtings)
                if row.job_id in used and finding is not None and not isinstance(found, DoubtedJob):
                    lost.append(_unknown(row, archive.record(row.job_id), finding))
                    continue
            except OcmmError as error:
                unread.append(f"{row.path}: {error.what}")
                continue
            if found is _ELSEWHERE:
                key = row.station, row.rig, row.calibration
                elsewhere[key] = elsewhere.get(key, 0) + 1
            elif isinstance(found, DoubtedJob):
                touched.append(found)
                hashes[row.path] = row.sha256
        unread += [
            f"{'1 job' if count == 1 else f'{count} jobs'} of station {station}: the history of "
            f"{'its' if count == 1 else 'their'} calibration "
            f"{calibration[:12] or '(none)'} of rig '{rig}' is not in the folders given."
            for (station, rig, calibration), count in sorted(elsewhere.items())
        ]

        def on_done(done: int) -> None:
            share = _LOOKING + (1.0 - _LOOKING) * done / max(len(touched), 1)
            tell(f"Recalculated {done} of {len(touched)} jobs", share)

        # Local processes open the archive themselves; for remote workers it is read here over the
        # open connection.
        contents = partial(_content_of, places, hashes)
        if site.scheduler:
            contents = partial(_from_open, archive, hashes)
        jobs, failed = recall_doubted(touched, contents, site, on_done)
        where = archive.place
    return RecallRecord(
        schema=SCHEMA,
        made_utc=now.isoformat(timespec="microseconds"),
        made_by="",
        software=build_version(),
        folders=(where, *(str(one) for one in places.calibrations)),
        looked_at=len(rows),
        jobs=tuple(sorted((*jobs, *lost), key=lambda job: (job.created_utc, job.path))),
        unread=tuple(sorted((*unread, *failed))),
    )


_ELSEWHERE = "elsewhere"


def _archived(row: tuple[object, ...], off: str) -> _Archived:
    number, *texts, simulated, fault = row
    job_uuid, sha256, station, part, serial, created_utc, rig, calibration = map(
        shown_text, map(str, texts)
    )
    return _Archived(
        int(str(number)), job_uuid, sha256, station, part, serial, created_utc, rig, calibration,
        bool(simulated), off or str(fault),
    )  # fmt: skip


def _users(archive: Archive, finding: ArchiveFinding | None) -> frozenset[int]:
    if finding is None:
        return frozenset()
    since = finding.since.astimezone(UTC).isoformat(timespec="milliseconds")
    table = archive.query(
        _USED, {"kind": finding.kind, "identity": finding.identity, "since": since}
    )
    late = archive.query(
        _USED_LATE, {"kind": finding.kind, "identity": finding.identity, "since": since}
    )
    # A slow station clock makes a job look older than the finding.
    behind = (
        row[0]
        for at, row in enumerate(late.rows)
        if at in late.malformed or _was_behind(archive.place, row[1], row[2])
    )
    return frozenset(int(str(one)) for one in (*(row[0] for row in table.rows), *behind))


def _was_behind(place: str, sent_utc: Cell, received_utc: Cell) -> bool:
    """Return whether a station's clock was behind the archive's at a delivery."""
    behind = time_of(place, received_utc) - time_of(place, sent_utc)
    return behind.total_seconds() > CLOCK_TELL_S


def _touched(
    archive: Archive, row: _Archived, doubtings: list[Doubting]
) -> DoubtedJob | str | None:
    """Return a suspect job, `_ELSEWHERE` if its history is missing here, None if unaffected."""
    if row.fault:
        raise InputError("recall.altered", row.fault, "Look at the file at its station.")
    if not row.calibration:
        # Measured by a document: no history can make it suspect.
        return None
    for doubting in doubtings:
        if doubting.knows(row.rig, row.calibration):
            return doubting.of_content(row.path, archive.content(row.sha256))
    return _ELSEWHERE


def _content_of(places: ShopPlaces, hashes: dict[Path, str], job: DoubtedJob) -> tuple[bytes]:
    with open_archive(places.address, password=places.password, read_only=True) as archive:
        return _from_open(archive, hashes, job)


def _from_open(archive: Archive, hashes: dict[Path, str], job: DoubtedJob) -> tuple[bytes]:
    return (archive.content(hashes[job.path]),)


def _unknown(row: _Archived, record: JobRecord, finding: ArchiveFinding) -> RecalledJob:
    """Return an affected job that cannot be recalculated."""
    return RecalledJob(
        path=str(row.path),
        sha256=row.sha256,
        job_uuid=row.job_uuid,
        part=row.part,
        serial=row.serial,
        created_utc=row.created_utc,
        rig=row.rig,
        calibration=row.calibration,
        simulated=row.simulated,
        in_doubt=tuple(range(1, record.job.points + 1)),
        why=(finding.sentence,),
        later="",
        judgement="Nothing here can replace it: measure the part again.",
        characteristics=tuple(_characteristics(record, finding)),
        released=(),
        points_sha256="",
    )


def _characteristics(
    record: JobRecord, finding: ArchiveFinding
) -> Iterator[RecalledCharacteristic]:
    for one in record.results:
        yield RecalledCharacteristic(
            name=shown_text(one.characteristic),
            before=RecalledValue(value=one.value, expanded=one.uncertainty, verdict=one.verdict),
            after=None,
            outcome=Outcome.UNKNOWN,
            reason=finding.sentence,
            released=False,
        )


def decide_archived(
    archive: Archive, record: RecallRecord, who: str, now: datetime
) -> tuple[RecallRecord, int]:
    """Store a recall with its marks; return it signed, and its number in the archive.

    Jobs whose verdicts and values all hold are released, others are held. Stations learn of it with
    their next upload. InputError: no name, or another recall was stored since this one was
    computed. StorageError: it cannot be stored, or this login may not.
    """
    if not who:
        raise InputError(
            "recall.nobody",
            "No name given for the decision.",
            "Give the name of the person who decides.",
        )
    # Compare by the archive's clock: a fast local clock would block every later recall.
    made = datetime.fromisoformat(record.made_utc) + (archive.now() - datetime.now(UTC))
    for one in archive.findings():
        if one.kind == "recall" and time_of(archive.place, one.received_utc) > made:
            raise InputError(
                "recall.overtaken",
                f"{one.who} has stored another recall since this one was computed.",
                "Run the recall again.",
            )
    decided = msgspec.structs.replace(record, made_by=who)
    utc = now.astimezone(UTC).isoformat(timespec="milliseconds")
    number = archive.add_finding(
        "recall", headline(decided), seal(decided).decode("utf-8"), who, utc,
        marks_of(decided, who, utc),
    )  # fmt: skip
    return decided, number


def marks_of(record: RecallRecord, who: str, utc: str) -> tuple[MarkRow, ...]:
    """Return the mark of each job of a recall; the latest mark of a job counts."""
    return tuple(
        MarkRow(
            job_uuid=job.job_uuid, kind="recall", holds=not _let_go(job),
            why=f"Recall: {job.outcome.value}. {job.judgement}"[:2000], who=who, utc=utc,
        )
        for job in record.jobs
    )  # fmt: skip


def _let_go(job: RecalledJob) -> bool:
    """Return whether a job is released: verdicts hold, and values also."""
    return job.outcome is Outcome.HOLDS and all(one.released for one in job.characteristics)
