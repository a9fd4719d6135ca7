"""After the set-up no command and no page compiles anything, in any process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ocmm_cli import compile_all
from ocmm_core.documents import resource
from tests import compile_log
from tests.host import HANG_S
from tests.slow_rig import CALM_HZ, SLOW_HZ, slow_rig_in

pytestmark = pytest.mark.slow

_PLAN = f"--plan {resource('plans', 'quick.toml')}"
_COMMANDS = (
    f"ocmm demo --headless {_PLAN} --out first",
    f"ocmm measure {_PLAN} --rig rig_{SLOW_HZ}_hz.toml --out second --seed 4",
    "ocmm report first/*.ocmm --format all --out again",
    "ocmm compare first/*.ocmm second/*.ocmm",
    "ocmm fit points.txt --shape sphere",
    "ocmm bench --seconds 0.2",
    f"ocmm calibrate probe --tip A --probes probes --poses 150 --rig rig_{CALM_HZ}_hz.toml",
)
"""One process runs them all: a function is stored for each set of types, for every caller."""
_WINDOW = f"window {_PLAN} --out seen --silent --speed 0 --quit-after 4 --rig rig_{SLOW_HZ}_hz.toml"


def test_no_command_and_no_window_compiles_anything(tmp_path: Path) -> None:
    compile_all(1)
    rng = np.random.default_rng()
    directions = rng.normal(size=(20, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    np.savetxt(tmp_path / "points.txt", 10.0 * directions, fmt="%.6f")
    # With fewer frames: their number is no argument of a compiled function.
    for rate_hz in (SLOW_HZ, CALM_HZ):
        slow_rig_in(tmp_path, rate_hz)
    log = tmp_path / "log.txt"
    for lines in (_COMMANDS, (_WINDOW,)):
        done = subprocess.run(
            [sys.executable, compile_log.__file__, *lines],
            cwd=tmp_path, capture_output=True, text=True, stdin=subprocess.DEVNULL,
            timeout=HANG_S, check=False,
            env=os.environ | {compile_log.VARIABLE: str(log)},
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr
    noted = log.read_text().splitlines()
    ran = [line.removeprefix("ran ") for line in noted if line.startswith("ran ")]
    assert ran == [*_COMMANDS, _WINDOW]
    assert noted.count("process") >= 2
    assert [line for line in noted if line.startswith("compiled ")] == []
