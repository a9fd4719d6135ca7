"""Results of a conformance run: rule results, measured times, one verdict; as text and HTML."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from html import escape
from itertools import groupby
from typing import Literal

import msgspec
import numpy as np

from ocmm_core.documents import read_text, resource
from ocmm_core.errors import BusError

_BINS = 24


class RuleVerdict(StrEnum):
    """Verdict of a rule or run."""

    PASSED = "PASSED"
    FAILED = "FAILED"
    NOT_TESTED = "NOT TESTED"


class CameraOutcome(StrEnum):
    """Verdict on a camera."""

    GREEN = "GREEN"
    INCOMPLETE = "INCOMPLETE"
    RED = "RED"


class TimingSheet(msgspec.Struct, frozen=True, kw_only=True):
    """Statistics of one measured time."""

    name: str
    count: int
    median_ns: int
    p99_ns: int
    worst_ns: int
    limit_ns: int
    """Limit of the worst time; 0: no limit."""
    edges_ns: tuple[int, ...]
    counts: tuple[int, ...]
    """`edges_ns`, `counts`: histogram; one more edge than counts."""

    @classmethod
    def from_times(cls, name: str, times_ns: Sequence[int], limit_ns: int) -> TimingSheet:
        """Return the sheet of at least one time."""
        values = np.asarray(times_ns, np.int64)
        low, high = int(values.min()), int(values.max())
        edges = np.unique(np.linspace(low, max(high, low + 1), _BINS + 1).astype(np.int64))
        counts, _ = np.histogram(values, edges)
        return cls(
            name=name,
            count=len(values),
            median_ns=int(np.median(values)),
            p99_ns=int(np.percentile(values, 99)),
            worst_ns=high,
            limit_ns=limit_ns,
            edges_ns=tuple(int(edge) for edge in edges),
            counts=tuple(int(count) for count in counts),
        )

    @property
    def kept(self) -> bool:
        """Return whether the worst time is within the limit."""
        return not self.limit_ns or self.worst_ns <= self.limit_ns


class RuleResult(msgspec.Struct, frozen=True, kw_only=True):
    """Result of one rule."""

    code: str
    section: str
    title: str
    verdict: RuleVerdict
    checked: int
    """Number of single expectations checked."""
    complaints: tuple[str, ...] = ()
    """Deviations, a sentence each, or the reason why the rule was not tested."""


class ConformanceReport(msgspec.Struct, frozen=True, kw_only=True):
    """Report of a whole run."""

    format: Literal["ocmm.conformance/1"] = "ocmm.conformance/1"
    serial: int
    alias: int
    vendor: int
    product: int
    revision: int
    firmware: str
    started_utc: str
    program: str
    results: tuple[RuleResult, ...]
    timings: tuple[TimingSheet, ...]

    @property
    def outcome(self) -> CameraOutcome:
        """Return the verdict on the camera, from rules and times."""
        verdicts = {result.verdict for result in self.results}
        late = any(not sheet.kept for sheet in self.timings)
        if RuleVerdict.FAILED in verdicts or late or not verdicts:
            return CameraOutcome.RED
        return (
            CameraOutcome.INCOMPLETE if RuleVerdict.NOT_TESTED in verdicts else CameraOutcome.GREEN
        )

    def to_json(self) -> bytes:
        """Return the report as JSON, including the verdict."""
        content = {"outcome": self.outcome.value, **msgspec.to_builtins(self)}
        return msgspec.json.format(msgspec.json.encode(content), indent=1) + b"\n"


class NotAsDescribedError(BusError):
    """The camera deviates such that the rest of the rule cannot be tested."""

    def __init__(self, what: str) -> None:
        super().__init__("bus.conform", what, "Correct the firmware of the camera.")
        self.complaint = what

    def __reduce__(self) -> tuple[type[NotAsDescribedError], tuple[str]]:  # type: ignore[override]  # made from its sentence alone
        return (type(self), (self.complaint,))


class NotTestedError(BusError):
    """A rule cannot be tested here."""

    def __init__(self, why: str) -> None:
        super().__init__("bus.conform", why, "Give what is missing, then repeat the test.")
        self.complaint = why

    def __reduce__(self) -> tuple[type[NotTestedError], tuple[str]]:  # type: ignore[override]  # made from its sentence alone
        return (type(self), (self.complaint,))


class RuleFindings:
    """Collects the findings of a running rule; extends `times` in place."""

    MOST_COMPLAINTS = 12

    def __init__(self, times: dict[str, tuple[int, list[int]]]) -> None:
        self._times = times
        self.checked = 0
        self.complaints: list[str] = []

    def expect(self, kept: bool, otherwise: str) -> bool:
        """Record an expectation; return whether it was met."""
        self.checked += 1
        if not kept and len(self.complaints) < self.MOST_COMPLAINTS:
            self.complaints.append(printable(otherwise))
        return kept

    def equal(self, what: str, found: object, expected: object) -> bool:
        return self.expect(
            found == expected, f"{what} is {_shown(found)}, must be {_shown(expected)}"
        )

    def need(self, kept: bool, otherwise: str) -> None:
        """Record an expectation that the rest of the rule requires."""
        if not self.expect(kept, otherwise):
            raise NotAsDescribedError(otherwise)

    def timed(self, name: str, time_ns: int, limit_ns: int = 0) -> None:
        """Record a time; one over the limit makes the run RED."""
        self._times.setdefault(name, (limit_ns, []))[1].append(time_ns)


def printable(text: str) -> str:
    """Return camera-supplied text as one line, so that it cannot forge report lines."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def _shown(value: object) -> str:
    if isinstance(value, bool) or not isinstance(value, int | bytes):
        return str(value)
    if isinstance(value, int):
        return f"{value:#x}" if value > 0xFF else str(value)
    return value[:16].hex(" ") + ("..." if len(value) > 16 else "") if value else "empty"


