"""Results of a conformance run: rule results, measured times and one verdict."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import Literal

import msgspec
import numpy as np

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
    def of(cls, name: str, times_ns: Sequence[int], limit_ns: int) -> TimingSheet:
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
