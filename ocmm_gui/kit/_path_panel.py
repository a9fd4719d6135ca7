"""The place where a file or folder to write is given; it is part of the window, not a dialog."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLineEdit, QPushButton

from ocmm_gui.kit._texts import PlainLabel, tr


class PathPanel(QFrame):
    """One line: path, Write, Cancel. Measuring goes on while it is open.

    Parameters
    ----------
    what
        What is done, before the field, e.g. ``"Write the report into the folder"``.
    asked
        What stands in the field, e.g. ``"Folder of the report"``.
    verb
        On the button.
    """

    given = Signal(object)
    """Emits the `Path` that was given."""

    def __init__(self, what: str, asked: str, verb: str) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self.setAccessibleName(what)
        self._field = OwnKeysField()
        self._field.setObjectName("path")
        self._field.setAccessibleName(asked)
        self._field.setMinimumWidth(300)
        write = QPushButton(verb)
        write.setAccessibleName(what)
        write.setProperty("role", "primary")
        cancel = QPushButton(tr("Cancel"))
        cancel.setAccessibleName(tr("Close without changes"))
        label = PlainLabel(what)
        label.setBuddy(self._field)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(12, 6, 8, 6)
        layout.addWidget(label)
        layout.addWidget(self._field, 1)
        layout.addWidget(write)
        layout.addWidget(cancel)
        self._field.returnPressed.connect(self._give)
        self._field.left.connect(self.hide)
        write.clicked.connect(self._give)
        cancel.clicked.connect(self.hide)
        self.hide()

    def ask(self, proposal: Path) -> None:
        """Open the panel with the keyboard in the field."""
        self._field.setText(str(proposal))
        self.show()
        self._field.setFocus()
        self._field.selectAll()

    def _give(self) -> None:
        text = self._field.text().strip()
        if text:
            self.hide()
            self.given.emit(Path(text).expanduser())


class OwnKeysField(QLineEdit):
    """A field that keeps its keys, so that a path with a space in it takes no point."""

    left = Signal()
    """Esc was pressed."""

    def event(self, event: QEvent) -> bool:
        """Keep every key from the shortcuts of the window."""
        if event.type() is QEvent.Type.ShortcutOverride:
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Leave at Esc."""
        if event.key() == Qt.Key.Key_Escape:
            self.left.emit()
            return
        super().keyPressEvent(event)
