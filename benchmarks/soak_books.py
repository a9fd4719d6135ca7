"""The accounts of a soak: the counts of each side, their memory, and their agreement."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np
from PySide6.QtCore import QTimer

from benchmarks.faulty_line import LineLog, LineOrder, LineRule
from ocmm_core.acquisition.frames import AcquisitionStatus, FrameRing
from ocmm_core.acquisition.recording import HISTORY_S
from ocmm_core.fieldbus.report import BusPhase, BusReport, Histogram, decode_report
from ocmm_core.station import MeasuringStation

LOST_WITHOUT_PRIORITY = 0.001
LOST_WITH_DROPS = 0.001
GROWTH_MIB = {"bus": 1.0, "cable": 1.0, "cameras": 16.0, "window": 32.0}
"""In ten minutes, by the slope. The cameras compute their pictures ahead, and the window keeps
traces and, while it measures, the job; both end, but not within a short run."""
GROWTH_MIB_AN_HOUR = 1.0
"""Of every process, once it has run for `STEADY_S`."""
STEADY_S = 600.0
UNDER_WAY = 16_000
"""Frames allowed between bus process and station when the counters are read: two seconds, for a
loaded computer."""
WARM_UP_S = 10.0
"""Until here code is compiled, pages are touched and the window is laid out."""
_FILLED_S = HISTORY_S + 5.0
"""The window keeps the frames of so long; until then its memory grows on purpose."""
_LONG_S = 2.0 * STEADY_S
_PAGE_MIB = os.sysconf("SC_PAGE_SIZE") / 2**20


class Usage(msgspec.Struct):
    """What one process held over a run: MiB, threads, descriptors, by time in seconds."""

    times: list[float] = msgspec.field(default_factory=list)
    mib: list[float] = msgspec.field(default_factory=list)
    threads: list[int] = msgspec.field(default_factory=list)
    descriptors: list[int] = msgspec.field(default_factory=list)

    def look(self, pid: int, now: float) -> None:
        """Take a sample."""
        process = Path("/proc", str(pid))
        resident = int((process / "statm").read_text(encoding="ascii").split()[1])
        self.times.append(now)
        self.mib.append(resident * _PAGE_MIB)
        self.threads.append(len(list((process / "task").iterdir())))
        self.descriptors.append(len(list((process / "fd").iterdir())))

    def growth_mib(self, begin_s: float, duration_s: float) -> float:
        """Return the growth in a duration by the straight line through the samples from then on."""
        kept = [at for at, when in enumerate(self.times) if when >= begin_s]
        if len(kept) < 3:
            return 0.0
        line = np.polyfit([self.times[at] for at in kept], [self.mib[at] for at in kept], 1)
        return float(line[0] * duration_s)

    def words(self) -> str:
        """Return the memory at the start and after each quarter."""
        picked = [self.mib[round(at * (len(self.mib) - 1) / 4)] for at in range(5)]
        return (
            f"MiB {' '.join(f'{one:.1f}' for one in picked)}; "
            f"threads {self.threads[0]} to {self.threads[-1]}"
        )


class Outcome(msgspec.Struct):
    """Results of one run.

    Attributes
    ----------
    seconds
        From the first reading of the counters to the last.
    status, first
        Counters at the end, with all processes stopped, and at the start of the run.
    report
        Final output of the bus process.
    exchanged, spoilt
        Cycles on the wire, and those with a dropped answer.
    answers, dropped
        Answers with process data on the wire, and those dropped.
    freezes
        Number of freezes of the window.
    usage
        Resources by process.
    frames, gaps, stale
        Read by the station from the ring: frames, missing exposures, and frames not later than
        their predecessor.
    """

    seconds: float
    status: dict[str, int]
    first: dict[str, int]
    report: BusReport
    exchanged: int
    spoilt: int
    answers: int
    dropped: int
    freezes: int
    usage: dict[str, Usage]
    frames: int
    gaps: int
    stale: int

    def during(self, name: str) -> int:
        """Return the increase of a counter during the run."""
        return self.status[name] - self.first[name]


@dataclass(slots=True)
class Cable:
    """The cable's control socket and everything that it has written down so far."""

    control: Path
    ask: socket.socket
    exchanged: int = 0
    answers: int = 0
    dropped: int = 0
    spoilt: set[int] = field(default_factory=set)

    def order(self, rules: tuple[LineRule, ...] | None = None) -> None:
        """Set its rules, or clear them, and take its log."""
        order = LineOrder(rules=rules, new_log=True)
        self.ask.sendto(msgspec.json.encode(order), str(self.control))
        log = msgspec.json.decode(self.ask.recv(1 << 20), type=LineLog)
        assert not log.error, log.error
        self.exchanged = max(self.exchanged, log.heartbeats[1])
        self.answers += log.seen.get("answer process", 0)
        self.dropped += log.done.get("answer process drop", 0)
        # Number zero belongs to a bring-up, before there are cycles.
        self.spoilt |= {frame.heartbeat for frame in log.touched if frame.heartbeat > 0}


