"""Curves with more points than pixels: extremes stay in the picture."""

from __future__ import annotations

import numpy as np

from ocmm_gui.charts._bus_charts import thinned

N = 6000


def test_few_points_are_all_drawn() -> None:
    x = np.linspace(0.0, 300.0, 600)
    assert thinned(x, np.sin(x))[0] is x


def test_a_single_value_that_stands_out_is_kept() -> None:
    rng = np.random.default_rng(5)
    x = np.linspace(50.0, 350.0, N)
    for place in rng.integers(0, N, 50):
        y = rng.normal(0.0, 0.1, N)
        y[place] = rng.choice([-7.0, 7.0])
        shown_x, shown_y = thinned(x, y)
        assert len(shown_x) <= 4 * 302
        assert (x[place], y[place]) in set(zip(shown_x.tolist(), shown_y.tolist(), strict=True))
        assert (np.diff(shown_x) > 0.0).all()


def test_unknown_values_break_the_curve() -> None:
    x = np.linspace(0.0, 100.0, N)
    y = np.zeros(N)
    y[1000:1010] = np.nan
    assert np.isnan(thinned(x, y)[1]).sum() == 10
