"""Minimum zones: time, a peer, agreement with 50 digits, and how often more starts find better.

    python -m benchmarks.zones [SETS]

All of it is seeded. The peer is the sequence of linear programmes that scipy offers without
writing a solver: `linprog` (HiGHS) on all points, restarted from each step, same first element. The
limit: a zone of 1,000 points, all its starts and its proof, takes no longer than the first of these
programmes. Times are process times, the least of some.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import linprog

from ocmm_core.blas import use_one_thread
from ocmm_core.errors import FitError
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.features.zones import ZONES, best_zone, certificate, distances, fit_zone, task_of
from ocmm_core.geometry import Points3
from tests.core.features.exact_zones import in_fifty_digits
from tests.core.features.shape_samples import OUTLINES, ideal_points, somewhere
from tests.core.features.test_zone import ZONED, sample

MANY_STARTS = 300
SHAPES = (*ZONED, *OUTLINES)


def drawn(shape: Shape, rng: np.random.Generator, n: int, noise: float) -> Points3:
    """Return noisy points (n, 3), mm, of a shape about the origin along z."""
    if shape not in OUTLINES:
        return sample(shape, rng, n, noise)
    points = ideal_points(shape, rng, n)
    points[:, :2] += rng.normal(0.0, noise, (n, 2))
    return points


def zone_of_squares(start: Fit) -> float:
    """Return the width of the zone about a least-squares element."""
    return 2.0 * float(np.abs(start.residuals).max()) if start.shape in OUTLINES else start.form


def _best_time(call: Callable[[], object], runs: int = 7) -> float:
    call()
    times = []
    for _ in range(runs):
        begin = time.process_time()
        call()
        times.append(time.process_time() - begin)
    return min(times)


def peer(start: Fit, points: Points3, programmes: int = 30) -> float:
    """Return the zone, mm, that a plain sequence of linear programmes reaches."""
    task = task_of(start, points, ZONES[start.shape])
    free, placed, n = list(task.surface.free), task.start, len(points)
    ones = np.ones((n, 1))
    width = np.inf
    for _ in range(programmes):
        found, jacobian = distances(task.surface, placed.local(task.points), placed.sizes)
        if width - np.ptp(found) < 1e-13:
            break
        width = float(np.ptp(found))
        step = np.zeros(jacobian.shape[1])
        jacobian = jacobian[:, free]
        rows = np.block([[jacobian, -ones, 0.0 * ones], [-jacobian, 0.0 * ones, ones]])
        answer = linprog(
            np.array([0.0] * len(free) + [1.0, -1.0]), rows, np.concatenate([-found, found]),
            bounds=[(-0.1, 0.1)] * len(free) + [(None, None)] * 2, method="highs",
        )  # fmt: skip
        step[free] = np.asarray(answer.x)[: len(free)]
        placed = placed.moved(step)
    return width * task.size


@dataclass(frozen=True, slots=True)
class Cost:
    """Cost of the zone of 1,000 points: ours, and the first of the peer's programmes, s."""

    start: Fit
    points: Points3
    zone: float
    programme: float

    @property
    def ratio(self) -> float:
        """Return the peer's time over ours; NaN without a peer."""
        return self.programme / self.zone


def cost(shape: Shape) -> Cost:
    """Return the cost of a zone of 1,000 points of a shape."""
    rng = np.random.default_rng(1)
    points = somewhere(rng).apply(drawn(shape, rng, 1000, 0.02))
    start = fit_shape(shape, points)
    zone = _best_time(partial(fit_zone, start, points))
    once = _best_time(partial(peer, start, points, 1), 5) if ZONES[shape].lower else np.nan
    return Cost(start, points, zone, once)


def times() -> None:
    """Print the times of 1,000 points of every shape, with least squares and the peer's."""
    for shape in SHAPES:
        found = cost(shape)
        start, points, zone = found.start, found.points, found.zone
        squares = _best_time(partial(fit_shape, shape, points))
        text = f"{shape.value:10} 1000 points: zone {1e3 * zone:6.1f} ms, "
        text += f"least squares {1e3 * squares:6.2f} ms, ratio {zone / squares:5.1f}"
        if ZONES[shape].lower:
            theirs = _best_time(partial(peer, start, points), 3)
            gap = peer(start, points) - fit_zone(start, points).form
            text += f"; linprog, one start {1e3 * theirs:6.1f} ms ({theirs / zone:4.1f} times)"
            text += f", one programme {1e3 * found.programme:6.1f} ms ({found.ratio:4.1f} times)"
            text += f", wider by {gap:.1e} mm"
        print(text)


def certified(sets: int) -> None:
    """Print the share of certified zones and the worst ratio to least squares."""
    for shape in SHAPES:
        proven, refused, better, gain, ratio = 0, 0, 0, 0.0, 0.0
        for seed in range(sets):
            rng = np.random.default_rng(seed)
            n = int(rng.integers(9, 200))
            noise = float(10.0 ** rng.uniform(-4.0, 0.3))
            points = somewhere(rng, 10_000.0).apply(drawn(shape, rng, n, noise))
            try:
                start = fit_shape(shape, points)
                zone = fit_zone(start, points)
            except FitError as error:
                refused += 1
                print("   ", shape.value, seed, n, f"{noise:.1e}", error)
                continue
            proven += certificate(zone, points).certified
            ratio = max(ratio, zone.form / zone_of_squares(start))
            if seed % 5 == 0:
                task = task_of(start, points, ZONES[shape])
                wide = best_zone(task.surface, task.points, task.start, MANY_STARTS, 2.0)
                halves = 1.0 if ZONES[shape].lower else 2.0
                won = zone.form - wide.width * task.size * halves
                better += won > 1e-9
                gain = max(gain, won)
        print(
            f"{shape.value:9} {proven} of {sets} certified, {refused} refused; zone / least "
            f"squares at most {ratio:.4f}; {MANY_STARTS} starts better in {better} of "
            f"{(sets + 4) // 5}, by at most {max(gain, 0.0):.1e} mm"
        )


def digits(sets: int) -> None:
    """Print the worst difference from solutions in 50 digits."""
    for shape in (Shape.CYLINDER, Shape.CONE, Shape.TORUS):
        for far in (0.0, 10_000.0):
            worst = 0.0
            for seed in range(sets):
                rng = np.random.default_rng(seed)
                points = somewhere(rng, far).apply(sample(shape, rng, 100, 0.02))
                fit = fit_zone(fit_shape(shape, points), points)
                exact, form = in_fifty_digits(fit, points)
                gap = float(np.abs(fit.geometry[:9] - exact[:9]).max())
                worst = max(worst, gap, abs(fit.form - form))
            print(
                f"{shape.value:9} {sets} sets, {far / 1e3:g} m away: within {worst:.1e} mm of 50 "
                "digits"
            )


def main() -> None:
    """Run everything."""
    use_one_thread()
    sets = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    times()
    digits(max(sets // 10, 1))
    certified(sets)


if __name__ == "__main__":
    main()
