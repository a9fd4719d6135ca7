"""The lane of the campaign that loses names of running jobs."""

from __future__ import annotations

from pathlib import Path

import pytest

from ocmm_bench.campaign import lose_name, possible_losses
from tests.host import amount


def test_no_loss_of_a_name_loses_a_point(tmp_path: Path) -> None:
    kinds = possible_losses()
    runs = amount(5, 1000)
    acknowledged = 0
    for number in range(runs):
        trial = lose_name(tmp_path / str(number), 1, number, kinds[3 * number % len(kinds)])
        # The delay of the message is judged by the campaign, not by a test under load.
        found = {finding: n for finding, n in trial.found.items() if finding != "told after 1 s"}
        assert not found, trial.note
        acknowledged += trial.acknowledged
    if not acknowledged:
        pytest.fail("no point was acknowledged before a loss")
