"""Batches of trials, in threads of this process or on workers of a site: same numbers.

The random numbers of a batch depend only on the seed, the stream and its index.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

from ocmm_core.cluster import Site, run_tasks
from ocmm_core.errors import OcmmError
from ocmm_core.geometry import Float
from ocmm_core.tolerances.monte_carlo._trials import Task, quick_model, slow_trials
from ocmm_core.tolerances.uncertainty import TWO_SIDED

Draws = np.ndarray[tuple[int, int], np.dtype[np.float32]]

_BLOCK_NUMBERS = 120_000
"""Numbers drawn at a time: a megabyte stays in the cache."""
_QUICK_A_TASK, _SLOW_A_TASK = 10, 2
"""Batches of a worker per request: about a second, to limit overhead."""


@dataclass(frozen=True, slots=True)
class Batch:
    """One batch."""

    draws: Draws
    """(m, k): deviations of the values from the measured ones; NaN for a failed fit."""
    figures: Float
    """(4, k): mean, standard deviation and ends of the interval of every value."""
    failed: int
    seconds: float


@dataclass(frozen=True, slots=True)
class BatchSource:
    """Generator of batches; can be sent to another computer."""

    task: Task
    names: tuple[str, ...]
    """`task`, `names`: Task, and its simulated characteristics."""
    start: Float
    """(k,): their measured values."""
    stream: int
    """0 for fast values, 1 for full evaluation."""
    size: int
    seed: int

    def maker(self, given_up: Callable[[], bool] = lambda: False) -> Callable[[int], Batch]:
        """Return the function that makes a batch by its index."""
        task, names = self.task, self.names
        slow = partial(slow_trials, task, names)
        trials = quick_model(task).trials if self.stream == 0 else slow
        draws = task.factors.with_own(task.form).draws()
        coordinates = 3 * len(task.points) + 1

        def make(index: int) -> Batch:
            began = time.thread_time()
            rng = np.random.default_rng(
                np.random.SeedSequence(self.seed, spawn_key=(self.stream, index))
            )
            rows = max(min(_BLOCK_NUMBERS // coordinates, self.size), 1)
            found = np.full((self.size, len(names)), np.nan, dtype=np.float32)
            lost = 0
            for first in range(0, self.size, rows):
                if given_up():
                    break
                count = min(rows, self.size - first)
                values, bad = trials(draws(rng, count))
                lost += bad
                found[first : first + count] = values - self.start
            return Batch(found, _figures(found), lost, time.thread_time() - began)

        return make


def here(
    source: BatchSource, batches: int, threads: int, given_up: Callable[[], bool]
) -> Generator[Batch, None, None]:
    """Yield batches in order, made by threads of this process."""
    make = source.maker(given_up)
    with ThreadPoolExecutor(threads) as pool:
        for first in range(0, batches, threads):
            yield from pool.map(make, range(first, min(first + threads, batches)))


def on_site(source: BatchSource, batches: int, site: Site) -> Generator[Batch, None, None]:
    """Yield batches in order, made by the workers of a site; OcmmError if one fails."""
    step = _SLOW_A_TASK if source.stream else _QUICK_A_TASK
    stretches = [range(first, min(first + step, batches)) for first in range(0, batches, step)]
    answers = run_tasks(
        partial(_stretch, source), stretches, lambda some: "The simulation", site=site
    )
    for answer in answers:
        if isinstance(answer, OcmmError):
            raise answer
        yield from answer


def _stretch(source: BatchSource, indices: range) -> list[Batch]:
    make = source.maker()
    return [make(index) for index in indices]


def _figures(draws: Draws) -> Float:
    """Return mean, standard deviation and ends of the interval of every value, (4, k)."""
    figures = np.full((4, draws.shape[1]), np.nan)
    for column, own in enumerate(draws.T):
        # Trials with a failed fit are excluded; `value` reports if none remains.
        good = own[np.isfinite(own)].astype(np.float64)
        if len(good) > 1:
            ends = np.quantile(good, [0.5 - 0.5 * TWO_SIDED, 0.5 + 0.5 * TWO_SIDED])
            figures[:, column] = good.mean(), good.std(ddof=1), *ends
    return figures
