"""A help loads no room: what computes is imported by the command that runs, when it runs."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from ocmm_cli.options import FORMAT_WORDS, PROFILED_WORDS
from ocmm_core.export import ALL, FORMATS
from tests.host import HANG_S, on_linux_only

HEAVY = ("numpy", "scipy", "numba", "llvmlite", "PySide6", "pyqtgraph", "psygnal", "lxml", "pysoem")
MOST_MODULES = 620
"""602 are loaded with Python 3.11; 1,580 where every command loaded its rooms."""

_EVERY_HELP = r"""
import io, json, re, sys, contextlib
from ocmm_cli import app
import typer.main

def paths(command, path=()):
    yield path
    for name, inner in getattr(command, "commands", {}).items():
        yield from paths(inner, (*path, name))

root = typer.main.get_command(app)
shown = []
for path in paths(root):
    if path == ("window",):
        continue  # the help of the program of the window
    out, found = io.StringIO(), root
    for name in path:
        found = found.commands[name]
    with contextlib.redirect_stdout(out):
        code = root.main([*path, "--help"], prog_name="ocmm", standalone_mode=False)
    assert not code and "Usage" in out.getvalue(), path
    assert "…" not in out.getvalue(), path
    # The library takes a word in brackets for a style, and leaves it out.
    lost = re.search(r"\[/?[a-zA-Z#@][^\[\]]*\]", found.help or "")
    assert not lost, (path, lost)
    shown.append(" ".join(path))
print(json.dumps([shown, sorted(sys.modules)]))
"""


def test_no_help_loads_what_computes() -> None:
    done = subprocess.run(
        [sys.executable, "-c", _EVERY_HELP], env={**os.environ, "COLUMNS": "80"},
        capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    shown, modules = json.loads(done.stdout)
    # All that there are, also those of a command in a command.
    assert len(shown) > 40
    assert {"", "measure", "bus black store", "calibrate tip", "verify-fits"} <= set(shown)
    assert [name for name in modules if name.partition(".")[0] in HEAVY] == []
    assert len(modules) < MOST_MODULES


@on_linux_only
@pytest.mark.parametrize("command", ["", "measure"])
def test_who_reads_one_line_of_a_help_gets_no_complaint(command: str) -> None:
    """Close the pipe before anything is written, which ``| head -1`` only sometimes does."""
    process = subprocess.Popen(
        [sys.executable, "-m", "ocmm_cli", *command.split(), "--help"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    assert process.stdout is not None
    process.stdout.close()
    assert process.stderr is not None
    assert process.stderr.read() == b""
    process.stderr.close()
    # 128 + SIGPIPE.
    assert process.wait(HANG_S) == 141


def test_the_help_of_reports_names_the_formats_of_the_registry() -> None:
    assert f"{', '.join(FORMATS)} or {ALL}" == FORMAT_WORDS
    assert ", ".join(name for name, one in FORMATS.items() if one.profile) == PROFILED_WORDS
