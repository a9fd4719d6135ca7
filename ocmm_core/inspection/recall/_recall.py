"""Recall: which verdicts of older jobs hold after their calibration was found wrong.

The jobs that are suspect because of their calibration are found first. Each is recalculated from
its raw spots with the calibration now in force (`_recall_job`); the cases that the spots exclude
decide which of both counts (`_recall_judge`). Job files are only read, in copies.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import msgspec

from ocmm_core.build import build_version
from ocmm_core.calibration import records
from ocmm_core.cluster import HERE, Site, run_tasks
from ocmm_core.documents import find_files
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.inspection import finished
from ocmm_core.inspection.recall import _recall_job as recall_job
from ocmm_core.inspection.recall._recall_judge import Cases, cases_of, judgement, recalled, unknown
from ocmm_core.seals import KeptKeys
from ocmm_core.storage import JobFile, read_job


class Doubting:
    """Suspect jobs, by the histories of one folder. `now`: time of the query."""

    def __init__(self, calibrations: Path, probes: Path | None, now: datetime) -> None:
        self._calibrations, self._probes, self._now = calibrations, probes, now
        self._keys = KeptKeys()
        self._stores: dict[str, records.CalibrationStore] = {}
        self._laters: dict[tuple[str, str], recall_job.Later] = {}

    def knows(self, rig: str, calibration: str) -> bool:
        try:
            return finished.is_known(self._store(rig).events, calibration)
        except InputError:
            return False

    def of_file(self, path: Path) -> recall_job.DoubtedJob | None:
        """Return a job with suspect points, or None; OcmmError if job or history is unreadable."""
        with JobFile.read(path) as job:
            return self._doubted_job(path, job, lambda store: finished.known_here(
                job, path, self._probes, self._calibrations, store, self._keys
            ))  # fmt: skip

    def of_content(self, path: Path, content: bytes) -> recall_job.DoubtedJob | None:
        """Return a job of any computer by the bytes of its file, called `path`; as `of_file`."""
        with JobFile.in_memory(path, content) as job:
            return self._doubted_job(path, job, lambda _: replace(
                finished.known_alone(job, self._keys),
                tip=finished.ask_tip(
                    finished.StoredDocuments(path, job.head).probe_records(),
                    self._probes or records.default_probe_folder(),
                ),
            ))  # fmt: skip

    def _doubted_job(
        self,
        path: Path,
        job: JobFile,
        asked: Callable[[records.CalibrationStore], finished.KnownOfJob],
    ) -> recall_job.DoubtedJob | None:
        # Regardless of earlier releases: the last recall decides about all points.
        record = finished.StoredDocuments(path, job.head).camera_record()
        if record is None:
            return None
        store, used = self._store(record.rig), job.head.rig_identity
        events = store.events
        if not finished.is_known(events, used):
            # Silence would mean that it is not suspect.
            raise InputError(
                "recall.unknown",
                f"{path}: its calibration {used[:12]} is not in the history of rig "
                f"'{record.rig}' in {self._calibrations}, so it is unknown here whether it failed.",
                "Give the calibration folder it was measured with.",
            )
        observed = job.observed()
        doubts = finished.points_in_doubt(events, used, finished.first_stored(observed))
        why = doubts.open | doubts.failed
        counts = [one.number for one in observed if not one.annulled]
        in_doubt = {number: why[number] for number in counts if number in why}
        if not in_doubt:
            # A changed point is reported in any case; in a suspect job each is checked at
            # recalculation.
            job.points()
            job.annulled()
            return None
        key = record.rig, records.record_hash(record)
        if key not in self._laters:
            self._laters[key] = later_than(store, record, self._now)
        known = asked(store)
        # A mark of an earlier recall must not prevent this one.
        cameras = finished.CameraHistory(unread=known.cameras.unread)
        known = replace(known, cameras=cameras, held=())
        return recall_job.DoubtedJob(path, self._laters[key], in_doubt, known)

    def _store(self, rig: str) -> records.CalibrationStore:
        if rig not in self._stores:
            self._stores[rig] = records.CalibrationStore(
                records.store_folder(self._calibrations, rig)
            )
        return self._stores[rig]


def later_than(
    store: records.CalibrationStore, record: records.CameraRecord, now: datetime
) -> recall_job.Later:
    """Return the calibration in force, if verified and of these cameras, or why none."""
    try:
        later = store.active()
        if later is None or store.active_hash == records.record_hash(record):
            return recall_job.Later(
                None, why_not="No later calibration: calibrate and verify first."
            )
        status = store.status(now)
    except OcmmError as error:
        return recall_job.Later(None, why_not=error.what)
    if not status.state.usable:
        return recall_job.Later(
            None, why_not=f"The active calibration cannot be used: {status.reason} {status.remedy}"
        )
    if _cameras(later) != _cameras(record):
        return recall_job.Later(None, why_not="The active calibration belongs to other cameras.")
    # Residual noise of a calibration beyond that of the rig is no sign of a change.
    scale = max(record.chi2_per_dof, later.chi2_per_dof, 1.0) ** 0.5
    return recall_job.Later(later, records.record_hash(later), scale=scale)


def _cameras(record: records.CameraRecord) -> list[tuple[str, int]]:
    return [(one.name, one.serial) for one in record.cameras]


Tell = Callable[[str, float], None]
"""Receives the next step, and the share done."""

_LOOKING = 0.1
"""Share of the time for searching jobs."""


@dataclass(frozen=True, slots=True)
class KeptPlaces:
    """Places of jobs, calibrations and probes on this computer."""

    jobs: tuple[Path, ...]
    """Folders, searched recursively, and job files."""
    calibrations: Path
    """One subfolder per rig."""
    probes: Path | None = None
    """One subfolder per probe; None is the folder of this user."""


def recall(
    places: KeptPlaces,
    now: datetime,
    tell: Tell = lambda what, share: None,
    processes: int | None = None,
    site: Site = HERE,
) -> finished.RecallRecord:
    """Return the outcome of all suspect jobs; changes nothing, unlike `decide`.

    ``processes``: None for one per core, or this process alone for few jobs; without them ``site``
    computes the same record. InputError without such a folder, file, or a job in it.
    """
    paths, left_out = _paths(places.jobs)
    touched, unread = _touched(paths, places, now, tell)

    def on_done(done: int) -> None:
        share = _LOOKING + (1.0 - _LOOKING) * done / max(len(touched), 1)
        tell(f"Recalculated {done} of {len(touched)} jobs", share)

    if processes is not None:
        site = Site(workers=processes)
    jobs, failed = recall_doubted(touched, content_of_file, site, on_done)
    return finished.RecallRecord(
        schema=finished.SCHEMA,
        made_utc=now.isoformat(timespec="microseconds"),
        made_by="",
        software=build_version(),
        folders=tuple(str(path) for path in places.jobs),
        looked_at=len(paths),
        jobs=jobs,
        unread=tuple(sorted((*left_out, *unread, *failed))),
    )


def _paths(jobs: Sequence[Path]) -> tuple[list[Path], list[str]]:
    found: dict[Path, None] = {}
    left_out: list[str] = []
    for place in jobs:
        if place.is_dir():
            files, errors = find_files(place, finished.SUFFIX)
            found |= dict.fromkeys(files)
            left_out += [f"{error.what} {error.remedy}" for error in errors]
        elif place.is_file():
            found[place] = None
        else:
            raise InputError(
                "recall.folder",
                f"{place}: folder or job file not found.",
                "Give the folder that contains the jobs.",
            )
    if not found:
        raise InputError(
            "recall.no_jobs",
            " ".join((f"No job in {', '.join(str(place) for place in jobs)}.", *left_out)),
            "Give the folder that contains the jobs.",
        )
    return list(found), left_out


def _touched(
    paths: Sequence[Path], places: KeptPlaces, now: datetime, tell: Tell
) -> tuple[list[recall_job.DoubtedJob], list[str]]:
    doubting = Doubting(places.calibrations, places.probes, now)
    touched: list[recall_job.DoubtedJob] = []
    unread: list[str] = []
    for done, path in enumerate(paths):
        tell(f"Checking {path.name}", _LOOKING * done / len(paths))
        try:
            found = doubting.of_file(path)
            if found is not None:
                touched.append(found)
        except InputError as error:
            unread.append(f"{error.what} {error.remedy}")
        except OcmmError as error:
            unread.append(error.what)
    return touched, unread


def recall_doubted(
    touched: Sequence[recall_job.DoubtedJob],
    contents: Callable[[recall_job.DoubtedJob], tuple[bytes]],
    site: Site,
    on_done: Callable[[int], None],
) -> tuple[tuple[finished.RecalledJob, ...], list[str]]:
    """Return the outcome of suspect jobs, and why some could not be opened.

    ``contents``: bytes of a job, with the steps of its log. ``site`` computes; all are judged here.
    """
    found: list[recall_job.JobFindings] = []
    failed: list[str] = []
    for one in run_tasks(
        recall_job.findings_of,
        touched,
        lambda job: f"Recalculating {job.path.name}",
        site=site,
        contents=contents,
        on_done=on_done,
    ):
        if isinstance(one, recall_job.JobFindings):
            found.append(one)
        else:
            failed.append(one.what)
    return tuple(_judged(found)), failed


def content_of_file(job: recall_job.DoubtedJob) -> tuple[bytes]:
    """Return the bytes of a job on this computer, with the steps of its log."""
    return (read_job(job.path).file,)


def _judged(found: Sequence[recall_job.JobFindings]) -> Iterator[finished.RecalledJob]:
    ordered = sorted(found, key=lambda job: (job.begun_utc, str(job.path)))
    groups: dict[tuple[str, str, str], list[tuple[recall_job.JobFindings, recall_job.Anew]]] = {}
    for job in ordered:
        if job.anew is not None:
            key = job.rig, job.calibration, job.later_calibration
            groups.setdefault(key, []).append((job, job.anew))
    cases: dict[int, Cases] = {}
    for group in groups.values():
        cases |= {id(job): case for (job, _), case in zip(group, cases_of(group), strict=True)}
    for job in ordered:
        if job.anew is None:
            yield _as_record(job, unknown(job, job.why_not), job.why_not)
        else:
            case = cases[id(job)]
            yield _as_record(job, recalled(job, job.anew, case), judgement(job, case))


def _as_record(
    job: recall_job.JobFindings, found: tuple[finished.RecalledCharacteristic, ...], sentence: str
) -> finished.RecalledJob:
    kept = {
        job.points[place].number
        for one, rests_on in zip(found, job.rests_on, strict=True)
        if not one.released
        for place in rests_on
    }
    # A point without dependent results was not judged.
    judged = {job.points[place].number for rests_on in job.rests_on for place in rests_on}
    released = sorted((job.in_doubt.keys() & judged) - kept)
    return finished.RecalledJob(
        path=str(job.path),
        sha256=job.sha256,
        name="" if job.name == job.path.stem else job.name,
        job_uuid=job.head.job_uuid,
        part=job.head.part,
        serial=job.head.serial,
        created_utc=job.head.created_utc,
        rig=job.rig,
        calibration=job.calibration,
        simulated=job.simulated,
        in_doubt=tuple(sorted(job.in_doubt)),
        why=tuple(filter(None, dict.fromkeys((*job.in_doubt.values(), job.left_out)))),
        later=job.later_calibration,
        judgement=" ".join(filter(None, (sentence, job.requirements))),
        characteristics=found,
        released=tuple(released),
        points_sha256=finished.points_digest(job.points, released),
    )


def decide(
    record: finished.RecallRecord, places: KeptPlaces, who: str, now: datetime
) -> finished.RecallRecord:
    """Release the points whose results hold, and return the signed recall.

    ``record``: the reviewed result of `recall`; stored with its calibrations, in their histories.
    InputError without a name, or if the calibrations have changed since; StorageError,
    CalibrationError if it cannot be stored.
    """
    if not who:
        raise InputError(
            "recall.nobody",
            "No name given for the decision.",
            "Give the name of the person who decides.",
        )
    about = dict.fromkeys((job.rig, job.calibration) for job in record.jobs)
    stores = {
        rig: records.CalibrationStore(records.store_folder(places.calibrations, rig))
        for rig, _ in about
    }
    for rig, store in stores.items():
        if any(one.utc > record.made_utc for one in store.events):
            raise InputError(
                "recall.overtaken",
                f"The calibrations of rig '{rig}' have changed since the recall.",
                "Run the recall again.",
            )
    decided = msgspec.structs.replace(record, made_by=who)
    found = [one for one in finished.Outcome if record.count(one)]
    words = ", ".join(f"{record.count(one)} {one.value}" for one in found)
    for rig, calibration in about:
        path = records.save(stores[rig].folder, decided)
        # The history must not name an unreadable record.
        records.load_named(stores[rig].folder, path.stem, finished.RecallRecord)
        stores[rig].recalled(calibration, path.stem, who, f"Jobs: {words}.", now)
    return decided
