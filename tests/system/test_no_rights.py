"""The window and the commands hold no privilege of the kernel, with any of their parent.

Real processes of an ordinary user, examined from outside (``/proc/PID/task/*/status``). Only root
can become an ordinary user with inheritable rights, so these tests need root.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from ocmm_core.acquisition.bus_process import NEEDED, ProcessRights, rights_of
from tests.host import HANG_S, long_form, needs_root, needs_tools, not_run, on_linux_only
from tests.programs import rings_of
from tests.waiting import wait_until

pytestmark = [on_linux_only, pytest.mark.slow]

_ROOT = Path(__file__).resolve().parents[2]
_NOBODY = "65534"
_HANDED_ON = "+net_raw,+net_admin,+sys_nice"
_WINDOW = ("ocmm_gui", "--silent", "--quit-after", "600")
_COMMAND = ("ocmm_cli", "demo", "--headless", "--speed", "0.2")


@contextmanager
def _folder_of_nobody() -> Iterator[Path]:
    folder = Path(tempfile.mkdtemp(prefix="ocmm-nobody-"))
    os.chown(folder, int(_NOBODY), int(_NOBODY))
    try:
        yield folder
    finally:
        shutil.rmtree(folder)


@pytest.fixture(scope="module")
def ordinary_user() -> None:
    """Require an ordinary user who can run the installed programs; checked once."""
    needs_root("become an ordinary user")
    needs_tools("setpriv")
    with _folder_of_nobody() as folder:
        reads = [*_as_user(""), sys.executable, "-c", "import ocmm_core, numpy, PySide6"]
        if subprocess.call(reads, cwd=folder, env=_environment(folder)) != 0:
            not_run("another user cannot import the packages of this environment")


@pytest.fixture
def home(ordinary_user: None) -> Iterator[Path]:
    """Return a folder of an ordinary user's own."""
    with _folder_of_nobody() as folder:
        yield folder


def _as_user(handed_on: str) -> list[str]:
    """Return the prefix that runs a command as an ordinary user, with ambient rights if any."""
    rights = [f"--inh-caps={handed_on}", f"--ambient-caps={handed_on}"] if handed_on else []
    return ["setpriv", f"--reuid={_NOBODY}", f"--regid={_NOBODY}", "--clear-groups", *rights, "--"]


def _environment(home: Path) -> dict[str, str]:
    places = dict.fromkeys(
        ("HOME", "TMPDIR", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_STATE_HOME", "XDG_CACHE_HOME",
         "XDG_RUNTIME_DIR"),
        str(home),
    )  # fmt: skip
    return {**os.environ, **places, "QT_QPA_PLATFORM": "offscreen", "PYTHONPATH": str(_ROOT)}


def _seen(program: tuple[str, ...], handed_on: str, home: Path) -> list[ProcessRights]:
    """Return the rights of every thread of a program that is at work."""
    with (home / "log").open("wb") as log:
        process = subprocess.Popen(
            [*_as_user(handed_on), sys.executable, "-m", *program],
            cwd=home, env=_environment(home), stdout=log, stderr=log,
        )  # fmt: skip
    try:
        # It measures: the thread that reads the ring works as well.
        wait_until(lambda: rings_of(process.pid) or process.poll() is not None)
        assert process.poll() is None, (home / "log").read_text(encoding="utf-8")
        tasks = Path(f"/proc/{process.pid}/task").iterdir()
        return [rights_of(int(task.name)) for task in tasks]
    finally:
        # It is killed: another user keeps no compiled code and may be compiling for minutes.
        rings = rings_of(process.pid)
        process.kill()
        process.wait(HANG_S)
        for ring in rings:
            ring.unlink(missing_ok=True)


# Without rights there is nothing to lay down: in the long form only.
@pytest.mark.parametrize("handed_on", ["", _HANDED_ON] if long_form() else [_HANDED_ON])
@pytest.mark.parametrize("program", [_WINDOW, _COMMAND], ids=["window", "command"])
def test_it_holds_no_right_and_hands_none_on(
    program: tuple[str, ...], handed_on: str, home: Path
) -> None:
    for one in _seen(program, handed_on, home):
        assert not one.effective
        assert not one.permitted
        assert not one.inheritable
        assert not one.ambient
        # What root gave a file, it still gets: the interpreter of the bus process.
        assert one.bounding >= NEEDED
        assert not one.no_new_privileges


def test_rights_are_really_handed_on_here(home: Path) -> None:
    """Otherwise the test above would show nothing."""
    read = (
        "from ocmm_core.acquisition.bus_process import NEEDED, rights_of as r, hold_nothing as h; "
        "assert r().effective == NEEDED == r().ambient, r(); h(); assert not r().permitted, r()"
    )
    subprocess.run(
        [*_as_user(_HANDED_ON), sys.executable, "-c", read],
        check=True, cwd=home, env=_environment(home), timeout=HANG_S,
    )  # fmt: skip
