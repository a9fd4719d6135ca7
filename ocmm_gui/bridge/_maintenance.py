"""What a maintenance technician asks of the station in the window."""

from __future__ import annotations

import threading
from pathlib import Path

from PySide6.QtCore import QObject, Qt, Signal

from ocmm_core.failure import contained
from ocmm_core.station import MeasuringStation
from ocmm_gui.bridge._commands import CommandQueue


class MaintenanceCommands(QObject):
    """Carry out maintenance on threads that may wait.

    Parameters
    ----------
    station
        Is looked after.
    queue
        Carries the commands out.
    """

    bus_text_saved = Signal(object)
    """Emits the `Path` that the report of the bus was written to."""
    cameras_written = Signal()
    """The cameras store the intrinsics of the calibration."""
    failed = Signal(object)
    """Emits the `OcmmError` of writing to the cameras."""

    # One signal each for the thread change; the public ones are emitted on the window's thread.
    _written_elsewhere = Signal()
    _failed_elsewhere = Signal(object)

    def __init__(self, station: MeasuringStation, queue: CommandQueue, parent: QObject) -> None:
        super().__init__(parent)
        self._maintenance, self._queue = station.maintenance, queue
        self._writing: threading.Thread | None = None
        queued = Qt.ConnectionType.QueuedConnection
        self._written_elsewhere.connect(self.cameras_written, queued)
        self._failed_elsewhere.connect(self.failed, queued)

    def save_bus_text(self, path: Path) -> None:
        """Write the report of the bus to a file."""
        self._queue.do(
            lambda: self._maintenance.save_bus_text(path), lambda: self.bus_text_saved.emit(path)
        )

    def mount_tip(self, tip: str) -> None:
        """Say that a tip, maybe the same one again, was screwed on."""
        self._queue.do(lambda: self._maintenance.mount_tip(tip))

    def look_at_probe_records(self) -> None:
        """Let the station take in what a wizard has stored about the probe."""
        self._queue.do(self._maintenance.probe_records_changed)

    def write_to_cameras(self) -> None:
        """Store the intrinsics of the calibration in the cameras, in a thread of its own."""
        if self._queue.closed or (self._writing is not None and self._writing.is_alive()):
            return
        self._writing = threading.Thread(target=self._write, name="ocmm-write-cameras")
        self._writing.start()

    def join(self, limit_s: float) -> None:
        """Wait until nothing is written any more; the end of the bus ends it."""
        if self._writing is not None:
            self._writing.join(limit_s)

    def _write(self) -> None:
        try:
            self._maintenance.write_to_cameras()
        except Exception as error:
            self._failed_elsewhere.emit(contained(error, "Writing to the cameras"))
        else:
            self._written_elsewhere.emit()
