"""Sheets: pages opened during measuring and closed with Esc without loss, and parts made late."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeVar

from PySide6.QtCore import QObject, QPointF, Qt, Signal
from PySide6.QtGui import QAction, QColor, QKeyEvent, QPainter, QPaintEvent, QPolygonF
from PySide6.QtWidgets import QComboBox, QGridLayout, QLabel, QSizePolicy, QWidget

from ocmm_core.errors import OcmmError
from ocmm_gui.kit._actions import ActionInfo
from ocmm_gui.kit._marks import ink
from ocmm_gui.kit._narrow import PlainLabel
from ocmm_gui.kit._panels import OwnKeysField
from ocmm_gui.kit._parts import dressed, hbox, sentence_label, vbox
from ocmm_gui.kit._shortcuts import F_KEYS, make_action, make_button
from ocmm_gui.kit._texts import later, literal, tr
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
    field = dressed(FormField(text), name)
    field.setToolTip(literal(tip))
    field.setPlaceholderText(tip)
    field.setFont(text_font(15))
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
