"""Import page of a table: its lines, columns, unit and decimal sign before anything is taken."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QWidget

from ocmm_core.tables import TableOptions, TablePreview
from ocmm_gui.kit._narrow import NarrowButton, PlainLabel
from ocmm_gui.kit._parts import DataTable, dressed, hbox, sentence_label, vbox
from ocmm_gui.kit._sheet import ChoiceBox, form_field, form_grid
from ocmm_gui.kit._texts import said, tr
from ocmm_gui.kit._theme import Themed, text_font

_SIGNS = ("", "point", "comma")
_CELL_PX = 110
_PAUSE_MS = 300
"""Typing ends before the table is read again."""


class TableImport(Themed, QWidget):
    """First and last lines of a table, with columns, unit and decimal sign, all changeable.

    Return takes the table over, Esc goes back; ``example``: columns as they are stated.
    """

    changed = Signal(object, object)
    """Emits path and `TableOptions`: the table is to be read again."""
    taken = Signal(object)
    """Emits the content that the reader returned."""
    declined = Signal()

    def __init__(self, example: str) -> None:
        super().__init__()
        self.setAccessibleName(tr("Import of a table"))
        self._path = Path()
        self._found: TablePreview[Any] | None = None
        self.summary = sentence_label(tr("What the reader makes of the table"), 15)
        self.title = dressed(PlainLabel(), font=text_font(18, bold=True))
        self.table = DataTable(tr("First and last lines"), (), font=text_font(14))
        self.unit = form_field(tr("Unit of lengths"), tr("as in the file, else mm"))
        self.columns = form_field(
            tr("Columns"), tr("as in the heading; {example}").format(example=example)
        )
        self.skip = form_field(tr("Lines to skip"), tr("none; 3: first three, 4-9: range"))
        names = {"": tr("by the numbers"), "point": tr("point"), "comma": tr("comma")}
        tip = tr("Sign before the decimals")
        self.decimal = ChoiceBox(tr("Decimal sign"), tip, _SIGNS, names.__getitem__)
        take = NarrowButton(tr("Take over  [Return]"))
        self.take = dressed(take, tr("Take the table over"), role="primary")
        self.back = dressed(NarrowButton(tr("Back  [Esc]")), tr("Go back without the table"))
        self.take.clicked.connect(self._emit_taken)
        self.back.clicked.connect(self.declined)
        self._again = QTimer(self, singleShot=True, interval=_PAUSE_MS)
        self._again.timeout.connect(self._emit_changed)
        for field in (self.unit, self.columns, self.skip):
            field.textChanged.connect(lambda _text: self._again.start())
        self.decimal.currentIndexChanged.connect(lambda _row: self._again.start())
        self._lay_out()
        self.hide()

    def open_table(self, path: Path) -> None:
        """Start with a table and no options."""
        self._path = path
        self.title.setText(path.name)
        for field in (self.unit, self.columns, self.skip):
            field.blockSignals(True)
            field.clear()
            field.blockSignals(False)
        self.decimal.blockSignals(True)
        self.decimal.choose("")
        self.decimal.blockSignals(False)

    def options(self) -> TableOptions:
        return TableOptions(
            self.unit.text().strip(), self.columns.text().strip(), self.decimal.choice(),
            self.skip.text().strip(),
        )  # fmt: skip

    def show_preview(self, found: TablePreview[Any]) -> None:
        """Show the lines of a table, and the account or the reason of a refusal."""
        self._found = found
        account = found.account
        rows = found.rows
        width = max((len(row.cells) for row in rows), default=1)
        heads = [tr("Line"), tr("Left out, because")]
        for column in range(width):
            role = account.columns[column].role if account and column < len(account.columns) else ""
            heads.append(role or (tr("not read") if account else str(column + 1)))
        self.table.setColumnCount(width + 2)
        self.table.setHorizontalHeaderLabels(heads)
        self.table.setRowCount(len(rows))
        for row, one in enumerate(rows):
            cells = [*one.cells, *[""] * (width - len(one.cells))]
            muted = dict.fromkeys(range(width + 2), "muted") if one.why else None
            self.table.show_words(row, (str(one.line), said(one.why or ""), *cells), muted)
        for column in range(width + 2):
            self.table.setColumnWidth(column, (60, 170)[column] if column < 2 else _CELL_PX)
        if found.error is not None:
            words = f"{said(found.error.what)}\n{said(found.error.remedy)}"
        else:
            words = "  ".join(said(one) for one in account.sentences(0)) if account else ""
        if found.hidden:
            hidden = tr(
                "%n lines between them are not shown.",
                "1 line between them is not shown.",
                found.hidden,
            )
            words = f"{words}  {hidden}"
        self.summary.setText(words)
        self.take.setEnabled(found.table is not None)
        self._paint()
        if not self.isVisible():
            self.show()
            (self.take if found.table is not None else self.columns).setFocus()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Take over with Return, go back with Esc."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self._emit_taken()
        elif event.key() == Qt.Key.Key_Escape:
            self.declined.emit()
        else:
            super().keyPressEvent(event)

    def _paint(self) -> None:
        if self._found is not None:
            colour = self._theme.text if self._found.error is None else self._theme.bad
            self.summary.setStyleSheet(f"color: {colour};")

    def _emit_changed(self) -> None:
        if self.isVisible():
            self.changed.emit(self._path, self.options())

    def _emit_taken(self) -> None:
        # A field may have changed since the table was read.
        if self._found is not None and self._found.table is not None:
            if self._found.options == self.options():
                self.taken.emit(self._found.table)
            else:
                self._emit_changed()

    def _lay_out(self) -> None:
        form = form_grid((self.unit, self.decimal, self.columns, self.skip), across=2)
        form.setColumnStretch(1, 1)
        form.setColumnStretch(3, 1)
        keys = hbox((self.take, 2), (self.back, 1))
        vbox(
            self.title, self.summary, (self.table, 1), form, keys, parent=self, spacing=8, margins=0
        )
