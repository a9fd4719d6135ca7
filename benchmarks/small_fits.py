"""Fits of as many points as are touched by hand, beside scipy's least_squares from the truth.

Ours start cold, look for every other element that the points allow (decision 17) and give the
derivatives by every point; scipy starts at the truth, which ours do not know, and gives the
element. Points are spread at random over the whole surface, which no two of so few need be.

For each shape and number of points: processor time of both, the median over the sets, of each the
least of some calls taken in turns; the sets in which scipy was quicker; and those that ours refused
or named a rival for.
The limit: the median of ours is no more than that of scipy.
Run: ``python -m benchmarks.small_fits [--sets 20]``.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass

import numpy as np

from benchmarks.fits import by_scipy, sample
from ocmm_core.blas import use_one_thread
from ocmm_core.errors import FitError
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Points3

NUMBERS = {
    Shape.CIRCLE: (4, 6, 8, 12, 17),
    Shape.SPHERE: (5, 6, 8, 12, 17),
    Shape.CYLINDER: (6, 8, 10, 12, 17),
    Shape.CONE: (7, 8, 10, 12, 17),
    Shape.TORUS: (8, 10, 12, 17),
}
CALLS = 5


@dataclass(frozen=True, slots=True)
class Row:
    """Results of a shape and a number of points: times in ms, and numbers of sets."""

    ours_ms: float
    scipy_ms: float
    quicker: int
    open: int


def measure(shape: Shape, n: int, sets: int) -> Row:
    """Return the row of a shape and a number of points."""
    ours, theirs, doubtful = [], [], 0
    for seed in range(sets):
        points, truth = sample(shape, np.random.default_rng([seed, n]), n, 2.0 * np.pi)
        peer = by_scipy(shape, points, truth)
        own, other = [], []
        for _ in range(CALLS):
            begun = time.process_time()
            is_open = _fitted(shape, points)
            between = time.process_time()
            peer()
            own.append(between - begun)
            other.append(time.process_time() - between)
        ours.append(min(own))
        theirs.append(min(other))
        doubtful += is_open
    quicker = sum(b < a for a, b in zip(ours, theirs, strict=True))
    return Row(1e3 * float(np.median(ours)), 1e3 * float(np.median(theirs)), quicker, doubtful)


def _fitted(shape: Shape, points: Points3) -> bool:
    """Fit, and return whether the points leave the element open."""
    try:
        fit = fit_shape(shape, points)
    except FitError:
        return True
    return fit.rival is not None


def main() -> int:
    """Print the table; return 1 if scipy is quicker."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--sets", type=int, default=20)
    sets = parser.parse_args().sets
    use_one_thread()
    print(f"{sets} sets each, least of {CALLS} calls; medians")
    heads = f"{'points':>7}{'ours ms':>9}{'scipy ms':>10}{'ratio':>7}{'quicker':>9}{'open':>6}"
    print(f"{'shape':<10}{heads}")
    slower = 0
    for shape, numbers in NUMBERS.items():
        for n in numbers:
            row = measure(shape, n, sets)
            slower += row.ours_ms > row.scipy_ms
            print(
                f"{shape.value:<10}{n:>7}{row.ours_ms:>9.2f}{row.scipy_ms:>10.2f}"
                f"{row.scipy_ms / row.ours_ms:>7.2f}{row.quicker:>9}{row.open:>6}",
                flush=True,
            )
    print(f"slower in {slower} rows" if slower else "limit kept")
    return int(slower > 0)


if __name__ == "__main__":
    sys.exit(main())
