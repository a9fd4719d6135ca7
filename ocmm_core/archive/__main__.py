"""Start the hand-over: ``python -m ocmm_core.archive ADDRESS STATION OUTBOX [PASSWORD_FILE]``."""

from __future__ import annotations

import sys

from ocmm_core.archive import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
