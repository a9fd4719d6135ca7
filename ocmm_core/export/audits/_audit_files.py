"""Audit of single files other than jobs: records, chains, documents, reports, certificates."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import chain
from pathlib import Path
from typing import Any

import msgspec

from ocmm_core import documents
from ocmm_core.acceptance import AcceptanceRecord, chain_history
from ocmm_core.calibration.records import load_signed
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.export import ENDING, check_report_seal
from ocmm_core.export.certificate import CERTIFICATE_ENDING, SEAL_SUFFIX, check_dcc_seal
from ocmm_core.inspection.finished import RecallRecord
from ocmm_core.plugins import load_all
from ocmm_core.seals import RELEASE_ENDING, KeyFolder, SealState, SealWord, Signed, release_state
from ocmm_core.settings import SettingsFile
from ocmm_core.storage import JobFile


class AuditedKind(StrEnum):
    """Kinds of files and folders."""

    JOB = "job"
    CAMERAS = "calibrations of cameras"
    PROBE = "calibrations of a probe"
    REPORT = "report"
    CERTIFICATE = "certificate"
    ACCEPTANCE = "acceptance"
    TEST = "acceptance session"
    INTERIM = "interim checks"
    STUDY = "study"
    ARTEFACTS = "artefacts"
    RECALL = "recall"
    PLAN = "plan"
    TEMPLATE = "template"
    DOCUMENT = "document"
    SETTINGS = "settings"
    OTHER = "file"


@dataclass(frozen=True, slots=True)
class AuditedRecord:
    """A kind of signed JSON record; packages add theirs by entry points of `ocmm.records`."""

    family: str
    """Of its schema, without the version."""
    kind: type[Any]
    signed: Signed
    words: Callable[[Any], str]
    """Returns a summary of such a record."""


@dataclass(frozen=True, slots=True)
class AuditRow:
    """A step: when (ISO 8601), by whom (may be empty), and what."""

    utc: str
    who: str
    what: str


@dataclass(frozen=True, slots=True)
class Audit:
    path: Path
    kind: AuditedKind
    signer: SealState
    faults: tuple[str, ...]
    """Sentences; empty if it is intact."""
    rows: tuple[AuditRow, ...]
    """Steps, oldest first."""
    proofs: tuple[str, ...] = ()
    """Further findings that are no faults, in sentences."""

    adopted: tuple[str, ...] = ()
    """Adopted steps: by whom, why, and suspicions, in sentences."""

    @property
    def intact(self) -> bool:
        """Return whether a trusted station wrote it, and it is unchanged."""
        return not self.faults and not self.adopted

    @property
    def word(self) -> str:
        if self.faults:
            return "NOT INTACT"
        return "ADOPTED" if self.adopted else "INTACT"


def _acceptance_words(record: AcceptanceRecord) -> str:
    return ", ".join((*record.instrument.states, record.procedure.id, record.verdict.value))


def _recall_words(record: RecallRecord) -> str:
    return f"recall of {len(record.jobs)} jobs"


_RECORDS = (
    AuditedRecord("ocmm.acceptance-record", AcceptanceRecord, Signed.ACCEPTANCE, _acceptance_words),
    AuditedRecord("ocmm.recall", RecallRecord, Signed.RECALL, _recall_words),
)


class _Head(msgspec.Struct):
    schema: str = ""


class _Record(msgspec.Struct):
    content: _Head = msgspec.field(default_factory=_Head)


def document_kind(path: Path) -> Signed:
    """Return the kind of a releasable document; InputError for any other file."""
    family = _schema_of(path).partition("/")[0]
    if not family.startswith("ocmm.") or family == "ocmm.settings":
        raise InputError(
            "release.kind",
            f"{path}: this is no document that can be released.",
            "Give a plan, a report template, or another document of this program (TOML).",
        )
    kinds = {"ocmm.plan": Signed.PLAN, "ocmm.report-template": Signed.TEMPLATE}
    return kinds.get(family, Signed.DOCUMENT)


def audit_file(path: Path) -> Audit:
    """Return the audit of a file that is no job; OcmmError if it cannot be read."""
    for ending, read in _READERS.items():
        if path.name.endswith(ending):
            return read(path)
    seal = next(_seals_naming(path), None)
    if seal is not None:
        return _of_report(seal, path)
    if not path.is_file():
        raise InputError(
            "document.missing", f"{path}: file not found.", "Check the name and the folder."
        )
    fault = "This kind of file has no signature, and no seal of a report next to it names it."
    return Audit(path, AuditedKind.OTHER, SealState(SealWord.NOT_SIGNED), (fault,), ())


def _of_report(path: Path, only: Path | None = None) -> Audit:
    found = check_report_seal(path, KeyFolder())
    faults = [*([found.state.fault] if found.state.fault else []), *found.faults]
    proofs = [
        f"Made from job {job.name} ({job.uuid}) at step {job.steps}: {job.head}"
        for job in found.seal.jobs
    ]
    whole = len(found.seal.files) - len(found.faults)
    proofs.append(f"{whole} of {len(found.seal.files)} files are as they were written")
    for job in found.seal.jobs:
        for folder in (path.parent, path.parent.parent):
            file = folder / f"{job.name}.ocmm"
            if file.is_file():
                told, is_fault = _since(file, job.uuid, job.steps, job.head)
                (faults if is_fault else proofs).append(told)
                break
    return Audit(only or path, AuditedKind.REPORT, found.state, tuple(faults), (), tuple(proofs))


def _since(file: Path, uuid: str, steps: int, head: str) -> tuple[str, bool]:
    """Return the later state of a reported job, and whether it contradicts the report."""
    try:
        with JobFile.read(file) as job:
            links, own = job.links(), job.head.job_uuid
    except OcmmError as error:
        return f"The job next to it cannot be read: {error.what}", True
    if own != uuid or links.get(steps) != head:
        return f"{file.name} next to it does not hold the reported state of the job.", True
    more = len(links) - steps
    if more:
        s = "s" if more > 1 else ""
        return f"{file.name} has changed since: {more} step{s} came after the report.", False
    return f"{file.name} is as it was reported.", False


def _seals_naming(path: Path) -> Iterator[Path]:
    # Mostly the one of the same name: a folder may have those of thousands of parts.
    seals = documents.files_of_folder(path.parent, ENDING)
    for seal in sorted(seals, key=lambda one: not path.name.startswith(one.name[: -len(ENDING)])):
        try:
            if any(
                one.name == path.name for one in check_report_seal(seal, KeyFolder()).seal.files
            ):
                yield seal
        except OcmmError:
            continue


def _of_certificate(path: Path) -> Audit:
    xml = path.with_name(path.name.removesuffix(SEAL_SUFFIX))
    found = check_dcc_seal(xml, KeyFolder())
    row = AuditRow(found.dcc.end, found.dcc.laboratory, f"{found.dcc.number} {found.dcc.title}")
    audit = _judged(xml, AuditedKind.CERTIFICATE, found.state, row)
    why = found.dcc.signature.why
    return replace(audit, faults=(*audit.faults, f"{found.summary}")) if why else audit


def _of_chain(path: Path) -> Audit:
    signed, state, rows = chain_history(path)
    kind = AuditedKind(signed.value)
    return _judged(path, kind, state, *(AuditRow(*row) for row in rows))


def _of_json(path: Path) -> Audit:
    content = documents.read_bytes(path)
    try:
        schema = documents.decode_json(content, _Record).content.schema
    except (ValueError, msgspec.MsgspecError, RecursionError):
        schema = ""
    family = schema.partition("/")[0]
    known = chain(_RECORDS, load_all("ocmm.records", AuditedRecord))
    found = next((one for one in known if one.family == family), None)
    if found is None:
        seal = next(_seals_naming(path), None)
        if seal is not None:
            return _of_report(seal, path)
        raise InputError(
            "audit.file",
            f"{path}: this is no record with a signature of its own.",
            "For a calibration give the folder of its rig or probe; for a report give its seal.",
        )
    loaded = load_signed(path, found.kind, found.signed)
    record = loaded.record
    utc = getattr(record, "ended_utc", "") or getattr(record, "made_utc", "")
    return _judged(
        path, AuditedKind(found.signed.value), loaded.signer,
        AuditRow(utc, record.made_by, found.words(record)),
    )  # fmt: skip


def _of_document(path: Path) -> Audit:
    path = path.with_name(path.name.removesuffix(RELEASE_ENDING))
    if _schema_of(path).startswith("ocmm.settings/"):
        return _judged(path, AuditedKind.SETTINGS, SettingsFile(path).signer())
    kind = document_kind(path)
    found = release_state(path, kind)
    row, fault = found.release, found.signer.fault
    if row is None:
        return Audit(path, AuditedKind(kind.value), found.signer, ("Not released.",), ())
    if found.changed:
        fault = "The file was changed after its release."
    elif found.replaced:
        fault = "A later release replaced this one."
    step = AuditRow(row.utc, row.who, f"released. {row.reason}".strip())
    faults = (fault,) if fault else ()
    return Audit(path, AuditedKind(kind.value), found.signer, faults, (step,))


def _judged(path: Path, kind: AuditedKind, state: SealState, *rows: AuditRow) -> Audit:
    return Audit(path, kind, state, (state.fault,) if state.fault else (), rows)


def _schema_of(path: Path) -> str:
    try:
        return str(
            tomllib.loads(documents.read_text(path, documents.LARGEST_DOCUMENT)).get("schema", "")
        )
    except (ValueError, RecursionError) as error:
        raise StorageError(
            "audit.document", f"{path}: the file is not valid TOML ({error}).",
            "Restore it from a backup.",
        ) from error  # fmt: skip


_READERS: dict[str, Callable[[Path], Audit]] = {
    ENDING: _of_report,
    RELEASE_ENDING: _of_document,
    SEAL_SUFFIX: _of_certificate,
    CERTIFICATE_ENDING: _of_certificate,
    ".chain": _of_chain,
    ".toml": _of_document,
    ".json": _of_json,
}
"""By end of the name, the longest first."""
