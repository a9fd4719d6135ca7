"""Many things side by side in processes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from ocmm_core.errors import InputError, InternalError, OcmmError
from ocmm_core.host import HOST
from ocmm_core.processes import Aside, processes_for, side_by_side
from tests.host import HANG_S, not_run

BOUND_S = HANG_S
"""Ending takes a second a process; hanging ones sleep for 1,000 s."""


def work(thing: tuple[str, float]) -> tuple[str, int]:
    """Do as the item requests: wait, raise, die, or hang."""
    kind, value = thing
    if kind == "wait":
        time.sleep(value)
    elif kind == "raise":
        raise InputError("test.bad", f"Thing {value:g} is bad.", "Take another.")
    elif kind == "defect":
        raise KeyError(value)
    elif kind == "die":
        os._exit(9)
    elif kind == "hang":
        time.sleep(1000.0)
    return f"{kind} {value:g}", os.getpid()


def named(thing: tuple[str, float]) -> str:
    return f"Work {thing[0]}"


def test_answers_come_in_the_order_of_the_things_whichever_is_done_first() -> None:
    # The first takes longest, so that others are done before it.
    things = [("wait", 1.0), *(("wait", 0.01 * k) for k in range(1, 8))]
    done: list[int] = []
    found = list(side_by_side(work, things, 3, named, done.append))
    assert [one[0] for one in found if isinstance(one, tuple)] == [
        f"wait {value:g}" for _, value in things
    ]
    used = {one[1] for one in found if isinstance(one, tuple)}
    assert os.getpid() not in used
    assert len(used) > 1
    assert done == list(range(9))
    here = list(side_by_side(work, things[1:3], 1, named))
    assert here == [("wait 0.01", os.getpid()), ("wait 0.02", os.getpid())]


@pytest.mark.parametrize("processes", [1, 2])
def test_a_bad_thing_is_an_answer_and_the_others_go_on(processes: int) -> None:
    things = [("wait", 0.0), ("raise", 7.0), ("defect", 1.0), ("wait", 0.1)]
    found = list(side_by_side(work, things, processes, named))
    assert [type(one) for one in found] == [tuple, InputError, InternalError, tuple]
    assert isinstance(found[1], OcmmError)
    assert found[1].what == "Thing 7 is bad."
    assert isinstance(found[2], OcmmError)
    assert found[2].what.startswith("Work defect failed")


def test_a_process_that_dies_is_an_answer_and_another_takes_its_place() -> None:
    things = [("die", 0.0), ("wait", 0.0), ("die", 0.0), ("wait", 0.1), ("wait", 0.2)]
    found = list(side_by_side(work, things, 2, named))
    codes = [one.code if isinstance(one, OcmmError) else "" for one in found]
    assert codes == ["processes.died", "", "processes.died", "", ""]


def test_who_leaves_ends_the_processes_whatever_they_do() -> None:
    answers = side_by_side(work, [("wait", 0.0), ("hang", 0.0), ("hang", 1.0)], 2, named)
    assert isinstance(next(answers), tuple)
    begun = time.monotonic()
    answers.close()  # type: ignore[attr-defined]  # it is a generator
    assert time.monotonic() - begun < BOUND_S


def test_few_things_are_done_here() -> None:
    assert processes_for(1) == 1
    assert 1 <= processes_for(1000) <= (os.cpu_count() or 1)


_PARENT = """
import sys
sys.path[:0] = {path!r}
from tests.core.test_processes import named, told_hang
from ocmm_core.processes import side_by_side

if __name__ == "__main__":
    list(side_by_side(told_hang, [{folder!r}] * 2, 2, str))
