"""What a recall found, as a table: one row a characteristic."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.inspection.archive import Outcome, RecallRecord
from ocmm_core.inspection.recall import COLUMNS, job_line, rests_on, row, worst_first
from ocmm_gui.kit import (
    ColouredRow,
    DataTable,
    Mark,
    Theme,
    later,
    mark_colour,
    said_word,
    tr,
    tr_all,
)

_TIPS = (
    later("file of the job"),
    later("as in the plan"),
    later("value ± U and verdict with the calibration of the job"),
    later("the same with the calibration its spots support"),
    later("whether the verdict still holds"),
    later("and why"),
)
_MARKS = {Outcome.HOLDS: Mark.GOOD, Outcome.CHANGES: Mark.BAD, Outcome.UNKNOWN: Mark.DOUBT}


def mark_of(record: RecallRecord) -> Mark:
    """Return what a recall looks like as a whole: as its worst verdict does."""
    worst = next(
        (one for one in (Outcome.CHANGES, Outcome.UNKNOWN) if record.count(one)), Outcome.HOLDS
    )
    return Mark.DOUBT if record.unread and worst is Outcome.HOLDS else _MARKS[worst]


class RecallTable(DataTable):
    """One row a characteristic, the jobs that need somebody first."""

    def __init__(self) -> None:
        super().__init__(
            tr("Verdicts of the recall"),
            tuple(zip(map(said_word, COLUMNS), tr_all(_TIPS), strict=True)),
        )
        self._record: RecallRecord | None = None
        self._lines: list[str] = []
        self._rows = ColouredRow(self)
        self.setItemDelegate(self._rows)
        self.resizeColumnsToContents()

    def show_record(self, record: RecallRecord) -> None:
        """Show what a recall found."""
        self._record = record
        rows = [(job, one) for job in worst_first(record.jobs) for one in job.characteristics]
        self._lines = [f"{job_line(job)} {rests_on(job)}" for job, _ in rows]
        self.setRowCount(len(rows))
        for at, (job, one) in enumerate(rows):
            for column, text in enumerate((Path(job.path).stem, *row(one))):
                colour = mark_colour(self._colours, _MARKS[one.outcome]) if column == 4 else None
                self._write(at, column, text, colour)
        self.resizeColumnsToContents()
        if rows:
            self.selectRow(0)

    def line(self) -> str:
        """Return what the chosen row rests on; empty without one."""
        at = self.currentRow()
        return self._lines[at] if 0 <= at < len(self._lines) else ""

    def set_theme(self, theme: Theme) -> None:
        """Write in the colours of ``theme`` from now on."""
        self._colours = self._rows.theme = theme
        if self._record is not None:
            self.show_record(self._record)
