from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.acceptance import AcceptanceSession, AcceptanceVerdict
from ocmm_core.errors import StorageError
from tests.core.acceptance.acceptance_site import ROOM, Machine, begin
from tests.core.acceptance.kill_guided import bench_in

_ROOT = Path(__file__).parents[3]


_LAST = 20


@pytest.mark.slow
def test_kills_lose_no_point_that_was_told(tmp_path: Path, repeats: Callable[..., int]) -> None:
    wanted = repeats(8, 50)
    rng = np.random.default_rng(8)
    command = [sys.executable, "-m", "tests.core.acceptance.kill_worker"]
    number, stored = 0, 0
    path = tmp_path / "0" / "session.chain"
    with subprocess.Popen(
        command, cwd=_ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as worker:
        assert worker.stdin is not None
        for _ in range(wanted):
            # A child takes up to eight more, and the test must not end.
            if stored >= _LAST:
                number, stored = number + 1, 0
                path = tmp_path / str(number) / "session.chain"
            done, now = killed(worker, path, int(rng.integers(0, 8)), float(rng.uniform()))
            # Points stored before the last kill are there.
            assert done >= stored
            stored = now
            assert sum(AcceptanceSession.resume(path).view.done) >= stored
        worker.stdin.close()
    session = AcceptanceSession.resume(path)
    machine = Machine(sigma=0.001)
    machine.run(session)
    assert session.finish(machine.now, ROOM).verdict is AcceptanceVerdict.PASS


def test_a_line_cut_at_any_byte_leaves_what_was_stored(tmp_path: Path) -> None:
    path = tmp_path / "session.chain"
    session, machine = begin(path, "SPAT"), Machine(sigma=0.001)
    for _ in range(4):
        machine.step(session)
    before = path.stat().st_size
    machine.step(session)
    whole = path.read_bytes()
    cuts = np.random.default_rng(1).integers(before, len(whole), 25)
    for cut in cuts:
        copy = tmp_path / f"{cut}.chain"
        copy.write_bytes(whole[:cut])
        # This computer's memory contains the fifth point: without it the file is refused here.
        with pytest.raises(StorageError, match="missing"):
            AcceptanceSession.resume(copy)


@pytest.mark.slow
def test_a_guided_test_killed_at_any_moment_is_offered_and_keeps_every_point(
    tmp_path: Path, repeats: Callable[..., int]
) -> None:
    moments = repeats(3, 10)
    rng = np.random.default_rng(19)
    command = [sys.executable, "-m", "tests.core.acceptance.kill_guided"]
    folder, number, stored, resumed = tmp_path / "0", 0, 0, 0
    with subprocess.Popen(
        command, cwd=_ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as worker:
        assert worker.stdin is not None
        for _ in range(moments):
            resumed += stored > 0
            # The first kill of a folder leaves a point at least, so that the second one resumes.
            points = int(rng.integers(0 if stored else 1, 5))
            done, now = killed(worker, folder, points, float(rng.uniform()))
            assert done >= stored
            stored = now
            (left,) = bench_in(folder).unfinished(datetime.now(UTC))
            assert left.blocker == ""
            assert stored <= left.done <= stored + 1
            # Six more at the most, and never the last one.
            if left.done >= left.wanted - 8:
                number, stored = number + 1, 0
                folder = tmp_path / str(number)
        worker.stdin.close()
    assert resumed >= moments // 2


def killed(worker: subprocess.Popen[str], path: Path, points: int, share: float) -> tuple[int, int]:
    """Kill a child in the step that follows some points; return the points before and after.

    The moment is a share of the time that the step before took, which is as long on any computer.
    """
    assert worker.stdin is not None
    assert worker.stdout is not None
    worker.stdin.write(f"{points} {path}\n")
    worker.stdin.flush()
    word, child, done = worker.stdout.readline().split()
    assert word == "begun"
    stored, begun, step_s = int(done), time.monotonic(), 0.0
    for _ in range(points):
        word, count = worker.stdout.readline().split(maxsplit=1)
        assert word == "taken", count
        stored, step_s, begun = int(count), time.monotonic() - begun, time.monotonic()
    time.sleep(share * step_s)
    os.kill(int(child), signal.SIGKILL)
    while (line := worker.stdout.readline().split()) != ["ended"]:
        stored = int(line[1])
    return int(done), stored
