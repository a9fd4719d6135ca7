"""Propagation of distributions by Monte Carlo (JCGM 101)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.tolerances.monte_carlo._monte_carlo import (
        MonteCarloOptions,
        MonteCarloReport,
        MonteCarloValue,
        factor_of,
        simulate,
    )
    from ocmm_core.tolerances.monte_carlo._process import simulate_elsewhere
    from ocmm_core.tolerances.monte_carlo._trials import Task
else:
    __getattr__ = door(
        __name__,
        _monte_carlo="MonteCarloOptions MonteCarloReport MonteCarloValue factor_of simulate",
        _process="simulate_elsewhere",
        _trials="Task",
    )

__all__ = [
    "MonteCarloOptions",
    "MonteCarloReport",
    "MonteCarloValue",
    "Task",
    "factor_of",
    "simulate",
    "simulate_elsewhere",
]
