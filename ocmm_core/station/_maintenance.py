"""What a maintenance technician does at a running station: tip, cameras, procedures, bus report."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.records import Blocker
from ocmm_core.export import write_together
from ocmm_core.station._bus_watch import BusWatch, bus_text
from ocmm_core.station._calibration_watch import CalibrationWatch
from ocmm_core.station._faults import StationEvents, StationFaults
from ocmm_core.station._open_job import CurrentJob


class StationMaintenance:
    """Look after probe, cameras and bus while the station runs.

    Parameters
    ----------
    current
        Its watch over the tip learns what was done.
    calibration
        Writes into the cameras.
    bus
        None where the frames do not come over one.
    rig
        Name of the rig, for the report of the bus.
    faults, events
        Told what fails, and what changes.
    """

    def __init__(
        self,
        current: CurrentJob,
        calibration: CalibrationWatch,
        bus: BusWatch | None,
        rig: str,
        faults: StationFaults,
        events: StationEvents,
    ) -> None:
        self._current, self._calibration, self._bus, self._rig = current, calibration, bus, rig
        self._faults, self._events = faults, events
        self._watcher: Callable[[FrameBlock], None] | None = None

    def mount_tip(self, tip: str) -> None:
        """Say that a tip, maybe the same one again, was screwed on; it must be checked.

        With another tip than that of this job no points are taken any more: the geometry of a job
        does not change.

        Raises
        ------
        CalibrationError
            The probe has no records, or was never calibrated with this tip.
        StorageError
            It could not be made durable.
        """
        self._current.now.probe.mount(tip)
        self._events.emit(self._events.changed)

    def probe_records_changed(self) -> None:
        """Look at the records of the probe anew: something was appended to them.

        A check that passed lets points be taken again at once. A new calibration or qualification
        is for the next job: this one goes on only with the geometry that it was begun with.
        """
        probe = self._current.now.probe
        probe.forget()
        probe.settle()
        self._events.emit(self._events.changed)

    def write_to_cameras(self) -> None:
        """Store the intrinsics of the calibration in the cameras and read them back.

        Takes up to some seconds: not for the thread of a window.

        Raises
        ------
        CalibrationError
            There is nothing to write, or nobody to write to.
        BusError
            A camera does not take them.
        """
        self._calibration.write_to_cameras()

    def set_frame_tap(self, watcher: Callable[[FrameBlock], None] | None) -> None:
        """Show all frames to a calibration procedure from now on, or to nobody.

        It is called on the reconstruction thread. As long as it watches, no points are taken:
        whoever waves the probe through the volume does not measure the part.
        """
        self._watcher = watcher

    @property
    def blocking_reason(self) -> Blocker | None:
        """Return that a procedure watches, so that no points are taken; None where none does."""
        return None if self._watcher is None else _WATCHED

    def takes(self, block: FrameBlock) -> bool:
        """Show frames to whoever watches, and say whether somebody does (reconstruction thread)."""
        watcher = self._watcher
        if watcher is None:
            return False
        try:
            watcher(block)
        except Exception as error:
            # It is still waved through the volume: no points, whoever looks.
            self._watcher = _look_away
            self._faults.note(error, "The calibration procedure")
        return True

    def save_bus_text(self, path: Path) -> None:
        """Write the report of the bus as text for support.

        Raises
        ------
        InputError
            There is nothing to report on.
        StorageError
            The file cannot be written.
        """
        write_together({path: bus_text(self._bus, self._rig).encode("utf-8")})


_WATCHED = Blocker(
    "A procedure of Maintain uses the frames: no points are taken.", "Finish it, or leave it."
)


def _look_away(block: FrameBlock) -> None:
    """Watch nothing."""
