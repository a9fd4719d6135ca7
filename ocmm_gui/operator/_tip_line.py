"""Line on every screen with the mounted tip and its status."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QSizePolicy

from ocmm_core.calibration.records import CalibrationStatus, ProbeView
from ocmm_gui.kit import (
    DEFAULT_THEME,
    THEMES,
    Mark,
    PlainLabel,
    Theme,
    day_words,
    far_type,
    literal,
    mark_colour,
    said,
    said_word,
    tr,
)
from ocmm_gui.operator._trust_bar import MarkView, TrustPlace

_NEAR_PX = 14
_CALM_SHARE = 0.35
"""Relative to far type: good order need not be readable at three metres."""


class TipLine(QFrame):
    """A mark and a sentence about the probe; always visible."""

    turned = Signal(object)
    """Emits the `ProbeView` when the tip starts or stops blocking points."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("tipline")
        self.setAccessibleName(tr("Probe and tip"))
        self._theme = THEMES[DEFAULT_THEME]
        self._view: ProbeView | None = None
        self._place = TrustPlace.DESK
        self._pixels = _NEAR_PX
        self._mark = MarkView()
        # Nothing to mark before the first view.
        self._mark.hide()
        self._text = PlainLabel()
        self._text.setAccessibleName(tr("Status of the tip"))
        self._text.setTextFormat(Qt.TextFormat.PlainText)
        self._text.setWordWrap(True)
        self._text.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(14, 2, 14, 2)
        layout.setSpacing(8)
        layout.addWidget(self._mark)
        layout.addWidget(self._text, 1)

    def show_probe(self, view: ProbeView, place: TrustPlace) -> None:
        pixels = _NEAR_PX
        if place is TrustPlace.FAR:
            pixels = round((_CALM_SHARE if _is_calm(view) else 1.0) * far_type(self))
        if (view, place, pixels) == (self._view, self._place, self._pixels):
            return
        before, self._view, self._place, self._pixels = self._view, view, place, pixels
        text = tip_words(view, place)
        self._mark.show()
        self._text.setText(text)
        self._text.setToolTip(literal(text))
        self._paint()
        if before is not None and (before.blocking_reason is None) != (
            view.blocking_reason is None
        ):
            self.turned.emit(view)

    def text(self) -> str:
        return self._text.text()

    def set_theme(self, theme: Theme) -> None:
        self._theme = theme
        self._paint()

    def _paint(self) -> None:
        theme, view = self._theme, self._view
        mark = Mark.DONE if view is None else tip_mark(view)
        calm = view is None or _is_calm(view)
        colour = theme.muted if calm else mark_colour(theme, mark)
        pixels = self._pixels
        self._mark.setFixedSize(round(1.1 * pixels), round(1.1 * pixels))
        self._mark.show_mark(mark, mark_colour(theme, mark), theme.panel)
        weight = "normal" if calm else "bold"
        self.setStyleSheet(
            f"#tipline {{ background: {theme.panel}; border-bottom: 1px solid {theme.border}; }}"
            f" #tipline QLabel {{ color: {colour}; font-size: {pixels}px; font-weight: {weight}; }}"
        )


def tip_mark(view: ProbeView) -> Mark:
    if view.uncalibrated:
        return Mark.BAD
    return {
        CalibrationStatus.VALID: Mark.GOOD,
        CalibrationStatus.DESIGN: Mark.DONE if view.blocker is None else Mark.DOUBT,
        CalibrationStatus.DUE: Mark.DOUBT,
        CalibrationStatus.SUSPECT: Mark.DOUBT,
    }.get(view.word, Mark.BAD)


def _is_calm(view: ProbeView) -> bool:
    return tip_mark(view) in (Mark.DONE, Mark.GOOD)


def tip_words(view: ProbeView, place: TrustPlace) -> str:
    """Return the probe status; from three metres only the tip name and one word."""
    word = tr("UNCALIBRATED") if view.uncalibrated else said_word(view.word.value)
    if place is TrustPlace.FAR:
        return (
            tr("Tip {tip}: {word}").format(tip=view.tip, word=word)
            if view.tip
            else tr("Probe {probe}: {word}").format(probe=view.probe, word=word)
        )
    ball = tr("ball {diameter_mm:.4f} mm").format(diameter_mm=view.diameter_mm)
    if view.word is CalibrationStatus.DESIGN and view.blocker is None:
        return tr("Probe {title}: {word}, nominal geometry, {ball}.").format(
            title=view.title, word=word, ball=ball
        )
    # The desk view's status strip already shows why no points are recorded.
    why = ""
    if view.blocker is not None and view.uncalibrated:
        why = f" {said(view.blocker.what)}"
    elif view.blocker is not None and place is TrustPlace.MAINTAIN:
        why = " " + tr("No points: {blocker}").format(blocker=said(str(view.blocker)))
    warnings = f" {' '.join(map(said, view.warnings))}" if view.warnings else ""
    usable = view.word in (CalibrationStatus.VALID, CalibrationStatus.DUE) and bool(view.due_utc)
    line = tr("Probe {title}: {word}, {ball}.")
    if usable:
        line = tr("Probe {title}: {word} until {until}, {ball}.")
    line = line.format(title=view.title, word=word, until=day_words(view.due_utc), ball=ball)
    return f"{line}{why}{warnings}"
