"""The place where the folder of the report is given; it is part of the window, not a dialog."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QLineEdit, QPushButton


class ExportPanel(QFrame):
    """One line: folder, Write, Cancel. Measuring goes on while it is open."""

    folder_given = Signal(object)
    """Emits the `Path` to write into."""

    def __init__(self, proposal: Path) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self.setAccessibleName("Export")
        self._field = _PathField(str(proposal))
        self._field.setObjectName("folder")
        self._field.setAccessibleName("Folder of the report")
        self._field.setMinimumWidth(300)
        write = QPushButton("Write")
        write.setAccessibleName("Write the report")
        write.setProperty("role", "primary")
        cancel = QPushButton("Cancel")
        cancel.setAccessibleName("Close without writing")
        label = QLabel("Write the report into the folder")
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

    def ask(self) -> None:
        """Open the panel with the keyboard in the field."""
        self.show()
        self._field.setFocus()
        self._field.selectAll()

    def _give(self) -> None:
        text = self._field.text().strip()
        if text:
            self.hide()
            self.folder_given.emit(Path(text).expanduser())


class _PathField(QLineEdit):
    """A field that keeps its keys, so that a path with a space in it takes no point."""

    left = Signal()
    """Esc was pressed."""

    def event(self, event: QEvent) -> bool:
        if event.type() is QEvent.Type.ShortcutOverride:
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.left.emit()
            return
        super().keyPressEvent(event)
