from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout

from ocmm_gui.kit._narrow import NarrowButton
from ocmm_gui.kit._path_panel import OwnKeysField
from ocmm_gui.kit._texts import PlainLabel, later, tr

PROPOSAL = later("missed the surface")


class ReasonPanel(QFrame):
    """One line: object, reason, Delete, Cancel."""

    given = Signal(int, str)
    """Emits the number of the point and the reason."""

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self.setAccessibleName(tr("Delete a point"))
        self._number = 0
        self._label = PlainLabel()
        self.field = OwnKeysField()
        self.field.setAccessibleName(tr("Reason for deletion"))
        self.field.setMinimumWidth(260)
        self._label.setBuddy(self.field)
        delete = NarrowButton(tr("Delete"))
        delete.setAccessibleName(tr("Delete the point now"))
        delete.setProperty("role", "primary")
        cancel = NarrowButton(tr("Cancel"))
        cancel.setAccessibleName(tr("Close without deleting"))
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
        """Open the panel for a point, with the focus in the field."""
        self._number = number
        self._label.setText(tr("Reason for deleting point {number}").format(number=number))
        self.field.setText(tr(PROPOSAL))
        self.show()
        self.field.setFocus()
        self.field.selectAll()

    def _give(self) -> None:
        reason = self.field.text().strip()
        if reason:
            self.hide()
            self.given.emit(self._number, reason)
