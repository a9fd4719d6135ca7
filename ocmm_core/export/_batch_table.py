"""Statistics of a batch as a table: every value, with its chart and indices."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator

from ocmm_core.export.report import clean_text, spreadsheet_text
from ocmm_core.inspection.finished import Comparison, Trend

BATCH_COLUMNS = (
    "Characteristic", "Features", "Job", "Serial", "Utc", "Value", "U", "Verdict", "LowerLimit",
    "UpperLimit", "Signals", "Centre", "ControlLow", "ControlHigh", "Count", "Mean", "Cp", "Cpk",
    "CpkLow", "CpkHigh", "Pp", "Ppk", "Simulated",
)  # fmt: skip
"""One row per value; data of the whole characteristic are repeated in each of its rows."""


def batch_table(comparison: Comparison) -> bytes:
    """Return a CSV file (comma, decimal point, UTF-8 with BOM) of a comparison.

    Numbers have all their digits; values that are not counted and missing indices are empty. Text
    that a spreadsheet would compute gets a quote. StorageError if a job lost its name.
    """
    comparison.require_names()
    stream = io.StringIO(newline="")
    writer = csv.writer(stream, lineterminator="\r\n")
    writer.writerow(BATCH_COLUMNS)
    for trend in comparison.trends:
        writer.writerows(_rows(trend, simulated=comparison.simulated))
    return stream.getvalue().encode("utf-8-sig")


def _rows(trend: Trend, *, simulated: bool) -> Iterator[list[str]]:
    chart, able = trend.chart, trend.capability
    signals: dict[int, list[str]] = {}
    for index, signal in () if chart is None else chart.signals:
        signals.setdefault(index, []).append(signal.rule)
    whole = [
        *(("",) * 3 if chart is None else map(_number, (chart.centre, chart.low, chart.high))),
        *(
            ("",) * 8
            if able is None
            else (str(able.count), *map(_number, (
                able.mean, able.cp, able.cpk, able.cpk_low, able.cpk_high, able.pp, able.ppk)))
        ),
        "yes" if simulated else "no",
    ]  # fmt: skip
    counted = 0
    for part in trend.parts:
        told = ""
        if part.value is not None:
            told = "; ".join(signals.get(counted, []))
            counted += 1
        yield [
            _text(trend.name), _text(" + ".join(trend.features)), _text(part.job),
            _text(part.serial), _text(part.created_utc), _number(part.value),
            _number(part.uncertainty), part.verdict.value, _number(trend.low),
            _number(trend.high), told, *whole,
        ]  # fmt: skip


def _text(text: str) -> str:
    return spreadsheet_text(clean_text(text))


def _number(value: float | None) -> str:
    return "" if value is None or not math.isfinite(value) else repr(float(value))
