"""Time from a still ball to the answer of ``PtMeas``: ``python -m benchmarks.ippdme [TOUCHES]``.

A point is complete with the last frame of its window; the answer is timed where the client reads
it. The frame is dated by the first look in which the station has it. The virtual rig runs in real
time, so wall times hold for this computer with its load. Shares of each answer: the disk (write
and fsync), and the processor time of the two threads that make it, which depends on no load
(Linux: ``schedstat``). What is left is the wait for a processor.
"""

from __future__ import annotations

import os
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ocmm_core.blas import use_one_thread

# As the command does; with two threads the drift monitor takes twenty times its processor time.
use_one_thread()

import numpy as np  # noqa: E402 - after the line above

from ocmm_core.measuring import MeasuredPoint  # noqa: E402 - as above
from ocmm_core.storage import JobFile  # noqa: E402 - as above
from tests.serve.ippdme_client import session  # noqa: E402 - as above
from tests.serve.ippdme_station import served_station  # noqa: E402 - as above

_LOOK_S = 0.0005
PROMISED_MS = 100.0
_THREADS = ("ocmm-reconstruction", "ocmm-serve")
"""They make an answer, one after the other."""


class FrameClock:
    """Remember when each frame had been measured; a thread, a context manager."""

    def __init__(self, newest: Callable[[], int]) -> None:
        self._newest = newest
        self._ended = threading.Event()
        self._seen: list[tuple[int, float, float]] = [(-1, time.monotonic(), 0.0)]
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
                self._seen.append((frame, time.monotonic(), used_s()))

    def time_of(self, frame: int) -> tuple[float, float]:
        """Return when a frame had been measured, at the latest, and `used_s` then."""
        while self._seen[-1][0] < frame:
            # A busy computer keeps this clock waiting longer than the answer.
            time.sleep(_LOOK_S)
        return next((at, used) for newest, at, used in self._seen if newest >= frame)


def used_s(*numbers: int, waiting: bool = False) -> float:
    """Return the processor time of threads, or their wait for a processor; by default of an answer.

    0 if the system does not tell.
    """
    found = numbers or [one.native_id for one in threading.enumerate() if one.name in _THREADS]
    try:
        texts = [Path(f"/proc/self/task/{number}/schedstat").read_text() for number in found]
    except OSError:
        return 0.0
    return sum(int(text.split()[int(waiting)]) for text in texts) * 1e-9


@contextmanager
def timed_disk() -> Iterator[list[tuple[float, float]]]:
    """Yield start and wait for the disk (write and fsync) of each step of a job, s."""
    found: list[tuple[float, float]] = []

    def timed(step: Callable[..., None]) -> Callable[..., None]:
        def run(*args: Any, **options: Any) -> None:
            own = threading.get_native_id()
            start, busy = time.monotonic(), used_s(own) + used_s(own, waiting=True)
            try:
                step(*args, **options)
            finally:
                wall = time.monotonic() - start
                found.append((start, wall - (used_s(own) + used_s(own, waiting=True) - busy)))

        return run

    plain = JobFile.change, JobFile.append_event
    # A probe of this benchmark.
    JobFile.change = timed(JobFile.change)  # type: ignore[method-assign]
    JobFile.append_event = timed(JobFile.append_event)  # type: ignore[method-assign]
    try:
        yield found
    finally:
        JobFile.change, JobFile.append_event = plain  # type: ignore[method-assign]


def _tell(what: str, values: list[float]) -> None:
    median, p99, most = np.percentile(1000.0 * np.array(values), [50, 99, 100])
    print(f"{what}: median {median:.1f} ms, p99 {p99:.1f} ms, maximum {most:.1f} ms")


def main(touches: int) -> None:
    """Print median, 99th percentile and maximum, and the shares."""
    waits: list[float] = []
    own: list[float] = []
    disk: list[float] = []
    busy: list[float] = []
    taken: list[tuple[MeasuredPoint, float]] = []
    loads = [os.getloadavg()[0]]
    with (
        tempfile.TemporaryDirectory() as folder, timed_disk() as steps,
        served_station(Path(folder), speed=1.0) as served,
    ):  # fmt: skip
        station = served.built.station
        station.events.point_taken.connect(lambda point: taken.append((point, time.monotonic())))
        clock = FrameClock(lambda: station.looks.live().frame_counter)
        with clock, session(served.address) as client:
            client.good("Home()")
            client.good('ChangeTool("standard")')
            for number in range(touches):
                x, y = (number % 9 - 4) * 5.0, (number // 9 % 9 - 4) * 5.0
                done = client.good(f"PtMeas(X({x}), Y({y}), Z(0), IJK(0, 0, 1))")
                used = used_s()
                point, durable_s = taken[-1]
                still_s, used_before = clock.time_of(point.last_frame)
                waits.append(done.answered_s - min(still_s, durable_s))
                own.append(done.answered_s - durable_s)
                disk.append(sum(took for start, took in steps if start > still_s))
                busy.append(used - used_before)
                steps.clear()
            overruns = station.looks.acquisition().overrun
    loads.append(os.getloadavg()[0])
    print(
        f"N = {touches}, {os.cpu_count()} processors, load {loads[0]:.1f} to {loads[1]:.1f}, "
        f"{overruns} frames dropped"
    )
    _tell(f"From stillness to the answer (promised p99 {PROMISED_MS:g} ms)", waits)
    _tell("Of which from the durable point to the answer", own)
    _tell("Of which the disk (write and fsync)", disk)
    _tell("Of which processor time", busy)
    share = 100.0 * sum(disk) / sum(waits)
    late = sum(one > PROMISED_MS * 1e-3 for one in waits)
    print(f"Share of the disk {share:.0f} %; later than {PROMISED_MS:g} ms: {late} of {touches}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
