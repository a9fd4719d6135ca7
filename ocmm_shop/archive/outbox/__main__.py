"""Start the upload: ``python -m ocmm_shop.archive.outbox ADDRESS STATION OUTBOX [PASSWORD]``."""

from __future__ import annotations

import sys

from ocmm_shop.archive.outbox import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
