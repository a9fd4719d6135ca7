"""The command line: ``ocmm``."""

from __future__ import annotations

import sys

from ocmm_core.blas import use_one_thread
from ocmm_core.errors import OcmmError

COULD_NOT_MEASURE = 2


def main() -> None:
    """Run the command line; every expected fault is one sentence and its remedy."""
    use_one_thread()
    # typer and the rooms behind it take a while to load; a worker process that imports this
    # package by chance should not pay for them.
    from ocmm_core.cli.app import app

    try:
        app()
    except OcmmError as error:
        sys.stderr.write(f"ocmm: {error.what}\n      {error.remedy}\n")
        sys.exit(COULD_NOT_MEASURE)
    except KeyboardInterrupt:
        sys.stderr.write("ocmm: stopped; every point that was taken is in the job file.\n")
        sys.exit(130)


if __name__ == "__main__":
    main()
