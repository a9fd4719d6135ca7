"""The gate itself: skipped tests, repeated ones, and the summary."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.gate import FAILED, NOT_RUN, PASSED, Outcome, summary, write_record
from tests.host import AGAIN, HANG_S, LONG, amount, looser
from tests.processor import AVX2, GENERIC, why_not

_ROOT = Path(__file__).resolve().parents[2]

_CONFTEST = """
import os
from tests.gate import gate_of

def pytest_configure(config):
    config.pluginmanager.register(gate_of(os.environ))
"""

_TESTS = """
import pytest
from tests.host import not_run, needs_tools

def test_that_passes(): pass
def test_that_fails(): assert False
def test_of_a_tool(): needs_tools("no-such-tool")

@pytest.fixture
def rights(): not_run("only root can")
def test_of_rights(rights): pass

@pytest.fixture
def spoilt():
    yield
    raise RuntimeError
def test_that_leaves_badly(spoilt): pass
"""


def pytest_in(folder: Path, *options: str, **environment: str) -> tuple[int, str]:
    """Run these tests with the gate in a separate folder; return exit code and output."""
    (folder / "conftest.py").write_text(_CONFTEST)
    if not (folder / "test_them.py").exists():
        (folder / "test_them.py").write_text(_TESTS)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-p", "xdist.plugin", *options],
        cwd=folder, capture_output=True, text=True, timeout=HANG_S, check=False,
        # The other plugins, that of Qt above all, take longer to load than these tests.
        env={**os.environ, "PYTHONPATH": str(_ROOT), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
             **environment},
    )  # fmt: skip
    return done.returncode, done.stdout


@pytest.mark.parametrize("workers", [(), ("-n", "2")])
def test_what_is_not_run_is_listed_with_its_reason_and_recorded(
    workers: tuple[str, ...], tmp_path: Path
) -> None:
    record = tmp_path / "record.json"
    code, said = pytest_in(tmp_path, *workers, OCMM_TEST_RECORD=str(record), OCMM_REQUIRE_ALL="0")
    assert code == 1
    listed = said[said.index("NOT RUN on this host") :]
    for reason, test in (
        ("'no-such-tool' is not installed", "test_of_a_tool"), ("only root can", "test_of_rights")
    ):  # fmt: skip
        assert f"NOT RUN (1): {reason}\n    test_them.py::{test}" in listed
    found = {entry["test"].partition("::")[2]: entry for entry in json.loads(record.read_text())}
    assert {name: entry["outcome"] for name, entry in found.items()} == {
        "test_that_passes": PASSED,
        "test_that_fails": FAILED,
        "test_of_a_tool": NOT_RUN,
        "test_of_rights": NOT_RUN,
        "test_that_leaves_badly": FAILED,
    }
    assert found["test_of_rights"]["reason"] == "only root can"


@pytest.mark.parametrize("workers", [(), ("-n", "2")])
def test_a_host_that_should_have_everything_fails_what_is_not_run(
    workers: tuple[str, ...], tmp_path: Path
) -> None:
    record = tmp_path / "record.json"
    code, said = pytest_in(tmp_path, *workers, OCMM_TEST_RECORD=str(record), OCMM_REQUIRE_ALL="1")
    assert code == 1
    assert "NOT RUN, and OCMM_REQUIRE_ALL is set: only root can" in said
    outcomes = [entry["outcome"] for entry in json.loads(record.read_text())]
    assert sorted(outcomes) == [FAILED] * 4 + [PASSED]


def test_a_file_that_cannot_be_read_is_a_failure(tmp_path: Path) -> None:
    (tmp_path / "test_them.py").write_text("raise RuntimeError\n")
    record = tmp_path / "record.json"
    assert pytest_in(tmp_path, OCMM_TEST_RECORD=str(record))[0] == 2
    assert [entry["outcome"] for entry in json.loads(record.read_text())] == [FAILED]


def test_a_run_that_is_cut_off_is_a_failure(tmp_path: Path) -> None:
    (tmp_path / "test_them.py").write_text("import os\ndef test_it(): os._exit(0)\n")
    record = tmp_path / "1-others.json"
    # The record claims success, wrongly.
    assert pytest_in(tmp_path, OCMM_TEST_RECORD=str(record))[0] == 0
    lines, well = summary(tmp_path)
    assert not well
    assert lines[-1] == "All: 0 passed, 1 failed, 0 repeated, 0 not run."


def test_the_summary_adds_up_all_runs_and_names_what_was_repeated(tmp_path: Path) -> None:
    def lane(name: str, **outcomes: str) -> None:
        write_record(
            tmp_path / f"{name}.json",
            [Outcome(f"a.py::{test}", how, "no bus" * (how == NOT_RUN))
             for test, how in outcomes.items()],
        )  # fmt: skip

    lane("1-timing", quick=FAILED, slow=PASSED, wire=NOT_RUN)
    lane("1-timing.again", quick=PASSED)
    lane("2-others", one=PASSED, two=PASSED)
    lines, well = summary(tmp_path)
    assert well
    assert "NOT RUN (1): no bus" in lines
    assert "REPEATED a.py::quick: passed at the second try" in lines
    assert lines[-1] == "All: 4 passed, 0 failed, 1 repeated, 1 not run."

    lane("1-timing.again", quick=FAILED)
    lines, well = summary(tmp_path)
    assert not well
    assert "FAILED a.py::quick (timing)" in lines
    assert "REPEATED a.py::quick: failed again" in lines
    assert lines[-1] == "All: 3 passed, 1 failed, 1 repeated, 1 not run."


def test_what_failed_and_was_not_tried_again_stays_failed(tmp_path: Path) -> None:
    write_record(tmp_path / "1-timing.json", [Outcome("a.py::quick", FAILED)])
    write_record(tmp_path / "1-timing.again.json", [])
    lines, well = summary(tmp_path)
    assert not well
    assert lines[-1] == "All: 0 passed, 1 failed, 0 repeated, 0 not run."


def test_only_one_file_says_that_a_test_is_not_run() -> None:
    """An error turned into a skip makes a broken product look green."""
    skips = re.compile(r"pytest\.(skip|importorskip|mark\.skip)|\bSkipTest\b")
    found = [
        path.name
        for path in sorted((_ROOT / "tests").rglob("*.py"))
        if skips.search(path.read_text(encoding="utf-8")) and path != Path(__file__)
    ]
    assert found == ["host.py"]


_ASIDE = """
import os, signal
print(os.nice(0), signal.getsignal(signal.SIGINT) is signal.default_int_handler)
"""


def test_what_runs_aside_comes_second_and_can_be_interrupted() -> None:
    # So does a shell start what runs in its background.
    command = f"trap '' INT; {sys.executable} -m tests.aside {sys.executable} -c '{_ASIDE}'"
    done = subprocess.run(
        ["sh", "-c", command], cwd=_ROOT, capture_output=True, text=True, timeout=HANG_S, check=True
    )
    nicer = min(os.nice(0) + 5, 19)
    assert done.stdout.split() == [str(nicer), "True"]


_LOOK = """
import numba, numpy
from numba.core.codegen import JITCPUCodegen
found = numpy.show_config(mode="dicts")["SIMD Extensions"].get("found", ())