class WakeUps:
    """Wake-up latency of this computer, measured by the doctor's method in another process.

    A control for the run: a cycle that is late in both was delayed by the computer.
    """

    def __init__(self, seconds: float) -> None:
        self._process = subprocess.Popen(  # noqa: S603 - our own interpreter and modules, no shell
            [sys.executable, "-m", "ocmm_core.doctor._wake", str(seconds), "-1"],
            stdout=subprocess.PIPE,
        )

    def words(self) -> str:
        """Wait until it has measured, and return its findings."""
        content, _ = self._process.communicate()
        seen: dict[str, float] = msgspec.json.decode(content)
        late = 100.0 * seen["missed"] / seen["cycles"]
        return (
            f"us {seen['p50_us']:.0f} in the median, 99 % within {seen['p99_us']:.0f}, 99.9 % "
            f"within {seen['p999_us']:.0f}, worst {seen['max_us']:.0f}; {seen['missed']:.0f} of "
            f"{seen['cycles']:.0f} ({late:.3f} %) a whole cycle late"
        )


def counters(status: AcquisitionStatus) -> dict[str, int]:
    """Return what counts, by name."""
    names = ("elapsed", "good", "late", "lost", "bad", "frames", "frames_lost", "overrun")
    return {name: getattr(status, name) for name in names}


def mapped_ring() -> FrameRing:
    """Return the ring of this process, mapped once more: this one outlives the station."""
    for line in Path("/proc/self/maps").read_text(encoding="utf-8").splitlines():
        if "/ocmm-ring-" in line:
            return FrameRing.attach(line.split()[-1])
    raise RuntimeError("there is no ring")


def once_in_operation(
    station: MeasuringStation,
    ring: FrameRing,
    start_s: float,
    begin: Callable[[], object],
    give_up: Callable[[], object],
) -> None:
    """Call ``begin`` in the event loop, warmed up, once the station follows an operational bus.

    If it does not within ``start_s``, ``give_up`` is called instead.
    """
    until = time.monotonic() + start_s

    def look() -> None:
        report = decode_report(ring.report())
        follows = station.looks.live().frame_counter > 0
        if report is not None and report.phase is BusPhase.OPERATION and follows:
            QTimer.singleShot(round(1000 * WARM_UP_S), begin)
        elif time.monotonic() > until:
            give_up()
        else:
            QTimer.singleShot(100, look)

    QTimer.singleShot(0, look)


@dataclass(frozen=True, slots=True)
class Row:
    """A line of the table: what, its value, its limit, and whether it is kept."""

    name: str
    value: str
    limit: str
    kept: bool


def taken_by_station(frames: int, written: int) -> Row:
    """Return the line that says whether the station ran to the end.

    The counters of the bus do not show a reconstruction that has stopped.
    """
    return Row(
        "frames taken by the station",
        f"{frames}",
        f"= {written} +- {UNDER_WAY}",
        abs(written - frames) <= UNDER_WAY,
    )


