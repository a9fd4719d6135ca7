"""Audit of files of a station: authors, times, steps and integrity.

Other files than jobs and histories are in `_audit_files`. Nothing is written or recomputed.
"""

from __future__ import annotations

import os
from pathlib import Path

import msgspec

from ocmm_core.calibration.records import CalibrationStore, ProbeStore
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.export import ENDING
from ocmm_core.export.audits._audit_files import Audit, AuditedKind, AuditRow, audit_file
from ocmm_core.export.certificate import CERTIFICATE_ENDING, SEAL_SUFFIX
from ocmm_core.inspection.finished import SUFFIX
from ocmm_core.seals import RELEASE_ENDING
from ocmm_core.storage import JobEvent, JobFile

_OF_HISTORY = ("events.jsonl", "events.seal.json")
_ENDINGS = (SUFFIX, ENDING, CERTIFICATE_ENDING, ".chain", ".toml", ".json")
_STEPS = {
    "head": "job begun",
    "observation": "point {} stored",
    "annulment": "point {} taken back",
    "reference": "reference body stored",
    "reference_observation": "reference body beside point {}",
}


def audit(path: Path, line: str = "") -> Audit:
    """Return the audit of a file or folder; `line`: code of a report, or ""; OcmmError: neither."""
    if path.is_dir():
        return _of_records(path)
    if path.suffix == SUFFIX or line:
        return _of_job(path, line)
    return _of_records(path.parent) if path.name in _OF_HISTORY else audit_file(path)


def files_to_audit(path: Path) -> tuple[Path, ...]:
    """Return auditable items of a folder, without links; a file or history itself."""
    if not path.is_dir() or os.path.isfile(path / _OF_HISTORY[0]):  # noqa: PTH113 - never raises
        return (path,)
    found: list[Path] = []

    def unreadable(error: OSError) -> None:
        # Audited nevertheless, so that it is named.
        found.append(Path(error.filename))

    for place, folders, names in os.walk(path, onerror=unreadable):
        folder = Path(place)
        if _OF_HISTORY[0] in names:
            found.append(folder)
            folders.clear()
            continue
        folders.sort()
        own = [folder / name for name in sorted(names) if name.endswith(_ENDINGS)]
        # A release or a seal is audited with its document.
        found += [one for one in own if not one.name.endswith((RELEASE_ENDING, SEAL_SUFFIX))]
    return tuple(found) or (path,)


def _of_job(path: Path, line: str) -> Audit:
    with JobFile.read(path) as job:
        seal, faults = job.seal(), job.verify()
        proofs = [told for told in (seal.forgotten, job.left_out) if told]
        if line:
            try:
                proofs.append(job.check_line(line))
            except OcmmError as error:
                faults.append(error.what)
        # Events are numbered from 1 on, and none is ever removed.
        texts = {
            ("event", number): _said(event) for number, event in enumerate(job.events(), start=1)
        }
        rows = [
            AuditRow(
                step.time_utc, job.head.operator,
                texts.get((step.subject, step.key))
                or _STEPS.get(step.subject, step.subject).format(step.key),
            )
            for step in job.audited()
        ]  # fmt: skip
    return Audit(
        path, AuditedKind.JOB, seal.state, tuple(faults), tuple(rows), tuple(proofs), seal.adopted
    )  # fmt: skip


class _Words(msgspec.Struct):
    """Readable part of a machine-readable event."""

    way: str = ""
    words: str = ""


def _said(event: JobEvent) -> str:
    """Return an event in a line; of machine-readable ones only the words."""
    if not event.text.startswith("{"):
        return f"{event.kind}: {event.text}" if event.text else event.kind
    try:
        found = msgspec.json.decode(event.text, type=_Words)
    except (ValueError, RecursionError):
        return event.kind
    return f"{event.kind}: {found.way} {found.words}" if found.words else event.kind


def _of_records(folder: Path) -> Audit:
    kind, store = _store(folder)
    faults = [fault.what for fault in (store.exchanged, store.defect(thorough=True)) if fault]
    rows = [
        AuditRow(event.utc, event.who, f"{event.kind.value}. {event.reason}".strip())
        for event in store.events
    ]
    return Audit(folder, kind, store.signer, tuple(faults), tuple(rows))


def _store(folder: Path) -> tuple[AuditedKind, CalibrationStore | ProbeStore]:
    if folder.is_dir() and not os.access(folder, os.R_OK | os.X_OK):
        raise InputError(
            "audit.unreadable",
            f"{folder}: the folder cannot be read.",
            "Get read permission for the folder, or ask its owner to verify it.",
        )
    if not (folder / "events.jsonl").is_file():
        raise InputError(
            "audit.folder",
            f"{folder}: there is no history of calibrations.",
            "Give the folder of one rig or probe, a job file, or the seal of a report.",
        )
    try:
        return AuditedKind.CAMERAS, CalibrationStore(folder)
    except OcmmError as error:
        try:
            return AuditedKind.PROBE, ProbeStore(folder)
        except OcmmError:
            raise error from None
