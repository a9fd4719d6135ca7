"""The field in which somebody types what the manual is searched for, and a hit in words."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtGui import QKeyEvent

from ocmm_core.manual import ManualHit
from ocmm_gui.kit import FormField, list_step, literal, text_font


class SearchField(FormField):
    """Up and Down move in what was found."""

    moved = Signal(int)

    @classmethod
    def of(cls, name: str, tip: str) -> SearchField:
        """Return the field with its names."""
        field = cls("")
        field.setAccessibleName(name)
        field.setToolTip(literal(tip))
        field.setPlaceholderText(tip)
        field.setFont(text_font(15))
        return field

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move in the list, or type."""
        if step := list_step(event):
            self.moved.emit(step)
            return
        super().keyPressEvent(event)


def hit_words(hit: ManualHit) -> str:
    """Return a hit as it stands in the list: where, and the words around it."""
    where = hit.title if hit.title == hit.chapter else f"{hit.chapter}: {hit.title}"
    return f"{where}\n{hit.excerpt}" if hit.excerpt else where
