"""Snapshots of a running station: live values, acquisition and bus; its maintenance."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ocmm_core.acquisition import frames
from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.records import Blocker
from ocmm_core.errors import MeasuringError
from ocmm_core.export import write_together
from ocmm_core.fieldbus.report import BusReport
from ocmm_core.inspection.evaluation import LiveView
from ocmm_core.station._bus_watch import BusView, BusWatch, bus_text
from ocmm_core.station._calibration_watch import CalibrationWatch
from ocmm_core.station._faults import StationEvents, StationFaults
from ocmm_core.station._instruments import Instruments
from ocmm_core.station._live import LiveState
from ocmm_core.station._open_job import CurrentJob
from ocmm_core.station.coaching import ProbeNow

_UNKNOWN = frames.AcquisitionStatus(
    frames.AcquisitionState.STOPPED, frames.StopReason.FAILED, "", 0, 0, 0, 0, 0, 0, 0, 0
)


class Looks:
    """Snapshots of the station; thread-safe.

    `bus`: None if frames come otherwise. `instruments` may forbid points, `faults` every number.
    Procedures of `maintenance` receive the frames.
    """

    def __init__(
        self,
        ring: frames.FrameRing,
        live: LiveState,
        bus: BusWatch | None,
        instruments: Instruments,
        maintenance: StationMaintenance,
        faults: StationFaults,
    ) -> None:
        self._ring, self._live, self._bus = ring, live, bus
        self._instruments, self._maintenance, self._faults = instruments, maintenance, faults
        self._last_status: frames.AcquisitionStatus | None = None

    def acquisition(self) -> frames.AcquisitionStatus:
        """Return the counters of the acquisition; after `close`, those at the end."""
        return (
            self._last_status if self._last_status is not None else frames.read_status(self._ring)
        )

    def live(self) -> LiveView:
        status = _UNKNOWN
        try:
            status = self.acquisition()
            if self._faults.measuring is None:
                return self._live.view(status, str(self._blocker or ""), self._words_beside)
        except Exception as error:
            self._faults.fail(error, "Judging the view")
        return self._live.failed(status, self._faults.reason, self._words_beside)

    def probe_now(self) -> ProbeNow | None:
        """Return the last state of the probe; None while points are blocked, as the readout."""
        if self._faults.measuring is not None or self._blocker is not None:
            return None
        return self._live.probe_now()

    def bus(self) -> BusView | None:
        """Return the state of the bus; None if frames do not come over one."""
        if self._bus is None:
            return None
        status = self.acquisition()
        ended = ""
        if status.state is frames.AcquisitionState.STOPPED:
            ended = status.message or "Acquisition ended."
        return self._bus.view(ended)

    def bus_report(self) -> BusReport | None:
        """Return the last report of the bus process; None without one."""
        return self._bus.report() if self._bus is not None else None

    def close(self) -> None:
        """Keep the last state, and release the ring."""
        self._last_status = self.acquisition()
        if self._bus is not None:
            self._bus.close()

    @property
    def _blocker(self) -> Blocker | None:
        """Return why no point can be recorded, or None."""
        return self._maintenance.blocking_reason or self._instruments.blocking_reason()[1]

    @property
    def _words_beside(self) -> tuple[str, ...]:
        return tuple(fault.error.what for fault in self._faults.beside)


class StationMaintenance:
    """Maintain probe, cameras and bus while the station runs.

    `current`: its watch of the tip learns changes. `calibration`: writes into cameras. `bus`: or
    None. `rig`: its name for the bus report. `untimed`: procedures get no frames, because they move
    the probe before cameras that do not prove when they expose.
    """

    def __init__(
        self,
        current: CurrentJob,
        calibration: CalibrationWatch,
        bus: BusWatch | None,
        rig: str,
        faults: StationFaults,
        events: StationEvents,
        *,
        untimed: bool = False,
    ) -> None:
        self._current, self._calibration, self._bus, self._rig = current, calibration, bus, rig
        self._untimed = untimed
        self._faults, self._events = faults, events
        self._watcher: Callable[[FrameBlock], None] | None = None

    def mount_tip(self, tip: str) -> None:
        """Note that a tip, maybe the same one, was mounted; it must be checked.

        With another tip than that of this job no more points are recorded: the geometry of a job
        does not change. CalibrationError: the probe has no records, or was never calibrated with
        this tip. StorageError: it could not be made durable.
        """
        self._current.now.probe.mount(tip)
        self._events.emit(self._events.changed)

    def probe_records_changed(self) -> None:
        """Reread the records of the probe: a passed check unblocks points at once.

        This job keeps its geometry; a new calibration or qualification applies to the next one.
        """
        probe = self._current.now.probe
        probe.forget()
        probe.settle()
        self._events.emit(self._events.changed)

    def write_to_cameras(self) -> None:
        """Store the intrinsics of the calibration in the cameras and read them back.

        Takes up to some seconds: not for the thread of a window. CalibrationError: there is nothing
        to write, or nowhere to write to. BusError: a camera refuses them.
        """
        self._calibration.write_to_cameras()

    def set_frame_tap(self, watcher: Callable[[FrameBlock], None] | None) -> None:
        """Pass all frames to a procedure, or None, on their thread; no points meanwhile."""
        self._watcher = watcher

    @property
    def blocking_reason(self) -> Blocker | None:
        """Return the blocker while a procedure receives the frames, else None."""
        return None if self._watcher is None else _WATCHED

    def takes(self, block: FrameBlock) -> bool:
        """Pass frames to a procedure; return whether there is one (reconstruction thread)."""
        watcher = self._watcher
        if watcher is None:
            return False
        try:
            if self._untimed and watcher is not _look_away:
                raise MeasuringError(
                    "maintenance.untimed",
                    "Calibrations and acceptance tests need cameras that prove when they expose: "
                    "this procedure gets no frames.",
                    "Use cameras with a common clock (PTP), or calibrate with pictures of a board "
                    "at rest.",
                )
            watcher(block)
        except Exception as error:
            # The probe is still in use by the procedure: no points.
            self._watcher = _look_away
            self._faults.note(error, "The calibration procedure")
        return True

    def save_bus_text(self, path: Path) -> None:
        """Write the bus report as text for support; InputError: nothing to report; StorageError."""
        write_together({path: bus_text(self._bus, self._rig).encode("utf-8")})


_WATCHED = Blocker(
    "A procedure of Maintain uses the frames: no points are taken.", "Finish it, or leave it."
)


def _look_away(block: FrameBlock) -> None:
    """Ignore frames."""
