"""Propagation of distributions by Monte Carlo (JCGM 101).

In: the task of a job: points with their covariance, elements, characteristics, a seed.
Out: the distribution of every value, and validation of the first-order uncertainty.

Read `_trials` (one trial, and many of them quickly if possible) with `_refit_kernel` (the
same element through moved points), `_monte_carlo` (convergence and comparison; also in a
separate process). The package is independent of verdicts: it validates results without changing
them.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.tolerances.monte_carlo._monte_carlo import (
        MonteCarloOptions, MonteCarloReport, MonteCarloValue, simulate, simulate_elsewhere,
    )  # fmt: skip
    from ocmm_core.tolerances.monte_carlo._trials import Task
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "MonteCarloOptions", "MonteCarloReport", "MonteCarloValue", "Task", "simulate",
    "simulate_elsewhere",
]  # fmt: skip
