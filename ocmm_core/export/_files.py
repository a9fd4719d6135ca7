"""Files of a report: refused for incomplete jobs, written all or none, and sealed.

Incomplete jobs need an explicit request. The seal, ``NAME.seal.json``, contains the job of the
report, the hashes of its files, and the signer: it is signed by the writing station, and recipients
verify the files and the reported step of the job.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from ocmm_core.documents import read_bytes, write_atomic, written_beside
from ocmm_core.errors import InputError, MeasuringError, OcmmError, StorageError
from ocmm_core.export.report import ReportData
from ocmm_core.host import HOST
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.leftovers import clear_beside
from ocmm_core.seals import KeyFolder, SealState, Signature, Signed, judge_signature, sign
from ocmm_core.side_files import LARGEST_JOB, read_guarded

_MOST_NAMED = 6


def missing_of(view: JobView) -> tuple[str, ...]:
    """Return the missing items: features, then characteristics without a value though measured."""
    part = view.part_verdict
    left = set(part.missing_features)
    about = {item.name: set(item.features) for item in view.characteristics}
    return (*part.missing_features, *(name for name in part.unmeasured if not about[name] & left))


def missing_words(missing: Sequence[str]) -> str:
    """Return names in one line, truncated."""
    more = len(missing) - _MOST_NAMED
    named = ", ".join(missing[:_MOST_NAMED])
    return f"{named} and {more} more" if more > 0 else named


def require_complete(jobs: Sequence[ReportData]) -> None:
    """Raise MeasuringError, code ``export.incomplete``, if a job is not complete."""
    for data in jobs:
        missing = missing_of(data.view)
        if missing:
            raise MeasuringError(
                "export.incomplete",
                f"Job {data.job} is INCOMPLETE: {missing_words(missing)} not measured.",
                "Measure what is missing; or ask for the report of an incomplete job.",
            )


def write_together(
    contents: Mapping[Path, bytes], check: Callable[[Mapping[Path, bytes]], None] | None = None
) -> None:
    """Write files of one folder, created if missing.

    Everything is first written and synced under temporary names. If a rename fails after others
    succeeded, the replaced files are restored. Temporary files of a killed program are removed here
    and at the next start (`leftovers`).

    `check`: receives the read-back content before any file is replaced; may raise. Raises
    StorageError if something cannot be written; the folder then holds its former files, or the
    error names those that could not be restored.
    """
    staged: dict[Path, Path] = {}
    replaced: list[tuple[Path, os.stat_result, bytes | None]] = []
    path = next(iter(contents))
    try:
        with contextlib.ExitStack() as held:
            for path in contents:
                path.parent.mkdir(parents=True, exist_ok=True)
                clear_beside(path)
                staged[path] = held.enter_context(written_beside(path, contents[path]))
            if check is not None:
                check({path: staged[path].read_bytes() for path in contents})
            for path in contents:
                before = read_guarded(path, LARGEST_JOB) if path.exists() else None
                state = staged[path].lstat()
                staged[path].replace(path)
                replaced.append((path, state, before))
            for folder in {path.parent for path in contents}:
                HOST.sync_folder(folder)
    except OSError as error:
        mixed = [one[0].name for one in replaced if not _put_back(*one)]
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        raise StorageError(
            "export.not_writable",
            f"{path}: the file cannot be written ({error.strerror})."
            + (f" Already replaced: {', '.join(mixed)}." if mixed else ""),
            "Free space on that disk, or choose a folder on another one."
            if full
            else "Choose a writable folder, and close programs that use the file.",
        ) from error


def _put_back(path: Path, state: os.stat_result, before: bytes | None) -> bool:
    """Restore or remove a file that still is the one written; return whether that succeeded."""
    try:
        if before is None:
            return HOST.remove_same(path, state.st_dev, state.st_ino)
        if not os.path.samestat(path.lstat(), state):
            return False
        write_atomic(path, before)
    except OSError:
        # A disk that fails to rename may still write.
        if before is None:
            return False
        try:
            path.write_bytes(before)
        except OSError:
            return False
    return True


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
