"""Entry point of the bus process: one thread and minimal rights."""

from __future__ import annotations

import sys

from ocmm_core.acquisition.bus_process._rights import NEEDED, allow_locked_memory, give_up_all_but
from ocmm_core.blas import use_one_thread
from ocmm_core.failure import EXIT_INTERNAL, contained
from ocmm_core.host import require_linux


def main() -> None:
    """Drop rights, then run the bus process; ``ocmm-acq [CONFIG.json]``."""
    # numpy creates threads when imported, so import it last.
    use_one_thread()
    try:
        require_linux("The camera bus")
        allow_locked_memory()
        give_up_all_but(NEEDED)
        from ocmm_core.acquisition.bus_process._process import main as run

        run()
    except Exception as error:
        sys.stderr.write(f"{contained(error, 'The bus process')}\n")
        sys.exit(EXIT_INTERNAL)


if __name__ == "__main__":
    main()
