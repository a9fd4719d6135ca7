from __future__ import annotations

import contextlib
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

from ocmm_core.acceptance import AcceptanceSession, Verdict
from ocmm_core.errors import StorageError
from tests.core.acceptance.acceptance_site import Machine, begin
from tests.core.acceptance.kill_guided import bench_in

_ROOT = Path(__file__).parents[3]


@pytest.mark.slow
def test_kills_lose_no_point_that_was_told(tmp_path: Path, repeats: Callable[..., int]) -> None:
    wanted = repeats(12, 50)
    rng = np.random.default_rng(8)
    command = [sys.executable, "-m", "tests.core.acceptance.kill_worker"]
    kills, number, told = 0, 0, 0
    path = tmp_path / "0" / "session.chain"
    with subprocess.Popen(
        command, cwd=_ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as worker:
        assert worker.stdin is not None
        assert worker.stdout is not None
        while kills < wanted:
            if told >= 30:
                number, told = number + 1, 0
                path = tmp_path / str(number) / "session.chain"
            worker.stdin.write(f"{path}\n")
            worker.stdin.flush()
            word, child, done = worker.stdout.readline().split()
            assert word == "begun"
            # What the one before was told is there.
            assert int(done) >= told
            time.sleep(float(rng.uniform(0.0, 0.12)))
            # One that had taken everything is gone already, and was not killed.
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(child), signal.SIGKILL)
                kills += 1
            while (line := worker.stdout.readline().split()) != ["ended"]:
                told = max(told, int(line[1]))
            if path.exists():
                assert sum(AcceptanceSession.resume(path).view.done) >= told
        worker.stdin.close()
    session = AcceptanceSession.resume(path)
    machine = Machine(sigma=0.001)
    machine.run(session)
    assert session.finish(machine.now, 20.0).verdict is Verdict.PASS


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
        # This computer was told of the fifth point: without it the file is not used here.
        with pytest.raises(StorageError, match="missing"):
            AcceptanceSession.resume(copy)


@pytest.mark.slow
def test_a_guided_test_killed_at_any_moment_is_offered_and_keeps_every_point(
    tmp_path: Path, repeats: Callable[..., int]
) -> None:
    moments = repeats(4, 10)
    rng = np.random.default_rng(19)
    command = [sys.executable, "-m", "tests.core.acceptance.kill_guided"]
    folder, number, told, kills, resumed = tmp_path / "0", 0, 0, 0, 0
    with subprocess.Popen(
        command, cwd=_ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as worker:
        assert worker.stdin is not None
        assert worker.stdout is not None
        while kills < moments:
            worker.stdin.write(f"{folder}\n")
            worker.stdin.flush()
            word, child, done = worker.stdout.readline().split()
            assert word == "begun"
            # What the one before was told is there.
            assert int(done) >= told
            resumed += told > 0
            # After so many points, at any moment on the way to the next one.
            wanted = told + int(rng.integers(0, 5))
            while told < wanted:
                word, count = worker.stdout.readline().split(maxsplit=1)
                assert word == "taken", count
                told = int(count)
            time.sleep(float(rng.uniform(0.0, 0.2)))
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(child), signal.SIGKILL)
                kills += 1
            while (line := worker.stdout.readline().split()) != ["ended"]:
                told = max(told, int(line[1]))
            now = datetime.now(UTC)
            (left,) = bench_in(folder).unfinished(now)
            assert left.blocker == ""
            assert told <= left.done <= told + 1
            # Never to the end, which is no kill.
            if left.done >= left.wanted - 8:
                number, told = number + 1, 0
                folder = tmp_path / str(number)
        worker.stdin.close()
    assert resumed >= moments // 2
