"""``ocmm demo`` with its window ends as one: no process and no shared memory stay behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.host import HANG_S, long_form, on_linux_only
from tests.programs import rings_of
from tests.short_plan import ball_plan_in
from tests.waiting import wait_until

pytestmark = on_linux_only

_ROOT = Path(__file__).resolve().parents[2]
_ENDS = [signal.SIGINT, signal.SIGKILL, *[signal.SIGTERM] * long_form()]
"""The short form sends SIGTERM to a window in `test_window_program`, which handles both alike."""


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


@pytest.mark.parametrize("how", _ENDS)
def test_who_ends_the_demo_ends_its_window(tmp_path: Path, how: signal.Signals) -> None:
    """The window replaces the command's process, so that there is one process to end."""
    documents = ("--plan", ball_plan_in(tmp_path))
    with subprocess.Popen(
        [sys.executable, "-m", "ocmm_cli", "demo", *documents, "--out", tmp_path / "job"],
        cwd=_ROOT, env={**os.environ, "QT_QPA_PLATFORM": "offscreen"},
        stderr=subprocess.PIPE, text=True, start_new_session=True,
    ) as command:  # fmt: skip
        try:
            wait_until(lambda: rings_of(command.pid) or command.poll() is not None)
            rings = rings_of(command.pid)
            # The process that was started shows the window itself.
            assert rings, "it measures in another process, or not at all"
            command.send_signal(how)
            _, errors = command.communicate(timeout=HANG_S)
        finally:
            command.kill()
    assert command.returncode == (-how if how == signal.SIGKILL else 0), errors
    assert "Traceback" not in errors
    wait_until(lambda: not _of_session(command.pid))
    if how != signal.SIGKILL:
        assert not any(ring.exists() for ring in rings)
    for ring in rings:
        # A killed process leaves its ring to the next start; see test_frame_ring.
        ring.unlink(missing_ok=True)
