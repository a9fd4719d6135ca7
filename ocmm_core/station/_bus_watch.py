"""The bus as the station sees it: the report of the process on the wire, and its last minutes."""

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
"""A report is decoded no more often than this."""

SILENCE_S = 0.1
"""Frames that stay away longer than this are missed."""

TREND_S = 300.0
_TREND_EVERY_S = 0.5


@dataclass(frozen=True, slots=True)
class BusSample:
    """The clocks at one moment."""

    time_s: float
    """When, on the clock of `time.monotonic`."""
    phase_ns: int
    drift_ppm: float
    """`phase_ns`, `drift_ppm`: As in `BusReport`."""
    offsets_ns: tuple[int | None, ...]
    """Clock offset of each camera, in the order of the rig; None where not known."""


@dataclass(frozen=True, slots=True)
class BusView:
    """What is known about the bus."""

    report: BusReport | None
    """The last report; None before the first."""
    age_s: float
    """How long ago it came, s; a bus process that lives sends one every 50 ms."""
    ended: str
    """Why nothing more will come; empty while the acquisition runs."""
    trend: tuple[BusSample, ...]
    """The clocks of the last minutes, oldest first."""


class BusWatch:
    """Read what the process on the wire says about itself, without disturbing it."""

    def __init__(self, ring: FrameRing) -> None:
        self._ring = ring
        self._closed = False
        self._sequence = 0
        self._looked_at = self._came_at = self._sampled_at = -float("inf")
        self._report: BusReport | None = None
        self._trend: deque[BusSample] = deque(maxlen=round(TREND_S / _TREND_EVERY_S))

    def report(self) -> BusReport | None:
        """Return the last report, at most 0.1 s behind the process; None before the first."""
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
        """Return what is known, with the reason why no more will come, or an empty text."""
        report = self.report()
        return BusView(report, time.monotonic() - self._came_at, ended, tuple(self._trend))

    def silence_s(self) -> float | None:
        """Return for how long no frames have come, s; None where that is not known yet."""
        last_ns = 0 if self._closed else self._ring.word(RingHeaderField.LAST_FRAMES_NS)
        return (time.monotonic_ns() - last_ns) * 1e-9 if last_ns else None

    def close(self) -> None:
        """Keep what is known and leave the ring alone from now on."""
        self.report()
        self._closed = True


def bus_text(bus: BusWatch | None, rig: str) -> str:
    """Return the report of the bus as text for support.

    Parameters
    ----------
    bus
        None where the frames do not come over one.
    rig
        Name of the rig.

    Raises
    ------
    InputError
        There is nothing to report on.
    """
    if bus is None:
        raise InputError("bus.none", NO_BUS, NO_BUS_REMEDY)
    report = bus.report()
    if report is None:
        raise InputError("bus.no_report", NO_REPORT, NO_REPORT_REMEDY)
    return report_text(report, rig=rig, written=datetime.now().astimezone())
