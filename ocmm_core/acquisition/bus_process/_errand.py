"""Short task on the wire in a process with the necessary rights."""

from __future__ import annotations

import sys
from collections.abc import Callable

from ocmm_core.acquisition.bus_process._commands import read_first_line
from ocmm_core.acquisition.bus_process._rights import NEEDED, give_up_all_but
from ocmm_core.errors import InternalError
from ocmm_core.failure import EXIT_INTERNAL, contained

EXIT_FAILED = 2


def run_errand(run: Callable[[bytes], None], what: str) -> None:
    """Drop unneeded rights, and run the task with one line of standard input.

    Errors go to standard error; exit code 2, or 3 if unexpected.
    """
    try:
        give_up_all_but(NEEDED)
        run(read_first_line(sys.stdin.fileno()))
    except Exception as error:
        told = contained(error, what)
        sys.stderr.write(f"{told}\n")
        sys.exit(EXIT_INTERNAL if isinstance(told, InternalError) else EXIT_FAILED)
