"""Propagation of distributions by Monte Carlo (JCGM 101).

In: the task of a job: points with their covariance, elements, characteristics, a seed.
Out: the distribution of every value, and whether the uncertainty of first order agrees.

Read `_model` (what one trial computes), `_trials` (many of them, quickly where possible) with
`_refit_kernel` (the same element through moved points), `_monte_carlo` (stops when stable, and
compares), `_process` (in a process of its own, so that no screen waits).
It must not know verdicts: it changes no result, it examines them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.tolerances.monte_carlo._monte_carlo import (
        MonteCarloOptions,
        MonteCarloReport,
        MonteCarloValue,
        simulate,
    )
    from ocmm_core.tolerances.monte_carlo._process import simulate_elsewhere
    from ocmm_core.tolerances.monte_carlo._trials import Task
else:
    __getattr__ = door(
        __name__,
        _monte_carlo="MonteCarloOptions MonteCarloReport MonteCarloValue simulate",
        _process="simulate_elsewhere",
        _trials="Task",
    )

__all__ = [
    "MonteCarloOptions",
    "MonteCarloReport",
    "MonteCarloValue",
    "Task",
    "simulate",
    "simulate_elsewhere",
]
