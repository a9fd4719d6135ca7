"""Fits of hard sets of points against an independent search from very many starts.

`hard_samples` makes the sets, seeded and never chosen by hand; `hard_reference` looks for their
minima with scipy's least_squares, from the truth, places around it, and random ones. A set counts
as

- silently worse, where the product's cost is higher than the reference's by more than rounding and
  it neither refused nor named a rival (`Fit.rival`),
- well conditioned, where the reference determines the sizes to a tenth (condition below 1e4), no
  second minimum or descent without end of its own lies within what noise cannot decide, and the
  product found no lower minimum and no such second one (by the distances of the reference) either.

An element with a rival counts as refused here, as a job refuses it. The time of small fits is the
least processor time of three calls; it is printed and no limit is taken from it, as doubt takes
time. Run: ``python -m benchmarks.hard_fits --n 5000``; 5,000 sets a shape take some hours.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass

import numpy as np

from benchmarks.hard_reference import Reference, cost_of, reference_of
from benchmarks.hard_samples import SHAPES, HardSet, hard_set
from ocmm_core.blas import use_one_thread
from ocmm_core.errors import FitError
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.search import undecided
from ocmm_core.features.shapes import MINIMUM_POINTS, Fit, Shape

SEED, STARTS = 20_261, 16
ROUNDING, ROUNDING_MM = 1e-6, 1e-9
"""By which root mean squares may differ: relative, and mm for coordinates up to 10 m."""
DETERMINED, SHARP = 1e4, 0.1
"""Condition number, and standard deviation of a size against it, of well conditioned sets."""
MOST_REFUSED = 0.01
SMALL = (6, 17)
"""Points of a small fit."""
WANTED_MS = 5.0


@dataclass(frozen=True, slots=True)
class Judged:
    """Outcome of one set.

    Attributes
    ----------
    silent
        The element is worse than another one, without a message.
    well
        The set is well conditioned.
    refused, ambiguous
        There is no element, or there are two.
    better
        It is better than the reference.
    """

    silent: bool
    well: bool
    refused: bool
    ambiguous: bool
    better: bool


def judge(hard: HardSet, reference: Reference) -> Judged:
    """Return what becomes of a set."""
    try:
        fit = fit_shape(hard.shape, hard.points)
    except FitError:
        return Judged(False, well_conditioned(hard, reference), True, False, False)
    best = reference.minima[0].cost if reference.minima else np.inf
    higher = _higher(cost_of(fit, hard.points), best, len(hard.points))
    lower = _higher(best, cost_of(fit, hard.points), len(hard.points))
    ambiguous = fit.rival is not None
    well = well_conditioned(hard, reference) and not lower and not _real_rival(hard, fit)
    return Judged(higher and not ambiguous, well, False, ambiguous, lower)


def well_conditioned(hard: HardSet, reference: Reference) -> bool:
    """Return whether the reference has one minimum that the points determine well."""
    if not reference.minima:
        return False
    best, *others = reference.minima
    n, numbers = len(hard.points), MINIMUM_POINTS[hard.shape]
    size = float(np.sqrt(np.mean(np.sum((hard.points - hard.points.mean(axis=0)) ** 2, axis=1))))
    sigma = np.sqrt(best.cost / (n - numbers)) if n > numbers else hard.noise
    scale = np.array([1.0, best.sizes[1]]) if hard.shape is Shape.CONE else best.sizes
    return (
        best.condition < DETERMINED
        and bool(np.all(best.deviations * sigma < SHARP * np.abs(scale)))
        and not _higher(best.cost, reference.open_cost, n)
        and not any(
            undecided(best.cost / size**2, other.cost / size**2, n, numbers) for other in others
        )
    )


def _real_rival(hard: HardSet, fit: Fit) -> bool:
    """Return whether the reference missed a rival, by its own distances."""
    if fit.rival is None:
        return False
    n, numbers = len(hard.points), MINIMUM_POINTS[hard.shape]
    costs = (cost_of(fit, hard.points), cost_of(fit.rival, hard.points))
    return n > numbers and undecided(min(costs), max(costs), n, numbers)


def _higher(cost: float, other: float, n: int) -> bool:
    """Return whether a cost is higher than another by more than rounding."""
    rms, least = np.sqrt(cost / n), np.sqrt(other / n)
    return bool(rms > least * (1.0 + ROUNDING) + ROUNDING_MM)


def main() -> int:
    """Print a table; return 1 if a worse minimum went without a sign or too many are refused."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--n", type=int, default=5000, help="sets of every shape")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--starts", type=int, default=STARTS, help="random ones of the reference")
    parser.add_argument("--shapes", default=",".join(shape.name for shape in SHAPES))
    chosen = parser.parse_args()
    use_one_thread()
    print(f"seed {chosen.seed}, {chosen.n} sets a shape, 5 to 360 degrees, noise 1e-6 to 0.2")
    broken = False
    for name in chosen.shapes.split(","):
        broken |= _table(Shape[name], chosen.n, chosen.seed, chosen.starts)
    print("limits: 0 silently worse; fewer than 1 % of the well conditioned refused")
    print("LIMIT BROKEN" if broken else "limits kept")
    return int(broken)


def _table(shape: Shape, n: int, seed: int, starts: int) -> bool:
    found: list[Judged] = []
    silent, refused, times = [], [], []
    for number in range(n):
        hard = hard_set(shape, seed, number)
        judged = judge(hard, reference_of(hard, starts))
        found.append(judged)
        if judged.silent:
            silent.append(number)
        if judged.well and (judged.refused or judged.ambiguous):
            refused.append(number)
        if SMALL[0] <= len(hard.points) <= SMALL[1]:
            times.append(min(_milliseconds(hard) for _ in range(3)))
    well = sum(judged.well for judged in found)
    print(
        f"{shape.value:<11} silently worse {len(silent)} of {n} {silent[:10] or ''}\n"
        f"{'':<11} refused or ambiguous {len(refused)} of {well} well conditioned "
        f"{refused[:10] or ''}\n"
        f"{'':<11} all: {sum(item.refused for item in found)} refused, "
        f"{sum(item.ambiguous for item in found)} ambiguous; better than the reference "
        f"{sum(item.better for item in found)}"
    )
    if times:
        within = np.mean(np.array(times) <= WANTED_MS)
        print(
            f"{'':<11} {len(times)} sets of {SMALL[0]} to {SMALL[1]} points: median "
            f"{np.median(times):.1f} ms, 90 % within {np.percentile(times, 90):.1f} ms, longest "
            f"{max(times):.1f} ms; {100.0 * within:.0f} % within {WANTED_MS:g} ms",
            flush=True,
        )
    return bool(silent) or len(refused) >= max(1.0, MOST_REFUSED * well)


def _milliseconds(hard: HardSet) -> float:
    start = time.process_time_ns()
    _tried(hard)
    return 1e-6 * (time.process_time_ns() - start)


def _tried(hard: HardSet) -> Fit | None:
    try:
        return fit_shape(hard.shape, hard.points)
    except FitError:
        return None


if __name__ == "__main__":
    sys.exit(main())
