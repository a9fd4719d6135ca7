"""Environment of each test: no user data, no screen, and nothing may be left behind.

After a test that passed, these must be gone within `_GRACE_S`: threads, child processes (also
grandchildren whose parent ended), frame rings in shared memory and top-level windows. The same is
checked once more at the end of the session, for wider fixtures. Only children of this process
count, so that parallel workers do not accuse each other.
"""

from __future__ import annotations

import ctypes
import gc
import multiprocessing
import os
import signal
import sys
import tempfile
import threading
import time
import traceback
import weakref
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from pytestqt.qtbot import QtBot

from ocmm_core.blas import use_one_thread
from tests.commands import calm_rig, ocmm, ocmm_here, slow_rig  # noqa: F401 - fixtures
from tests.gate import gate_of
from tests.host import HANG_MS, amount, long_form, not_run
from tests.other_station import forget_histories
from tests.sleeps import scale_sleeps

# As the product does, before numpy is loaded: with two threads small matrices take ten times as
# long on a contended computer.
use_one_thread()
if "numpy" in sys.modules:
    # It would have no effect, and numbers here would differ in their last bit from those of the
    # product's own processes.
    raise ImportError("numpy was loaded before the tests could set the threads of its BLAS")

from tests.compiled import CompileWatch  # noqa: E402 - it loads numpy

# For the same result on every machine, windows are drawn in memory unless the caller chose a
# platform.
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
# In English, independent of the language of the developer.
os.environ["LANGUAGE"] = "en"
# A shell starts its background jobs with Ctrl-C ignored, and every program of a test inherits that.
signal.signal(signal.SIGINT, signal.default_int_handler)

_REPOSITORY = Path(__file__).resolve().parents[1]
_REFERENCE = _REPOSITORY.parent / "shared" / "reference"
_GRACE_S = 30.0
_PR_SET_CHILD_SUBREAPER = 36
_THREADS_OF_DASK = ("Dask-Offload_", "Dask-Callback-Thread_", "IO loop")
"""Dask makes these once a process and keeps them; they wait, and end with it. So does the loop of
a client that was not let in."""
_LONG_S = 7200.0
_PASSED = pytest.StashKey[bool]()

_started_at: weakref.WeakKeyDictionary[threading.Thread, str] = weakref.WeakKeyDictionary()
_rings_made: set[Path] = set()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let tests of hundreds of touches take hours in the long form; they still end."""
    for item in items if long_form() else ():
        item.add_marker(pytest.mark.timeout(_LONG_S))


def pytest_configure(config: pytest.Config) -> None:
    """Watch thread starts and ring files, and adopt orphaned grandchildren."""
    # Collecting fifteen thousand tests makes a million objects, which each collection of Python's
    # own threshold visits; parsing all sources takes four times as long with it.
    gc.set_threshold(50_000, 20, 50)
    scale_sleeps()
    # 5 s are too short for a busy computer, and a longer deadline costs nothing if it is met.
    for wait in (QtBot.waitActive, QtBot.waitExposed, QtBot.waitSignal, QtBot.waitUntil):
        defaults = wait.__kwdefaults__
        assert defaults is not None
        defaults["timeout"] = HANG_MS
    config.pluginmanager.register(gate_of(os.environ))
    start = threading.Thread.start

    def start_and_remember(self: threading.Thread) -> None:
        frames = traceback.extract_stack()[:-1]
        own = [frame for frame in frames if Path(frame.filename).is_relative_to(_REPOSITORY)]
        where = (own or frames)[-1]
        _started_at[self] = f"{where.filename}:{where.lineno}"
        start(self)

    threading.Thread.start = start_and_remember  # type: ignore[method-assign] # the only way to learn the line
    # An audit hook would run at every import, file and attribute of all tests, for seconds.
    make = tempfile.mkstemp

    def make_and_remember(*arguments: Any, **named: Any) -> tuple[int, Any]:
        made = make(*arguments, **named)
        if Path(os.fsdecode(made[1])).name.startswith("ocmm-ring-"):
            _rings_made.add(Path(os.fsdecode(made[1])))
        return made

    tempfile.mkstemp = make_and_remember
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """Exclude loaded and collected objects from garbage collections."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Record whether the test passed: leftovers of a failed test are not a second finding."""
    # A worker can send text, but no number of numpy's.
    item.user_properties[:] = [(name, str(value)) for name, value in item.user_properties]
    report = yield
    if call.when == "call":
        item.stash[_PASSED] = report.passed
    # A command that ran in this process has set it for its own processes, see `side_files`.
    os.environ.pop("PYTHONSAFEPATH", None)
    return report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the measurements of tests (`record_property`), also those of workers."""
    for outcome in ("passed", "failed"):
        for report in terminalreporter.getreports(outcome):
            for name, value in report.user_properties:
                if report.when == "call":
                    terminalreporter.write_line(f"{report.nodeid.split('::')[-1]}, {name}: {value}")


@pytest.fixture(scope="session", autouse=True)
def _no_user_data(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Let this process and its children see empty data, configuration and state folders."""
    home = tmp_path_factory.mktemp("home")
    with pytest.MonkeyPatch.context() as patch:
        for name in ("XDG_DATA_HOME", "XDG_CONFIG_HOME", "XDG_STATE_HOME", "XDG_CONFIG_DIRS"):
            patch.setenv(name, str(home / name.lower()))
        yield


