"""Start the upload: ``python -m ocmm_core.archive.outbox ADDRESS STATION OUTBOX [PASSWORD]``."""

from __future__ import annotations

import sys

from ocmm_core.archive.outbox import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
