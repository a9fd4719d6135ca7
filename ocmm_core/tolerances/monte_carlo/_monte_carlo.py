"""Monte Carlo propagation of distributions (JCGM 101:2008), and validation of the GUM.

All inputs are perturbed by their joint uncertainty and the whole evaluation is repeated with its
nonlinearity (`_trials`); trials are added in batches until twice the standard errors of the mean,
of the standard uncertainty and of both ends of the interval are below the numerical tolerance
(7.9). Then the interval of linear propagation, y ± U, is compared with the simulated one (8.1),
both for the probability 95.45 %, that of k = 2. The form of surfaces is drawn with the variance of
the residuals; the uncertainty of this variance only widens the U of a result, and is excluded from
both intervals here.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

from ocmm_core.cluster import HERE, Site, run_tasks
from ocmm_core.errors import MeasuringError, OcmmError
from ocmm_core.geometry import Float
from ocmm_core.processes import Tell, run_elsewhere
from ocmm_core.tolerances.kinds import evaluate, involved_features, spec_of
from ocmm_core.tolerances.monte_carlo._trials import Task, quick_model, slow_trials
from ocmm_core.tolerances.uncertainty import TWO_SIDED

Draws = np.ndarray[tuple[int, int], np.dtype[np.float32]]

_BLOCK_NUMBERS = 120_000
"""Numbers drawn at a time: a megabyte stays in the cache."""
_QUICK_A_TASK, _SLOW_A_TASK = 10, 2
"""Batches of a worker per request: about a second, to limit overhead."""


@dataclass(frozen=True, slots=True)
class Batch:
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


_FEWEST_BATCHES = 10


@dataclass(frozen=True, slots=True)
class MonteCarloOptions:
    max_trials: int = 1_000_000
    """For fast values; memory grows with it, 4 bytes a trial and value."""
    max_slow_trials: int = 2_000
    digits: int = 2
    """Significant digits of u, 1 or 2: the numerical tolerance."""
    seed: int = 1
    """The result depends on the seed only, not on the number of threads."""
    threads: int = 2
    batch: int = 10_000
    slow_batch: int = 100
    adaptive: bool = True
    """Stop at the tolerance; else run all trials."""


@dataclass(frozen=True, slots=True)
class MonteCarloValue:
    """The distribution of one value, in its unit."""

    name: str
    unit: str
    value: float
    standard: float
    """`value`, `standard`: Measured value, and standard uncertainty by linear propagation."""
    trials: int
    """Number with a value."""
    mean: float
    sigma: float
    symmetric: tuple[float, float]
    shortest: tuple[float, float]
    """`symmetric`, `shortest`: intervals of 95.45 %, probabilistically symmetric, and shortest."""
    tolerance: float
    """Numerical tolerance of sigma."""
    off_low: float
    off_high: float
    """`off_low`, `off_high`: ends of value ± 2 standard less those of ``symmetric``."""
    settled: bool

    @property
    def validated(self) -> bool:
        """Return whether linear propagation gives the same interval within the tolerance."""
        return max(self.off_low, self.off_high) <= self.tolerance


@dataclass(frozen=True, slots=True)
class MonteCarloReport:
    """All values, number of failed trials, elapsed time, s, and total processor time, s."""

    values: tuple[MonteCarloValue, ...]
    failed: int
    seconds: float
    processor_s: float
    seed: int


def simulate(
    task: Task,
    options: MonteCarloOptions,
    tell: Tell = lambda what, share: None,
    given_up: Callable[[], bool] = lambda: False,
    site: Site = HERE,
) -> MonteCarloReport:
    """Simulate all characteristics of a task.

    Parameters
    ----------
    tell
        Called from this thread after every batch.
    given_up
        Polled after every batch; True cancels.
    site
        Computing resources: threads of this process, unless it has workers or a scheduler. No
        influence on the numbers.

    Raises
    ------
    MeasuringError
        It was cancelled, or a value failed in all trials.
    OcmmError
        The site cannot be used.
    """
    begun, worked = time.monotonic(), time.process_time()
    quick = quick_model(task)
    slow = [item.name for item in task.characteristics if item.name not in quick.values]
    away = bool(site.scheduler) or site.workers is not None
    found: dict[str, MonteCarloValue] = {}
    failed, elsewhere = 0, 0.0
    parts = (
        (list(quick.values), options.max_trials, options.batch),
        (slow, options.max_slow_trials, options.slow_batch),
    )
    for stream, (names, most, batch) in enumerate(parts):
        if not names:
            continue
        run = _Run(task, names, most, batch, options)
        source = BatchSource(task, tuple(names), run.start, stream, batch, options.seed)
        if away:
            batches = on_site(source, run.batches, site)
        else:
            batches = here(source, run.batches, options.threads, given_up)
        with contextlib.closing(batches):
            lost, seconds = run.go(batches, tell, given_up)
        failed += lost
        elsewhere += seconds if away else 0.0
        found |= {name: run.value(name) for name in names}
    return MonteCarloReport(
        tuple(found[item.name] for item in task.characteristics),
        failed,
        time.monotonic() - begun,
        time.process_time() - worked + elsewhere,
        options.seed,
    )


class _Run:
    """Trials of some values, batch after batch."""

    def __init__(
        self, task: Task, names: Sequence[str], most: int, batch: int, options: MonteCarloOptions
    ) -> None:
        self._options, self._batch = options, batch
        self.batches = max(most // batch, 1)
        self._names = list(names)
        self._linear = _linear(task, names)
        self._units = {item.name: spec_of(item.kind).unit for item in task.characteristics}
        self.start = np.array([self._linear[name][0] for name in names])
        # Deviations from the measured value: four bytes give them a relative precision of 1e-6.
        self._draws = np.empty((self.batches * batch, len(names)), dtype=np.float32)
        self._done = 0
        self._figures: list[Float] = []
        self._settled = np.zeros(len(names), dtype=bool)

    def go(
        self, batches: Iterator[Batch], tell: Tell, given_up: Callable[[], bool]
    ) -> tuple[int, float]:
        """Add batches until the tolerance is met; return failed trials and their time.

        Checked after every `MonteCarloOptions.threads` batches, independent of their source.
        """
        failed, seconds = 0, 0.0
        for batch in batches:
            if given_up():
                raise MeasuringError(
                    "monte_carlo.given_up",
                    "Simulation cancelled.",
                    "Run it again when you are ready.",
                )
            self._draws[self._done * self._batch : (self._done + 1) * self._batch] = batch.draws
            self._figures.append(batch.figures)
            failed += batch.failed
            seconds += batch.seconds
            self._done += 1
            if self._done % self._options.threads and self._done < self.batches:
                continue
            self._settled = self._met()
            tell("Monte Carlo", self._done / self.batches)
            if self._options.adaptive and bool(self._settled.all()):
                break
        return failed, seconds

    def _met(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return the mask of values with all four standard errors small enough."""
        count = len(self._figures)
        if count < _FEWEST_BATCHES:
            return np.zeros(len(self._names), dtype=bool)
        figures = np.array(self._figures)
        errors = figures.std(axis=0, ddof=1) / math.sqrt(count)
        sigma = figures[:, 1].mean(axis=0)
        limits = np.array([tolerance_of(float(u), self._options.digits) for u in sigma])
        return np.asarray(np.all(2.0 * errors < limits, axis=0))

    def value(self, name: str) -> MonteCarloValue:
        """Return the distribution of one value over all trials."""
        column = self._names.index(name)
        measured, standard = self._linear[name]
        own = self._draws[: self._done * self._batch, column]
        draws = np.sort(own[np.isfinite(own)]).astype(np.float64)
        if len(draws) < 2:
            raise MeasuringError(
                "monte_carlo.nothing",
                f"{name} could not be evaluated in any trial.",
                "Take more points, spread over more of the features.",
            )
        sigma = float(draws.std(ddof=1))
        tolerance = tolerance_of(sigma, self._options.digits)
        inside = min(max(round(TWO_SIDED * len(draws)), 1), len(draws) - 1)
        first = (len(draws) - inside) // 2
        symmetric = (measured + draws[first], measured + draws[first + inside])
        widths = draws[inside:] - draws[:-inside]
        best = int(np.argmin(widths))
        return MonteCarloValue(
            name=name,
            unit=self._units[name],
            value=measured,
            standard=standard,
            trials=len(draws),
            mean=measured + float(draws.mean()),
            sigma=sigma,
            symmetric=(float(symmetric[0]), float(symmetric[1])),
            shortest=(measured + float(draws[best]), measured + float(draws[best + inside])),
            tolerance=tolerance,
            off_low=abs(measured - 2.0 * standard - float(symmetric[0])),
            off_high=abs(measured + 2.0 * standard - float(symmetric[1])),
            settled=bool(self._settled[column]),
        )


