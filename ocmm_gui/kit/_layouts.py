"""Box layouts in one call (contents with stretch, spacing and margins, px), and named widgets."""

from __future__ import annotations

from typing import TypeVar

from PySide6.QtGui import QFont
from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QLayout, QVBoxLayout, QWidget

Part = QWidget | QLayout | tuple[QWidget | QLayout, int]
"""Widget or layout, with its stretch if not zero."""
B = TypeVar("B", bound=QBoxLayout)
W = TypeVar("W", bound=QWidget)


def vbox(
    *parts: Part,
    parent: QWidget | None = None,
    spacing: int | None = None,
    margins: int | tuple[int, int, int, int] | None = None,
) -> QVBoxLayout:
    """Return a column; ``margins`` are equal, or left, top, right, bottom; None: as the style."""
    made = QVBoxLayout() if parent is None else QVBoxLayout(parent)
    return _filled(made, parts, spacing, margins)


def hbox(
    *parts: Part,
    parent: QWidget | None = None,
    spacing: int | None = None,
    margins: int | tuple[int, int, int, int] | None = None,
) -> QHBoxLayout:
    """Return a row; see `vbox`."""
    made = QHBoxLayout() if parent is None else QHBoxLayout(parent)
    return _filled(made, parts, spacing, margins)


def fill(layout: QBoxLayout, *parts: Part) -> None:
    """Append parts to a layout."""
    for part in parts:
        content, stretch = part if isinstance(part, tuple) else (part, 0)
        if isinstance(content, QWidget):
            layout.addWidget(content, stretch)
        else:
            layout.addLayout(content, stretch)


def dressed(
    widget: W, name: str = "", tip: str = "", *, font: QFont | None = None, role: str = ""
) -> W:
    """Return a widget with its accessible name and description, font, and role of the styles."""
    if name:
        widget.setAccessibleName(name)
    if tip:
        widget.setAccessibleDescription(tip)
    if font is not None:
        widget.setFont(font)
    if role:
        widget.setProperty("role", role)
    return widget


def _filled(
    layout: B,
    parts: tuple[Part, ...],
    spacing: int | None,
    margins: int | tuple[int, int, int, int] | None,
) -> B:
    if spacing is not None:
        layout.setSpacing(spacing)
    if margins is not None:
        left, top, right, bottom = (margins,) * 4 if isinstance(margins, int) else margins
        layout.setContentsMargins(left, top, right, bottom)
    fill(layout, *parts)
    return layout