def judge(name: str, seen: Outcome) -> list[Row]:
    """Return the table of one run."""
    whole, begun = sum(seen.report.round_trip.counts), sum(seen.report.lateness.counts)
    status = seen.status
    unanswered = begun - whole
    unasked = unanswered - seen.spoilt
    sum_of_verdicts = sum(status[verdict] for verdict in ("good", "late", "lost", "bad"))
    lost = seen.during("frames_lost")
    share = lost / max(1, lost + seen.during("frames"))
    limit = {
        "undisturbed": 0.0 if not any("priority" in n for n in seen.report.notes) else
        LOST_WITHOUT_PRIORITY,
        "1 % of answers dropped": LOST_WITH_DROPS,
    }.get(name, 0.0)  # fmt: skip
    rows = [
        Row("cycles in one account each", f"{sum_of_verdicts}", f"= {status['elapsed']}",
            sum_of_verdicts == status["elapsed"]),
        Row("cycles sent, by bus process", f"{begun}", f"= {seen.exchanged} by cable",
            begun == seen.exchanged),
        # An answer that is not lost on the wire but late counts as stray in the bus process.
        Row("answer late, none dropped", f"{unasked}", f"0 to {seen.report.stray_answers} strays",
            0 <= unasked <= seen.report.stray_answers),
        Row("cycles refused or lost", f"{status['lost'] + status['bad']}",
            f">= {unanswered} without answer", status["lost"] + status["bad"] >= unanswered),
        Row("frames lost", f"{lost} ({100 * share:.4f} %)", f"<= {100 * limit:.1f} %",
            share <= limit),
        Row("frames that the ring lost", f"{seen.during('overrun')}", "= 0",
            seen.during("overrun") == 0),
        taken_by_station(seen.frames, seen.during("frames") - seen.during("overrun")),
        # Frames missing at the reader are those counted as lost, to the frame.
        Row("exposures missing at reader", f"{seen.gaps} of {seen.frames}", "<= lost + ring's",
            seen.gaps <= lost + seen.during("overrun") and seen.frames > 0),
        Row("frames stale or repeated", f"{seen.stale} of {seen.frames}", "= 0", not seen.stale),
    ]  # fmt: skip
    for process, held in seen.usage.items():
        is_long = seen.seconds >= _LONG_S
        what = f"MiB an hour after {STEADY_S:.0f} s" if is_long else "MiB in 10 minutes"
        begin_s = STEADY_S if is_long else _FILLED_S if process == "window" else 0.0
        grown = held.growth_mib(begin_s, 3600.0 if is_long else 600.0)
        allowed = GROWTH_MIB_AN_HOUR if is_long else GROWTH_MIB[process]
        rows.append(
            Row(f"{process}: {what}", f"{grown:+.2f}", f"<= {allowed:.0f}", grown <= allowed)
        )
        for what in ("threads", "descriptors"):
            counts = getattr(held, what)
            more = counts[-1] - counts[0] if counts else 0
            rows.append(Row(f"{process}: {what}", f"{more:+d}", "<= 0", more <= 0))
    return rows


def words(seen: Outcome) -> list[str]:
    """Return the lines above the table."""
    status, report = seen.status, seen.report
    notes = "; ".join(report.notes) or "nothing"
    return [
        f"{seen.seconds:.0f} s; not allowed to the bus process: {notes}",
        f"bus process: {status['elapsed']} cycles of 1 ms: {status['good']} good, "
        f"{status['late']} late, {status['lost']} lost, {status['bad']} bad; "
        f"{report.stray_answers} stray answers; {report.recoveries} recoveries",
        f"cable: {seen.exchanged} cycles, {seen.answers} answers, {seen.dropped} of them dropped "
        f"in {seen.spoilt} cycles; the window stood still {seen.freezes} times",
        f"frames in the run: {seen.during('frames')}, lost {seen.during('frames_lost')}",
        *(f"{process}: {held.words()}" for process, held in seen.usage.items()),
        f"cycle begins late   {text_of(report.lateness)}",
        f"answer takes        {text_of(report.round_trip)}",
    ]


def text_of(histogram: Histogram) -> str:
    """Return a histogram in one line."""
    total = max(1, sum(histogram.counts))
    bins = [
        f"<={edge:g}: {100 * count / total:.3g}%"
        for edge, count in zip(histogram.edges_us, histogram.counts, strict=False)
        if count
    ]
    beyond = histogram.counts[-1]
    more = f" >{histogram.edges_us[-1]:g}: {beyond}" if beyond else ""
    return f"us {' '.join(bins)}{more} (worst {histogram.worst_us:.0f})"


def children_of(pid: int) -> Iterator[tuple[int, bytes]]:
    """Yield the processes that a process has started and how each was called; some may just end."""
    for entry in Path("/proc", str(pid), "task").iterdir():
        # A thread or a process may be gone between two looks.
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            for child in map(int, (entry / "children").read_text(encoding="ascii").split()):
                yield child, Path("/proc", str(child), "cmdline").read_bytes()
