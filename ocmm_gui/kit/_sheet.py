"""Sheets: pages opened during measuring and closed with Esc without loss, and parts made late.

The import page of a table shows its lines, columns, unit and decimal sign before anything is taken.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from PySide6.QtCore import QObject, QPointF, Qt, QTimer, Signal
from PySide6.QtGui import QAction, QColor, QKeyEvent, QPainter, QPaintEvent, QPolygonF
from PySide6.QtWidgets import QComboBox, QGridLayout, QLabel, QSizePolicy, QWidget

from ocmm_core.errors import OcmmError
from ocmm_core.tables import TableOptions, TablePreview
from ocmm_gui.kit._actions import ActionInfo
from ocmm_gui.kit._marks import ink
from ocmm_gui.kit._narrow import NarrowButton, PlainLabel
from ocmm_gui.kit._panels import OwnKeysField
from ocmm_gui.kit._parts import DataTable, dressed, hbox, sentence_label, vbox
from ocmm_gui.kit._shortcuts import F_KEYS, make_action, make_button
from ocmm_gui.kit._texts import later, literal, said, tr
from ocmm_gui.kit._theme import Themed, text_font, use_role

LEAVE = ActionInfo("leave", later("Back"), later("Back to measuring; nothing is lost"), ("Esc",))
_BUTTON_PX = 42
_MOST_IN_ROW = 10

T = TypeVar("T")


class LateParts(QObject):
    """Base of objects with late parts, each a `cached_property`."""

    def is_made(self, name: str) -> bool:
        """Return whether the part of this name was used before."""
        # `cached_property` stores its value under its name.
        return name in self.__dict__


class Sheet(QWidget):
    """Title, body, and buttons of ``infos`` and `LEAVE`; keys act only while it has the focus."""

    left = Signal()
    failed = Signal(object)
    """Emits the `OcmmError` of a failed action."""
    told = Signal(str)
    """Emits information, in one sentence."""

    def __init__(self, title: str, infos: Sequence[ActionInfo]) -> None:
        super().__init__()
        self.setAccessibleName(title)
        self._infos = (LEAVE, *infos)
        self.keys: dict[str, QAction] = {}
        head = dressed(PlainLabel(title), font=text_font(22, bold=True))
        self._about = sentence_label(tr("About this page"), 14, role="muted", middle=True)
        self.body = vbox(spacing=8)
        self._row = QGridLayout()
        self._row.setSpacing(8)
        above = hbox(head, (self._about, 1), spacing=18)
        vbox(above, (self.body, 1), self._row, parent=self, spacing=8, margins=(14, 8, 14, 10))

    def show_message(self, about: str, *, warns: bool = False) -> None:
        """Show a sentence next to the title, optionally in warning colour."""
        use_role(self._about, "warn" if warns else "muted")
        self._about.setText(about)

    def about(self) -> str:
        """Return the sentence next to the title."""
        return self._about.text()

    def close_work(self) -> None:
        """Cancel running calculations before the window closes; none by default."""

    def attempt(self, call: Callable[[], T]) -> T | None:
        """Return the result of a call; on failure emit the error and return None."""
        try:
            return call()
        except OcmmError as error:
            self.failed.emit(error)
            return None

    def use_keys(
        self, calls: Mapping[str, Callable[[], None]], primary: str = "", aside: str = ""
    ) -> None:
        """Create actions and buttons, but none for ``aside``; ``calls``: every key but `LEAVE`."""
        shown, shift = [info for info in self._infos if info.key != aside], tr("Shift")
        in_row = -(-len(shown) // -(-len(shown) // _MOST_IN_ROW))
        for info in self._infos:
            action = make_action(info, self)
            call = self.left.emit if info is LEAVE else calls[info.key]
            action.triggered.connect(lambda _checked, call=call: call())
            self.keys[info.key] = action
            if info.key == aside:
                continue
            index = shown.index(info)
            font = text_font(14, bold=info.key == primary)
            button = make_button(action, primary=info.key == primary)
            dressed(button, font=font, high=_BUTTON_PX)
            button.setObjectName(f"button_{info.key}")
            # The full text would not fit into the row.
            button.setText(button.text().replace(f"{shift}+", "⇧"))
            button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
            self._row.addWidget(button, index // in_row, index % in_row)


class FormField(OwnKeysField):
    """A field of a sheet: letters are its own, F-keys and Esc act on the sheet."""

    given_keys = (*F_KEYS, Qt.Key.Key_Escape)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Leave Esc to the sheet or, with a notice, to the window."""
        if event.key() == Qt.Key.Key_Escape:
            event.ignore()
            return
        super().keyPressEvent(event)


class ChoiceBox(Themed, QComboBox):
    """A choice whose arrow follows the theme."""

    def __init__(
        self, name: str, tip: str, choices: Sequence[str], words: Callable[[str], str] | None = None
    ) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setToolTip(literal(tip))
        for one in choices:
            self.addItem(one if words is None else words(one), one)
        self.setFont(text_font(15))

    def choice(self) -> str:
        """Return the selected choice, independent of its text."""
        return str(self.currentData())

    def choose(self, choice: str) -> None:
        self.setCurrentIndex(self.findData(choice))

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        ink(painter, Qt.PenStyle.NoPen, QColor(self._theme.text))
        x, y = self.width() - 16.0, 0.5 * self.height()
        painter.drawPolygon(
            QPolygonF([QPointF(x - 5, y - 3), QPointF(x + 5, y - 3), QPointF(x, y + 4)])
        )


def form_field(name: str, tip: str, text: str = "") -> FormField:
    """Return a field in a type readable while standing."""
    field = dressed(FormField(text), name, tip, font=text_font(15))
    field.setPlaceholderText(tip)
    return field


def caption(text: str, buddy: QWidget | None = None, pixels: int = 14) -> QLabel:
    label = dressed(PlainLabel(text), font=text_font(pixels), role="muted")
    if buddy is not None:
        label.setBuddy(buddy)
    return label


def form_grid(
    fields: Iterable[QWidget], *, across: int = 1, down: int = 0, first: int = 0, pixels: int = 14
) -> QGridLayout:
    """Return fields with their accessible names as captions.

    `across`: Fields of a row; or `down`, fields of a column. `first`: row. `pixels`: of captions.
    """
    grid = QGridLayout()
    for number, field in enumerate(fields):
        row, column = divmod(number, across)
        if down:
            column, row = divmod(number, down)
        buddy = None if isinstance(field, QLabel) else field
        grid.addWidget(caption(field.accessibleName(), buddy, pixels), first + row, 2 * column)
        grid.addWidget(field, first + row, 2 * column + 1)
    return grid


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
