"""How often value ± U (k = 2) holds the truth, over seeded virtual rigs: `ocmm study coverage`.

    python -m benchmarks.coverage [RUNS] [SCHEDULER]

The same table, on all cores or on the workers of a scheduler.
"""

from __future__ import annotations

import os
import sys

from ocmm_core.blas import use_one_thread

use_one_thread()

from ocmm_core.cli.study import CoverageSetup, coverage_table, run_coverage  # noqa: E402
from ocmm_core.cluster import Site  # noqa: E402


def main() -> None:
    """Print the coverage of every characteristic."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    site = Site(sys.argv[2]) if len(sys.argv) > 2 else Site(workers=os.cpu_count())
    rows = coverage_table(run_coverage(CoverageSetup(), range(count), site))
    print(f"{count} runs; wanted: 92 to 99 %")
    print(f"{'characteristic':<24}{'covered %':>10}{'mean U um':>11}{'RMS error um':>14}")
    for name, covered, stated, error in rows:
        print(f"{name:<24}{100 * covered:>10.1f}{1e3 * stated:>11.2f}{1e3 * error:>14.2f}")


if __name__ == "__main__":
    main()
