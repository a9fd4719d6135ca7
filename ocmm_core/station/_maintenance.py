"""Maintenance at a running station: tip, cameras, procedures, bus report."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.records import Blocker
from ocmm_core.errors import MeasuringError
from ocmm_core.export import write_together
from ocmm_core.station._bus_watch import BusWatch, bus_text
from ocmm_core.station._calibration_watch import CalibrationWatch
from ocmm_core.station._faults import StationEvents, StationFaults
from ocmm_core.station._open_job import CurrentJob


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
