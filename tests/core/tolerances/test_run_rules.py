"""Run rules of a control chart: each reported once, for its own pattern, with its name."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.tolerances.decisions import Signal, control_chart
from ocmm_core.tolerances.decisions._capability import _run_signals

NAMES = {
    Signal.BEYOND: "Western Electric 1",
    Signal.TWO_OF_THREE: "Western Electric 2",
    Signal.FOUR_OF_FIVE: "Western Electric 3",
    Signal.RUN: "Western Electric 4",
    Signal.TREND: "Nelson 3",
}


@pytest.mark.parametrize(
    ("values", "wanted"),
    [
        # In units of sigma from the centre line.
        ([2.5, 0.1, 2.5, -0.1], [(2, Signal.TWO_OF_THREE)]),
        ([2.5, 0.1, -2.5, -0.1], []),
        ([2.5, 0.1, 0.1, 2.5], []),
        ([1.2, 1.3, -0.2, 1.2, 1.1], [(4, Signal.FOUR_OF_FIVE)]),
        ([1.2, 1.3, -0.2, -1.2, 1.1], []),
        ([0.1, 0.2, 0.1, 0.3, 0.1, 0.4, 0.2, 0.1], [(7, Signal.RUN)]),
        ([0.1, 0.2, 0.1, -0.3, 0.1, 0.4, 0.2, 0.1], []),
        ([-0.9, -0.5, -0.1, 0.1, 0.4, 0.8], [(5, Signal.TREND)]),
        ([0.9, 0.5, 0.1, -0.1, -0.4, -0.8], [(5, Signal.TREND)]),
        ([-0.9, -0.5, -0.1, 0.1, 0.4, 0.4], []),
        ([-0.9, -0.5, -0.1, 0.1, 0.4], []),
    ],
)
def test_a_rule_answers_to_its_pattern_alone(
    values: list[float], wanted: list[tuple[int, Signal]]
) -> None:
    assert _run_signals(np.array(values), 1.0) == wanted
    mirrored = sorted(_run_signals(-np.array(values), 1.0), key=lambda one: one[0])
    assert mirrored == wanted


def test_every_signal_names_its_rule() -> None:
    assert {signal: signal.rule for signal in Signal} == NAMES


@pytest.mark.statistics
def test_chance_alone_hardly_speaks() -> None:
    # Random values about their true centre trigger each rule alone at these rates: 2 of 3 beyond
    # two sigma 0.3 %, 4 of 5 beyond one sigma 0.5 %, eight on a side 0.4 to 0.8 %, six in a row
    # rising or falling 0.3 %; none of them in more than one of a hundred values.
    rng = np.random.default_rng(20261125)
    counts = dict.fromkeys(Signal, 0)
    total = 200_000
    for _, signal in _run_signals(rng.normal(size=total), 1.0):
        counts[signal] += 1
    for signal in (Signal.TWO_OF_THREE, Signal.FOUR_OF_FIVE, Signal.RUN, Signal.TREND):
        assert 0.0005 * total < counts[signal] < 0.012 * total, signal


def test_the_chart_tells_them_in_the_order_of_the_parts() -> None:
    rng = np.random.default_rng(3)
    values = np.concatenate([rng.normal(10.0, 0.01, 20), rng.normal(10.03, 0.01, 20)])
    places = [index for index, _ in control_chart(values).signals]
    assert places == sorted(places)
    assert Signal.RUN in {signal for _, signal in control_chart(values).signals}