_WORDS = {
    CameraOutcome.GREEN: "Every rule was tried and is kept.",
    CameraOutcome.INCOMPLETE: "What was tried is kept; not everything was tried.",
    CameraOutcome.RED: "The camera is not as described.",
}
_NOT_SHOWN = (
    "Not shown by this test: clocks of several cameras that follow each other below 1 us, frames "
    "that arrive broken, loss of power in the middle of writing, temperature, EMC, and the "
    "conformance test of the EtherCAT Technology Group."
)
_HEAD = "<tr><th>Verdict</th><th>Rule</th><th>What must hold</th><th class=n>Checked</th></tr>"


def conformance_text(report: ConformanceReport) -> str:
    """Return the report as lines of text."""
    lines = [
        f"Conformance of the camera with serial number {report.serial}: {report.outcome.value}",
        _WORDS[report.outcome],
        _who(report),
        "",
    ]
    for section, results in groupby(report.results, key=lambda each: each.section):
        lines.append(section)
        for each in results:
            lines.append(
                f"  {each.verdict.value:10}  {each.code:24} {each.title} ({each.checked} checked)"
            )
            lines += [f"              - {complaint}" for complaint in each.complaints]
    lines += ["", "Times, ms                                          N   median      99 %    worst"
              "    limit"]  # fmt: skip
    lines += [_sheet_line(sheet) for sheet in report.timings]
    lines += ["", _NOT_SHOWN]
    return "\n".join(lines) + "\n"


def conformance_page(report: ConformanceReport) -> str:
    """Return the report as one self-contained HTML page."""
    title = f"Conformance: camera {report.serial}"
    style = read_text(resource("ethercat", "conformance.css"))
    rows = []
    for section, results in groupby(report.results, key=lambda each: each.section):
        rows.append(f"<h2>{escape(section)}</h2><table>{_HEAD}")
        rows += [_rule_row(each) for each in results]
        rows.append("</table>")
    outcome = report.outcome.value
    return "\n".join(
        (
            "<!DOCTYPE html>",
            f'<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>',
            '<meta name="viewport" content="width=device-width">',
            f"<style>{style}</style></head><body>",
            f'<h1>{escape(title)}: <span class="{outcome}">{outcome}</span></h1>',
            f"<p>{escape(_WORDS[report.outcome])}</p><p>{escape(_who(report))}</p>",
            *rows,
            "<h2>Timing sheets</h2><table><tr><th>Time</th><th class=n>N</th><th class=n>Median, "
            "ms</th><th class=n>99 %, ms</th><th class=n>Worst, ms</th><th class=n>Limit, ms</th>"
            "<th>Distribution</th></tr>",
            *(_sheet_row(sheet) for sheet in report.timings),
            f"</table><p>{escape(_NOT_SHOWN)}</p></body></html>\n",
        )
    )


def _who(report: ConformanceReport) -> str:
    return (
        f"Vendor {report.vendor:#010x}, product {report.product:#010x}, revision "
        f"{report.revision:#010x}, alias {report.alias}, firmware {report.firmware}. Tested "
        f"{report.started_utc} with OCMM {report.program}: {len(report.results)} rules, "
        f"{sum(each.checked for each in report.results)} expectations."
    )


def _sheet_line(sheet: TimingSheet) -> str:
    mark = "" if sheet.kept else "  <- late"
    limit = _ms(sheet.limit_ns) if sheet.limit_ns else "-"
    return (
        f"  {sheet.name:43} {sheet.count:>7} {_ms(sheet.median_ns):>8}  {_ms(sheet.p99_ns):>8} "
        f"{_ms(sheet.worst_ns):>8} {limit:>8}{mark}"
    )


def _rule_row(result: RuleResult) -> str:
    verdict = result.verdict.value
    complaints = "".join(f"<li>{escape(each)}</li>" for each in result.complaints)
    more = f"<ul>{complaints}</ul>" if complaints else ""
    return (
        f'<tr><td class="mark {verdict.split()[0]}">{verdict}</td><td>{escape(result.code)}</td>'
        f"<td>{escape(result.title)}{more}</td><td class=n>{result.checked}</td></tr>"
    )


def _sheet_row(sheet: TimingSheet) -> str:
    limit = _ms(sheet.limit_ns) if sheet.limit_ns else "-"
    worst = (
        f'<td class="n {"" if sheet.kept else RuleVerdict.FAILED.value}">{_ms(sheet.worst_ns)}</td>'
    )
    return (
        f"<tr><td>{escape(sheet.name)}</td><td class=n>{sheet.count}</td>"
        f"<td class=n>{_ms(sheet.median_ns)}</td><td class=n>{_ms(sheet.p99_ns)}</td>{worst}"
        f"<td class=n>{limit}</td><td>{_histogram(sheet)}</td></tr>"
    )


def _histogram(sheet: TimingSheet) -> str:
    most = max(sheet.counts)
    bars = "".join(
        f'<rect x="{number}" y="{1 - count / most:.3f}" width="0.9" height="{count / most:.3f}"/>'
        for number, count in enumerate(sheet.counts)
        if count
    )
    ends = f"{_ms(sheet.edges_ns[0])} to {_ms(sheet.edges_ns[-1])} ms"
    return (
        f'<svg role="img" aria-label="{ends}" viewBox="0 0 {len(sheet.counts)} 1" '
        f'preserveAspectRatio="none">{bars}</svg>{ends}'
    )


def _ms(time_ns: int) -> str:
    return f"{time_ns / 1e6:.3f}"
