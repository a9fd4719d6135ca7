from __future__ import annotations

from PySide6.QtCore import QRectF, QSize
from PySide6.QtGui import QColor, QPainter, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from ocmm_gui.kit._theme import DEFAULT_THEME, THEMES, Theme

SCENE_SIZE, SCENE_LEAST = (460, 340), (200, 130)
"""Size and minimum of pictures that fill most of a page."""


class Painted(QWidget):
    """A widget painted in the colours of a theme; ``size``: hint, ``least``: legible, px."""

    def __init__(self, name: str, size: tuple[int, int], least: tuple[int, int]) -> None:
        super().__init__()
        self._theme = THEMES[DEFAULT_THEME]
        self._size_hint = QSize(*size)
        self._least_size = QSize(*least)
        self.setAccessibleName(name)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def set_theme(self, theme: Theme) -> None:
        self._theme = theme
        self.update()

    def sizeHint(self) -> QSize:
        return self._size_hint

    def minimumSizeHint(self) -> QSize:
        return self._least_size

    def _painter(self) -> QPainter:
        """Return an antialiased painter; only for use in `paintEvent`."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        return painter

    def _paint_panel(self, painter: QPainter) -> QRectF:
        """Paint and return the frame of a panel, highlighted if it has the focus."""
        frame = QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5)
        theme = self._theme
        pen = QPen(QColor(theme.border), theme.border_px)
        if self.hasFocus():
            pen = QPen(QColor(theme.accent), theme.border_px + 1)
        painter.setPen(pen)
        painter.setBrush(QColor(self._theme.panel))
        painter.drawRoundedRect(frame, 6, 6)
        return frame
