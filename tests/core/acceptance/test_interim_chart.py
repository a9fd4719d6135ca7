from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.acceptance import InterimCheck, InterimHistory, InterimWord, interim_chart
from ocmm_core.geometry import Float

_BEGIN = datetime(2026, 11, 25, tzinfo=UTC)


def _checks(errors: Float, limit: float = 0.025) -> list[InterimCheck]:
    return [
        InterimCheck(
            utc=(_BEGIN + timedelta(hours=8 * i)).isoformat(),
            calibration="c",
            artefact="D-1",
            tip="t",
            error_mm=float(error),
            limit_mm=limit,
        )
        for i, error in enumerate(errors)
    ]


@pytest.mark.statistics
def test_a_shift_of_30_um_is_found_at_once_and_false_stops_are_rare() -> None:
    rng = np.random.default_rng(3)
    found = stops = checks = 0
    charts = 1000
    for _ in range(charts):
        errors = 0.003 * rng.standard_normal(25 + 40)
        points = interim_chart(_checks(errors)).points[25:]
        stops += any(one.word is InterimWord.STOP for one in points)
        checks += len(points)
        # Quiet while it was learnt; then the bar measures 30 um too long, also in the repeat.
        moved = np.concatenate([errors[:25], 0.030 + 0.003 * rng.standard_normal(2)])
        found += interim_chart(_checks(moved)).word is InterimWord.STOP
    assert found == charts  # 99.9 % required
    assert stops <= checks / 1000


def test_a_slow_drift_within_the_limit_is_found_by_the_sums() -> None:
    rng = np.random.default_rng(4)
    drift = np.concatenate([np.zeros(25), np.linspace(0.0, 0.010, 60)])
    points = interim_chart(_checks(drift + 0.002 * rng.standard_normal(85))).points
    stop = next(i for i, one in enumerate(points) if one.word is InterimWord.STOP)
    assert abs(points[stop].check.error_mm) < 0.0125  # long before the limit of 25 um
    assert points[stop - 1].word is InterimWord.REPEAT


def test_a_signal_that_the_repeat_does_not_confirm_is_no_stop() -> None:
    errors = np.concatenate([0.002 * np.sin(np.arange(25.0)), [0.008, 0.0]])
    points = interim_chart(_checks(errors)).points
    assert [one.word for one in points[-2:]] == [InterimWord.REPEAT, InterimWord.GOOD]
    assert "from the centre" in points[-2].reason


def test_the_hard_limit_holds_while_the_chart_learns_and_nan_is_beyond_it() -> None:
    for wrong in (0.04, float("nan")):
        chart = interim_chart(_checks(np.array([0.001, wrong, wrong])))
        assert [one.word for one in chart.points] == [
            InterimWord.LEARNING, InterimWord.REPEAT, InterimWord.STOP,
        ]  # fmt: skip
        assert chart.last_good == _BEGIN


def test_checks_are_kept_by_calibration_artefact_and_tip(tmp_path: Path) -> None:
    history = InterimHistory(tmp_path)
    for one in _checks(np.zeros(3)):
        history.add(one)
    assert len(InterimHistory(tmp_path).chart("c", "D-1", "t").points) == 3
    assert len(history.chart("c", "D-2", "t").points) == 0
