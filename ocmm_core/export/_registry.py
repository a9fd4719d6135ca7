"""All formats of a report, and the function that writes them, verified by reading back."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from ocmm_core.errors import InputError, StorageError
from ocmm_core.export import report
from ocmm_core.export._files import require_complete, seal_of, write_together
from ocmm_core.export.aqdef import AQDEF
from ocmm_core.export.qif import QIF

EXPORTERS: dict[str, report.Exporter] = {
    item.name: item
    for item in (report.POLYWORKS, QIF, AQDEF, report.XLSX, report.JSON, report.AS9102)
}
"""Formats of this package, by name on the command line."""

PDF = report.ReportFormat(
    name="pdf",
    title="PDF",
    purpose="paper; the JSON file is inside",
    suffixes=("_report.pdf",),
    profile="",
)
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
