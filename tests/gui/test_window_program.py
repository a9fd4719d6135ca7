"""The window as a program: it starts, takes its picture, and ends cleanly on request."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from PySide6.QtGui import QImage

from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from tests.host import BUSY, HANG_S
from tests.programs import handles, rings_of
from tests.waiting import wait_until

# Counts the rings of the whole machine and holds the window to two seconds.
pytestmark = pytest.mark.timing

_COMMAND = (sys.executable, "-m", "ocmm_gui", "--silent", "--size", "1280x720", "--out")
_ROOT = Path(__file__).resolve().parents[2]


def test_it_quits_by_itself_and_leaves_a_picture(tmp_path: Path) -> None:
    picture = tmp_path / "window.png"
    with subprocess.Popen(
        [*_COMMAND, str(tmp_path), "--quit-after", "1", "--screenshot", str(picture)],
        cwd=_ROOT, stderr=subprocess.PIPE, text=True,
    ) as window:  # fmt: skip
        wait_until(lambda: rings_of(window.pid) or window.poll() is not None)
        rings = rings_of(window.pid)
        _, errors = window.communicate(timeout=HANG_S)
    assert window.returncode == 0, errors
    assert "Traceback" not in errors
    image = QImage(str(picture))
    assert (image.width(), image.height()) == (1280, 720)
    assert list(tmp_path.glob("*.ocmm"))
    assert rings
    assert not any(ring.exists() for ring in rings)


def test_a_termination_signal_closes_the_window_within_two_seconds(tmp_path: Path) -> None:
    with subprocess.Popen(
        [*_COMMAND, str(tmp_path)], cwd=_ROOT, stderr=subprocess.PIPE, text=True
    ) as window:
        try:
            wait_until(lambda: rings_of(window.pid) and handles(window.pid, signal.SIGTERM))
            rings = rings_of(window.pid)
            begun = time.monotonic()
            window.send_signal(signal.SIGTERM)
            _, errors = window.communicate(timeout=HANG_S)
        finally:
            window.kill()
    assert window.returncode == 0, errors
    assert time.monotonic() - begun < BUSY * 2.0
    assert "Traceback" not in errors
    assert not any(ring.exists() for ring in rings)


def test_a_termination_signal_during_the_start_is_not_lost() -> None:
    """Events are handled while a window starts, and no loop runs then that could end."""
    program = (
        "import signal, sys\n"
        "from PySide6.QtWidgets import QApplication\n"
        "from ocmm_gui._start import end_on_signals, splash\n"
        "app = QApplication(sys.argv)\n"
        "end_on_signals(app)\n"
        "signal.raise_signal(signal.SIGTERM)\n"
        "shown = splash(app, 'a source', 'light')\n"
        "sys.exit(app.exec())\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=_ROOT, timeout=HANG_S, check=False)
    assert done.returncode == 0


def test_who_looks_at_a_job_has_nothing_measured_behind_it(tmp_path: Path) -> None:
    """A double click on a job opened a window in which the robot measured a demo part."""
    request = StationRequest(plan=resource("plans", "quick.toml"), out=tmp_path / "jobs")
    built = build_station(request)
    built.station.close()
    out = tmp_path / "out"
    done = subprocess.run(
        [*_COMMAND, str(out), "--quit-after", "3", "--start", str(built.job_path)],
        cwd=_ROOT, capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert not list(out.glob("*.ocmm"))


def test_a_job_behind_the_option_for_pictures_is_not_written_over(tmp_path: Path) -> None:
    job = tmp_path / "DEMO-001.ocmm"
    job.write_bytes(b"a job")
    done = subprocess.run(
        [*_COMMAND, str(tmp_path / "out"), "--quit-after", "1", "--screenshot", str(job)],
        cwd=_ROOT, capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert "give a name ending in .png" in done.stderr
    assert job.read_bytes() == b"a job"
