"""Rapid starts, restarts of cameras and bus, and links that flap: what became of them.

Each is played many times on real processes; part of ``benchmarks/fault_scenarios.py``.
"""

from __future__ import annotations

import os
import signal
import tempfile
import threading
import time
from pathlib import Path

import msgspec
import numpy as np

from benchmarks.camera_faults import FaultKind
from benchmarks.fault_list import LEFT, RIGHT
from benchmarks.fault_rig import FAR, HOST, NEAR, FaultRig
from ocmm_core.acquisition.bus_process import EthercatSource
from ocmm_core.acquisition.frames import (
    AcquisitionStatus,
    AcquisitionWorker,
    FrameRing,
    StopReason,
    read_status,
)
from ocmm_core.documents import write_atomic
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.cycle import BusSettings
from ocmm_core.fieldbus.report import decode_report
from tests.system.frame_watch import FrameWatch, Watched

CYCLE_NS = 1_000_000
GIVE_UP_S = 10.0
_POLL_S = 0.002
_LOOKS = 8
_RESTART_KINDS = 10
"""Of ten restarts one is of the process of the cameras, one of the bus process."""


class Starts(msgspec.Struct, kw_only=True):
    """Results of rapid starts and stops.

    Attributes
    ----------
    count
        Number of starts.
    ended
        Runs that stopped on request and in time.
    measured
        Runs that delivered frames before they stopped.
    frames, wrong
        Frames delivered in all runs, and those that should not have been.
    slowest_stop_s
        Longest time from request to end.
    descriptors, threads
        Increase since the first start.
    works
        Whether the last run, left undisturbed, delivered frames.
    messages
        Messages of the runs that ended in any other way.
    """

    count: int = 0
    ended: int = 0
    measured: int = 0
    frames: int = 0
    wrong: int = 0
    slowest_stop_s: float = 0.0
    descriptors: int = 0
    threads: int = 0
    works: bool = False
    messages: list[str] = msgspec.field(default_factory=list)


def play_starts(count: int, out: Path) -> None:
    """Start and stop the acquisition again and again, often before it is in operation."""
    random = np.random.default_rng(5)
    result = Starts(count=count)
    with tempfile.TemporaryDirectory() as folder, FaultRig(Path(folder), (LEFT, RIGHT)) as rig:
        before: tuple[int, int] | None = None
        for number in range(count + 1):
            last = number == count
            _start_once(result, 3.0 if last else float(random.uniform(0.0, 0.9)), last=last)
            now_open = (len(list(Path("/proc/self/fd").iterdir())), threading.active_count())
            before = before or now_open
            result.descriptors = now_open[0] - before[0]
            result.threads = now_open[1] - before[1]
        rig.line_log()
    write_atomic(out, msgspec.json.encode(result))


def _start_once(result: Starts, seconds: float, *, last: bool) -> None:
    ring = FrameRing.create(2)
    try:
        settings = BusSettings(HOST, (LEFT, RIGHT), 125_000, CYCLE_NS)
        worker = AcquisitionWorker(EthercatSource(settings), ring)
        watch, seen = FrameWatch(ring), Watched()
        worker.start()
        end = time.monotonic() + seconds
        while time.monotonic() < end and not (last and seen.frames):
            watch.look(seen)
            time.sleep(_POLL_S)
        asked = time.monotonic()
        worker.request_stop()
        in_time = worker.join(GIVE_UP_S)
        watch.look(seen)
        status = read_status(ring)
        requested = status.stop_reason is StopReason.REQUESTED
        if not requested:
            result.messages.append(status.message)
        result.ended += 0 if last else int(in_time and requested)
        result.works |= last and seen.frames > 0
        result.slowest_stop_s = max(result.slowest_stop_s, time.monotonic() - asked)
        result.measured += bool(seen.frames)
        result.frames += seen.frames
        result.wrong += seen.wrong
    finally:
        ring.close()


class Restarts(msgspec.Struct, kw_only=True):
    """Results of restarting the cameras and the bus process.

    Attributes
    ----------
    count, of_cameras, of_the_bus
        Number of restarts; the latter two restart whole processes.
    killed
        Restarts of the bus process that killed it; the others stopped it on request.
    looks, torn
        Reads of the counters meanwhile, and reads in which the cycles did not add up.
    elapsed, passed
        Cycles counted, and cycles expected from the system clock.
    back
        Restarts after which the bus became operational again.
    message
        Message of the bus process where it did not.
    """

    count: int = 0
    of_cameras: int = 0
    of_the_bus: int = 0
    killed: int = 0
    looks: int = 0
    torn: int = 0
    elapsed: int = 0
    passed: float = 0.0
    back: int = 0
    message: str = ""


