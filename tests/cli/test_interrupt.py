"""Ctrl-C ends a measurement between two steps, never inside one."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from ocmm_cli.measure._interrupt import DeferredInterrupt
from ocmm_core.documents import resource
from ocmm_core.storage import JobFile
from tests.host import HANG_S


def test_the_first_ctrl_c_waits_for_a_check_and_the_second_does_not() -> None:
    before = signal.getsignal(signal.SIGINT)
    lock, interrupt = threading.Lock(), DeferredInterrupt()
    try:
        with lock:
            os.kill(os.getpid(), signal.SIGINT)
            reached = True
        assert reached
        with pytest.raises(KeyboardInterrupt):
            interrupt.check()
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
    finally:
        interrupt.end()
    assert signal.getsignal(signal.SIGINT) is before


def test_ctrl_c_ends_a_job_that_keeps_its_points(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-u", "-m", "ocmm_cli", "measure", "--plan",
         str(resource("plans", "quick.toml")), "--speed", "1", "--out", "out"],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert process.stdout is not None
        # The line before the first frame.
        for line in process.stdout:
            if line.startswith("Temperature"):
                break
        (job,) = (tmp_path / "out").glob("*.ocmm")
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=HANG_S)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 130
    assert "all points taken are saved" in said
    with JobFile.read(job) as opened:
        assert not opened.verify()
