"""The history of a rig's calibrations as a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import Enum

from PySide6.QtWidgets import QHeaderView

from ocmm_core.calibration.records import Event, EventKind
from ocmm_gui.kit import DataTable, Theme, later, said, time_words, tr, tr_all

_COLUMNS = (
    (later("Time"), later("Local time")),
    (later("What happened"), later("Calibration concerned, see the last column")),
    (later("Who"), later("As entered")),
    (later("Why"), later("As entered, or the rule applied")),
    (later("Good until"), later("If suspect: last time known good")),
    (later("Calibration"), later("First digits of its hash")),
)
_WORDS = {
    EventKind.ACCEPTED: later("Activated"),
    EventKind.PASSED: later("Verification passed"),
    EventKind.FAILED: later("Verification FAILED"),
    EventKind.SUSPECTED: later("Marked suspect"),
    EventKind.FALLEN: later("Artefact found WRONG"),
    EventKind.RECALLED: later("Jobs recalled"),
}


class Tone(Enum):
    """Colour of an event."""

    PLAIN = "plain"
    GOOD = "good"
    WARN = "warn"
    BAD = "bad"


_TONES = {
    EventKind.PASSED: Tone.GOOD,
    EventKind.FAILED: Tone.BAD,
    EventKind.FALLEN: Tone.BAD,
    EventKind.SUSPECTED: Tone.WARN,
}


@dataclass(frozen=True, slots=True)
class Line:
    cells: tuple[str, ...]
    tone: Tone = Tone.PLAIN


class EventTable(DataTable):
    """Events, newest first. `what`, `why`: Columns with the event, and with long text."""

    def __init__(self, columns: Sequence[tuple[str, str]], what: int, why: int) -> None:
        super().__init__(tr("History, newest first"), columns)
        self._what, self._why = what, why
        header = self.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(why, QHeaderView.ResizeMode.Stretch)
        self.setWordWrap(True)
        self._lines: tuple[Line, ...] = ()
        header.sectionResized.connect(self._fit_rows)

    def show_lines(self, lines: Sequence[Line]) -> None:
        """Show events, given oldest first."""
        if tuple(lines) != self._lines:
            self._lines = tuple(lines)
            self._show()

    def set_theme(self, theme: Theme) -> None:
        self._colours = theme
        self._show()

    def _show(self) -> None:
        theme = self._colours
        tones = {
            Tone.PLAIN: theme.text, Tone.GOOD: theme.good, Tone.WARN: theme.warn,
            Tone.BAD: theme.bad,
        }  # fmt: skip
        self.setRowCount(len(self._lines))
        for row, line in enumerate(reversed(self._lines)):
            for column, text in enumerate(line.cells):
                colour = theme.text if column == self._why else theme.muted
                if column == self._what:
                    colour = tones[line.tone]
                self._write(row, column, text, colour)
        self.resizeRowsToContents()

    def _fit_rows(self, column: int) -> None:
        if column == self._why:
            self.resizeRowsToContents()


class HistoryTable(EventTable):
    """Events of the calibrations, newest first."""

    def __init__(self) -> None:
        super().__init__(tr_all(_COLUMNS), what=1, why=3)

    def show_events(self, events: Sequence[Event]) -> None:
        """Show events, given oldest first."""
        self.show_lines([_line(event) for event in events])


def _line(event: Event) -> Line:
    cells = (
        local_time(event.utc),
        tr(_WORDS[event.kind]),
        event.who,
        said(event.reason),
        local_time(event.since_utc) if event.since_utc else "",
        event.calibration[:12],
    )
    return Line(cells, _TONES.get(event.kind, Tone.PLAIN))


def local_time(utc: str) -> str:
    """Return a record's time in local display format."""
    return time_words(datetime.fromisoformat(utc).astimezone())
