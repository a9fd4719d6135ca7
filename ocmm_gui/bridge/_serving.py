"""Commands to the server that lets a measuring program measure with the running station."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QObject, Signal

from ocmm_core.settings import Settings
from ocmm_core.station import MeasuringStation, ServiceState, StationService, start_service
from ocmm_gui.bridge._commands import CommandQueue

_SERVICE = "ippdme"


class ServingCommands(QObject):
    """Start and stop the server, pass on words of the operator, and watch its state."""

    changed = Signal(object)
    """Emits the `ServiceState`; None while no server runs."""

    def __init__(self, station: MeasuringStation, queue: CommandQueue, parent: QObject) -> None:
        super().__init__(parent)
        self._station, self._queue = station, queue
        self._service: StationService | None = None
        self._shown: ServiceState | None = None

    @property
    def runs(self) -> bool:
        return self._service is not None

    def start(self, hand: Any, settings: Settings) -> str:
        """Start the server with a job of its own; on a thread that may wait; OcmmError."""
        self._service = start_service(_SERVICE, self._station, hand, settings)
        return ""

    def stop(self) -> None:
        self._queue.do(self.close)

    def operate(self, words: str) -> None:
        """Send a word of the operator to the program."""
        if self._service is not None:
            self._service.operate(words)

    def close(self) -> None:
        service, self._service = self._service, None
        if service is not None:
            service.close()

    def look(self) -> None:
        """Emit the state if it has changed."""
        state = None if self._service is None else self._service.state()
        if state != self._shown:
            self._shown = state
            self.changed.emit(state)