@numba.njit(fastmath=True)
def total(values):
    s = 0.0
    for value in values:
        s += value * value
    return s

total(numpy.ones(9))
(code,) = total.inspect_asm().values()
print("zmm" in code, "ymm" in code, any("AVX512" in name or name == "X86_V4" for name in found))
"""


@pytest.mark.parametrize(("processor", "wide"), [(AVX2, "True"), (GENERIC, "False")])
def test_libraries_see_the_processor_that_is_asked_for(processor: str, wide: str) -> None:
    # The test itself may run as another processor than this one.
    plain = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    plain.pop("NPY_DISABLE_CPU_FEATURES", None)
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "tests.processor", processor,
         sys.executable, "-W", "error", "-c", _LOOK],
        cwd=_ROOT, capture_output=True, text=True, timeout=HANG_S, check=False, env=plain,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    if not why_not(processor):
        assert done.stdout.split() == ["False", wide, "False"]


def test_the_files_that_took_longest_are_named(tmp_path: Path) -> None:
    (tmp_path / "test_them.py").write_text("import time\ndef test_it(): time.sleep(1)\n")
    (tmp_path / "test_quick.py").write_text("def test_it(): pass\n")
    assert pytest_in(tmp_path, OCMM_TEST_RECORD=str(tmp_path / "1-others.json"))[0] == 0
    long = [line.split() for line in summary(tmp_path)[0] if line.startswith("LONG")]
    assert [line[3] for line in long] == ["test_them.py", "test_quick.py"]
    assert int(long[0][1]) >= 1
    slow = [line.split() for line in summary(tmp_path)[0] if line.startswith("SLOW")]
    assert [line[3] for line in slow] == ["test_them.py::test_it", "test_quick.py::test_it"]


@pytest.mark.parametrize("workers", [(), ("-n", "1")])
def test_what_tests_use_of_a_processor_is_told_by_folder(
    workers: tuple[str, ...], tmp_path: Path
) -> None:
    (tmp_path / "test_them.py").write_text("def test_nothing(): pass\n")
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "test_busy.py").write_text(
        "import subprocess, sys, time\n"
        "def test_it():\n"
        "    while time.process_time() < 0.5: pass\n"
        "def test_of_a_program():\n"
        "    busy = 'import time\\nwhile time.process_time() < 0.7: pass'\n"
        "    subprocess.run([sys.executable, '-c', busy], check=True)\n"
        "def test_that_waits(): time.sleep(0.5)\n"
    )
    record = tmp_path / "1-others.json"
    assert pytest_in(tmp_path, *workers, OCMM_TEST_RECORD=str(record))[0] == 0
    used = {entry["test"].partition("::")[2]: entry["processor_s"]
            for entry in json.loads(record.read_text())}  # fmt: skip
    # Times of program and kernel come in whole ticks of a hundredth of a second.
    assert used["test_of_a_program"] >= 0.7 - 0.03
    assert used["test_that_waits"] < 0.3
    folders = [line.split() for line in summary(tmp_path)[0] if line.startswith("FOLDER")]
    found = {line[-1]: int(line[6]) for line in folders}
    assert found.keys() == {".", "deep", "all"}
    assert found["all"] >= found["deep"] >= 1


def test_the_long_form_takes_the_whole_number(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (LONG, AGAIN):
        monkeypatch.delenv(name, raising=False)
    assert (amount(6, 50), amount(6, 50, again=3)) == (6, 6)
    monkeypatch.setenv(AGAIN, "1")
    assert (amount(6, 50), amount(6, 50, again=3)) == (6, 3)
    monkeypatch.setenv(LONG, "1")
    assert (amount(6, 50), amount(6, 50, again=3)) == (50, 50)
    # Half of the draws know a mean half as well, squared.
    assert looser(0.02, 2_500, 10_000) == pytest.approx(0.04)
