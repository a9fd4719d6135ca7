"""Seal of a report, ``NAME.seal.json``: its job, hashes of its files, and the signer.

Signed by the writing station; recipients verify the files and the reported step of the job.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.export.report import ReportData
from ocmm_core.seals import KeyFolder, SealState, Signature, Signed, judge_signature, sign

SCHEMA = "ocmm.report-seal/1"
ENDING = ".seal.json"


class SealedJob(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A job of the report; ``steps`` and ``head`` identify its end (`storage.JobSeal`)."""

    name: str
    uuid: str
    steps: int
    head: str


class SealedFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    name: str
    sha256: str


class ReportSeal(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    schema: str
    jobs: tuple[SealedJob, ...]
    files: tuple[SealedFile, ...]
    signature: Signature | None = None


@dataclass(frozen=True, slots=True)
class ReportSealFound:
    """A seal with the state of its files."""

    seal: ReportSeal
    state: SealState
    faults: tuple[str, ...]
    """Missing and changed files, a sentence each."""


def seal_of(
    name: str, contents: Mapping[Path, bytes], jobs: Sequence[ReportData]
) -> tuple[str, bytes]:
    """Return name and content of the seal of files; StorageError if the key is unusable."""
    seal = ReportSeal(
        schema=SCHEMA,
        jobs=tuple(
            SealedJob(
                name=data.job, uuid=data.head.job_uuid,
                steps=0 if data.seal is None else data.seal.steps,
                head="" if data.seal is None else data.seal.head,
            )
            for data in jobs
        ),
        files=tuple(
            SealedFile(name=path.name, sha256=hashlib.sha256(content).hexdigest())
            for path, content in sorted(contents.items())
        ),
    )  # fmt: skip
    signature = sign(KeyFolder().station_key(), Signed.REPORT, _content(seal))
    whole = msgspec.json.encode(msgspec.structs.replace(seal, signature=signature))
    return f"{name}{ENDING}", msgspec.json.format(whole, indent=1) + b"\n"


def check_report_seal(path: Path, keys: KeyFolder) -> ReportSealFound:
    """Return the state of a seal and of the files next to it; InputError: no seal; StorageError."""
    try:
        seal = msgspec.json.decode(read_bytes(path), type=ReportSeal)
    except (ValueError, RecursionError) as error:
        raise _no_seal(path, str(error)) from error
    if seal.schema != SCHEMA:
        raise _no_seal(path, f"its schema is {seal.schema!r}")
    state = judge_signature(keys, Signed.REPORT, _content(seal), seal.signature)
    faults = []
    for one in seal.files:
        # Names with folders are refused: only files next to the seal are checked.
        if Path(one.name).name != one.name:
            faults.append(f"{one.name!r} is no name of a file.")
            continue
        try:
            digest = hashlib.sha256(read_bytes(path.with_name(one.name))).hexdigest()
        except OcmmError as error:
            faults.append(error.what)
            continue
        if digest != one.sha256:
            faults.append(f"{one.name} was changed after the report was written.")
    return ReportSealFound(seal, state, tuple(faults))


def _content(seal: ReportSeal) -> bytes:
    return msgspec.json.encode(msgspec.structs.replace(seal, signature=None), order="sorted")


def _no_seal(path: Path, why: str) -> InputError:
    return InputError(
        "report.seal",
        f"{path}: this is not the seal of a report ({why}).",
        f"Give the file ending in {ENDING} beside the report.",
    )
