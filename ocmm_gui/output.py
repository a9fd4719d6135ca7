"""The files that are written on a key: reports, the report of the bus, the log."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QObject

from ocmm_core.errors import OcmmError
from ocmm_gui.bridge import StationBridge
from ocmm_gui.notify import NoticeCentre
from ocmm_gui.operator.path_panel import PathPanel


class Output(QObject):
    """Write files into the folder that was given at the start, or ask for one in the window.

    Parameters
    ----------
    bridge
        The running inspection.
    notices
        Where errors and news go.
    out
        Folder of the report; None asks.
    """

    def __init__(self, bridge: StationBridge, notices: NoticeCentre, out: Path | None) -> None:
        super().__init__()
        self._bridge, self._notices, self._out = bridge, notices, out
        self.export_panel = PathPanel("report", "folder")
        self.bus_panel = PathPanel("report of the bus", "file")
        self.export_panel.given.connect(bridge.export)
        self.bus_panel.given.connect(bridge.save_bus_text)
        bridge.exported.connect(self._on_exported)
        bridge.bus_text_saved.connect(
            lambda path: notices.inform(f"The report of the bus is in {path}.")
        )

    def calls(self) -> dict[str, Callable[[], None]]:
        """Return what the keys do, by key of the action."""
        return {"export": self._export, "bus_text": self._save_bus_text, "log": self._save_log}

    def folder(self) -> Path:
        """Return where files go unless somebody says otherwise."""
        return self._out if self._out is not None else Path.home() / "ocmm-out"

    def hide(self) -> None:
        """Put away what asks for a place."""
        self.export_panel.hide()
        self.bus_panel.hide()

    def _export(self) -> None:
        if self._out is not None:
            self._bridge.export(self._out)
        else:
            self.export_panel.ask(self.folder())

    def _on_exported(self, paths: tuple[Path, ...]) -> None:
        names = ", ".join(path.name for path in paths)
        folder = paths[0].parent if paths else ""
        self._notices.inform(f"Written to {folder}: {names}")

    def _save_bus_text(self) -> None:
        path = self._new_text("bus")
        if self._out is not None:
            self._bridge.save_bus_text(path)
        else:
            self.bus_panel.ask(path)

    def _save_log(self) -> None:
        path = self._new_text("log")
        try:
            self._notices.save(path)
        except OcmmError as error:
            self._notices.error(error)
        else:
            self._notices.inform(f"The log is in {path}.")

    def _new_text(self, what: str) -> Path:
        folder = self._out if self._out is not None else Path.home()
        return folder / f"ocmm-{what}-{datetime.now().astimezone():%Y%m%d-%H%M%S}.txt"
