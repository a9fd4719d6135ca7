from __future__ import annotations

from PySide6.QtWidgets import QVBoxLayout, QWidget

from ocmm_gui.kit import caption


def labelled(name: str, field: QWidget) -> QWidget:
    holder = QWidget()
    layout = QVBoxLayout(holder)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(2)
    layout.addWidget(caption(name, field))
    layout.addWidget(field)
    return holder
