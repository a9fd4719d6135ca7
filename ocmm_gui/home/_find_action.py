"""Search over all actions of the window; Return runs the first one."""

from __future__ import annotations

from collections.abc import Mapping

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QAction, QKeyEvent
from PySide6.QtWidgets import QFrame, QListWidget, QListWidgetItem, QWidget

from ocmm_gui.kit import OwnKeysField, dressed, key_words, list_step, literal, text_font, tr, vbox

_ROW_PX = 42
_SHOWN = 8
_SHARE, _TOP_PX = 0.7, 48


class FindAction(QFrame):
    """A field with matching actions, best first, over the active page.

    Disabled actions are omitted unless another page provides them, which is then shown.
    """

    closed = Signal()
    """The search is over; an action may have been run."""
    other_wanted = Signal(str)
    """Emits the key of an action of another page."""

    def __init__(self, over: QWidget) -> None:
        super().__init__(over)
        self.setProperty("role", "panel")
        self.setAccessibleName(tr("Find an action"))
        self._actions: dict[str, QAction] = {}
        self._others: frozenset[str] = frozenset()
        name = tr("What do you want to do?")
        self.field = dressed(_Field(), name, font=text_font(20), high=57)
        self.field.setPlaceholderText(tr("What do you want to do? Return does it, Esc closes."))
        self.list = dressed(QListWidget(), tr("Actions that fit"), font=text_font(17))
        self.list.setFixedHeight(_SHOWN * _ROW_PX + 8)
        self.list.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        vbox(self.field, self.list, parent=self, margins=(10, 8, 10, 8))
        self.field.textEdited.connect(lambda _text: self._show())
        self.field.returnPressed.connect(self._do)
        self.field.left.connect(self.close_search)
        self.field.moved.connect(self._move)
        self.list.itemClicked.connect(lambda _item: self._do())
        self.hide()

    def ask(
        self, actions: Mapping[str, QAction], others: Mapping[str, QAction] | None = None
    ) -> None:
        """Open the search over enabled actions, followed by those of other pages."""
        now = {key: action for key, action in actions.items() if action.isEnabled()}
        elsewhere = {key: one for key, one in (others or {}).items() if key not in now}
        self._actions, self._others = now | elsewhere, frozenset(elsewhere)
        self.field.clear()
        self._show()
        over = self.parentWidget()
        if over is not None:
            width = round(_SHARE * over.width())
            self.setGeometry((over.width() - width) // 2, _TOP_PX, width, self.sizeHint().height())
        self.show()
        self.raise_()
        self.field.setFocus()

    def close_search(self) -> None:
        self.hide()
        self.closed.emit()

    def _do(self) -> None:
        chosen = self.list.selectedItems()
        key = chosen[0].data(Qt.ItemDataRole.UserRole) if chosen else ""
        self.close_search()
        if key in self._others:
            self.other_wanted.emit(key)
        elif key:
            self._actions[key].trigger()

    def _move(self, step: int) -> None:
        count = self.list.count()
        if count:
            self.list.setCurrentRow((self.list.currentRow() + step) % count)

    def _show(self) -> None:
        self.list.clear()
        for key in fitting(self.field.text(), self._actions):
            action = self._actions[key]
            keys = key_words(action.shortcut())
            about = action.toolTip()
            item = QListWidgetItem(f"{action.text()}  [{keys}]   {about}", self.list)
            item.setToolTip(literal(about))
            item.setData(Qt.ItemDataRole.UserRole, key)
            item.setSizeHint(QSize(200, _ROW_PX))
        if not self.list.count():
            nothing = QListWidgetItem(tr("Nothing found. Type less."), self.list)
            nothing.setFlags(Qt.ItemFlag.NoItemFlags)
            nothing.setSizeHint(QSize(200, _ROW_PX))
            return
        self.list.setCurrentRow(0)


def fitting(text: str, actions: Mapping[str, QAction]) -> tuple[str, ...]:
    """Return the keys of actions with all typed words: name prefixes, names, explanations."""
    words = text.lower().split()
    ranked = []
    for place, (key, action) in enumerate(actions.items()):
        if key == "find":
            continue
        name, about = action.text().lower(), action.toolTip().lower()
        if not all(word in name or word in about for word in words):
            continue
        whole = " ".join(words)
        rank = 0 if name.startswith(whole) else 1 if whole in name else 2
        ranked.append((rank, place, key))
    return tuple(key for _rank, _place, key in sorted(ranked))


class _Field(OwnKeysField):
    moved = Signal(int)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if step := list_step(event):
            self.moved.emit(step)
            return
        super().keyPressEvent(event)
