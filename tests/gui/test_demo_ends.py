"""``ocmm demo`` with its window ends as one: no process and no shared memory stay behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ocmm_core.documents import resource
from tests.host import HANG_S, on_linux_only

pytestmark = on_linux_only

_ROOT = Path(__file__).resolve().parents[2]


def _of_session(session: int) -> list[int]:
    """Return the processes of a session that still run."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, its_session, *_ = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue  # It has just ended.
        if int(its_session) == session and state != "Z":
            found.append(int(stat.parent.name))
    return found


def _rings_of(pid: int) -> set[Path]:
    """Return the rings that a process maps."""
    maps = Path(f"/proc/{pid}/maps").read_text().splitlines()
    return {Path(line.split()[5]) for line in maps if "ocmm-ring-" in line}


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
def test_who_ends_the_demo_ends_its_window(tmp_path: Path, how: signal.Signals) -> None:
    """The window takes the place of the command, so that there is one process to end."""
    plan = resource("plans", "quick.toml")
    with subprocess.Popen(
        [sys.executable, "-m", "ocmm_core.cli", "demo", "--plan", plan, "--out", tmp_path],
        cwd=_ROOT, env={**os.environ, "QT_QPA_PLATFORM": "offscreen"},
        stderr=subprocess.PIPE, text=True, start_new_session=True,
    ) as command:  # fmt: skip
        try:
            until = time.monotonic() + HANG_S
            rings: set[Path] = set()
            while not rings and command.poll() is None and time.monotonic() < until:
                time.sleep(0.05)
                rings = _rings_of(command.pid)
            # The process that was started shows the window itself.
            assert rings, "it measures in another process, or not at all"
            command.send_signal(how)
            _, errors = command.communicate(timeout=HANG_S)
        finally:
            command.kill()
    assert command.returncode == (-how if how == signal.SIGKILL else 0), errors
    assert "Traceback" not in errors
    while (left := _of_session(command.pid)) and time.monotonic() < until:
        time.sleep(0.05)
    assert left == []
    if how != signal.SIGKILL:
        assert not any(ring.exists() for ring in rings)
    for ring in rings:
        # What was killed left its ring to the next start; see test_frame_ring.
        ring.unlink(missing_ok=True)
