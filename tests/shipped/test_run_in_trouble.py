"""`./run` on computers where its set-up cannot be done: a sentence, and exit code 2, never 1."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from installer.locks import ROOT
from tests.host import HANG_S, on_linux_only

pytestmark = on_linux_only

# The user may not install packages; no Python is new enough, so the set-up ends there.
FAKES = {
    "id": "echo 1000", "dpkg-query": "exit 1", "sudo": 'exec "$@"', "python3": "exit 1",
    "df": "printf 'head\\na b c 9999999 e f\\n'",
    **{f"python3.{minor}": "exit 1" for minor in (11, 12, 13)},
    "dpkg": 'echo "dpkg $*" >&2', "apt-get": 'echo "apt-get $*" >&2',
}  # fmt: skip
NO_PYTHON = "Python 3.11 or newer is needed and was not found"
TROUBLES: list[tuple[dict[str, str], str]] = [
    ({}, NO_PYTHON),
    ({"df": "printf 'head\\na b c 90000 e f\\n'"}, "needs 1000 MB on the disk"),
    ({"sudo": "exit 1"}, "sudo refuses. As root, run: apt-get install libegl1"),
    ({"sudo": "exit 1"}, NO_PYTHON),
    ({"without": "sudo"}, "As root, run: apt-get install libegl1"),
    ({"apt-get": "exit 100"}, "These packages were not installed. As root, run: apt-get"),
    ({"dpkg": 'case $1 in --audit) echo x ;; *) echo "dpkg $*" >&2 ;; esac'},
     "dpkg --configure -a --force-confdef"),
    ({"python3": "kill -SEGV $$"}, NO_PYTHON),
    ({"words": "setup --all"}, "has no option '--all'"),
    ({"words": "tests"}, "There is no 'tests'"),
]  # fmt: skip


def run(
    folder: Path, words: str = "setup", *, without: str = "", **fakes: str
) -> subprocess.CompletedProcess[str]:
    """Run a copy of `./run` with other programs in its path."""
    tools, copy = folder / "tools", folder / "copy"
    tools.mkdir()
    copy.mkdir()
    shutil.copy(ROOT / "run", copy)
    for name, does in {**FAKES, **fakes}.items():
        if name != without:
            (tools / name).write_text(f"#!/bin/sh\n{does}\n", encoding="utf-8")
            (tools / name).chmod(0o755)
    for name in ("awk", "dirname", "ls", "cat", "grep", "sed", "env", "sh", "pwd", "mkdir", "true"):
        found = shutil.which(name)
        assert found is not None
        (tools / name).symlink_to(found)
    return subprocess.run(
        [str(copy / "run"), *words.split()],
        env={"PATH": str(tools), "HOME": os.environ.get("HOME", "/")},
        capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip


@pytest.mark.parametrize(("fakes", "told"), TROUBLES, ids=str)
def test_says_why_and_ends_with_2(fakes: dict[str, str], told: str, tmp_path: Path) -> None:
    done = run(tmp_path, **fakes)
    assert told in done.stderr
    assert done.returncode == 2


def test_asks_sudo_once_where_it_refuses(tmp_path: Path) -> None:
    done = run(tmp_path, sudo="echo refused >&2; exit 1")
    assert done.stderr.count("refused") == 1
