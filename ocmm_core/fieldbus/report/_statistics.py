"""Cycle counts and histograms for other programs, as JSON or CSV."""

from __future__ import annotations

import csv
import io

import msgspec

from ocmm_core.fieldbus.report._report import BusReport, Histogram

_FORMAT = "ocmm.bus_statistics/1"
_COUNTS = ("elapsed", "good", "late", "lost", "bad", "stray_answers", "recoveries")
_HISTOGRAMS = ("lateness", "round_trip")


def statistics_json(report: BusReport) -> bytes:
    """Return the figures as JSON: histograms by upper edges, us; the last count is beyond them."""
    content = {
        "format": _FORMAT,
        "interface": report.interface,
        "cycle_period_ns": report.cycle_period_ns,
        "frame_period_ns": report.frame_period_ns,
        "cycles": {name: getattr(report, name) for name in _COUNTS},
        "clock_phase_ns": report.clock_phase_ns,
        "clock_drift_ppm": report.clock_drift_ppm,
        "histograms": {name: getattr(report, name) for name in _HISTOGRAMS},
        "notes": report.notes,
    }
    return msgspec.json.format(msgspec.json.encode(content), indent=1) + b"\n"


def statistics_csv(report: BusReport) -> bytes:
    """Return the figures as CSV: ``kind,from_us,to_us,count``."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(("kind", "from_us", "to_us", "count"))
    for name in _COUNTS:
        writer.writerow((name, "", "", getattr(report, name)))
    for name in _HISTOGRAMS:
        histogram: Histogram = getattr(report, name)
        begins = (0.0, *histogram.edges_us)
        ends = (*histogram.edges_us, "")
        for begin, end, count in zip(begins, ends, histogram.counts, strict=True):
            writer.writerow((name, begin, end, count))
    return text.getvalue().encode("utf-8")