def play_restarts(count: int, out: Path) -> None:
    """Restart cameras and bus repeatedly, and read the accounts all the time."""
    result = Restarts(count=count)
    with tempfile.TemporaryDirectory() as folder, FaultRig(Path(folder), (LEFT, RIGHT)) as rig:
        books = _BookWatch(rig, result)
        books.begin()
        for number in range(count):
            if not books.back():
                break
            kind = number % _RESTART_KINDS
            if kind == _RESTART_KINDS - 1:
                # Every second one is killed at any moment, including the first: its last page must
                # be whole.
                books.end(kill=number // _RESTART_KINDS % 2 == 0)
                result.of_the_bus += 1
                books.begin()
            elif kind == 0:
                rig.kill_cameras()
                books.disturbed()
                rig.start_cameras()
                result.of_cameras += 1
            else:
                rig.command(FaultKind.RESTART, number % 2)
                books.disturbed()
        books.back()
        books.end()
    write_atomic(out, msgspec.json.encode(result))


class _BookWatch:
    """Reads the accounts of consecutive bus processes."""

    def __init__(self, rig: FaultRig, result: Restarts) -> None:
        self._rig = rig
        self._result = result
        self._first: tuple[int, int] = (0, 0)
        self._wanted = 0

    def begin(self) -> None:
        """Start the bus process."""
        self._rig.start_bus()
        self._wanted = 0
        self._first = (self.look().elapsed, time.monotonic_ns())

    def disturbed(self) -> None:
        """Expect the bus to be brought up once more."""
        self._wanted = self._recoveries() + 1

    def back(self) -> bool:
        """Wait for operation, and read the accounts meanwhile; return whether it came."""
        deadline = time.monotonic() + GIVE_UP_S
        while time.monotonic() < deadline:
            if self._recoveries() >= self._wanted:
                self._result.back += 1
                return True
            for _ in range(_LOOKS):
                self.look()
            time.sleep(_POLL_S)
        ring = self._rig.ring
        self._result.message = "" if ring is None else read_status(ring).message
        return False

    def _recoveries(self) -> int:
        content = b"" if self._rig.ring is None else self._rig.ring.report()
        report = decode_report(content) if content else None
        return 0 if report is None else report.recoveries

    def end(self, *, kill: bool = False) -> None:
        """Kill the bus process, or request its end; its accounts must still be whole."""
        elapsed, at_ns = self._first
        last = self.look()
        self._result.elapsed += last.elapsed - elapsed
        self._result.passed += (time.monotonic_ns() - at_ns) / CYCLE_NS
        bus = self._rig.bus
        if kill and bus is not None and bus.pid is not None:
            os.kill(bus.pid, signal.SIGKILL)
            self._result.killed += 1
            bus.join(GIVE_UP_S)
        elif bus is not None:
            bus.request_stop()
            bus.join(GIVE_UP_S)
        self.look()
        self._rig.stop_bus()

    def look(self) -> AcquisitionStatus:
        """Read the accounts once; they must add up."""
        ring = self._rig.ring
        if ring is None:
            raise BusError("rig.bus", "The bus process is not there.", "Start it.")
        status = read_status(ring)
        self._result.looks += 1
        counted = status.good + status.late + status.lost + status.bad
        self._result.torn += counted != status.elapsed
        return status


class Flaps(msgspec.Struct, kw_only=True):
    """What became of links that went away and came back.

    Attributes
    ----------
    count, back
        How often it went away, and how often operation was reached again.
    torn
        As in `Restarts`.
    frames, wrong
        Given out meanwhile, and those of them that must not have been.
    """

    count: int = 0
    back: int = 0
    torn: int = 0
    frames: int = 0
    wrong: int = 0


def play_flaps(count: int, out: Path) -> None:
    """Let the link at the master's end or further on flap, again and again."""
    result, books = Flaps(count=count), Restarts()
    with tempfile.TemporaryDirectory() as folder, FaultRig(Path(folder), (LEFT, RIGHT)) as rig:
        watched = _BookWatch(rig, books)
        watched.begin()
        if rig.ring is None:
            raise BusError("rig.bus", "The bus process is not there.", "Start it.")
        frames, seen = FrameWatch(rig.ring), Watched()
        random = np.random.default_rng(count)
        for number in range(count):
            name = (NEAR, FAR)[number % 2]
            watched.disturbed()
            rig.link(name, up=False)
            # Long enough that it is noticed, or so short that it may not be.
            time.sleep(float(random.uniform(0.005, 0.4)))
            rig.link(name, up=True)
            began = time.monotonic_ns()
            deadline = time.monotonic() + GIVE_UP_S
            while time.monotonic() < deadline:
                frames.look(seen)
                if seen.exposed_between(began, time.monotonic_ns()):
                    result.back += 1
                    break
                time.sleep(_POLL_S)
            watched.look()
            # Times of exposures are kept for the question whether one came since.
            seen.exposed_us.clear()
        watched.end()
        result.frames, result.wrong, result.torn = seen.frames, seen.wrong, books.torn
    write_atomic(out, msgspec.json.encode(result))
