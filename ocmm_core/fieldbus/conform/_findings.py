"""What a conformance run found: one result a rule, measured times, and one verdict."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import Literal

import msgspec
import numpy as np

from ocmm_core.errors import BusError

_BINS = 24


class Verdict(StrEnum):
    """What a rule, or the whole run, came to."""

    PASSED = "PASSED"
    FAILED = "FAILED"
    NOT_TESTED = "NOT TESTED"


class Outcome(StrEnum):
    """The verdict over a camera."""

    GREEN = "GREEN"
    """Every rule was tried and is kept."""
    INCOMPLETE = "INCOMPLETE"
    """What was tried is kept, but not everything was tried."""
    RED = "RED"
    """A rule is broken."""


class TimingSheet(msgspec.Struct, frozen=True, kw_only=True):
    """Times of one kind."""

    name: str
    """What was timed."""
    count: int
    """How many times were taken."""
    median_ns: int
    p99_ns: int
    worst_ns: int
    """`median_ns`, `p99_ns`, `worst_ns`: Of them."""
    limit_ns: int
    """The worst may be no longer; 0: no limit, for information."""
    edges_ns: tuple[int, ...]
    counts: tuple[int, ...]
    """`edges_ns`, `counts`: Histogram: the edges of its bins, one more than there are bins, and how
    many times fell in each."""

    @classmethod
    def of(cls, name: str, times_ns: Sequence[int], limit_ns: int) -> TimingSheet:
        """Return the sheet of these times, one at least."""
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
    """What one rule came to."""

    code: str
    section: str
    title: str
    """`code`, `section`, `title`: Of the rule."""
    verdict: Verdict
    """What it came to."""
    checked: int
    """How many single expectations were looked at."""
    complaints: tuple[str, ...] = ()
    """What was not as described, a sentence each; why it was not tested."""


class ConformanceReport(msgspec.Struct, frozen=True, kw_only=True):
    """A whole run."""

    format: Literal["ocmm.conformance/1"] = "ocmm.conformance/1"
    serial: int
    alias: int
    vendor: int
    product: int
    revision: int
    """`serial`, `alias`, `vendor`, `product`, `revision`: Of the camera, from its EEPROM."""
    firmware: str
    """Version that the camera tells."""
    started_utc: str
    """ISO 8601."""
    program: str
    """Version of this program."""
    results: tuple[RuleResult, ...]
    timings: tuple[TimingSheet, ...]
    """`results`, `timings`: What was found."""

    @property
    def outcome(self) -> Outcome:
        """Return the verdict over the camera: of the rules and of the times."""
        verdicts = {result.verdict for result in self.results}
        late = any(not sheet.kept for sheet in self.timings)
        if Verdict.FAILED in verdicts or late or not verdicts:
            return Outcome.RED
        return Outcome.INCOMPLETE if Verdict.NOT_TESTED in verdicts else Outcome.GREEN

    def to_json(self) -> bytes:
        """Return the report as JSON, with the verdict for those who read nothing else."""
        content = {"outcome": self.outcome.value, **msgspec.to_builtins(self)}
        return msgspec.json.format(msgspec.json.encode(content), indent=1) + b"\n"


class NotAsDescribedError(BusError):
    """The camera is not as its description says; the rest of the rule cannot be tried."""

    def __init__(self, what: str) -> None:
        super().__init__("bus.conform", what, "Correct the firmware of the camera.")
        self.complaint = what

    def __reduce__(self) -> tuple[type[NotAsDescribedError], tuple[str]]:  # type: ignore[override]  # made from its sentence alone
        return (type(self), (self.complaint,))


class NotTestedError(BusError):
    """A rule cannot be tried here."""

    def __init__(self, why: str) -> None:
        super().__init__("bus.conform", why, "Give what is missing, then repeat the test.")
        self.complaint = why

    def __reduce__(self) -> tuple[type[NotTestedError], tuple[str]]:  # type: ignore[override]  # made from its sentence alone
        return (type(self), (self.complaint,))


class Findings:
    """What a rule finds while it runs.

    Parameters
    ----------
    times
        Times of all rules so far, by name, with their limit; added to.
    """

    MOST_COMPLAINTS = 12

    def __init__(self, times: dict[str, tuple[int, list[int]]]) -> None:
        self._times = times
        self.checked = 0
        self.complaints: list[str] = []

    def expect(self, kept: bool, otherwise: str) -> bool:
        """Note one expectation; return whether it was met."""
        self.checked += 1
        if not kept and len(self.complaints) < self.MOST_COMPLAINTS:
            self.complaints.append(printable(otherwise))
        return kept

    def equal(self, what: str, found: object, expected: object) -> bool:
        """Expect two things to be equal."""
        return self.expect(
            found == expected, f"{what} is {_shown(found)}, must be {_shown(expected)}"
        )

    def need(self, kept: bool, otherwise: str) -> None:
        """Note an expectation without which the rule cannot go on."""
        if not self.expect(kept, otherwise):
            raise NotAsDescribedError(otherwise)

    def timed(self, name: str, time_ns: int, limit_ns: int = 0) -> None:
        """Note a time; one over the limit makes the run RED and is shown on the sheet."""
        self._times.setdefault(name, (limit_ns, []))[1].append(time_ns)


def printable(text: str) -> str:
    """Return a text that a camera had a part in, as one line: it cannot write lines of a report."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def _shown(value: object) -> str:
    if isinstance(value, bool) or not isinstance(value, int | bytes):
        return str(value)
    if isinstance(value, int):
        return f"{value:#x}" if value > 0xFF else str(value)
    return value[:16].hex(" ") + ("..." if len(value) > 16 else "") if value else "empty"
