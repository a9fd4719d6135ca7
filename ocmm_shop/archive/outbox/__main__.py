"""Start the upload: ``python -m ocmm_shop.archive.outbox ADDRESS STATION OUTBOX [PASSWORD]``."""

import sys

from ocmm_shop.archive.outbox import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
