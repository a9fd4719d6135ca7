"""Pages drawn by Qt, which commands and the core do not import before they need it."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.processes import processes_for, side_by_side

if TYPE_CHECKING:
    from ocmm_core.export.report import ReportData


def print_reports(data: Sequence[ReportData], folder: Path, *, incomplete: bool) -> list[Path]:
    """Write the PDF reports of jobs, many in parallel; return their paths in order.

    StorageError if one failed; the files of the others exist.
    """
    work = partial(_printed, folder=folder, incomplete=incomplete)
    try:
        # One application for all jobs of this process.
        with import_module("ocmm_gui.reports").drawing():
            found = list(side_by_side(work, data, processes_for(len(data)), lambda one: one.job))
        faults = [f"{one.what} {one.remedy}" for one in found if isinstance(one, OcmmError)]
    except ImportError as error:
        faults = [str(error)]
    if faults:
        why = " ".join(faults)
        raise StorageError(
            "export.pdf", f"The PDF report was not written: {why}",
            "The job and the other formats are not affected.",
        )  # fmt: skip
    return [one for one in found if isinstance(one, Path)]


def _printed(data: ReportData, folder: Path, *, incomplete: bool) -> Path:
    pages = import_module("ocmm_gui.reports")
    with pages.drawing():
        path: Path = pages.write_pdf(data, folder, incomplete=incomplete)
    return path


def print_pages(
    module: str, calls: Sequence[Sequence[str]], code: str, what: str, remedy: str
) -> list[str]:
    """Run ``python -m module`` with the arguments of each call, in parallel; return their output.

    StorageError if one failed, with ``code``, ``what`` and its last output, and ``remedy``; all
    have ended, and the files of the others exist.
    """
    programs: list[subprocess.Popen[str]] = []
    lines: list[str] = []
    faults: list[str] = []
    try:
        for arguments in calls:
            command = [sys.executable, "-m", module, *arguments]
            programs.append(
                subprocess.Popen(  # noqa: S603 - our own interpreter and module
                    command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
                )
            )
        for program in programs:
            printed, told = program.communicate()
            lines += printed.splitlines()
            if program.returncode != 0:
                faults += told.strip().splitlines()[-1:] or ["the drawing program ended"]
    finally:
        for program in programs:
            if program.poll() is None:
                program.kill()
                program.communicate()
    if faults:
        raise StorageError(code, f"{what}: {' '.join(faults)}", remedy)
    return lines
