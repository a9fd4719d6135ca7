"""Short task on the wire in a process with the necessary rights."""

from __future__ import annotations

import sys
from collections.abc import Callable

from ocmm_core.acquisition.bus_process._commands import read_first_line
from ocmm_core.acquisition.bus_process._rights import NEEDED, give_up_all_but
from ocmm_core.failure import exit_with


def run_errand(run: Callable[[bytes], None], what: str) -> None:
    """Drop rights, run the task with a line of input; errors to stderr, exit 2, unexpected 3."""
    try:
        give_up_all_but(NEEDED)
        run(read_first_line(sys.stdin.fileno()))
    except Exception as error:
        exit_with(error, what)
