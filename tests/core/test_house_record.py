"""Figures of the real sources against their record: each may only fall."""

from __future__ import annotations

import json

from benchmarks.house_record import RECORD, figures, worse
from tests.sources import uncollected


def test_no_figure_of_the_sources_is_above_its_record() -> None:
    record = json.loads(RECORD.read_text(encoding="utf-8"))
    with uncollected():
        now = figures()
    assert not worse(now, record), "python -m benchmarks.house_record shows all figures"


def test_reports_each_figure_above_its_record() -> None:
    assert worse({"lines": 11, "files": 2}, {"lines": 10, "files": 2}) == [
        "lines: 11, and the record is 10."
    ]
