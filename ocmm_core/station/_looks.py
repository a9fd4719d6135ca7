"""Snapshots of a running station: live values, acquisition and bus."""

from __future__ import annotations

from ocmm_core.acquisition import frames
from ocmm_core.calibration.records import Blocker
from ocmm_core.fieldbus.report import BusReport
from ocmm_core.inspection.evaluation import LiveView
from ocmm_core.station._bus_watch import BusView, BusWatch
from ocmm_core.station._faults import StationFaults
from ocmm_core.station._instruments import Instruments
from ocmm_core.station._live import LiveState
from ocmm_core.station._maintenance import StationMaintenance
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
