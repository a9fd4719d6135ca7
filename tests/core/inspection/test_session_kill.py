"""A job that is killed at any moment goes on with every acknowledged point."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.kill import REOPEN_LIMIT_S, run, wrong_points
from tests.host import BUSY, on_linux_only

pytestmark = on_linux_only


@pytest.mark.slow
@pytest.mark.timing
def test_no_acknowledged_step_of_a_session_is_lost_by_a_kill(tmp_path: Path) -> None:
    """500 kills are the benchmark's; a step of two commits is caught by some of these 30."""
    outcomes = run(30, seed=1, folder=tmp_path)
    assert sum(outcome.acknowledged for outcome in outcomes) > 40
    assert [outcome for outcome in outcomes if outcome.lost or outcome.faults] == []
    assert max(outcome.reopen_s for outcome in outcomes) < BUSY * REOPEN_LIMIT_S


def test_only_the_step_under_way_may_be_there_or_not() -> None:
    assert wrong_points([1, 2], [1, 2], "flip") == 0
    assert wrong_points([1, 2], [1, 2, 3], "take") == 0
    assert wrong_points([1, 2], [1], "undo") == 0
    assert wrong_points([1, 2], [1, 3], "flip") == 0
    assert wrong_points([1, 2], [1], "flip") == 1
    assert wrong_points([1, 2], [2], "undo") == 1
    assert wrong_points([1, 2], [1, 2, 3], "undo") == 1
