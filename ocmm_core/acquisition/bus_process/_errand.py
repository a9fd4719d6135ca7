"""One errand on the wire in a process of its own, which has the rights that this needs."""

from __future__ import annotations

import sys
from collections.abc import Callable

from ocmm_core.acquisition.bus_process._commands import read_first_line
from ocmm_core.acquisition.bus_process._rights import NEEDED, give_up_all_but
from ocmm_core.errors import InternalError
from ocmm_core.failure import EXIT_INTERNAL, contained

EXIT_FAILED = 2


def run_errand(run: Callable[[bytes], None], what: str) -> None:
    """Keep no more rights than it needs, and do what one line on standard input asks for.

    What goes wrong is told on standard error, and the process ends with 2, or 3 where nobody
    foresaw it.
    """
    try:
        give_up_all_but(NEEDED)
        run(read_first_line(sys.stdin.fileno()))
    except Exception as error:
        told = contained(error, what)
        sys.stderr.write(f"{told}\n")
        sys.exit(EXIT_INTERNAL if isinstance(told, InternalError) else EXIT_FAILED)
