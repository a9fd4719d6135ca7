"""A table with the columns of whatever was asked."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QTableWidgetItem

from ocmm_core.archive.questions import ArchiveAnswer
from ocmm_core.archive.records import shown_text
from ocmm_core.tolerances.decisions import PartWord, Verdict
from ocmm_gui.kit import DataTable, Theme, digit_font, localised, said_word, tr

_GOOD = (Verdict.CONFORM.value, PartWord.CONFORMS.value)
_BAD = (Verdict.NOT_CONFORM.value, PartWord.DOES_NOT_CONFORM.value)
_DOUBT = (
    Verdict.NOT_PROVEN.value, Verdict.NOT_MEASURED.value, Verdict.PROVISIONAL.value,
    PartWord.NOT_COMPLETE.value,
)  # fmt: skip
_LONGEST = 480


class AnswerTable(DataTable):
    """Rows of an answer; numbers at the right with four decimals."""

    def __init__(self) -> None:
        super().__init__(tr("Answer of the archive"), ())
        self._answer: ArchiveAnswer | None = None
        self.setWordWrap(False)

    def show_answer(self, answer: ArchiveAnswer | None) -> None:
        """Show an answer; None empties the table."""
        self._answer = answer
        self.clear()
        self.setRowCount(0)
        columns = () if answer is None else answer.columns
        self.setColumnCount(len(columns))
        if answer is None:
            return
        # Names of columns are words of the core, which also exports them; they are not data.
        for column, title in enumerate(columns):
            item = QTableWidgetItem(said_word(title))
            item.setTextAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
            self.setHorizontalHeaderItem(column, item)
        self.setRowCount(len(answer.rows))
        numbers = [
            any(isinstance(row[column], int | float) for row in answer.rows)
            for column in range(len(columns))
        ]
        for row, cells in enumerate(answer.rows):
            for column, cell in enumerate(cells):
                self._write(row, column, _text(cell), self._colour(cell))
                if numbers[column]:
                    item_there = self._cell(row, column)
                    item_there.setFont(digit_font(13, bold=False))
                    item_there.setTextAlignment(
                        Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
                    )
        self.right_heads(column for column, is_number in enumerate(numbers) if is_number)
        self.resizeColumnsToContents()
        for column in range(len(columns)):
            if self.columnWidth(column) > _LONGEST:
                self.setColumnWidth(column, _LONGEST)
        self.horizontalHeader().setStretchLastSection(bool(columns) and not numbers[-1])

    def set_theme(self, theme: Theme) -> None:
        """Write in the colours of ``theme`` from now on."""
        self._colours = theme
        self.show_answer(self._answer)

    def _colour(self, cell: object) -> str | None:
        if cell in _GOOD:
            return self._colours.good
        if cell in _BAD:
            return self._colours.bad
        return self._colours.warn if cell in _DOUBT else None


def _text(cell: object) -> str:
    if cell is None:
        return "–"
    return localised(f"{cell:.4f}") if isinstance(cell, float) else said_word(shown_text(str(cell)))
