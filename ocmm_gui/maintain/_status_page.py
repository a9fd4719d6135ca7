"""Base of the status pages, and events as a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Generic, TypeVar

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import QVBoxLayout, QWidget

from ocmm_core.calibration import records
from ocmm_gui import kit
from ocmm_gui.kit import tr


@dataclass(frozen=True, slots=True)
class EventLine:
    cells: tuple[str, ...]
    tone: str = "text"
    """Colour of the theme."""


class EventTable(kit.DataTable):
    """Events, newest first, muted except in some columns.

    `toned`: Columns in the tone of the event. `plain`: Columns in the colour of text. `long`:
    Columns with long texts.
    """

    def __init__(
        self,
        columns: Sequence[tuple[str, str]],
        *,
        toned: Sequence[int],
        plain: Sequence[int] = (),
        long: Sequence[int],
        name: str = "",
    ) -> None:
        super().__init__(name or tr("History, newest first"), kit.tr_all(tuple(columns)))
        self._toned, self._plain, self._long = toned, plain, long
        self.fit_columns(*long)
        self.setWordWrap(True)
        self._lines: tuple[EventLine, ...] = ()
        self.horizontalHeader().sectionResized.connect(self._fit_rows)

    def show_lines(self, lines: Sequence[EventLine]) -> None:
        """Show events, given oldest first."""
        if tuple(lines) != self._lines:
            self._lines = tuple(lines)
            self.setRowCount(len(lines))
            usual = dict.fromkeys(range(self.columnCount()), "muted")
            usual |= dict.fromkeys(self._plain, "text")
            for row, line in enumerate(reversed(lines)):
                self.show_words(row, line.cells, usual | dict.fromkeys(self._toned, line.tone))
            self.resizeRowsToContents()

    def _fit_rows(self, column: int) -> None:
        if column in self._long:
            self.resizeRowsToContents()


def local_time(utc: str) -> str:
    """Return a record's time in local display format."""
    return kit.time_words(datetime.fromisoformat(utc).astimezone())


REFRESH_MS = 500

_MARKS = {
    records.CalibrationStatus.VALID: kit.Mark.GOOD,
    records.CalibrationStatus.DESIGN: kit.Mark.DONE,
    records.CalibrationStatus.DUE: kit.Mark.DOUBT,
    records.CalibrationStatus.SUSPECT: kit.Mark.DOUBT,
}


V = TypeVar("V", records.CalibrationView, records.ProbeView)
H = TypeVar("H")
"""Contents of the store: history and trends."""


class StatusPage(QWidget, Generic[V, H]):
    """A large status word, its meaning, and facts; refreshed while visible.

    ``pull_overview`` returns the contents of the store, on opening and after status changes, as it
    reads many files; ``in_order``, ``design``: texts for good order, and for a virtual rig;
    ``in_doubt`` opens the jobs with suspect points.
    """

    def __init__(
        self,
        name: str,
        of: str,
        facts: Sequence[tuple[str, str]],
        pull: Callable[[], V],
        pull_overview: Callable[[], H],
        *,
        in_order: str,
        design: str,
        in_doubt: str = "",
    ) -> None:
        super().__init__()
        self._pull: Callable[[], V] = pull
        self._pull_overview = pull_overview
        self._in_order, self._design = in_order, design
        self._in_doubt = in_doubt
        self._view: V | None = None
        self.setAccessibleName(name)
        self.word = kit.FitText(of, limit=34, high=44)
        self.sentence = kit.sentence_label(tr("Meaning of the status"), 15)
        self.notes = kit.sentence_label(tr("Watch list"), 14)
        self.facts = {name: kit.value_label(tr(name), tr(tip)) for name, tip in facts}
        self.fault = kit.sentence_label(tr("Why no history is shown"), 20)
        self.fault.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.fault.setMargin(30)
        self._timer = QTimer(self, interval=REFRESH_MS)
        self._timer.timeout.connect(self.refresh)

    def refresh(self) -> None:
        view = self._pull()
        if view != self._view:
            self._view = view
            self._show_overview(view, self._pull_overview())
            self._show_status(view)

    def forget(self) -> None:
        """Reread everything at the next `refresh`."""
        self._view = None

    def _show_overview(self, view: V, found: H) -> None:
        raise NotImplementedError

    def showEvent(self, event: QShowEvent) -> None:
        """Reread all files and start refreshing."""
        super().showEvent(event)
        self.forget()
        self.refresh()
        self._timer.start()

    def hideEvent(self, event: QHideEvent) -> None:
        self._timer.stop()
        super().hideEvent(event)

    def _show_status(self, view: V) -> None:
        bad = view.uncalibrated or (
            view.word is records.CalibrationStatus.DESIGN and view.blocker is not None
        )
        word = tr("UNCALIBRATED") if view.uncalibrated else kit.said_word(view.word.value)
        self.word.show_text(word, mark=kit.Mark.BAD if bad else _MARKS.get(view.word, kit.Mark.BAD))
        in_order = self._design if view.word is records.CalibrationStatus.DESIGN else self._in_order
        self.sentence.setText(_sentence(view.blocker, in_order, uncalibrated=view.uncalibrated))
        notes = list(map(kit.said, view.warnings))
        if view.since_utc:
            notes.append(
                tr("Points since {since_utc} are suspect, also in older jobs.").format(
                    since_utc=local_time(view.since_utc)
                )
                + (self._in_doubt and f" {self._in_doubt}")
            )
        self.notes.tell("  ".join(notes))

    def _show_facts(self, words: dict[str, str]) -> None:
        for name, label in self.facts.items():
            label.setText(words[name])
            label.setToolTip(kit.literal(words[name]))

    def _lay_out(self, *parts: tuple[QWidget, int]) -> None:
        """Lay out status and facts, with the parts of the page below them."""
        words = kit.vbox(self.word, (self.sentence, 1), self.notes)
        grid = kit.form_grid(self.facts.values(), down=(len(self.facts) + 1) // 2, pixels=13)
        grid.setHorizontalSpacing(10)
        grid.setVerticalSpacing(1)
        for column in (1, 3):
            grid.setColumnStretch(column, 1)
        head = kit.hbox((kit.panel(words), 2), (kit.panel(grid), 3), spacing=8)
        kit.vbox(head, *parts, parent=self, spacing=8, margins=0)


def in_a_row(*panels: QVBoxLayout) -> QWidget:
    """Return panels side by side, equally wide."""
    whole = QWidget()
    row = kit.hbox(parent=whole, spacing=8, margins=0)
    for one in panels:
        row.addWidget(kit.panel(one), 1)
    return whole


def _sentence(blocker: records.Blocker | None, in_order: str, *, uncalibrated: bool) -> str:
    """Return the consequence of a status for measuring."""
    if uncalibrated:
        why = f" {kit.said(str(blocker))}" if blocker is not None else ""
        return tr("Points are taken but prove nothing: every verdict is NOT PROVEN.{why}").format(
            why=why
        )
    return (
        in_order
        if blocker is None
        else tr("No points are taken. {blocker}").format(blocker=kit.said(str(blocker)))
    )