@pytest.fixture(autouse=True)
def _remembers_nothing() -> None:
    """Hide from each test the progress of chains that another test copied."""
    forget_histories()


@pytest.fixture(scope="session", autouse=True)
def _session_leaves_nothing(_no_user_data: None) -> Iterator[None]:
    with _leaves_nothing() as findings:
        yield
    if findings:
        pytest.fail("After all tests:\n" + "\n".join(findings), pytrace=False)


@pytest.fixture(autouse=True)
def _leaves_nothing_behind(request: pytest.FixtureRequest) -> Iterator[None]:
    with _leaves_nothing() as findings:
        yield
    if findings and request.node.stash.get(_PASSED, False):
        pytest.fail("The test left behind:\n" + "\n".join(findings), pytrace=False)


@pytest.fixture(scope="session")
def _compile_watch() -> CompileWatch:
    return CompileWatch()


@pytest.fixture(autouse=True)
def _compiles_nothing(
    request: pytest.FixtureRequest, _compile_watch: CompileWatch
) -> Iterator[None]:
    """Every function called by a test was compiled by the set-up, for any command or page."""
    yield
    lines = _compile_watch.unlisted()
    if lines and request.node.stash.get(_PASSED, False):
        pytest.fail(
            "Not in ocmm_cli/_kernels.py, so that a user would wait for it:\n" + "\n".join(lines),
            pytrace=False,
        )


@pytest.fixture
def repeats(record_property: Callable[[str, object], None]) -> Callable[..., int]:
    """Return `tests.host.amount`, which then records the number with the test."""

    def chosen(short: int, long: int, again: int | None = None) -> int:
        n = amount(short, long, again)
        record_property("N", f"{n} of {long}" if n < long else n)
        return n

    return chosen


@pytest.fixture(scope="session")
def reference() -> Path:
    """Return the folder with reference data that is not part of the repository."""
    if not _REFERENCE.is_dir():
        not_run("the reference data (../shared/reference beside the checkout) is not there")
    return _REFERENCE


@pytest.fixture(scope="module")
def kept_readers() -> Iterator[None]:
    """Load the library for STEP files once; each model is read by a fork of that process.

    Loading takes longer than reading the models of most tests. The tests of the start itself
    (`test_step_model`) do without.
    """
    with _processes_of_a_server():
        yield


@pytest.fixture
def kept_sides() -> Iterator[None]:
    """Load the modules of the window's side processes once; each process is forked from it.

    Loading takes over a second of a processor, most calculations a tenth of that.
    """
    with _processes_of_a_server():
        yield


@contextmanager
def _processes_of_a_server() -> Iterator[None]:
    from ocmm_cad.step import READER_MODULES

    before = multiprocessing.get_start_method(allow_none=True)
    # One server a worker, and it begins once: it loads what any of them needs.
    multiprocessing.set_forkserver_preload([*READER_MODULES, "tests.kept_modules"])
    multiprocessing.set_start_method("forkserver", force=True)
    _load_server()
    try:
        yield
    finally:
        multiprocessing.set_start_method(before, force=True)


