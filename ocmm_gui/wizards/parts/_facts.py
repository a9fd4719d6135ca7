from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QGridLayout, QLabel, QScrollArea, QVBoxLayout, QWidget

from ocmm_gui.kit import PlainLabel, sentence_label, text_font, tr


def figures_area(told: QVBoxLayout) -> QScrollArea:
    """Return a scrollable area of figures and reasons, for small windows."""
    holder = QWidget()
    holder.setLayout(told)
    area = QScrollArea()
    area.setAccessibleName(tr("Figures and reasons"))
    area.setWidgetResizable(True)
    area.setFrameShape(QFrame.Shape.NoFrame)
    area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    area.setWidget(holder)
    return area


class Facts(QWidget):
    """Captions with values, one per line; long values wrap."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self._rows: dict[str, QLabel] = {}
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setHorizontalSpacing(12)
        self._grid.setVerticalSpacing(6)
        self._grid.setColumnStretch(1, 1)

    def show_facts(self, facts: Sequence[tuple[str, str]]) -> None:
        """Show captions with values; remove others."""
        named = dict(facts)
        for caption in [one for one in self._rows if one not in named]:
            for label in (self._rows.pop(caption), *self.findChildren(QLabel, caption)):
                label.hide()
                label.deleteLater()
        for caption, value in facts:
            if caption not in self._rows:
                self._add(caption)
            if self._rows[caption].text() != value:
                self._rows[caption].setText(value)

    def value(self, caption: str) -> str:
        return self._rows[caption].text()

    def _add(self, caption: str) -> None:
        row = self._grid.rowCount()
        left = PlainLabel(caption)
        left.setObjectName(caption)
        left.setProperty("role", "muted")
        left.setFont(text_font(16))
        left.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop)
        right = sentence_label(caption, 16)
        self._grid.addWidget(left, row, 0)
        self._grid.addWidget(right, row, 1)
        self._rows[caption] = right
