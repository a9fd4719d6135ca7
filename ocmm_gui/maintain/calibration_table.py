"""The history of a rig's calibrations as a table."""

from __future__ import annotations

from datetime import datetime

from PySide6.QtWidgets import QHeaderView

from ocmm_core.calibration.history import Event, EventKind
from ocmm_gui.maintain.parts import Table
from ocmm_gui.theme import Theme

_COLUMNS = (
    ("Time", "Local time"),
    ("What happened", "To which calibration, see the last column"),
    ("Who", "As entered"),
    ("Why", "As entered, or by which rule"),
    ("Good until", "For a doubt: the last moment at which all was well"),
    ("Calibration", "The beginning of its hash"),
)
_WHAT, _WHY = 1, 3
_WORDS = {
    EventKind.ACCEPTED: "Put in force",
    EventKind.PASSED: "Verification passed",
    EventKind.FAILED: "Verification FAILED",
    EventKind.SUSPECTED: "Put in doubt",
}


class HistoryTable(Table):
    """What happened to the calibrations, newest first."""

    def __init__(self) -> None:
        super().__init__("History, newest first", _COLUMNS)
        header = self.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(_WHY, QHeaderView.ResizeMode.Stretch)
        self.setWordWrap(True)
        self._events: tuple[Event, ...] = ()
        header.sectionResized.connect(self._fit_rows)

    def show_events(self, events: tuple[Event, ...]) -> None:
        """Show events, given oldest first."""
        if events != self._events:
            self._events = events
            self._show()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._colours = theme
        self._show()

    def _show(self) -> None:
        theme = self._colours
        colours = {
            EventKind.PASSED: theme.good,
            EventKind.FAILED: theme.bad,
            EventKind.SUSPECTED: theme.warn,
        }
        self.setRowCount(len(self._events))
        for row, event in enumerate(reversed(self._events)):
            texts = (
                local_time(event.utc),
                _WORDS[event.kind],
                event.who,
                event.reason,
                local_time(event.since_utc) if event.since_utc else "",
                event.calibration[:12],
            )
            for column, text in enumerate(texts):
                colour = theme.text if column == _WHY else theme.muted
                if column == _WHAT:
                    colour = colours.get(event.kind, theme.text)
                self._write(row, column, text, colour)
        self.resizeRowsToContents()

    def _fit_rows(self, column: int) -> None:
        if column == _WHY:
            self.resizeRowsToContents()


def local_time(utc: str) -> str:
    """Return a time of a record as people read it."""
    return f"{datetime.fromisoformat(utc).astimezone():%Y-%m-%d %H:%M}"
