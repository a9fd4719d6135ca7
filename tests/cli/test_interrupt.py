"""Ctrl-C ends a measurement between two steps, never inside one."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from ocmm_cli.measure import run_job
from ocmm_cli.terminal import DeferredInterrupt, PlainConsole
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
        interrupt.close()
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


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (["acceptance", "run", "SPHERE-25", "--who", "Ada", "--speed", "1", "--folder", "place"],
         "it continues this test"),
        pytest.param(["calibrate", "probe", "--tip", "A", "--probes", "place", "--poses", "150",
                      "--speed", "4"],
                     "All observations are stored. Start the command again: it continues this "
                     "session.", marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_ctrl_c_ends_a_guided_procedure_that_the_same_command_continues(
    tmp_path: Path, command: list[str], words: str
) -> None:
    for stored in (3, 5):
        process = subprocess.Popen(
            [sys.executable, "-u", "-m", "ocmm_cli", *command],
            cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        try:
            # After some observations, not after a time.
            while process.poll() is None and lines_of_session(tmp_path) < stored:
                time.sleep(0.01)
            process.send_signal(signal.SIGINT)
            output, said = process.communicate(timeout=HANG_S)
        finally:
            process.kill()
            process.wait()
        assert process.returncode == 130, output + said
        assert words in said
        assert ("Continue" in output) is (stored == 5)
        assert lines_of_session(tmp_path) >= stored


def lines_of_session(folder: Path) -> int:
    """Return the number of lines in the only session; 0 if none yet."""
    found = list(folder.glob("place/**/sessions/*.*"))
    assert len(found) <= 1
    return sum(path.read_bytes().count(b"\n") for path in found)


def test_ctrl_c_at_the_report_keeps_it_and_ends_the_command(tmp_path: Path) -> None:
    out = tmp_path / "out"
    built = build_station(StationRequest(plan=ball_plan_in(tmp_path), out=out, frame_rate_hz=500))
    screen = InterruptedAtTheReport()
    # `--parts` would begin the next part.
    with pytest.raises(KeyboardInterrupt):
        run_job(built, out, PlainConsole(file=screen, width=200))
    reports = list(out.glob("*.csv"))
    assert reports
    assert all(str(report) in screen.getvalue() for report in reports)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with JobFile.read(built.job_path) as opened:
        assert not opened.verify()
