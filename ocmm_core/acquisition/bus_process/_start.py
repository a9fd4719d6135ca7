"""Entry point of the bus process: one thread and minimal rights."""

from __future__ import annotations

import sys

from ocmm_core.acquisition.bus_process._rights import NEEDED, allow_locked_memory, give_up_all_but
from ocmm_core.blas import use_one_thread
from ocmm_core.failure import EXIT_INTERNAL, contained, hold_standard_streams, write_last
from ocmm_core.host import require_linux


def main() -> None:
    """Drop rights, then run the bus process; ``ocmm-acq [CONFIG.json]``."""
    # numpy creates threads when imported, so import it last.
    hold_standard_streams()
    use_one_thread()
    try:
        require_linux("The camera bus")
        allow_locked_memory()
        give_up_all_but(NEEDED)
        from ocmm_core.acquisition.bus_process._process import main as run

        run()
    except Exception as error:
        write_last(f"{contained(error, 'The bus process')}\n")
        sys.exit(EXIT_INTERNAL)


if __name__ == "__main__":
    main()
