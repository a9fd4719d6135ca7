"""Start the window: ``python -m ocmm_gui``."""

from __future__ import annotations

import multiprocessing
import sys

from ocmm_core.blas import use_one_thread

if __name__ == "__main__":
    # A frozen program would start itself again and again without this.
    multiprocessing.freeze_support()
    use_one_thread()

    from ocmm_gui.app import main

    sys.exit(main())
