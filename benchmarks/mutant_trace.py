"""A plugin of pytest that writes down which lines of a folder each test ran, and how long it took.

What a fixture of a module or of the whole session ran counts for every test of its file: later
tests rest on it too. What runs while the tests are collected counts for none. Lines of compiled
functions and of other processes are not seen.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Generator
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

Lines = dict[str, set[int]]


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add where to look and where to write."""
    parser.addoption("--trace-below", action="append", default=[])
    parser.addoption("--trace-into", default="")


def pytest_configure(config: pytest.Config) -> None:
    """Begin to look."""
    into = config.getoption("--trace-into")
    if into:
        below = tuple(config.getoption("--trace-below"))
        config.pluginmanager.register(_Tracer(config.rootpath, below, Path(into)))


class _Tracer:
    def __init__(self, root: Path, below: tuple[str, ...], into: Path) -> None:
        self._root, self._into = root, into
        self._below = tuple(str(root / folder) for folder in below)
        self._seen: dict[str, Lines] = {}
        self._shared: dict[str, Lines] = defaultdict(lambda: defaultdict(set))
        self._seconds: dict[str, float] = defaultdict(float)
        self._lines: Lines = defaultdict(set)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """Look while a test runs."""
        self._lines = self._seen[item.nodeid] = defaultdict(set)
        begin = time.process_time()
        sys.settrace(self._enter)
        threading.settrace(self._enter)
        try:
            return (yield)
        finally:
            sys.settrace(None)
            threading.settrace(None)
            self._seconds[item.nodeid] = time.process_time() - begin

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(
        self, fixturedef: pytest.FixtureDef[Any], request: pytest.FixtureRequest
    ) -> Generator[None, object, object]:
        """Let what wider fixtures run count for the whole file."""
        own = self._lines
        if fixturedef.scope != "function":
            self._lines = self._shared[request.node.nodeid.split("::")[0]]
        try:
            return (yield)
        finally:
            self._lines = own

    def pytest_sessionfinish(self) -> None:
        """Write it down."""
        tests = {}
        for test, seen in self._seen.items():
            lines: Lines = defaultdict(set)
            shared = [self._shared.get(test.split("::")[0], {}), self._shared.get("", {})]
            for part in (seen, *shared):
                for file, numbers in part.items():
                    lines[str(Path(file).relative_to(self._root))] |= numbers
            tests[test] = {
                "seconds": self._seconds[test],
                "lines": {file: sorted(numbers) for file, numbers in lines.items()},
            }
        self._into.write_text(json.dumps(tests), encoding="utf-8")

    def _enter(self, frame: FrameType, event: str, argument: object) -> Any:
        return self._line if frame.f_code.co_filename.startswith(self._below) else None

    def _line(self, frame: FrameType, event: str, argument: object) -> Any:
        self._lines[frame.f_code.co_filename].add(frame.f_lineno)
        return self._line
