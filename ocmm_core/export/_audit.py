"""The audit of files of a station: person, time, step, and whether they are unchanged.

For an auditor who has a file and nothing else: a job, a folder of records, or the seal of a
report. Nothing is written and nothing recalculated; `inspection.archive` does that for jobs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import msgspec

from ocmm_core.calibration.records import CalibrationStore, ProbeStore
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.export._report_seal import ENDING, check_report_seal
from ocmm_core.inspection.archive import copy_of_job
from ocmm_core.seals import KeyFolder, SealState, SealWord, shown_key
from ocmm_core.storage import JobEvent, JobFile

_STEPS = {
    "head": "job begun",
    "observation": "point {} stored",
    "annulment": "point {} taken back",
    "reference": "reference body stored",
    "reference_observation": "reference body beside point {}",
}
"""Names of the rows of the audit, by table."""


class AuditedKind(StrEnum):
    """Kinds of audited files."""

    JOB = "job"
    CAMERAS = "calibrations of cameras"
    PROBE = "calibrations of a probe"
    REPORT = "report"


@dataclass(frozen=True, slots=True)
class AuditRow:
    """Something that was stored: when (ISO 8601 text), by whom where that is known, and what."""

    utc: str
    who: str
    what: str


@dataclass(frozen=True, slots=True)
class Audit:
    """Result of an audit."""

    path: Path
    kind: AuditedKind
    """`path`, `kind`: The audited file or folder."""
    signer: SealState
    """State of its signature."""
    faults: tuple[str, ...]
    """Everything suspect about it, in sentences."""
    rows: tuple[AuditRow, ...]
    """What was stored, oldest first."""
    proofs: tuple[str, ...] = ()
    """What speaks for it beyond that, in sentences."""
    adopted: tuple[str, ...] = ()
    """Adoptions by name: person, reason, and everything that was suspect."""

    @property
    def intact(self) -> bool:
        """Return whether a trusted station signed all of it, and it is unchanged since."""
        return not self.faults and not self.adopted

    @property
    def word(self) -> str:
        """Return the result in a word."""
        if self.faults:
            return "NOT INTACT"
        return "ADOPTED" if self.adopted else "INTACT"


def audit(path: Path, line: str = "") -> Audit:
    """Return what was found of a job, a folder of records or the seal of a report.

    Parameters
    ----------
    line
        What the code on a report of the job holds; empty where there is none.

    Raises
    ------
    OcmmError
        It is none of these, or cannot be read.
    """
    if path.is_dir():
        return _of_records(path)
    if path.name.endswith(ENDING):
        return _of_report(path)
    return _of_job(path, line)


def _of_job(path: Path, line: str) -> Audit:
    with copy_of_job(path) as copy, JobFile.open(copy, scratch=True) as job:
        seal, faults, proofs = job.seal(), job.verify(), []
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
    """What a person reads of an event that is for the program."""

    way: str = ""
    words: str = ""


def _said(event: JobEvent) -> str:
    """Return an event in a line: of what is stored for the program, the words in it alone."""
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


def _of_report(path: Path) -> Audit:
    found = check_report_seal(path, KeyFolder())
    faults = [*_signature_faults(found.state), *found.faults]
    proofs = [
        f"Made from job {job.name} ({job.uuid}) at step {job.steps}: {job.head}"
        for job in found.seal.jobs
    ]
    whole = len(found.seal.files) - len(found.faults)
    proofs.append(f"{whole} of {len(found.seal.files)} files are as they were written")
    return Audit(path, AuditedKind.REPORT, found.state, tuple(faults), (), tuple(proofs))


def _signature_faults(state: SealState) -> Sequence[str]:
    return {
        SealWord.SEALED: (),
        SealWord.NOT_SIGNED: ("The report is not signed.",),
        SealWord.UNKNOWN_KEY: (
            "The report was signed by a station that this computer does not know "
            f"(key {shown_key(state.fingerprint)}).",
        ),
        SealWord.FORGED: ("The signature does not belong to the report.",),
    }[state.word]
