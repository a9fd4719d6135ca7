"""Time from a still ball to the answer of ``PtMeas``: ``python -m benchmarks.ippdme [TOUCHES]``.

A point is complete with the last frame of its window; the answer is timed where the client reads
it. The frame is dated by the station's own clock of arrival: the first look in which it is there.
The virtual rig runs in real time, so the figures hold for this computer with its load.
"""

from __future__ import annotations

import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ocmm_core.measuring import MeasuredPoint
from tests.serve.ippdme_client import session
from tests.serve.ippdme_station import served_station

_LOOK_S = 0.0005
PROMISED_MS = 100.0


class FrameClock:
    """Remember when each frame had been measured; a thread, a context manager."""

    def __init__(self, newest: Callable[[], int]) -> None:
        self._newest = newest
        self._ended = threading.Event()
        self._seen: list[tuple[int, float]] = [(-1, time.monotonic())]
        self._thread = threading.Thread(target=self._run, name="frame-clock")

    def __enter__(self) -> FrameClock:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(_LOOK_S):
            frame = self._newest()
            if frame != self._seen[-1][0]:
                self._seen.append((frame, time.monotonic()))

    def time_of(self, frame: int) -> float:
        """Return when a frame had been measured, at the latest."""
        return next(at for newest, at in self._seen if newest >= frame)


def main(touches: int) -> None:
    """Print median, 99th percentile and maximum."""
    waits, own = [], []
    taken: list[MeasuredPoint] = []
    durable_s: list[float] = []

    def note(point: MeasuredPoint) -> None:
        taken.append(point)
        durable_s.append(time.monotonic())

    with tempfile.TemporaryDirectory() as folder, served_station(Path(folder), speed=1.0) as served:
        station = served.built.station
        station.events.point_taken.connect(note)
        clock = FrameClock(lambda: station.looks.live().frame_counter)
        with clock, session(served.address) as client:
            client.good("Home()")
            client.good('ChangeTool("standard")')
            for number in range(touches):
                x, y = (number % 9 - 4) * 5.0, (number // 9 % 9 - 4) * 5.0
                done = client.good(f"PtMeas(X({x}), Y({y}), Z(0), IJK(0, 0, 1))")
                waits.append(1000.0 * (done.answered_s - clock.time_of(taken[-1].last_frame)))
                own.append(1000.0 * (done.answered_s - durable_s[-1]))
    median, p99, most = np.percentile(waits, [50, 99, 100])
    print(
        f"From stillness (last frame of the window) to the answer, N = {touches}: median "
        f"{median:.1f} ms, p99 {p99:.1f} ms, maximum {most:.1f} ms; promised p99 {PROMISED_MS:g} ms"
    )
    median, p99, most = np.percentile(own, [50, 99, 100])
    print(
        f"Of which from the durable point to the answer: median {median:.1f} ms, p99 {p99:.1f} ms, "
        f"maximum {most:.1f} ms"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
