"""The line in which a reason is given; it is part of the window, not a dialog."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton

from ocmm_gui.kit._path_panel import OwnKeysField

PROPOSAL = "missed the surface"


class ReasonPanel(QFrame):
    """One line: what is deleted, why, Delete, Cancel. Measuring goes on while it is open."""

    given = Signal(int, str)
    """Emits the number of the point and the reason."""

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self.setAccessibleName("Delete a point")
        self._number = 0
        self._label = QLabel()
        self.field = OwnKeysField()
        self.field.setAccessibleName("Reason for deletion")
        self.field.setMinimumWidth(260)
        self._label.setBuddy(self.field)
        delete = QPushButton("Delete")
        delete.setAccessibleName("Delete the point now")
        delete.setProperty("role", "primary")
        cancel = QPushButton("Cancel")
        cancel.setAccessibleName("Close without deleting")
        layout = QHBoxLayout(self)
        layout.setContentsMargins(12, 6, 8, 6)
        layout.addWidget(self._label)
        layout.addWidget(self.field, 1)
        layout.addWidget(delete)
        layout.addWidget(cancel)
        self.field.returnPressed.connect(self._give)
        self.field.left.connect(self.hide)
        delete.clicked.connect(self._give)
        cancel.clicked.connect(self.hide)
        self.hide()

    def ask(self, number: int) -> None:
        """Open the panel for a point, with the keyboard in the field."""
        self._number = number
        self._label.setText(f"Reason for deleting point {number}")
        self.field.setText(PROPOSAL)
        self.show()
        self.field.setFocus()
        self.field.selectAll()

    def _give(self) -> None:
        reason = self.field.text().strip()
        if reason:
            self.hide()
            self.given.emit(self._number, reason)
