"""All formats of a report, and the atomic, signed files that are written and read back."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from ocmm_core.cleanup import clear_beside
from ocmm_core.documents import read_bytes, write_atomic, written_beside
from ocmm_core.errors import InputError, MeasuringError, OcmmError, StorageError
from ocmm_core.export import report
from ocmm_core.export.aqdef import AQDEF
from ocmm_core.export.qif import QIF
from ocmm_core.export.report import ReportData
from ocmm_core.host import HOST
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.plugins import load_all
from ocmm_core.seals import KeyFolder, SealState, Signature, Signed, judge_signature, sign
from ocmm_core.side_files import LARGEST_JOB, read_guarded

EXPORTERS: dict[str, report.Exporter] = {
    item.name: item
    for item in (
        report.POLYWORKS, QIF, AQDEF, report.XLSX, report.JSON, report.AS9102,
        *load_all("ocmm.exports", report.Exporter),
    )
}  # fmt: skip
"""Formats of this package and of plug-ins, by name on the command line."""

PDF = report.ReportFormat(
    name="pdf", title="PDF", purpose="paper; the JSON file is inside", suffixes=("_report.pdf",),
    profile="",
)  # fmt: skip
"""Pages with pictures: they need Qt, so the window draws them."""

FORMATS: dict[str, report.ReportFormat] = {**EXPORTERS, PDF.name: PDF}
"""All formats of a report, by name on the command line."""

DEFAULT_FORMAT = report.POLYWORKS.name

ALL = "all"
"""All formats, on the command line."""

_MOST_TOLD = 3


def chosen_formats(names: Sequence[str]) -> tuple[str, ...]:
    """Return distinct names of `FORMATS`, `ALL` expanded; InputError if unknown."""
    found: list[str] = []
    for name in names:
        if name != ALL and name not in FORMATS:
            raise _no_format(name, (*FORMATS, ALL))
        found += FORMATS if name == ALL else [name]
    return tuple(dict.fromkeys(found))


def write_report(
    data: report.ReportData | Sequence[report.ReportData],
    formats: Sequence[str],
    folder: Path | str,
    profile: report.Profile | None = None,
    *,
    incomplete: bool = False,
    beside: Mapping[str, bytes] | None = None,
) -> tuple[Path, ...]:
    """Write reports, all files or none, and return their paths without that of their seal.

    Every file is read back and compared with the job before any older one is replaced.

    Parameters
    ----------
    data
        One job, or several: formats for statistics write them as several values of one file.
    formats
        Names of `EXPORTERS`.
    folder
        Created if missing. Files of the same name are replaced.
    profile
        Of the text files; None is that of PolyWorks.
    incomplete
        Also write the report of an incomplete job.
    beside
        Additional checked files by name, such as the PDF, written in the same transaction.

    Raises
    ------
    InputError
        Unknown format, or nothing to report.
    MeasuringError
        A job is not complete, and ``incomplete`` was not given.
    StorageError
        A name or a number does not fit the files, two jobs have the same name, the folder cannot
        be written, or files read back differ. Nothing is written then.
    """
    folder, profile = Path(folder), profile or report.polyworks_profile()
    contents: dict[Path, bytes] = {}
    taken: set[str] = set()
    if not incomplete:
        require_complete([data] if isinstance(data, report.ReportData) else data)
    for exporter, jobs in () if beside and not formats else _parts(data, formats):
        for name, content in exporter.contents(jobs, profile).items():
            # Some file systems are case-insensitive.
            if name.lower() in taken:
                raise StorageError(
                    "export.twice",
                    f"Two jobs would be written to {folder / name}.",
                    "Report jobs of the same name to separate folders.",
                )
            taken.add(name.lower())
            contents[folder / name] = content
    contents |= {folder / name: content for name, content in (beside or {}).items()}
    reported = [data] if isinstance(data, report.ReportData) else list(data)
    # Separately made files have a seal of their own, which must not replace that of the others.
    stem = reported[0].stem if formats else next(iter(beside or {}), reported[0].stem)
    seal_name, seal = seal_of(stem, contents, reported)
    sealed = {**contents, folder / seal_name: seal}

    def check(read: Mapping[Path, bytes]) -> None:
        for one in reported:
            if one.identity is not None:
                one.identity.require_name()
        files = {path.name: content for path, content in read.items()}
        if files[seal_name] != seal:
            raise _differs("its seal", [f"{seal_name}: it is not what was to be written."])
        for exporter, jobs in _parts(data, formats) if formats else ():
            _require_same(exporter, exporter.differences(jobs, profile, files))

    write_together(sealed, check)
    return tuple(contents)


def preview(
    data: report.ReportData | Sequence[report.ReportData],
    name: str,
    profile: report.Profile | None = None,
) -> tuple[report.ReportTable, ...]:
    """Return the contents of a format as tables; errors as `write_report`."""
    profile = profile or report.polyworks_profile()
    return tuple(
        table
        for exporter, jobs in _parts(data, (name,))
        for table in exporter.preview(jobs, profile)
    )


def preview_text(tables: Sequence[report.ReportTable]) -> str:
    """Return tables as text with columns of equal width."""
    parts = []
    for table in tables:
        rows = [list(table.columns), *([_shown(cell) for cell in row] for row in table.rows)]
        widths = [max(len(row[i]) for row in rows) for i in range(len(table.columns))]
        lines = [
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in rows
        ]
        parts.append("\n".join([table.title, *lines]))
    return "\n\n".join(parts) + "\n"


def _shown(cell: report.Cell) -> str:
    if cell is None:
        return ""
    return cell.text() if isinstance(cell, report.Number) else str(cell)


def _parts(
    data: report.ReportData | Sequence[report.ReportData], formats: Sequence[str]
) -> Iterator[tuple[report.Exporter, Sequence[report.ReportData]]]:
    """Yield every format with the jobs of each call."""
    jobs = [data] if isinstance(data, report.ReportData) else list(data)
    if not jobs or not formats:
        raise InputError("export.nothing", "Nothing to report.", "Name a job and a format.")
    for name in dict.fromkeys(formats):
        if name not in EXPORTERS:
            raise _no_format(name, EXPORTERS)
        exporter = EXPORTERS[name]
        for part in [jobs] if exporter.batch else [[job] for job in jobs]:
            yield exporter, part


def _no_format(name: str, known: Iterable[str]) -> InputError:
    return InputError(
        "export.format", f"Unknown report format {name!r}.", f"Choose from {', '.join(known)}."
    )


def _require_same(exporter: report.Exporter, differences: Sequence[str]) -> None:
    if differences:
        raise _differs(exporter.title, differences)


def _differs(what: str, differences: Sequence[str]) -> StorageError:
    told = " ".join(differences[:_MOST_TOLD])
    return StorageError(
        "export.differs",
        f"The report for {what} was read back and differs from the job: {told}",
        "Nothing was written. Report the job into another folder; if it happens again, send "
        "the job file to the maintainers of this program.",
    )


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
    and at the next start (`cleanup`).

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