@cache
def _load_server() -> None:
    """Wait until the server has loaded everything, as its first client would.

    The server starts here, in the folder of `tests`: a test may change the working folder.
    """
    # A failed preload is silent, and each process would then load everything.
    asked = "import sys; sys.exit('tests.kept_modules' not in sys.modules)"
    first = multiprocessing.get_context("forkserver").Process(target=exec, args=(asked,))
    first.start()
    first.join()
    assert first.exitcode == 0, "the server of processes has not loaded what they need"
    first.close()


@contextmanager
def _leaves_nothing() -> Iterator[list[str]]:
    """Fill the list, on leaving, with a line for each thing that is there and was not before."""
    threads, processes = set(threading.enumerate()), set(_children())
    rings, windows = set(_rings_made), _windows()
    findings: list[str] = []
    yield findings
    until = time.monotonic() + _GRACE_S
    while True:
        left_threads = [
            thread
            for thread in threading.enumerate()
            if thread not in threads and not thread.name.startswith(_THREADS_OF_DASK)
        ]
        left_processes = {pid: name for pid, name in _children().items() if pid not in processes}
        left_rings = [path for path in _rings_made - rings if path.exists()]
        # The windows of before are kept as objects: an id alone could have been used again.
        left_windows = [w for w in _windows() if not any(w is old for old in windows)]
        if not (left_threads or left_processes or left_rings or left_windows):
            return
        if time.monotonic() > until:
            break
        gc.collect()
        time.sleep(0.02)
    for thread in left_threads:
        where = _started_at.get(thread, "an unknown line")
        findings.append(f"thread {thread.name!r}, started at {where}")
    for pid, name in left_processes.items():
        findings.append(f"process {pid}: {name}")
        # The next test must not find it again.
        os.kill(pid, signal.SIGKILL)
    for path in left_rings:
        findings.append(f"frame ring {path}")
        path.unlink(missing_ok=True)
    findings.extend(f"window {window!r}" for window in left_windows)


def _children() -> dict[int, str]:
    """Return the living child processes and their commands; empty outside Linux.

    Unreaped children cause Python's ResourceWarning, which is an error here.
    """
    found = _children_of(os.getpid())
    servers = [pid for pid, command in found.items() if "multiprocessing.forkserver" in command]
    for pid, command in list(found.items()):
        # These live as long as the interpreter; processes started by a server do not.
        if pid in servers or "resource_tracker" in command:
            del found[pid]
    for server in servers:
        found |= _children_of(server)
    return found


def _children_of(parent: int) -> dict[int, str]:
    found: dict[int, str] = {}
    for process in _processes(parent):
        try:
            # The name is in brackets and may contain blanks and brackets.
            stat = (process / "stat").read_text()
            state, its_parent = stat.rpartition(")")[2].split()[:2]
            command = (process / "cmdline").read_bytes().replace(b"\0", b" ").decode()
        except (OSError, UnicodeDecodeError):
            continue
        if int(its_parent) == parent and state != "Z":
            found[int(process.name)] = command.strip()
    return found


def _processes(parent: int) -> Iterator[Path]:
    """Return the processes among which the children of one are."""
    processes = Path("/proc")
    if not Path("/proc/thread-self/children").exists():
        # A kernel that keeps no such lists: all of the computer, which takes milliseconds a test.
        yield from (stat.parent for stat in processes.glob("[0-9]*/stat"))
        return
    for thread in (processes / str(parent) / "task").glob("*/children"):
        # A thread that ended meanwhile has given its children to another one.
        with suppress(OSError):
            yield from (processes / pid for pid in thread.read_text().split())


def _windows() -> list[Any]:
    """Return the top-level widgets without a parent, once pending deletions are done."""
    widgets = sys.modules.get("PySide6.QtWidgets")
    if widgets is None or widgets.QApplication.instance() is None:
        return []
    core = sys.modules["PySide6.QtCore"]
    core.QCoreApplication.sendPostedEvents(None, core.QEvent.Type.DeferredDelete)
    return [w for w in widgets.QApplication.topLevelWidgets() if w.parent() is None]
