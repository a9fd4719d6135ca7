"""Bar on every screen while the calibration is not in good order."""

from __future__ import annotations

from enum import Enum

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QSizePolicy, QWidget

from ocmm_core.calibration.records import CalibrationView
from ocmm_gui.kit import (
    DEFAULT_THEME,
    THEMES,
    Mark,
    PlainLabel,
    Theme,
    far_type,
    literal,
    paint_mark,
    said,
    tr,
)

_NEAR_PX = 15


class TrustPlace(Enum):
    """Screen of the bar."""

    DESK = "desk"
    """Its status strip shows why no points are recorded."""
    FAR = "far"
    """Readable at three metres; the readout shows why no points are recorded."""
    MAINTAIN = "maintain"


class TrustBar(QFrame):
    """A mark with UNCALIBRATED, NO POINTS or a warning; hidden in good order."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("trust")
        self.setAccessibleName(tr("Calibration"))
        self._theme = THEMES[DEFAULT_THEME]
        self._view: CalibrationView | None = None
        self._place = TrustPlace.DESK
        self._beside = ""
        self._pixels = _NEAR_PX
        self._mark = MarkView()
        self._text = PlainLabel()
        self._text.setTextFormat(Qt.TextFormat.PlainText)
        self._text.setWordWrap(True)
        self._text.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(14, 4, 14, 4)
        layout.setSpacing(10)
        layout.addWidget(self._mark)
        layout.addWidget(self._text, 1)
        self.hide()

    def show_calibration(self, view: CalibrationView, place: TrustPlace, beside: str = "") -> None:
        """Show the status for a place, with ``beside`` for readers at the screen, or hide."""
        pixels = far_type(self) if place is TrustPlace.FAR else _NEAR_PX
        if (view, place, beside, pixels) == (self._view, self._place, self._beside, self._pixels):
            return
        self._view, self._place, self._beside, self._pixels = view, place, beside, pixels
        text = trust_words(view, place)
        if place is not TrustPlace.FAR:
            text = f"{text} {beside}".strip()
        self._text.setText(text)
        self._text.setToolTip(literal(text))
        self._paint()
        self.setVisible(bool(text))

    def text(self) -> str:
        """Return the text; empty while hidden."""
        return self._text.text()

    def set_theme(self, theme: Theme) -> None:
        self._theme = theme
        self._paint()

    def _paint(self) -> None:
        theme, view = self._theme, self._view
        severe = view is not None and (view.uncalibrated or view.blocker is not None)
        colour = theme.bad if severe else theme.warn
        pixels = self._pixels
        self._mark.setFixedSize(round(1.1 * pixels), round(1.1 * pixels))
        self._mark.show_mark(Mark.BAD if severe else Mark.DOUBT, colour, theme.panel)
        self.setStyleSheet(
            f"#trust {{ background: {theme.panel}; border-bottom: 3px solid {colour}; }}"
            f" #trust QLabel {{ color: {colour}; font-size: {pixels}px; font-weight: bold; }}"
        )


class MarkView(QWidget):
    """A mark as large as the widget."""

    def __init__(self) -> None:
        super().__init__()
        self._shown = (Mark.DOUBT, "#000000", "#000000")

    def show_mark(self, mark: Mark, colour: str, inside: str) -> None:
        """Show a mark; ``inside`` is the colour of its cut-outs."""
        self._shown = (mark, colour, inside)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        mark, colour, inside = self._shown
        paint_mark(QPainter(self), mark, QRectF(self.rect()), colour, inside)


def trust_words(view: CalibrationView, place: TrustPlace) -> str:
    """Return the text; empty in good order, and if shown elsewhere on the screen."""
    warnings = " ".join(map(said, view.warnings))
    if view.uncalibrated:
        if place is TrustPlace.FAR:
            return tr("UNCALIBRATED: no proof")
        why = said(view.blocker.what) if view.blocker is not None else ""
        return (
            tr("UNCALIBRATED: results are not proven. {why} {warnings}")
            .format(why=why, warnings=warnings)
            .strip()
        )
    if view.blocker is not None:
        return (
            tr("NO POINTS: {blocker}").format(blocker=said(str(view.blocker)))
            if place is TrustPlace.MAINTAIN
            else ""
        )
    # Warnings cannot be resolved three metres away.
    return "" if place is TrustPlace.FAR else warnings
