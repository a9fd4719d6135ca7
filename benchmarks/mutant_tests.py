"""A copy of the tree in which modules are changed, and the tests of a room that look at it.

Nothing is ever written where the sources stand. Every mutant gets a new process of pytest, which
ends at the first test that fails; the tests that ran the changed lines come first, the quickest of
them before the others. Results of numba are kept beside the sources: those that a change could
have gone into are taken away and put back afterwards.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from math import ceil, isfinite
from pathlib import Path
from resource import RLIMIT_CPU, prlimit

from benchmarks.house_tree import ROOTS
from benchmarks.mutant_sites import Change, places

NEEDED = (*ROOTS, "tests", "benchmarks", "resources", "installer", "docs")
LEFT_OUT = "timing"
"""Tests with this mark judge the machine, which is busy here."""
SLOWER = 10.0
"""A mutant may take this multiple of its tests' processor time before it counts as hanging, ..."""
BEGINNING_S, COMPILING_S = 30.0, 180.0
"""... plus this for the start of the process, and for compilation."""
WAITING = 30.0
"""Without using a processor it may wait this multiple as long: the machine may be busy."""
_NO_SUCH_TEST = 4
"""Pytest ends with this."""


@dataclass(frozen=True, slots=True)
class Room:
    """A part of the product and the tests that are its own.

    Attributes
    ----------
    name
        As in the table.
    sources, tests
        Folders or files, from the root of the repository.
    """

    name: str
    sources: tuple[str, ...]
    tests: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Seen:
    """What one test did before anything was changed: processor time and lines by file."""

    seconds: float
    lines: dict[str, frozenset[int]]


class Copy:
    """A copy of the tree in a separate folder."""

    def __init__(self, source: Path, folder: Path) -> None:
        self.root = folder / "tree"
        self.root.mkdir()
        if (source.parent / "shared").exists():
            # Reference data, which tests expect next to the tree.
            (folder / "shared").symlink_to(source.parent / "shared")
        for name in NEEDED:
            if (source / name).is_dir():
                shutil.copytree(source / name, self.root / name)
        for file in source.iterdir():
            if file.is_file():
                shutil.copy2(file, self.root / file.name)

    def files(self, room: Room) -> list[str]:
        """Return the modules of a package; a face only lists names."""
        found = [path for part in room.sources for path in _python(self.root / part)]
        return [str(path.relative_to(self.root)) for path in found if path.name != "__init__.py"]

    @cached_property
    def texts(self) -> dict[str, str]:
        """All modules of the product."""
        found = _python(self.root / "ocmm_core")
        return {str(path.relative_to(self.root)): path.read_text("utf-8") for path in found}

    def seen(self, room: Room, memory: Path) -> dict[str, Seen]:
        """Return what each test of the room runs, as far as it can from ``memory``."""
        own = [self.root / file for file in self.files(room)]
        tests = [path for part in room.tests for path in _python(self.root / part)]
        helpers = [path for path in tests if not path.name.startswith("test_")]
        state = _digest([*own, *helpers])
        known = json.loads(memory.read_text("utf-8")) if memory.exists() else {}
        stale = {}
        for path in tests:
            name, now = str(path.relative_to(self.root)), f"{state}{_digest([path])}"
            if path.name.startswith("test_") and known.get(name, {}).get("state") != now:
                stale[name] = now
        if stale:
            for name, seen in self._trace(room, list(stale)).items():
                known[name] = {"state": stale[name], "tests": seen}
            memory.write_text(json.dumps(known), encoding="utf-8")
        files = {str(path.relative_to(self.root)) for path in tests}
        return {
            test: Seen(one["seconds"], {f: frozenset(n) for f, n in one["lines"].items()})
            for name, entry in known.items()
            if name in files
            for test, one in entry["tests"].items()
        }

    def _trace(self, room: Room, files: list[str]) -> dict[str, dict[str, object]]:
        into = self.root / "trace.json"
        below = [f"--trace-below={part}" for part in room.sources]
        plugin = ("-p", "benchmarks.mutant_trace", f"--trace-into={into}", *below)
        ended = self.run(files, None, *plugin)
        if ended != "survived":
            fault = self.first_failure()
            raise SystemExit(f"The tests of {room.name} fail without any change: {fault}")
        found: dict[str, dict[str, object]] = {name: {} for name in files}
        for test, one in json.loads(into.read_text("utf-8")).items():
            found[test.split("::")[0]][test] = one
        return found

    def judge(self, file: str, change: Change, tests: list[str], limit_s: float) -> str:
        """Return ``killed``, ``survived`` or ``timeout`` of the tests with a change of a file."""
        path = self.root / file
        source = self.texts[file]
        times = path.stat()
        caches = {cache: (cache.read_bytes(), cache.stat()) for cache in self._caches(file, change)}
        path.write_text(change.applied(source), encoding="utf-8")
        if change.compiled:
            for cache in caches:
                cache.unlink()
        try:
            return self.run(tests, limit_s)
        finally:
            path.write_text(source, encoding="utf-8")
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
            for cache in self._caches(file, change):
                cache.unlink()
            for cache, (content, stamp) in caches.items():
                cache.write_bytes(content)
                os.utime(cache, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))

    def _caches(self, file: str, change: Change) -> list[Path]:
        """Return what numba keeps of the file and, for a compiled one, of who builds it in."""
        touched = {file}
        size = 0
        while change.compiled and size != len(touched):
            size = len(touched)
            modules = {name.removesuffix(".py").replace("/", ".") for name in touched}
            modules |= {name.rpartition(".")[0] for name in modules}
            touched |= {
                name
                for name, text in self.texts.items()
                if "compiled(" in text or "njit(" in text
                if any(f"from {module} import" in text for module in modules)
            }
        folders = {(self.root / name).parent / "__pycache__": None for name in touched}
        stems = {Path(name).stem for name in touched}
        return [
            path
            for folder in folders
            if folder.is_dir()
            for path in folder.iterdir()
            if path.suffix in (".nbi", ".nbc")
            and path.name.partition(".")[0].split("-")[0] in stems
        ]

    def run(self, tests: list[str], limit_s: float | None, *more: str) -> str:
        """Return the outcome of tests on the present copy."""
        asked = self.root / "tests.txt"
        asked.write_text("\n".join(tests), encoding="utf-8")
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"]
        command += ["-m", f"not {LEFT_OUT}", "-o", f"timeout={WAITING * COMPILING_S}"]
        command += [*more, f"@{asked}"]
        environment = dict(os.environ, PYTHONPATH=str(self.root), PYTHONDONTWRITEBYTECODE="1")
        with (self.root / "said.txt").open("wb") as said:
            process = subprocess.Popen(  # noqa: S603
                command,
                cwd=self.root,
                env=environment,
                stdout=said,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            if limit_s is not None:
                prlimit(process.pid, RLIMIT_CPU, (ceil(limit_s), ceil(limit_s)))
            try:
                code = process.wait(None if limit_s is None else WAITING * limit_s)
            except subprocess.TimeoutExpired:
                return "timeout"
            finally:
                # Its children too, of which a changed test may leave some.
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGKILL)
                    process.wait()
        if code in (-signal.SIGXCPU, -signal.SIGKILL):
            return "timeout"
        if code == _NO_SUCH_TEST:
            # The change is in the name of a test: its files are run as a whole.
            return self.run(list(dict.fromkeys(test.split("::")[0] for test in tests)), limit_s)
        return "killed" if code else "survived"

    def first_failure(self) -> str:
        """Return the name of the test that failed last."""
        lines = (self.root / "said.txt").read_text("utf-8", "replace").splitlines()
        failed = [line for line in lines if line.startswith(("FAILED", "ERROR"))]
        return failed[0].split(" - ")[0].partition(" ")[2] if failed else ""


