"""The lane "names" of the reliability campaign in the window instead of the command line.

Each trial is a program of its own: `ocmm_gui.app.main` on an offscreen screen and the virtual rig.
At a random moment the job file, its log or its folder is removed, moved, replaced, emptied or
overwritten, its file system is unmounted (root), or its disk filled. "Told" is the banner painted
with the cause. Then E asks for a report, and the window is closed; a quarter of them are closed at
once.
Run: ``python -m benchmarks.window_names --n 300``; exit code 1 for a finding.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections import Counter
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
# As the program does (`ocmm_core.blas`), before numpy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from PySide6.QtCore import QEvent, QObject, QSocketNotifier, QTimer
from PySide6.QtWidgets import QApplication

from ocmm_bench.campaign import lose_name, measure_job, other_station, possible_losses
from ocmm_core.composition import RECOMMENDED_RIG
from ocmm_core.documents import resource
from ocmm_gui.app import main as run_window
from ocmm_gui.app import make_application
from ocmm_gui.window import MainWindow

TRIALS = 300
RATE_HZ = 500
_POLL_MS = 10
_PATIENCE_MS = 120_000


class Driver(QObject):
    """Watch a window as an inspector does, and close it at the end of the trial."""

    def __init__(self, app: QApplication, jobs: Path, pipe: int, stopping: int) -> None:
        super().__init__()
        self._jobs, self._pipe = jobs, pipe
        self._window: MainWindow | None = None
        self._told = False
        self._stop = QSocketNotifier(stopping, QSocketNotifier.Type.Read, app)
        self._stop.activated.connect(self._ask_for_report)
        self._stop.setEnabled(False)
        self._timer = QTimer(app)
        self._timer.timeout.connect(self._look)
        self._timer.start(_POLL_MS)

    def say(self, line: str) -> None:
        """Write a line for the program that judges the trial."""
        os.write(self._pipe, f"{line}\n".encode())

    def end(self) -> None:
        """Report the loss as shown by the window, and reports that must not exist."""
        if self._window is None:
            return
        station = self._window._bridge.station  # noqa: SLF001 - the window gives its station to no one
        lost = station.job.lost
        if lost is not None:
            self.say(f"lost {lost.what}")
            for folder in self._jobs.parent.glob("*/"):
                if any(path.suffix == ".txt" for path in folder.glob("*")):
                    self.say("report")

    def _look(self) -> None:
        shown = [w for w in QApplication.topLevelWidgets() if isinstance(w, MainWindow)]
        if not shown:
            return
        self._timer.stop()
        self._window = shown[0]
        self._window.banner.installEventFilter(self)
        events = self._window._bridge.station.events  # noqa: SLF001 - as above
        self.say("made")
        events.point_taken.connect(lambda point: self.say(f"point {point.number}"))
        self._stop.setEnabled(True)
        QTimer.singleShot(_PATIENCE_MS, self._window.close)

    def eventFilter(self, banner: QObject, event: QEvent) -> bool:  # noqa: N802 - named by Qt
        """Report the loss when the banner is painted with its cause."""
        window = self._window
        if window is None or self._told or event.type() is not QEvent.Type.Paint:
            return False
        fault = window._bridge.station.faults.measuring  # noqa: SLF001 - as above
        if fault is not None and fault.error.what.split(". ")[0] in window.banner.text():
            self._told = True
            self.say("failed")
        return False

    def _ask_for_report(self) -> None:
        self._stop.setEnabled(False)
        if self._window is not None:
            self._window.actions_by_key["export"].trigger()
            QTimer.singleShot(0, self._window.close)


def measure_in_window(jobs: Path, pipe: int, stopping: int) -> None:
    """Measure the short plan in the window until ``stopping`` is closed; does not return."""
    rig = jobs.parent / "rig.toml"
    rig.write_text(RECOMMENDED_RIG.read_text("utf-8").replace("8000", str(RATE_HZ)), "utf-8")
    driver = Driver(make_application(), jobs, pipe, stopping)
    arguments = ["--silent", "--size", "1280x720", "--speed", "0", "--out", str(jobs)]
    arguments += ["--plan", str(resource("plans", "quick.toml")), "--rig", str(rig)]
    code = 3
    try:
        code = run_window(arguments)
        driver.end()
    finally:
        os._exit(code)


def main(arguments: list[str] | None = None) -> int:
    """Run the trials, print the findings, and return 1 if there are any."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--n", type=int, default=TRIALS)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    kinds = possible_losses()
    found, tried, acknowledged = Counter[str](), Counter[str](), 0
    with tempfile.TemporaryDirectory() as name, other_station(Path(name) / "home"):
        folder = Path(name)
        # Every copy of this program is warm then.
        measure_job(folder / "warm", None)
        for number in range(given.n):
            kind = kinds[number % len(kinds)]
            trial = lose_name(folder / f"{number}", given.seed, number, kind, measure_in_window)
            tried[kind] += 1
            acknowledged += trial.acknowledged
            found.update(trial.found)
            told = trial.note if trial.found else f"shown after {trial.note or '-'} s"
            print(f"{number}: {kind}: {dict(trial.found)} {told}", flush=True)
    for kind, count in sorted(tried.items()):
        print(f"{count:5}  {kind}")
    print(f"{given.n} windows, {acknowledged} acknowledged points: {dict(found) or 'no findings'}")
    print(f"3/N {3 / given.n:.1e}")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