def tolerance_of(sigma: float, digits: int) -> float:
    """Return half a unit of the last of ``digits`` significant digits of ``sigma`` (7.9.2)."""
    if not sigma > 0.0:
        return 0.0
    return 0.5 * 10.0 ** (math.floor(math.log10(sigma)) - digits + 1)


def _linear(task: Task, names: Sequence[str]) -> Mapping[str, tuple[float, float]]:
    """Return value and standard uncertainty of linear propagation by name."""
    factors = task.factors.with_own(task.form)
    asked = {item.name: item for item in task.characteristics}
    found = {}
    for name in names:
        item = asked[name]
        involved = {key: task.actual[key] for key in involved_features(item, task.alignment)}
        evaluation = evaluate(item, involved, task.alignment)
        variance = float(factors.covariance_of(evaluation.gradient[None])[0, 0])
        found[name] = (evaluation.value, math.sqrt(max(variance, 0.0)))
    return found


def simulate_elsewhere(
    task: Task,
    options: MonteCarloOptions,
    tell: Tell = lambda what, share: None,
    given_up: Callable[[], bool] = lambda: False,
) -> MonteCarloReport:
    """Simulate in another process and wait for it, to keep windows responsive; see `simulate`.

    ``given_up`` is polled 20 times a second and obeyed in two. OcmmError: failed, cancelled, died.
    """
    return run_elsewhere(
        partial(simulate, task, options),
        "The simulation",
        given_up,
        MeasuringError(
            "monte_carlo.given_up", "Simulation cancelled.", "Run it again when you are ready."
        ),
        MeasuringError(
            "monte_carlo.died",
            "The simulation ended unexpectedly; the computer may be out of memory.",
            "Close other programs, or request fewer trials.",
        ),
        tell,
    )
