"""Start the window: ``python -m ocmm_gui``."""

from __future__ import annotations

import multiprocessing
import sys

from ocmm_core.acquisition.bus_process import hold_nothing
from ocmm_core.blas import use_one_thread

if __name__ == "__main__":
    # A frozen program would otherwise start itself recursively.
    multiprocessing.freeze_support()
    # Before any other thread exists: capabilities are per thread.
    hold_nothing()
    use_one_thread()

    from ocmm_core.errors import InternalError
    from ocmm_core.failure import EXIT_INTERNAL, contained, hold_standard_streams, write_last
    from ocmm_core.host import library_fault
    from ocmm_core.side_files import distrust_working_folder

    hold_standard_streams()

    try:
        distrust_working_folder()
        from ocmm_gui.app import main
    except Exception as error:
        lacking = library_fault() if isinstance(error, ImportError) else None
        told = lacking or contained(error, "Loading the window")
        write_last(f"{told.what}\n{told.remedy}\n")
        sys.exit(EXIT_INTERNAL if isinstance(told, InternalError) else 2)
    code = main()
    write_last()
    sys.exit(code)
