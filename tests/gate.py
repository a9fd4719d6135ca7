"""The gate: outcomes of all tests, over all runs of pytest in one test of the product.

As a plugin (registered in `conftest`) it lists skipped tests with the reason; with
OCMM_REQUIRE_ALL=1 they fail. With OCMM_TEST_RECORD=FILE it also stores outcome and duration of
every test. As a program, ``python -m tests.gate FOLDER``, it sums up the records of the runs of
`./run test`, ``LANE.json`` and for repeated tests ``LANE.again.json``, and names the longest tests
and files; and, for each folder, the time of its tests and the processor time of the tests and their
programs.
"""

from __future__ import annotations

import json
import os
import sys
from collections import defaultdict
from collections.abc import Generator, Iterable
from dataclasses import asdict, dataclass, replace
from heapq import nlargest
from multiprocessing import forkserver
from operator import itemgetter
from pathlib import Path
from typing import TypeVar

import pytest

PASSED, FAILED, NOT_RUN = "passed", "failed", "not run"
RECORD, REQUIRE_ALL = "OCMM_TEST_RECORD", "OCMM_REQUIRE_ALL"
_AGAIN = ".again"
_USED = "processor_s"
"""In a report; a worker sends its whole content."""
LONGEST = 60
"""Number of files, and of tests, listed with their times."""
_Report = TypeVar("_Report", pytest.TestReport, pytest.CollectReport)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one test, or of one file that could not be read."""

    test: str
    outcome: str
    reason: str = ""
    seconds: float = 0.0
    processor_s: float = 0.0


class Gate:
    """Collects what becomes of the tests; registered in the run itself and in its workers."""

    def __init__(self, *, require_all: bool, record: Path | None) -> None:
        self._require_all = require_all
        self._record = record
        self._found: dict[str, Outcome] = {}
        self._seconds: defaultdict[str, float] = defaultdict(float)
        self._used: defaultdict[str, float] = defaultdict(float)
        self._used_before = _processor_s()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Fail skipped tests on a complete host; record the processor time."""
        report = yield
        # Set-up, call and taking down have a report each, and to ask takes up to a millisecond.
        if report.when == "teardown":
            now = _processor_s()
            vars(report)[_USED], self._used_before = now - self._used_before, now
        return self._strict(report)

    @pytest.hookimpl(wrapper=True)
    def pytest_make_collect_report(
        self,
    ) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
        """Do the same for a file that is not run as a whole."""
        report = yield
        return self._strict(report)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Keep the worst of set-up, call and taking down, and how long all three took."""
        self._seconds[report.nodeid] += report.duration
        self._used[report.nodeid] += getattr(report, _USED, 0.0)
        self._keep(report)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Keep files that could not be read or were not run."""
        if not report.passed:
            self._keep(report)

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """List skipped tests."""
        lines = not_run_lines(self._found.values())
        if lines:
            terminalreporter.section("NOT RUN on this host")
            for line in lines:
                terminalreporter.write_line(line)

    def pytest_sessionstart(self, session: pytest.Session) -> None:
        """Write that it did not come to its end, which stays if it does not."""
        self._write(session, [Outcome("the run of pytest", FAILED, "it was cut off")])

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Write the record."""
        found = self._found.items()
        outcomes = [
            replace(outcome, seconds=self._seconds[test], processor_s=self._used[test])
            for test, outcome in found
        ]
        self._write(session, outcomes)

    def _write(self, session: pytest.Session, outcomes: Iterable[Outcome]) -> None:
        # Workers have the same environment.
        if self._record is not None and not hasattr(session.config, "workerinput"):
            write_record(self._record, outcomes)

    def _strict(self, report: _Report) -> _Report:
        if self._require_all and report.skipped and not hasattr(report, "wasxfail"):
            report.outcome = "failed"
            report.longrepr = f"NOT RUN, and {REQUIRE_ALL} is set: {_reason(report)}"
        return report

    def _keep(self, report: pytest.TestReport | pytest.CollectReport) -> None:
        before = self._found.get(report.nodeid)
        if report.failed:
            now = Outcome(report.nodeid, FAILED)
        elif report.skipped:
            now = Outcome(report.nodeid, NOT_RUN, _reason(report))
        elif before is None and report.when == "call":
            now = Outcome(report.nodeid, PASSED)
        else:
            return
        if before is None or before.outcome != FAILED:
            self._found[report.nodeid] = now


def _processor_s() -> float:
    """Return the processor time of this process and its ended children."""
    used = os.times()
    own = used.user + used.system + used.children_user + used.children_system
    return own + _server_s()


def _server_s() -> float:
    """Return the same for the fork server, if there is one."""
    pid = getattr(getattr(forkserver, "_forkserver", None), "_forkserver_pid", None)
    stat = Path(f"/proc/{pid}/stat")
    if pid is None or not stat.exists():
        return 0.0
    fields = stat.read_text().rpartition(")")[2].split()
    # Own and ended children's, each in the program and in the system: fields 14 to 17.
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")


def write_record(path: Path, outcomes: Iterable[Outcome]) -> None:
    """Write down what became of tests."""
    path.write_text(json.dumps([asdict(outcome) for outcome in outcomes]), encoding="utf-8")


def _reason(report: pytest.TestReport | pytest.CollectReport) -> str:
    # File, line and text of the skip; pytest prepends a word of its own.
    said = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
    return said.removeprefix("Skipped: ")


def not_run_lines(outcomes: Iterable[Outcome]) -> list[str]:
    """Return a line for each reason, and one below it for each test."""
    tests: dict[str, set[str]] = {}
    for outcome in outcomes:
        if outcome.outcome == NOT_RUN:
            tests.setdefault(outcome.reason, set()).add(outcome.test)
    lines = []
    for reason in sorted(tests):
        lines.append(f"NOT RUN ({len(tests[reason])}): {reason}")
        lines.extend(f"    {test}" for test in sorted(tests[reason]))
    return lines


def summary(folder: Path) -> tuple[list[str], bool]:
    """Return the summary of the records in a folder, line by line, and whether all is well."""
    lanes = sorted(path for path in folder.glob("*.json") if not path.stem.endswith(_AGAIN))
    table = [f"{'':24}{PASSED:>8}{FAILED:>8}{'repeated':>10}{NOT_RUN:>9}"]
    everything: list[Outcome] = []
    repeats: list[str] = []
    failures: list[str] = []
    total = [0, 0, 0, 0]
    seconds: defaultdict[str, float] = defaultdict(float)
    for path in lanes:
        name = path.stem.partition("-")[2]
        found = _read(path)
        second = _read(path.with_name(f"{path.stem}{_AGAIN}.json"))
        tried = {test for test, outcome in found.items() if outcome.outcome == FAILED}
        again = sorted(tried & second.keys())
        found |= {test: second[test] for test in again}
        for test in again:
            how = "passed at the second try" if found[test].outcome == PASSED else "failed again"
            repeats.append(f"REPEATED {test}: {how}")
        failures.extend(
            f"FAILED {test} ({name})" for test in sorted(found) if found[test].outcome == FAILED
        )
        counts = [sum(o.outcome == word for o in found.values()) for word in (PASSED, FAILED)]
        counts += [len(again), sum(o.outcome == NOT_RUN for o in found.values())]
        table.append(f"{name:24}{counts[0]:>8}{counts[1]:>8}{counts[2]:>10}{counts[3]:>9}")
        total = [a + b for a, b in zip(total, counts, strict=True)]
        everything.extend(found.values())
        for outcome in found.values():
            seconds[f"{outcome.test.partition('::')[0]} ({name})"] += outcome.seconds
    tests = nlargest(LONGEST, everything, key=lambda outcome: outcome.seconds)
    longest = [f"SLOW {outcome.seconds:6.0f} s  {outcome.test}" for outcome in tests]
    longest += [
        f"LONG {long:6.0f} s  {file}"
        for file, long in nlargest(LONGEST, seconds.items(), key=itemgetter(1))
    ]
    longest += _by_folder(everything)
    last = "All: {} passed, {} failed, {} repeated, {} not run.".format(*total)
    lines = [*not_run_lines(everything), *longest, *failures, *repeats, *table, last]
    return lines, total[1] == 0


def _by_folder(outcomes: Iterable[Outcome]) -> list[str]:
    """Return a line a folder, the longest first, and one for all."""
    sums: defaultdict[str, list[float]] = defaultdict(lambda: [0.0, 0.0])
    for outcome in outcomes:
        parts = outcome.test.partition("::")[0].split("/")[:-1]
        for name in ("/".join(parts[:3]) or ".", "all"):
            sums[name][0] += outcome.seconds
            sums[name][1] += outcome.processor_s
    ordered = sorted(sums.items(), key=lambda one: -one[1][0])
    return [
        f"FOLDER {took:6.0f} s, of a processor {used:6.0f} s  {name}"
        for name, (took, used) in ordered
    ]


def _read(path: Path) -> dict[str, Outcome]:
    if not path.exists():
        return {}
    return {entry["test"]: Outcome(**entry) for entry in json.loads(path.read_text("utf-8"))}


def gate_of(environment: dict[str, str] | os._Environ[str]) -> Gate:
    """Return the gate requested by an environment."""
    record = environment.get(RECORD)
    return Gate(
        require_all=environment.get(REQUIRE_ALL, "") not in ("", "0"),
        record=Path(record) if record else None,
    )


if __name__ == "__main__":
    text, well = summary(Path(sys.argv[1]))
    sys.stdout.write("\n".join(text) + "\n")
    sys.exit(0 if well else 1)
