"""After the set-up no command and no page compiles anything, in whatever process it computes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.composition import compile_all
from ocmm_core.documents import resource
from tests import compile_log
from tests.host import HANG_S
from tests.slow_rig import slow_rig_in

pytestmark = pytest.mark.slow

_PLAN = ("--plan", str(resource("plans", "quick.toml")))
_COMMANDS = (
    ("ocmm", "demo", "--headless", *_PLAN, "--out", "first"),
    ("ocmm", "measure", *_PLAN, "--rig", "RIG", "--out", "second", "--seed", "4"),
    ("ocmm", "report", "FIRST", "--format", "all", "--out", "again"),
    ("ocmm", "compare", "FIRST", "SECOND"),
    ("ocmm", "fit", "points.txt", "--shape", "sphere"),
    ("ocmm", "bench", "--seconds", "0.2"),
    ("ocmm", "calibrate", "probe", "--tip", "A", "--probes", "probes", "--poses", "150"),
    ("window", *_PLAN, "--out", "seen", "--silent", "--speed", "0", "--quit-after", "4"),
)
"""FIRST and SECOND are the job files that demo and measure write, RIG one with fewer frames: how
many come is nothing that a compiled function is told."""


def test_no_command_and_no_window_compiles_anything(tmp_path: Path) -> None:
    compile_all(1)
    rng = np.random.default_rng()
    directions = rng.normal(size=(20, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    np.savetxt(tmp_path / "points.txt", 10.0 * directions, fmt="%.6f")
    log = tmp_path / "log.txt"
    for command in _COMMANDS:
        jobs = {"RIG": slow_rig_in(tmp_path)} | {
            folder.upper(): path
            for folder in ("first", "second")
            for path in (tmp_path / folder).glob("*.ocmm")
        }
        done = subprocess.run(
            [sys.executable, compile_log.__file__,
             *(str(jobs.get(word, word)) for word in command)],
            cwd=tmp_path, capture_output=True, text=True, stdin=subprocess.DEVNULL,
            timeout=HANG_S, check=False,
            env=os.environ | {compile_log.VARIABLE: str(log)},
        )  # fmt: skip
        assert done.returncode in (0, 1), done.stdout + done.stderr
    lines = log.read_text().splitlines()
    assert lines.count("process") >= len(_COMMANDS)
    assert [line for line in lines if line != "process"] == []
