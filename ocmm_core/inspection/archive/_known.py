"""Knowledge about a job outside its file, so that another computer opens it identically.

Histories of calibrations and tips, trusted keys, and the last known end of the job. A worker
elsewhere gets this and the bytes of the job, and looks nothing up.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import msgspec

from ocmm_core.calibration.records import CalibrationStore, default_folder, default_probe_folder
from ocmm_core.errors import OcmmError
from ocmm_core.inspection.archive._later_findings import (
    CameraHistory,
    TipHistory,
    ask_cameras,
    ask_tip,
)
from ocmm_core.inspection.archive._stored_documents import StoredDocuments, about
from ocmm_core.seals import KeyFolder, SealWord
from ocmm_core.storage import JobFile, JobSeal, held_sentences


@dataclass(frozen=True, slots=True)
class KnownOfJob:
    """Knowledge about a job outside its file."""

    seal: JobSeal
    """Its known end, its signer by the trusted keys, and missing steps."""
    cameras: CameraHistory = field(default_factory=CameraHistory)
    tip: TipHistory = field(default_factory=TipHistory)
    """`cameras`, `tip`: Later findings."""
    held: tuple[str, ...] = ()
    """Reasons why the archive of the shop holds the job."""
    left_out: str = ""


def known_alone(job: JobFile, keys: KeyFolder | None = None) -> KnownOfJob:
    """Return the knowledge by its file and the trusted keys alone."""
    return KnownOfJob(replace(job.seal(keys), missing=""), left_out=job.left_out)


def known_by_file(job: JobFile) -> KnownOfJob:
    """Return the knowledge common to all computers: a valid signature counts with any key."""
    seal = replace(job.seal(), missing="")
    if seal.state.word is SealWord.UNKNOWN_KEY:
        seal = replace(seal, state=replace(seal.state, word=SealWord.SEALED))
    return KnownOfJob(replace(seal, state=replace(seal.state, station="")))


def known_here(
    job: JobFile,
    path: Path,
    probes: Path | None,
    calibrations: Path | None,
    store: CalibrationStore | None = None,
    keys: KeyFolder | None = None,
) -> KnownOfJob:
    """Return this computer's knowledge of a job, and remember its end.

    ``job``: own copy of the file; ``store``: of its rig in ``calibrations``, if already read.
    """
    stored = StoredDocuments(path, job.head)
    seal = job.seal(keys)
    known = KnownOfJob(
        seal,
        ask_cameras(job, stored.camera_record(), calibrations or default_folder(), store),
        ask_tip(stored.probe_records(), probes or default_probe_folder()),
        held_sentences(job.head.job_uuid),
        job.left_out,
    )
    job.note_seen(path, seal)
    return known


def content_and_known(
    path: Path, probes: Path | None, calibrations: Path | None
) -> tuple[bytes, bytes]:
    """Return a job's bytes and the knowledge to open it elsewhere; OcmmError if unreadable."""
    try:
        with JobFile.read(path) as job:
            known = known_here(job, path, probes, calibrations)
            return job.content(), msgspec.json.encode(known)
    except OcmmError as error:
        raise about(error, path) from error


def known_from(content: bytes) -> KnownOfJob:
    """Decode the knowledge from `content_and_known`."""
    return msgspec.json.decode(content, type=KnownOfJob)