"""


def told_hang(folder: str) -> None:
    """Say which process this is, and hang."""
    (Path(folder) / str(os.getpid())).touch()
    time.sleep(1000.0)


def test_processes_end_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    pids, script = tmp_path / "pids", tmp_path / "parent.py"
    pids.mkdir()
    script.write_text(_PARENT.format(path=sys.path, folder=str(pids)), encoding="utf-8")
    with subprocess.Popen([sys.executable, str(script)]) as parent:
        until = time.monotonic() + HANG_S
        while len(list(pids.iterdir())) < 2:
            assert time.monotonic() < until
            time.sleep(0.05)
        parent.send_signal(signal.SIGKILL)
    children = [int(file.name) for file in pids.iterdir()]
    until = time.monotonic() + BOUND_S
    while any(_lives(pid) for pid in children):
        assert time.monotonic() < until
        time.sleep(0.05)


def _lives(pid: int) -> bool:
    """Return whether a process still runs; a zombie does not."""
    try:
        return "Z" not in Path(f"/proc/{pid}/stat").read_text(encoding="ascii").split()[2]
    except (FileNotFoundError, ProcessLookupError):
        return False


def needs_copies() -> None:
    if not HOST.can_copy_process():
        not_run("this system does not copy processes, or has one processor")


def test_a_copy_sends_what_it_makes_and_ends_with_it() -> None:
    needs_copies()
    held = {"what only this process has": 7}

    def made(send: Callable[[bytes], None]) -> None:
        send(str(held).encode())
        # More than a pipe holds: it blocks until it is read.
        send(b"x" * 3_000_000)

    aside = Aside(made)
    assert aside.next(HANG_S) == str(held).encode()
    assert len(aside.next(HANG_S) or b"") == 3_000_000
    assert aside.next(HANG_S) is None
    assert aside.next(HANG_S) is None
    aside.end()


def test_a_copy_works_on_while_nobody_listens(tmp_path: Path) -> None:
    needs_copies()
    mark = tmp_path / "went on"

    def made(send: Callable[[bytes], None]) -> None:
        send(b"x" * 3_000_000)
        mark.touch()

    aside = Aside(made)
    until = time.monotonic() + HANG_S
    while not mark.exists() and time.monotonic() < until:
        time.sleep(0.01)
    assert mark.exists()
    assert len(aside.next(HANG_S) or b"") == 3_000_000
    assert aside.next(HANG_S) is None
    aside.end()


def test_a_copy_that_fails_or_takes_too_long_sends_nothing() -> None:
    needs_copies()

    def fails(send: Callable[[bytes], None]) -> None:
        send(b"first")
        raise KeyError("defect")

    aside = Aside(fails)
    assert aside.next(HANG_S) == b"first"
    assert aside.next(HANG_S) is None

    def works_on(send: Callable[[bytes], None]) -> None:
        while True:
            pass

    aside = Aside(works_on)
    began = time.monotonic()
    assert aside.next(0.05) is None
    assert time.monotonic() - began < BOUND_S
    # A calculation without a waiting caller ends on request.
    aside = Aside(works_on)
    aside.end()
    aside.end()


_PARENT_OF_COPY = """
import os, sys, time
from ocmm_core.processes import Aside
def work(send):
    send(str(os.getpid()).encode())
    while True:
        pass
aside = Aside(work)
print(aside.next(1000.0).decode(), flush=True)
time.sleep(1000.0)
"""


def test_a_copy_ends_with_the_process_that_was_killed() -> None:
    needs_copies()
    parent = subprocess.Popen(
        [sys.executable, "-c", _PARENT_OF_COPY], stdout=subprocess.PIPE, text=True
    )
    assert parent.stdout is not None
    try:
        copy = int(parent.stdout.readline())
    finally:
        parent.kill()
        parent.wait()
        parent.stdout.close()
    until = time.monotonic() + BOUND_S
    while time.monotonic() < until and _runs(copy):
        time.sleep(0.05)
    assert not _runs(copy)


def _runs(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text("utf-8", "replace").rpartition(")")[2]
    except OSError:
        return False
    # A dead process stays in the list until its parent reads its exit code.
    return state.split()[0] not in ("Z", "X")
