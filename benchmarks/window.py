"""How the window keeps up with 8 kHz: frames a second, latency of its event loop, time to close.

The whole chain runs in one process as in the demo: virtual rig, tracking, session and window. A
thread posts an event to the window every 5 ms; the latency is the time until it is handled. The
third row measures the same while a finished job is opened and the running one is reported, as often
as the time allows.

Run ``python -m benchmarks.window [SECONDS] [JOB] [--points N]``; the exit code is 1 if a limit is
missed. JOB is a finished job file to be opened, of about 100 points; without it the third row is
left out, unless the running job is a large one: with N points more, of spheres with 20 points each
(500 spheres at most), it goes on with them, and such a job is opened in the third row. Memory is
what the process holds at the end of each row, and how much more than after its first third.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal

from benchmarks.large_jobs import write_large_job
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.station import MeasuringStation
from ocmm_gui.app import make_application
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import NoticeCentre
from ocmm_gui.window import MainWindow

SECONDS = 20.0
WARM_UP_S = 5.0
POST_EVERY_S = 0.005
MIN_FRAMES_PER_S = 30.0
MAX_LATENCY_S = 0.050
MAX_CLOSE_S = 2.0
_POINTS_EACH, _MOST_SPHERES = 20, 500


class Probe(QObject):
    """Posts time stamps from a separate thread and measures the delay of their handling."""

    posted = Signal(float)

    def __init__(self) -> None:
        super().__init__()
        self.latencies: list[float] = []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._post, name="benchmark-post")
        self.posted.connect(self._handle, Qt.ConnectionType.QueuedConnection)

    def start(self) -> None:
        """Begin to post."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._stop.set()
        self._thread.join()

    def _post(self) -> None:
        while not self._stop.wait(POST_EVERY_S):
            self.posted.emit(time.perf_counter())

    def _handle(self, posted_at: float) -> None:
        self.latencies.append(time.perf_counter() - posted_at)


class PaintCounter(QObject):
    """Counts how often a widget is painted."""

    def __init__(self) -> None:
        super().__init__()
        self.count = 0

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802 - Qt's name
        """Count, and let the event pass."""
        if event.type() is QEvent.Type.Paint:
            self.count += 1
        return False


class Reporter:
    """Opens a job and writes the report of the running one, again and again.

    Parameters
    ----------
    window
        Its results page is shown.
    job
        A finished job file.
    """

    def __init__(self, window: MainWindow, job: Path) -> None:
        self._window, self._job = window, job
        self.opened = self.written = 0
        window.output.exported.connect(self._on_written)
        self._timer = QTimer(window)
        self._timer.timeout.connect(self._go_on)

    def begin(self) -> None:
        """Open the results page and begin."""
        self._window.sheets.show_sheet("results")
        self._timer.start(50)

    def end(self) -> None:
        """Begin nothing more."""
        self._timer.stop()

    def _go_on(self) -> None:
        results, output = self._window.sheets.results, self._window.output
        if results.is_opening() or output.is_writing():
            return
        if output.question.isVisible():
            output.question.agree()
        elif self.opened <= self.written:
            self.opened += 1
            results.open_file(self._job)
        else:
            output.calls()["export"]()

    def _on_written(self) -> None:
        self.written += 1


@dataclass(frozen=True, slots=True)
class Run:
    """Frames a second, p99 of the latency (s), time to close (s), memory and its growth (MB)."""

    rate: float
    latency: float
    close: float
    memory: float
    grown: float


def measure(
    station: MeasuringStation, seconds: float, out: Path, *, far: bool, job: Path | None = None
) -> Run:
    """Return what one run shows."""
    app = make_application()
    bridge = StationBridge(station)
    window = MainWindow(bridge, NoticeCentre(), out=out / "report")
    window.resize(1920, 1080)
    window.show_far(far)
    window.show()
    probe, paints, shown = Probe(), PaintCounter(), [0]
    window.desk.points.installEventFilter(paints)
    bridge.live_changed.connect(lambda _live: shown.__setitem__(0, shown[0] + 1))
    began = [0.0, 0.0]
    held: list[float] = []
    reporter = None if job is None else Reporter(window, job)

    def begin() -> None:
        probe.start()
        if reporter is not None:
            reporter.begin()
        paints.count = shown[0] = 0
        began[0] = time.perf_counter()

    def end() -> None:
        began[1] = time.perf_counter()
        held.append(held_mb())
        probe.stop()
        if reporter is not None:
            reporter.end()
            print(f"       {reporter.opened} jobs opened, {reporter.written} reports written")
        window.close()

    QTimer.singleShot(round(1000 * WARM_UP_S), begin)
    third = WARM_UP_S + seconds / 3.0
    QTimer.singleShot(round(1000 * third), lambda: held.append(held_mb()))
    QTimer.singleShot(round(1000 * (WARM_UP_S + seconds)), end)
    bridge.start()
    app.exec()
    # Digits of the far view change 12 times a second on purpose; there the updates count.
    hidden = far or reporter is not None
    frames = shown[0] if hidden else min(paints.count, shown[0])
    rate = frames / (began[1] - began[0])
    latency = float(np.quantile(probe.latencies, 0.99))
    return Run(rate, latency, window.close_seconds, held[1], held[1] - held[0])


def held_mb() -> float:
    """Return the memory that this process holds, MB."""
    pages = int(Path("/proc/self/statm").read_text("ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _spheres(points: int) -> int:
    return min(points // _POINTS_EACH, _MOST_SPHERES)


def begun(folder: Path, points: int) -> StationRequest:
    """Return the demonstration, or a large job that goes on with it."""
    demo = resource("plans", "demo.toml")
    if not points:
        return StationRequest(plan=demo, out=folder, speed=1.0, stay=True)
    plan, job = write_large_job(folder, points, _spheres(points), demo)
    return StationRequest(plan=plan, out=folder, speed=1.0, stay=True, resume=job)


def main() -> int:
    """Print the table and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seconds", type=float, nargs="?", default=SECONDS)
    parser.add_argument("job", type=Path, nargs="?")
    parser.add_argument("--points", type=int, default=0)
    options = parser.parse_args()
    ok = True
    print("view   frames/s (>= 30)  p99 latency (<= 50 ms)  close (<= 2 s)  memory  left behind")
    with tempfile.TemporaryDirectory(prefix="ocmm-window-") as name:
        job = options.job
        if job is None and options.points:
            opened = Path(name) / "opened"
            opened.mkdir()
            job = write_large_job(opened, options.points, _spheres(options.points))[1]
        for view in ("desk", "far", *(() if job is None else ("report",))):
            folder = Path(name) / view
            folder.mkdir()
            found = measure(
                build_station(begun(folder, options.points)).station,
                options.seconds,
                folder,
                far=view == "far",
                job=job if view == "report" else None,
            )
            left = [t.name for t in threading.enumerate() if t is not threading.main_thread()]
            print(
                f"{view:<6} {found.rate:16.1f}  {1e3 * found.latency:19.1f} ms  "
                f"{found.close:12.2f} s  {found.memory:.0f} MB ({found.grown:+.0f})  "
                f"{', '.join(left) or 'nothing'}"
            )
            in_time = (
                found.rate >= MIN_FRAMES_PER_S
                and found.latency <= MAX_LATENCY_S
                and found.close <= MAX_CLOSE_S
            )
            ok = ok and in_time and not left
    return 0 if ok else 1


if __name__ == "__main__":
    sys.exit(main())
