"""The soak in lock-step: the virtual wire waits for the computer, so every cycle is exercised.

As `ethercat:virtual` runs it: master and cameras share a time that goes on from cycle to cycle and
stands still in between (`ocmm_core.acquisition.bus_process._process`). A computer that stalls
makes the bus slower and loses nothing, so whatever is lost, doubled or old here was lost by the
program: master, books, judge, queues, ring, reconstruction and window are those of a real bus.
What it cannot show is the latency of a real computer; the soak in real time is for that.

Beside the books of the bus process an observer looks at every frame that the station takes out of
the ring: exposure numbers follow each other without a gap (lost) and without a repetition or a step
back (stale), each time is one period after the one before, and of one block in `SAMPLE` the pixels
are those that the rig shows at that very exposure.
Run: ``python -m benchmarks.soak --stepped [BUS_SECONDS [AT_MOST_SECONDS]]``.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QTimer

from benchmarks.soak_books import (
    GROWTH_MIB,
    GROWTH_MIB_AN_HOUR,
    STEADY_S,
    Row,
    Usage,
    children_of,
    counters,
    mapped_ring,
    once_in_operation,
    taken_by_station,
)
from benchmarks.soak_observer import Observer, run_observed
from ocmm_core.acquisition.frames import FrameRing, read_status
from ocmm_core.camera import load_rig
from ocmm_core.composition import DEMO_PLAN, RECOMMENDED_RIG, StationRequest, build_station
from ocmm_core.fieldbus.report import decode_report
from ocmm_core.inspection.plan import load_plan
from ocmm_gui.app import make_application
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import NoticeCentre
from ocmm_gui.window import MainWindow
from ocmm_sim.scene import RigScript, decode_script
from ocmm_sim.sources import segment_of

BUS_SECONDS, AT_MOST_S = 1800.0, 7200.0
START_S, SAMPLE_S, MOST_SAMPLES = 120.0, 2.0, 300


def processes() -> dict[str, int]:
    """Return the numbers of the processes of the virtual bus, which this one has started."""
    found: dict[str, int] = {}
    left = [os.getpid()]
    while left:
        for child, words in children_of(left.pop()):
            if b"_virtual_bus" in words:
                found["cameras"] = child
            elif b"bus_process._start" in words:
                found["bus"] = child
            left.append(child)
    return found


@dataclass(slots=True)
class Soak:
    """A run that is under way, and what came of it."""

    seconds: float
    at_most_s: float
    ring: FrameRing
    observer: Observer
    usage: dict[str, Usage]
    begun_s: float = 0.0
    lasted_s: float = 0.0
    first: dict[str, int] | None = None
    last: dict[str, int] | None = None

    def begin(self) -> None:
        """Count from now on."""
        self.observer.clear()
        self.first, self.begun_s = counters(read_status(self.ring)), time.monotonic()

    def look(self) -> bool:
        """Take a sample; return whether the run is at its end."""
        assert self.first is not None
        now, self.lasted_s = counters(read_status(self.ring)), time.monotonic() - self.begun_s
        pids = processes() | {"window": os.getpid()}
        for name, held in self.usage.items():
            held.look(pids[name], self.lasted_s)
        self.last = now
        done = now["elapsed"] - self.first["elapsed"]
        if int(self.lasted_s) % 60 < SAMPLE_S:
            sys.stderr.write(
                f"{self.lasted_s:.0f} s: {done} cycles, {self.observer.frames} frames, "
                f"lost {now['frames_lost']}, stale {self.observer.stale}\n"
            )
        return done >= 1000.0 * self.seconds or self.lasted_s > self.at_most_s


def play(folder: Path, seconds: float, at_most_s: float) -> tuple[Soak, str]:
    """Play the run and return it with the notes of the bus process."""
    request = StationRequest(
        plan=DEMO_PLAN, out=folder / "jobs", source="ethercat:virtual", uncalibrated=True
    )
    segment = segment_of(request, load_plan(DEMO_PLAN), load_rig(RECOMMENDED_RIG))
    app = make_application()
    station = build_station(request).station
    ring = mapped_ring()
    observer = Observer(decode_script(bytes(segment.provider), RigScript).build(), 125_000)
    names = ("window", "bus", "cameras")
    soak = Soak(seconds, at_most_s, ring, observer, {name: Usage() for name in names})
    bridge = StationBridge(station)
    window = MainWindow(bridge, NoticeCentre())
    window.resize(1920, 1080)
    window.show()
    sampling = QTimer()
    sampling.setInterval(round(1000 * max(SAMPLE_S, min(seconds, at_most_s) / MOST_SAMPLES)))

    def begin() -> None:
        soak.begin()
        sampling.start()

    def sample() -> None:
        if soak.look():
            sampling.stop()
            window.close()

    sampling.timeout.connect(sample)
    once_in_operation(station, ring, START_S, begin, window.close)
    run_observed(app, bridge, station, observer)
    report, status = decode_report(ring.report()), read_status(ring)
    ring.close()
    if soak.last is None or report is None:
        raise RuntimeError(f"the bus did not come to operation: {status.message}")
    return soak, "; ".join(report.notes) or "nothing"


def judge(soak: Soak) -> list[Row]:
    """Return the table."""
    first, last, seen = soak.first, soak.last, soak.observer
    assert first is not None
    assert last is not None
    more = {name: last[name] - first[name] for name in last}
    verdicts = sum(more[name] for name in ("good", "late", "lost", "bad"))
    rows = [
        Row("cycles in one account each", f"{verdicts}", f"= {more['elapsed']}",
            verdicts == more["elapsed"]),
        *(Row(f"cycles {name}", f"{more[name]}", "= 0", not more[name])
          for name in ("late", "lost", "bad")),
        Row("frames lost by the books", f"{more['frames_lost']}", "= 0", not more["frames_lost"]),
        Row("frames that the ring lost", f"{more['overrun']}", "= 0", not more["overrun"]),
        taken_by_station(seen.frames, more["frames"] - more["overrun"]),
        Row("exposures missing at the reader", f"{seen.gaps}", "= 0", not seen.gaps),
        Row("frames stale or repeated", f"{seen.stale}", "= 0", not seen.stale),
        Row("frames not a period later", f"{seen.untimely}", "= 0", not seen.untimely),
        Row(f"pixels not of their exposure of {seen.compared}", f"{seen.differing}", "= 0",
            not seen.differing and seen.compared > 0),
    ]  # fmt: skip
    # Deliberate buffers of a window fill by bus time, which a busy computer stretches: the second
    # half is judged, not the time after a fixed delay.
    is_long, half_s = soak.lasted_s >= 2.0 * STEADY_S, 0.5 * soak.lasted_s
    for process, held in soak.usage.items():
        what = "MiB an hour in the second half" if is_long else "MiB in 10 minutes"
        grown = held.growth_mib(half_s, 3600.0) if is_long else held.growth_mib(0.0, 600.0)
        allowed = GROWTH_MIB_AN_HOUR if is_long else GROWTH_MIB[process]
        rows.append(
            Row(f"{process}: {what}", f"{grown:+.2f}", f"<= {allowed:.0f}", grown <= allowed)
        )
        for what in ("threads", "descriptors"):
            counts = getattr(held, what)
            rows.append(Row(f"{process}: {what}", f"{counts[-1] - counts[0]:+d}", "<= 0",
                            counts[-1] <= counts[0]))  # fmt: skip
    return rows


def main(arguments: list[str]) -> int:
    """Play it, print the table and return the exit code."""
    seconds = float(arguments[0]) if arguments else BUS_SECONDS
    at_most_s = float(arguments[1]) if len(arguments) > 1 else AT_MOST_S
    with tempfile.TemporaryDirectory() as folder:
        soak, notes = play(Path(folder), seconds, at_most_s)
    rows = judge(soak)
    assert soak.first is not None
    assert soak.last is not None
    cycles = soak.last["elapsed"] - soak.first["elapsed"]
    print(
        f"== in lock-step: {cycles} cycles of 1 ms of bus time in {soak.lasted_s:.0f} s (pace "
        f"{cycles / 1000.0 / max(soak.lasted_s, 1e-9):.2f}), {soak.observer.frames} frames taken "
        f"by the station; not allowed to the bus process: {notes}"
    )
    for process, held in soak.usage.items():
        print(f"{process}: {held.words()}")
    for row in rows:
        print(f"{row.name:44s} {row.value:>14s}  {row.limit:16s} {'ok' if row.kept else 'BROKEN'}")
    whole = cycles >= 1000.0 * seconds
    if not whole:
        print(f"ended after {at_most_s:.0f} s: {100.0 * cycles / (1000.0 * seconds):.0f} % of it")
    return 0 if all(row.kept for row in rows) else 1
