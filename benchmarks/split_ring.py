"""A ring broken between two cameras: how well this computer could tell both halves the time.

Each half then has a reference clock of its own, and only this computer sees both. It reads both
system times and takes the middle of sending and receiving for the moment of the reading. The two
cameras of this benchmark have the same clock, so every difference that is found is an error. Two
virtual cables, two processes of cameras, N readings, alone and the best of ten (shortest way).

Run inside a private network namespace by itself: ``python -m benchmarks.split_ring [N]``.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ocmm_core.fieldbus.wire import Command, Datagram, RawLine, make_link, namespace_command

_SYSTEM_TIME = 0x0910
_LIMIT_NS = 20_000
"""More than that between two clocks refuses a cycle."""
_BEST_OF = 10
_INSIDE = "inside"
_FRAMES = (("ring0", "half0"), ("ring1", "half1"))


def main() -> int:
    """Measure and print; return the exit code."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 and sys.argv[1] != _INSIDE else 2000
    if _INSIDE not in sys.argv:
        done = subprocess.run(  # noqa: S603 - our own interpreter and module, no shell
            [*namespace_command(), sys.executable, "-m", "benchmarks.split_ring", str(count),
             _INSIDE],
            check=False,
            cwd=Path(__file__).resolve().parents[1],
        )  # fmt: skip
        return done.returncode
    cameras = []
    for near, far in _FRAMES:
        make_link(near, far)
        cameras.append(
            subprocess.Popen(  # noqa: S603 - our own interpreter and module, no shell
                [sys.executable, "-m", "tests.second_camera.second_camera", far, "1"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[1])},
            )
        )
    for camera in cameras:
        assert camera.stdout is not None
        camera.stdout.readline()
    lines = [RawLine(near) for near, _far in _FRAMES]
    try:
        readings = np.array([[_read(line) for line in lines] for _ in range(count)])
    finally:
        for line in lines:
            line.close()
        for camera in cameras:
            assert camera.stdin is not None
            camera.stdin.close()
            camera.wait()
    _report("each reading", readings)
    blocks = readings[: len(readings) // _BEST_OF * _BEST_OF].reshape(-1, _BEST_OF, 2, 2)
    best = np.argmin(blocks[..., 1], axis=1)
    chosen = np.take_along_axis(blocks, best[:, None, :, None], axis=1)[:, 0]
    _report(f"best of {_BEST_OF}", chosen)
    return 0


def _read(line: RawLine) -> tuple[int, int]:
    """Return the camera clock's lead over this computer's, and the round trip."""
    before = time.monotonic_ns()
    answer = line.exchange(Datagram(Command.APRD, 0, _SYSTEM_TIME, bytes(8)))
    after = time.monotonic_ns()
    return int.from_bytes(answer.data, "little") - (before + after) // 2, after - before


def _report(name: str, readings: NDArray[np.int64]) -> None:
    error = readings[:, 0, 0] - readings[:, 1, 0]
    way = readings[..., 1].ravel()
    print(
        f"{name} (N={len(error)}): error of the difference of both clocks, us: median "
        f"{np.median(np.abs(error)) / 1e3:.1f}, 95 % {np.percentile(np.abs(error), 95) / 1e3:.1f}, "
        f"worst {np.abs(error).max() / 1e3:.1f}; mean {error.mean() / 1e3:+.1f}; over "
        f"{_LIMIT_NS / 1e3:.0f} us: {np.mean(np.abs(error) > _LIMIT_NS) * 100:.1f} %; there and "
        f"back, us: median {np.median(way) / 1e3:.0f}"
    )


if __name__ == "__main__":
    sys.exit(main())
