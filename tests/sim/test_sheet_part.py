"""Whole jobs on a virtual sheet: thickness, trimmed edge and tapped holes hold the truth."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from scipy.stats import binom

from ocmm_cli.study import CoverageSetup, coverage_table, run_coverage
from ocmm_core.documents import resource

SHEET = CoverageSetup(plan=resource("plans", "sheet.toml"), part=resource("parts", "sheet.toml"))
FIRST_SEED = 3000
RUNS = 100


@pytest.mark.statistics
@pytest.mark.timeout(900)
def test_a_sheet_and_its_holes_hold_the_truth(
    record_property: Callable[[str, object], None], repeats: Callable[..., int]
) -> None:
    """Cameras, probe and ball of each run are drawn from their documents; gauges have no play."""
    runs = repeats(4, RUNS, 3)
    rows = coverage_table(run_coverage(SHEET, range(FIRST_SEED, FIRST_SEED + runs)))
    assert [row[0] for row in rows][:4] == [
        "Thickness", "Trim", "Least thickness", "Hole distance",
    ]  # fmt: skip
    # Fewer happen with a probability of 1 % over all characteristics if U is correct.
    least = binom.ppf(0.01 / len(rows), runs, 0.954) / runs
    for name, covered, stated, error, without in rows:
        record_property(f"{name}: covered, U, rms mm", (covered, stated, error))
        assert without == 0, name
        assert covered >= least, name
        assert stated < 0.06, name
