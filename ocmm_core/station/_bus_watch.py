"""The station's view of the bus: the report of the bus process, and its last minutes."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass
from datetime import datetime

from ocmm_core.acquisition.frames import FrameRing, RingHeaderField
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.report import BusReport, decode_report, report_text

NO_BUS = "The frames of this job do not come from a camera bus."
NO_BUS_REMEDY = (
    "Choose in Settings (Instrument, Cameras) ethercat:INTERFACE for real cameras, or "
    "ethercat:virtual for the virtual rig on a complete bus."
)
NO_REPORT = "No report from the bus yet."
NO_REPORT_REMEDY = "Wait until the bus process has started."

_LOOK_S = 0.1
"""Minimum interval between decoded reports."""

SILENCE_S = 0.1
"""A longer absence of frames is a fault."""

TREND_S = 300.0
_TREND_EVERY_S = 0.5


@dataclass(frozen=True, slots=True)
class BusSample:
    """Clocks at one moment."""

    time_s: float
    """On the clock of `time.monotonic`."""
    phase_ns: int
    drift_ppm: float
    """`phase_ns`, `drift_ppm`: As in `BusReport`."""
    offsets_ns: tuple[int | None, ...]
    """Clock offset of each camera, in the order of the rig; None if unknown."""


@dataclass(frozen=True, slots=True)
class BusView:
    report: BusReport | None
    """The last report; None before the first."""
    age_s: float
    """Its age, s; a live bus process sends one every 50 ms."""
    ended: str
    """Why no more will come; empty while the acquisition runs."""
    trend: tuple[BusSample, ...]
    """Clocks of the last minutes, oldest first."""


class BusWatch:
    """Read the reports of the bus process without disturbing it."""

    def __init__(self, ring: FrameRing) -> None:
        self._ring = ring
        self._closed = False
        self._sequence = 0
        self._looked_at = self._came_at = self._sampled_at = -float("inf")
        self._report: BusReport | None = None
        self._trend: deque[BusSample] = deque(maxlen=round(TREND_S / _TREND_EVERY_S))

    def report(self) -> BusReport | None:
        """Return the last report, at most 0.1 s old; None before the first."""
        now = time.monotonic()
        if self._closed or now - self._looked_at < _LOOK_S:
            return self._report
        sequence = self._ring.word(RingHeaderField.REPORT_SEQUENCE)
        if sequence == self._sequence:
            return self._report
        report = decode_report(self._ring.report())
        if report is None:
            return self._report
        self._looked_at = self._came_at = now
        self._sequence, self._report = sequence, report
        if now - self._sampled_at >= _TREND_EVERY_S:
            self._sampled_at = now
            offsets = tuple(camera.clock_offset_ns for camera in report.cameras)
            self._trend.append(
                BusSample(now, report.clock_phase_ns, report.clock_drift_ppm, offsets)
            )
        return report

    def view(self, ended: str) -> BusView:
        """Return the current state, with the reason why no more will come, or an empty text."""
        report = self.report()
        return BusView(report, time.monotonic() - self._came_at, ended, tuple(self._trend))

    def silence_s(self) -> float | None:
        """Return the time since the last frames, s; None if unknown."""
        last_ns = 0 if self._closed else self._ring.word(RingHeaderField.LAST_FRAMES_NS)
        return (time.monotonic_ns() - last_ns) * 1e-9 if last_ns else None

    def close(self) -> None:
        """Keep the last state and release the ring."""
        self.report()
        self._closed = True


def bus_text(bus: BusWatch | None, rig: str) -> str:
    """Return the bus report as text; `bus`: or None; `rig`: name; InputError: no report."""
    if bus is None:
        raise InputError("bus.none", NO_BUS, NO_BUS_REMEDY)
    report = bus.report()
    if report is None:
        raise InputError("bus.no_report", NO_REPORT, NO_REPORT_REMEDY)
    return report_text(report, rig=rig, written=datetime.now().astimezone())
