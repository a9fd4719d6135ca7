"""Propagation of distributions by Monte Carlo, as JCGM 101:2008 says, and what it says of the GUM.

All inputs are perturbed together by their joint uncertainty, the whole evaluation is done anew with
its curvature (`_trials`), and trials are added in batches until twice the standard
errors of the mean, of the standard uncertainty and of both ends of the interval are below the
numerical tolerance (7.9). Then the interval of linear propagation, y ± U, is compared with the one
found (8.1). Both are those of the probability 95.45 %, which k = 2 stands for.

The form of surfaces is drawn with the variance that the residuals show; that this variance itself
is known from few points only widens the U of a result, and is left out of both intervals here.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ocmm_core.errors import MeasuringError
from ocmm_core.geometry import Float
from ocmm_core.tolerances.kinds import evaluate, involved_features, spec_of
from ocmm_core.tolerances.monte_carlo._trials import Task, quick_model, slow_trials
from ocmm_core.tolerances.uncertainty import TWO_SIDED

Tell = Callable[[str, float], None]
"""Told what is done and the share that is done, 0 to 1."""

_BLOCK_NUMBERS = 120_000
"""Numbers drawn at a time: a megabyte stays near the processor."""
_FEWEST_BATCHES = 10


@dataclass(frozen=True, slots=True)
class MonteCarloOptions:
    """How long and how finely.

    Attributes
    ----------
    max_trials
        Of what is quick; the memory needed grows with it, 4 bytes a trial and value.
    max_slow_trials
        Of what is evaluated the ordinary way.
    digits
        Significant digits of u that are wanted, 1 or 2: the numerical tolerance.
    seed
        The same seed gives the same numbers, however many threads.
    threads
        That work at a time.
    batch, slow_batch
        Trials of one batch.
    adaptive
        Stop as soon as the tolerance is met; else all trials are done.
    """

    max_trials: int = 1_000_000
    max_slow_trials: int = 2_000
    digits: int = 2
    seed: int = 1
    threads: int = 2
    batch: int = 10_000
    slow_batch: int = 100
    adaptive: bool = True


@dataclass(frozen=True, slots=True)
class MonteCarloValue:
    """The distribution of one value, in its unit.

    Attributes
    ----------
    name, unit
        Of the characteristic.
    value, standard
        Measured value, and standard uncertainty by linear propagation.
    trials
        That gave a value.
    mean, sigma
        Of them.
    symmetric, shortest
        Intervals of 95.45 % of them: as many below as above, and the shortest.
    tolerance
        Numerical tolerance of sigma.
    off_low, off_high
        Distance of the ends of value ± 2 standard from those of ``symmetric``.
    settled
        The tolerance was met.
    """

    name: str
    unit: str
    value: float
    standard: float
    trials: int
    mean: float
    sigma: float
    symmetric: tuple[float, float]
    shortest: tuple[float, float]
    tolerance: float
    off_low: float
    off_high: float
    settled: bool

    @property
    def validated(self) -> bool:
        """Return whether linear propagation gives the same interval within the tolerance."""
        return max(self.off_low, self.off_high) <= self.tolerance


@dataclass(frozen=True, slots=True)
class MonteCarloReport:
    """All values, trials whose fit failed, how long it took, s, and of that all processors, s."""

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
) -> MonteCarloReport:
    """Simulate all characteristics of a task.

    Parameters
    ----------
    tell
        Called from this thread after every batch.
    given_up
        Asked after every batch.

    Raises
    ------
    MeasuringError
        It was given up, or a value came out in no trial.
    """
    begun, worked = time.monotonic(), time.process_time()
    quick = quick_model(task)
    slow = [item.name for item in task.characteristics if item.name not in quick.values]
    draws = task.factors.with_own(task.form).draws()
    found: dict[str, MonteCarloValue] = {}
    failed = 0
    if quick.values:
        names = list(quick.values)
        run = _Run(task, names, options.max_trials, options.batch, options)
        failed += run.go(quick.trials, draws, 0, tell, given_up)
        found |= {name: run.value(name) for name in names}
    if slow:
        run = _Run(task, slow, options.max_slow_trials, options.slow_batch, options)
        failed += run.go(lambda rows: slow_trials(task, slow, rows), draws, 1, tell, given_up)
        found |= {name: run.value(name) for name in slow}
    return MonteCarloReport(
        tuple(found[item.name] for item in task.characteristics),
        failed,
        time.monotonic() - begun,
        time.process_time() - worked,
        options.seed,
    )


class _Run:
    """Trials of some values, batch after batch."""

    def __init__(
        self, task: Task, names: Sequence[str], most: int, batch: int, options: MonteCarloOptions
    ) -> None:
        self._options, self._batch = options, batch
        self._batches = max(most // batch, 1)
        self._names = list(names)
        self._coordinates = 3 * len(task.points) + 1
        self._linear = _linear(task, names)
        self._units = {item.name: spec_of(item.kind).unit for item in task.characteristics}
        start = np.array([self._linear[name][0] for name in names])
        self._start = start
        # Deviations from the measured value: four bytes hold them to a millionth of themselves.
        self._draws = np.empty((self._batches * batch, len(names)), dtype=np.float32)
        self._done = 0
        self._figures: list[Float] = []
        self._settled = np.zeros(len(names), dtype=bool)

    def go(
        self,
        trials: Callable[[Float], tuple[Float, int]],
        draws: Callable[[np.random.Generator, int], Float],
        stream: int,
        tell: Tell,
        given_up: Callable[[], bool],
    ) -> int:
        """Add batches until the tolerance is met; return how many trials failed."""
        failed = 0

        def batch(index: int) -> int:
            rng = np.random.default_rng(
                np.random.SeedSequence(self._options.seed, spawn_key=(stream, index))
            )
            rows = max(min(_BLOCK_NUMBERS // self._coordinates, self._batch), 1)
            lost = 0
            for first in range(0, self._batch, rows):
                if given_up():
                    break
                count = min(rows, self._batch - first)
                deviations = draws(rng, count)
                values, bad = trials(deviations)
                lost += bad
                place = index * self._batch + first
                self._draws[place : place + count] = values - self._start
            return lost

        with ThreadPoolExecutor(self._options.threads) as pool:
            while self._done < self._batches:
                ahead = min(self._options.threads, self._batches - self._done)
                failed += sum(pool.map(batch, range(self._done, self._done + ahead)))
                if given_up():
                    raise MeasuringError(
                        "monte_carlo.given_up",
                        "Simulation cancelled.",
                        "Run it again when you are ready.",
                    )
                for index in range(self._done, self._done + ahead):
                    place = slice(index * self._batch, (index + 1) * self._batch)
                    self._figures.append(_figures(self._draws[place]))
                self._done += ahead
                self._settled = self._met()
                tell("Monte Carlo", self._done / self._batches)
                if self._options.adaptive and bool(self._settled.all()):
                    break
        return failed

    def _met(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return for which values all four standard errors are small enough."""
        count = len(self._figures)
        if count < _FEWEST_BATCHES:
            return np.zeros(len(self._names), dtype=bool)
        figures = np.array(self._figures)
        errors = figures.std(axis=0, ddof=1) / math.sqrt(count)
        sigma = figures[:, 1].mean(axis=0)
        limits = np.array([tolerance_of(float(u), self._options.digits) for u in sigma])
        return np.asarray(np.all(2.0 * errors < limits, axis=0))

    def value(self, name: str) -> MonteCarloValue:
        """Return what all trials say about one value."""
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


def _figures(draws: np.ndarray[tuple[int, int], np.dtype[np.float32]]) -> Float:
    """Return mean, standard deviation and ends of the interval of every value, (4, k)."""
    figures = np.full((4, draws.shape[1]), np.nan)
    for column, own in enumerate(draws.T):
        # Trials whose fit failed are left out; `value` says if nothing is left.
        good = own[np.isfinite(own)].astype(np.float64)
        if len(good) > 1:
            ends = np.quantile(good, [0.5 - 0.5 * TWO_SIDED, 0.5 + 0.5 * TWO_SIDED])
            figures[:, column] = good.mean(), good.std(ddof=1), *ends
    return figures


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
        variance = float(factors.of(evaluation.gradient[None])[0, 0])
        found[name] = (evaluation.value, math.sqrt(max(variance, 0.0)))
    return found
