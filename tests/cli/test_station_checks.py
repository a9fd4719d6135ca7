"""The bus over a virtual cable that the doctor of a station measures."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ocmm_cli.station._doctor import measured_checks
from ocmm_core.doctor import NotAskedError
from tests.core.doctor.fake_computer import good_computer
from tests.host import HANG_S, private_network


def test_frames_go_round_on_a_private_cable(tmp_path: Path) -> None:
    private_network()
    _, loop = measured_checks(0.3)
    figures = loop.check(good_computer(tmp_path)).figures
    assert figures["cycles"] == 300.0
    # A cable that is memory loses nothing, however late a busy computer is.
    assert figures["lost"] == 0.0
    assert 0.0 < figures["p50_us"] <= figures["p999_us"] <= figures["max_us"]


def test_with_no_time_nothing_is_measured(tmp_path: Path) -> None:
    computer = good_computer(tmp_path)
    for spec in measured_checks(0.0):
        with pytest.raises(NotAskedError, match="Not measured"):
            spec.check(computer)


def test_nothing_is_left_of_a_measurement_that_is_killed() -> None:
    """The fixture that checks for child processes after each test would find the mirror."""
    command = [
        *private_network(), sys.executable, "-m", "ocmm_cli.station._doctor", "60",
    ]  # fmt: skip
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    until = time.monotonic() + HANG_S
    mirror = ""
    # First the tools that make the cable, each for a moment, then the mirror, which is Python.
    while "_doctor" not in mirror and time.monotonic() < until:
        for number in children.read_text().split():
            try:
                mirror = Path(f"/proc/{number}/cmdline").read_text()
            except OSError:
                continue
        time.sleep(0.02)
    assert "_doctor" in mirror
    os.kill(process.pid, signal.SIGKILL)
    process.wait(HANG_S)
