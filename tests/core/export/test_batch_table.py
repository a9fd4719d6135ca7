"""Statistics of a batch as a table: every value, by feature, and nothing a spreadsheet computes."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from ocmm_core.errors import InputError
from ocmm_core.export import BATCH_COLUMNS, batch_table
from ocmm_core.inspection.finished import Comparison, PartValue, Trend
from ocmm_core.tolerances.decisions import Verdict, capability, control_chart

VALUES = np.array([20.001, 20.002, 20.000, 20.003, 20.001, 20.040])


def trend(name: str, *features: str) -> Trend:
    parts = [
        PartValue(f"J-{n}", f"=S{n}", f"2026-11-25T0{n}", float(value), 0.004, Verdict.CONFORM)
        for n, value in enumerate(VALUES)
    ]
    # Not counted, and it must not shift the signals of those behind it.
    parts.insert(1, PartValue("J-X", "X", "2026-11-25T00", None, None, Verdict.NOT_MEASURED))
    return Trend(
        name, "diameter", 19.95, 20.05, tuple(parts), (), control_chart(VALUES),
        capability(VALUES, 19.95, 20.05, 0.002), "", features,
    )  # fmt: skip


COMPARISON = Comparison(
    "PLAN", ("J-0", "J-1"), ((), ()), (trend("Bore", "BORE_A"), trend("Boss", "BOSS", "BORE_A")),
    (), (), simulated=True,
)  # fmt: skip


def rows(found: Comparison) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(batch_table(found).decode("utf-8-sig"))))


def test_every_value_is_there_with_its_chart_and_indices() -> None:
    told = rows(COMPARISON)
    assert list(told[0]) == list(BATCH_COLUMNS)
    assert len(told) == 2 * 7
    assert [row["Value"] for row in told[:7]] == [
        repr(float(VALUES[0])), "", *(repr(float(value)) for value in VALUES[1:])
    ]  # fmt: skip
    able = COMPARISON.trends[0].capability
    assert able is not None
    assert float(told[0]["Cpk"]) == able.cpk
    assert (float(told[0]["CpkLow"]), float(told[0]["CpkHigh"])) == (able.cpk_low, able.cpk_high)
    assert told[0]["Simulated"] == "yes"
    assert told[0]["Serial"] == "'=S0"


def test_signals_stand_beside_their_own_value() -> None:
    chart = COMPARISON.trends[0].chart
    assert chart is not None
    counted = [row for row in rows(COMPARISON)[:7] if row["Value"]]
    for index, row in enumerate(counted):
        assert row["Signals"] == "; ".join(s.rule for k, s in chart.signals if k == index)


def test_a_feature_chooses_what_is_about_it() -> None:
    assert [one.name for one in COMPARISON.about("BOSS").trends] == ["Boss"]
    assert [one.name for one in COMPARISON.about("BORE_A").trends] == ["Bore", "Boss"]
    assert COMPARISON.about("") is COMPARISON
    with pytest.raises(InputError, match="'HOLE'") as told:
        COMPARISON.about("HOLE")
    assert "BORE_A, BOSS" in told.value.remedy
