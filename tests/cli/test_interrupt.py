"""Ctrl-C ends a measurement between two steps, never inside one."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from rich.console import Console

from ocmm_cli.measure import run_job
from ocmm_cli.measure._interrupt import DeferredInterrupt
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.storage import JobFile
from tests.host import HANG_S
from tests.short_plan import ball_plan_in


class InterruptedAtTheReport(io.StringIO):
    """A screen whose reader presses Ctrl-C once, as soon as a report is named."""

    def write(self, text: str, /) -> int:
        if text.startswith("Report") and "Report" not in self.getvalue():
            os.kill(os.getpid(), signal.SIGINT)
        return super().write(text)


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


def test_ctrl_c_at_the_report_keeps_it_and_ends_the_command(tmp_path: Path) -> None:
    out = tmp_path / "out"
    built = build_station(StationRequest(plan=ball_plan_in(tmp_path), out=out, frame_rate_hz=500))
    screen = InterruptedAtTheReport()
    # `--parts` would begin the next part.
    with pytest.raises(KeyboardInterrupt):
        run_job(built, out, Console(file=screen, width=200))
    reports = list(out.glob("*.csv"))
    assert reports
    assert all(str(report) in screen.getvalue() for report in reports)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with JobFile.read(built.job_path) as opened:
        assert not opened.verify()
