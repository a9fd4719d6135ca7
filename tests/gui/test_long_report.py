"""A report of many characteristics: its head is readable, and no column is useless."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ocmm_core.tolerances.decisions import Verdict
from ocmm_gui.reports import _pdf as pdf
from tests.core.export.sample_report import result, sample_report, sample_view
from tests.gui.pdf_texts import texts

FAILING = 40


def _said() -> str:
    results = tuple(
        result(f"Bore {number:02d}", 20.05, Verdict.NOT_CONFORM) for number in range(FAILING)
    )
    data = sample_report(replace(sample_view(), characteristics=results))
    return " ".join(texts(pdf.lay_out(data)).split())


@pytest.mark.usefixtures("qapp")
def test_a_reason_names_some_and_counts_the_rest() -> None:
    said = _said()
    head = said.partition("Results")[0]
    assert "Bore 23 and 16 more, see the results" in head
    assert "Bore 24" not in head
    assert f"{FAILING} NOT CONFORM" in head
    # The table contains all of them.
    table = said.partition("Results")[2]
    assert all(f"Bore {number:02d}" in table for number in range(FAILING))


@pytest.mark.usefixtures("qapp")
def test_a_column_that_nothing_fills_is_left_out() -> None:
    assert "Datums" not in _said()
    assert "Characteristic" in _said()
