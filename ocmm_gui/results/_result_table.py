"""All characteristics of a job with their verdicts, one row each."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QResizeEvent

from ocmm_core.inspection.evaluation import JobView
from ocmm_core.tolerances.decisions import U_LABEL, CharacteristicResult, Verdict
from ocmm_gui.kit import (
    ColouredRow,
    DataTable,
    Theme,
    digit_font,
    later,
    limit_words,
    quantity,
    said_word,
    text_font,
    tr,
    tr_all,
    verdict_colour,
    with_unit,
)

VERDICT_SIGNS = {
    Verdict.CONFORM: "✔",
    Verdict.NOT_CONFORM: "✖",
    Verdict.NOT_PROVEN: "▲",
    Verdict.NOT_MEASURED: "○",
    Verdict.PROVISIONAL: "◌",
}
"""A sign for each verdict, so that nothing depends on colour."""

_COLUMNS = (
    (later("Characteristic"), later("as in the plan")),
    (later("Of"), later("kind and features")),
    (later("Nominal"), later("{unit}, or degrees for angles")),
    (later("Measured"), later("{unit}, or degrees for angles")),
    (later("Deviation"), later("measured minus nominal")),
    (later("Limits"), later("of the deviation")),
    (U_LABEL, later("expanded uncertainty")),
    (later("Verdict"), later("the decision")),
)
_NUMBERS = range(2, 7)
_DEVIATION, _VERDICT = 4, 7
_ROW_PX = 34
_NARROW_PX = 860
_HEAD_PX = 13
_SMALLER_PX = 12, 11


class ResultTable(DataTable):
    """Rows can be selected with the arrow keys."""

    result_chosen = Signal(str)

    def __init__(self) -> None:
        super().__init__(tr("Characteristics"), with_unit(tr_all(_COLUMNS)))
        self._results: tuple[CharacteristicResult, ...] = ()
        self._pixels = self._least = 0
        self.setFont(text_font(15))
        self.horizontalHeader().setFont(text_font(_HEAD_PX))
        self.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.setWordWrap(False)
        self.right_heads(_NUMBERS)
        self._rows = ColouredRow(self)
        self.setItemDelegate(self._rows)
        self.currentCellChanged.connect(lambda row, *_: self._on_row(row))

    def show_job(self, job: JobView) -> None:
        """Show all characteristics of a job; keep the selection, by default the deciding one."""
        chosen = self.chosen()
        deciding = job.part_verdict.summary.deciding
        before, self._results = self._results, job.characteristics
        # A point changes few of hundreds of characteristics.
        new = [
            row
            for row, result in enumerate(self._results)
            if row >= len(before) or before[row] is not result
        ]
        self.blockSignals(True)
        self.setRowCount(len(self._results))
        for row in new:
            result = self._results[row]
            colour = verdict_colour(self._colours, result.verdict)
            verdict = f"{VERDICT_SIGNS[result.verdict]}  {said_word(result.verdict.value)}"
            words = (
                result.name,
                f"{said_word(result.kind)} {' – '.join(result.features)}",
                quantity(result, result.nominal),
                quantity(result, result.measured),
                quantity(result, result.deviation, signed=True),
                limit_words(result),
                quantity(result, result.uncertainty),
                verdict,
            )
            for column, word in enumerate(words):
                self._write(row, column, word, colour if column == _VERDICT else None)
            for column in _NUMBERS:
                self._cell(row, column).setTextAlignment(
                    Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
                )
        names = [result.name for result in self._results]
        if names:
            self.setCurrentCell(names.index(chosen if chosen in names else deciding), 0)
        self.blockSignals(False)
        if new or len(before) != len(self._results):
            self._share_width(new)
        if names and self.chosen() != chosen:
            self._on_row(self.currentRow())

    def chosen(self) -> str:
        row = self.currentRow()
        return self._results[row].name if 0 <= row < len(self._results) else ""

    def choose(self, name: str) -> None:
        """Select the row of a characteristic; an unknown one changes nothing."""
        for row, result in enumerate(self._results):
            if result.name == name:
                self.setCurrentCell(row, 0)

    def set_theme(self, theme: Theme) -> None:
        self._colours = self._rows.theme = theme
        for row, result in enumerate(self._results):
            for column, word in enumerate(self.words(row)):
                judged = verdict_colour(self._colours, result.verdict)
                self._write(row, column, word, judged if column == _VERDICT else None)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give the remaining width to the second column."""
        super().resizeEvent(event)
        self._least = 0
        self._share_width()

    def _share_width(self, new: Sequence[int] = ()) -> None:
        """Set the width of columns, and the letter size of ``new`` rows, or all."""
        narrow = self.width() < _NARROW_PX
        pixels = self._least or (13 if narrow else 15)
        rows = new if pixels == self._pixels else range(self.rowCount())
        if pixels != self._pixels:
            for column in range(self.columnCount()):
                head = self.horizontalHeaderItem(column)
                if head is not None:
                    head.setFont(text_font(min(_HEAD_PX, pixels)))
        self._pixels = pixels
        for row in rows:
            for column in range(self.columnCount()):
                bold = column in (_DEVIATION, _VERDICT)
                font = digit_font if column in _NUMBERS else text_font
                self._cell(row, column).setFont(font(pixels, bold=bold))
        self.resizeColumnsToContents()
        # Kind and features are also next to the table.
        self.setColumnHidden(1, narrow)
        wide = 0 if self.isColumnHidden(1) else 1
        rest = sum(self.columnWidth(c) for c in range(self.columnCount()) if c != wide)
        room = self.viewport().width() - rest - 4
        smaller = next((size for size in _SMALLER_PX if size < pixels), 0)
        if smaller and room < (self.columnWidth(0) if wide == 0 else 60):
            # Long words get smaller letters, so that the verdict stays visible.
            self._least = smaller
            self._share_width()
            return
        self.setColumnWidth(wide, max(room, self.columnWidth(wide) if wide == 0 else 60))

    def _on_row(self, row: int) -> None:
        if 0 <= row < len(self._results):
            self.result_chosen.emit(self._results[row].name)
