"""How the window keeps up with 8 kHz: frames a second, latency of its event loop, time to close.

The whole chain runs in one process as in the demo: virtual rig, tracking, session and window. A
thread posts an event to the window every 5 ms; the latency is the time until it is handled. The
third row measures the same while a finished job is opened and the running one is reported, as often
as the time allows.

Run ``python -m benchmarks.window [SECONDS] [JOB]``; the exit code is 1 if a limit is missed. JOB is
a finished job file to be opened, of about 100 points; without it the third row is left out.
"""

from __future__ import annotations

import os
import sys
import tempfile
import threading
import time
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal

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


class Probe(QObject):
    """Posts time stamps from a thread of its own and measures how late they are handled."""

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
        self._window.sheets.open_results()
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


def measure(
    station: MeasuringStation, seconds: float, out: Path, *, far: bool, job: Path | None = None
) -> tuple[float, float, float]:
    """Return frames a second, p99 of the latency (s) and time to close (s) of one run."""
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
    reporter = None if job is None else Reporter(window, job)

    def begin() -> None:
        probe.start()
        if reporter is not None:
            reporter.begin()
        paints.count = shown[0] = 0
        began[0] = time.perf_counter()

    def end() -> None:
        began[1] = time.perf_counter()
        probe.stop()
        if reporter is not None:
            reporter.end()
            print(f"       {reporter.opened} jobs opened, {reporter.written} reports written")
        window.close()

    QTimer.singleShot(round(1000 * WARM_UP_S), begin)
    QTimer.singleShot(round(1000 * (WARM_UP_S + seconds)), end)
    bridge.start()
    app.exec()
    # Digits of the far view change 12 times a second on purpose; there the updates count.
    hidden = far or reporter is not None
    frames = shown[0] if hidden else min(paints.count, shown[0])
    rate = frames / (began[1] - began[0])
    return rate, float(np.quantile(probe.latencies, 0.99)), window.close_seconds


def main() -> int:
    """Print the table and return the exit code."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    job = Path(sys.argv[2]) if len(sys.argv) > 2 else None
    ok = True
    print("view   frames/s (>= 30)  p99 latency (<= 50 ms)  close (<= 2 s)  left behind")
    for name in ("desk", "far", *(() if job is None else ("report",))):
        with tempfile.TemporaryDirectory() as out:
            built = build_station(
                StationRequest(
                    plan=resource("plans", "demo.toml"), out=Path(out), speed=1.0, stay=True
                )
            )
            rate, latency, close = measure(
                built.station,
                seconds,
                Path(out),
                far=name == "far",
                job=job if name == "report" else None,
            )
        left = [t.name for t in threading.enumerate() if t is not threading.main_thread()]
        print(
            f"{name:<6} {rate:16.1f}  {1e3 * latency:19.1f} ms  {close:12.2f} s  "
            f"{', '.join(left) or 'nothing'}"
        )
        in_time = rate >= MIN_FRAMES_PER_S and latency <= MAX_LATENCY_S and close <= MAX_CLOSE_S
        ok = ok and in_time and not left
    return 0 if ok else 1


if __name__ == "__main__":
    sys.exit(main())
