"""Cycles of the bus as figures for other programs: the numbers are those of the report."""

from __future__ import annotations

import csv
import io
import json

from ocmm_core.fieldbus.report import (
    EDGES_US,
    BusPhase,
    BusReport,
    Histogram,
    statistics_csv,
    statistics_json,
)

COUNTS = tuple(range(1, len(EDGES_US) + 2))
REPORT = BusReport(
    interface="enp3s0", phase=BusPhase.OPERATION, cameras=(), cycle_period_ns=1_000_000,
    frame_period_ns=125_000, elapsed=1000, good=990, late=5, lost=3, bad=2, stray_answers=4,
    recoveries=1, lateness=Histogram(edges_us=EDGES_US, counts=COUNTS, worst_us=12_000.0),
    round_trip=Histogram(edges_us=EDGES_US, counts=COUNTS[::-1], worst_us=900.0),
    notes=("no dedicated processor",),
)  # fmt: skip


def test_json_holds_counts_and_both_histograms() -> None:
    found = json.loads(statistics_json(REPORT))
    assert found["format"] == "ocmm.bus_statistics/1"
    assert found["cycles"]["elapsed"] == 1000
    assert sum(found["cycles"][name] for name in ("good", "late", "lost", "bad")) == 1000
    assert found["histograms"]["lateness"]["counts"] == list(COUNTS)
    assert found["histograms"]["round_trip"]["edges_us"] == list(EDGES_US)
    assert found["notes"] == ["no dedicated processor"]


def test_csv_has_a_row_a_bin_that_joins_the_next() -> None:
    rows = list(csv.DictReader(io.StringIO(statistics_csv(REPORT).decode())))
    assert {row["kind"]: row["count"] for row in rows if not row["from_us"]}["bad"] == "2"
    for kind, counts in (("lateness", COUNTS), ("round_trip", COUNTS[::-1])):
        bins = [row for row in rows if row["kind"] == kind]
        assert [int(row["count"]) for row in bins] == list(counts)
        assert [row["to_us"] for row in bins[:-1]] == [row["from_us"] for row in bins[1:]]
        assert (bins[0]["from_us"], bins[-1]["to_us"]) == ("0.0", "")