def chosen(
    copy: Copy, file: str, change: Change, seen: dict[str, Seen], budget_s: float
) -> tuple[list[str], bool]:
    """Return the tests to run for a change, best first, and whether any of them is near it.

    Near are those that ran the changed lines; where none is seen, those that ran lines that name
    what was changed, and then all others. They go on as far as ``budget_s`` of their time reaches.
    """
    lines = {file: frozenset(range(change.begin[0], change.end[0] + 1))}
    if change.names:
        names = _users(copy.texts, change) if change.compiled else frozenset(change.names)
        lines = {name: frozenset(places(text, names)) for name, text in copy.texts.items()}
    near = [
        test
        for test, one in seen.items()
        if any(numbers & lines.get(name, frozenset()) for name, numbers in one.lines.items())
    ]
    near.sort(key=lambda test: seen[test].seconds)
    others: Iterable[str] = ()
    if change.names:
        others = sorted(seen, key=lambda test: seen[test].seconds)
    elif not isfinite(budget_s):
        # One test may have left something in memory that others of its file rest on.
        files = {test.split("::")[0] for test in near}
        others = [test for test in seen if test.split("::")[0] in files]
    tests, spent = list[str](), 0.0
    for test in dict.fromkeys((*near, *others)):
        spent += seen[test].seconds
        if spent > budget_s and tests:
            break
        tests.append(test)
    return tests, bool(near or change.names)


def limit(tests: list[str], seen: dict[str, Seen], compiled: bool) -> float:
    """Return the processor time after which the tests count as hanging, s."""
    beginning = COMPILING_S if compiled else BEGINNING_S
    return beginning + SLOWER * sum(seen[test].seconds for test in tests)


def _users(texts: dict[str, str], change: Change) -> frozenset[str]:
    """Return the compiled function and all compiled ones that call it, however far."""
    calls = {}
    for text in texts.values():
        if "compiled(" in text or "njit(" in text:
            for node in ast.parse(text).body:
                if isinstance(node, ast.FunctionDef) and node.decorator_list:
                    calls[node.name] = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
    names = set(change.names)
    while more := {name for name, used in calls.items() if used & names} - names:
        names |= more
    return frozenset(names)


def _python(path: Path) -> list[Path]:
    return [path] if path.is_file() else sorted(path.rglob("*.py"))


def _digest(paths: list[Path]) -> str:
    total = hashlib.sha256()
    for path in paths:
        total.update(path.read_bytes())
    return total.hexdigest()[:16]
