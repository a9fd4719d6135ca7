"""List of all keys of the window, changeable."""

from __future__ import annotations

from collections.abc import Mapping

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent, QKeySequence
from PySide6.QtWidgets import (
    QHBoxLayout,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from ocmm_gui.home._setting_row import HIGH_PX
from ocmm_gui.kit import (
    ACTIONS,
    ActionInfo,
    NarrowButton,
    PlainLabel,
    conflict_of,
    key_words,
    sentence_label,
    shortcuts_of,
    text_font,
    tr,
)

_ROW_PX = 40
_BARE = (
    Qt.Key.Key_Shift, Qt.Key.Key_Control, Qt.Key.Key_Alt, Qt.Key.Key_Meta, Qt.Key.Key_AltGr,
    Qt.Key.Key_CapsLock, Qt.Key.Key_NumLock, Qt.Key.Key_unknown,
)  # fmt: skip
_KEPT = ("Esc", "Tab", "Shift+Tab", "Shift+Backtab", "Backtab")
"""Reserved navigation keys."""


class KeyList(QWidget):
    """Select an action, press Change, and press the new key; keys in use are refused."""

    changed = Signal(object)
    """Emits all non-default keys, by action."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Keys"))
        self._changed: dict[str, tuple[str, ...]] = {}
        self.list = QListWidget()
        self.list.setAccessibleName(tr("Actions and their keys"))
        self.list.setFont(text_font(16))
        self.told = sentence_label(tr("About the chosen key"), 15)
        self.told.setText(
            tr("Choose an action and press Change; a foot switch is set up likewise.")
        )
        self.capture = _Capture()
        self.capture.pressed_key.connect(self.take)
        self.capture.given_up.connect(self._give_up)
        self._change = _wide(tr("Change"))
        self._change.clicked.connect(self._begin)
        self._default = _wide(tr("Default key"))
        self._default.clicked.connect(self.restore)
        row = QHBoxLayout()
        row.addWidget(self._change)
        row.addWidget(self._default)
        row.addWidget(self.capture, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.list, 1)
        layout.addWidget(self.told)
        layout.addLayout(row)
        self.list.itemActivated.connect(lambda _item: self._begin())
        self.show_keys({})

    def show_keys(self, changed: Mapping[str, tuple[str, ...]]) -> None:
        self._changed = dict(changed)
        row = max(self.list.currentRow(), 0)
        self.list.clear()
        for info in ACTIONS:
            keys = ", ".join(map(key_words, shortcuts_of(info, changed)))
            mark = "●" if info.key in changed else "  "
            item = QListWidgetItem(f"{mark} {keys}   {tr(info.text)}: {tr(info.tip)}", self.list)
            item.setData(Qt.ItemDataRole.UserRole, info.key)
            item.setSizeHint(QSize(200, _ROW_PX))
        self.list.setCurrentRow(min(row, self.list.count() - 1))

    def select(self, key: str) -> None:
        self.list.setCurrentRow([info.key for info in ACTIONS].index(key))

    def take(self, shortcut: str) -> None:
        """Assign a key to the selected action, or show why not."""
        info = self._chosen()
        other = conflict_of(info.key, shortcut, self._changed)
        if shortcut in _KEPT:
            self.told.setText(
                tr("{key} leaves and walks through pages.").format(key=key_words(shortcut))
            )
        elif other is not None:
            self.told.setText(
                tr(
                    "{key} is already {action}. Choose another key, or change that one first."
                ).format(key=key_words(shortcut), action=tr(other.text))
            )
        else:
            self.told.setText(
                tr("{action} is now on {key}.").format(
                    action=tr(info.text), key=key_words(shortcut)
                )
            )
            # Foot switch keys (F13 and up) are kept in addition to the new key.
            kept = tuple(
                key for key in info.shortcuts[1:] if key.startswith("F1") and key != shortcut
            )
            self.changed.emit({**self._changed, info.key: (shortcut, *kept)})
        self.list.setFocus()

    def restore(self) -> None:
        info = self._chosen()
        left = {key: keys for key, keys in self._changed.items() if key != info.key}
        taken = [conflict_of(info.key, key, left) for key in info.shortcuts]
        other = next((one for one in taken if one is not None), None)
        if other is not None:
            self.told.setText(
                tr("The default key is now {action}. Change that one first.").format(
                    action=tr(other.text)
                )
            )
        elif info.key in self._changed:
            self.changed.emit(left)

    def _chosen(self) -> ActionInfo:
        return ACTIONS[max(self.list.currentRow(), 0)]

    def _begin(self) -> None:
        self.told.setText(
            tr("Press the new key of {action}. Esc keeps the old one.").format(
                action=tr(self._chosen().text)
            )
        )
        self.capture.listen()

    def _give_up(self) -> None:
        self.told.setText(tr("The key was not changed."))
        self.list.setFocus()


class _Capture(PlainLabel):
    """Captures the next key, whatever its other meaning."""

    pressed_key = Signal(str)
    given_up = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Press the new key"))
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setFont(text_font(16, bold=True))
        self._listens = False

    def listen(self) -> None:
        self._listens = True
        self.setText(tr("Waiting for a key"))
        self.setFocus()
        self.grabKeyboard()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key = Qt.Key(event.key())
        if not self._listens or key in _BARE:
            return
        self._end()
        if key == Qt.Key.Key_Escape:
            self.given_up.emit()
            return
        shortcut = QKeySequence(event.keyCombination()).toString(
            QKeySequence.SequenceFormat.PortableText
        )
        self.pressed_key.emit(shortcut)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Stop capturing: after a click elsewhere the next key has another target."""
        super().focusOutEvent(event)
        if self._listens:
            self._end()
            self.given_up.emit()

    def _end(self) -> None:
        self._listens = False
        self.setText("")
        self.releaseKeyboard()


def _wide(text: str) -> QPushButton:
    button = NarrowButton(text)
    button.setAccessibleName(text)
    button.setMinimumHeight(HIGH_PX)
    button.setFont(text_font(16))
    return button
