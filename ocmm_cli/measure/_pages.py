"""Pages drawn by a separate program: the core does not import Qt."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence

from ocmm_core.errors import StorageError


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
