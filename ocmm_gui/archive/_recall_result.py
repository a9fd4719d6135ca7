"""What a recall found: totals in large words, and every verdict in a table."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from PySide6.QtWidgets import QVBoxLayout, QWidget

from ocmm_core.export import write_together
from ocmm_core.inspection.archive import RecallRecord
from ocmm_core.inspection.recall import checked, decided, headline, not_judged, totals
from ocmm_gui.archive._recall_table import RecallTable, mark_of
from ocmm_gui.kit import (
    DEFAULT_THEME,
    THEMES,
    FitText,
    Theme,
    later,
    mark_colour,
    sentence_label,
    tr,
)
from ocmm_gui.reports import drawing, pdf_bytes
from ocmm_gui.work import Teller

_MOST_LINES = 3
"""Of jobs that were not judged: the table below needs the room."""


class RecallResult(QWidget):
    """The record of a recall, whichever jobs it looked at."""

    def __init__(self) -> None:
        super().__init__()
        self._theme = THEMES[DEFAULT_THEME]
        self.record: RecallRecord | None = None
        self._headline = FitText(tr("Result of the recall"), limit=26)
        self._headline.setFixedHeight(40)
        self.totals = sentence_label(tr("Findings of the recall"), 15)
        self.table = RecallTable()
        self.about_job = sentence_label(tr("Evidence for the selected verdict"), 14)
        self.about_job.setProperty("role", "muted")
        body = QVBoxLayout(self)
        body.setContentsMargins(0, 0, 0, 0)
        body.addWidget(self._headline)
        body.addWidget(self.totals)
        body.addWidget(self.table, 1)
        body.addWidget(self.about_job)
        self.table.itemSelectionChanged.connect(self._show_job)

    def show_record(self, record: RecallRecord) -> str:
        """Show what a recall found, and return the sentence about what was looked at."""
        self.record = record
        self._show_words(record)
        self.table.show_record(record)
        self._show_job()
        return checked(record)

    def headline(self) -> str:
        """Return the totals in large words; for tests."""
        return self._headline.text()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self.table.set_theme(theme)
        if self.record is not None:
            self._show_words(self.record)

    def _show_words(self, record: RecallRecord) -> None:
        mark = mark_of(record)
        self._headline.show_text(headline(record), mark_colour(self._theme, mark), mark)
        said = (*totals(record), decided(record)) if record.jobs else ()
        self.totals.setText("\n".join((*said, *not_judged(record, _MOST_LINES))))

    def _show_job(self) -> None:
        self.about_job.setText(self.table.line())


@dataclass(frozen=True, slots=True)
class WritingRecall:
    """Write the pages of a recall, in the process beside the window."""

    record: RecallRecord
    path: Path

    def __call__(self, tell: Teller) -> Path:
        """Return where they are."""
        tell(later("Creating the pages"), 0.3)
        with drawing():
            content = pdf_bytes(self.record)
        tell.commit()
        write_together({self.path: content})
        return self.path
