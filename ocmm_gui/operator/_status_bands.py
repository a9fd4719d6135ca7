"""Bands on every screen: simulated measurements, status of the tip, state of the calibration."""

from __future__ import annotations

from enum import Enum

from PySide6.QtCore import QPointF, QRectF, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QFrame, QWidget

from ocmm_core.calibration.records import CalibrationStatus, CalibrationView, ProbeView
from ocmm_core.inspection.evaluation import SIMULATED
from ocmm_gui import kit
from ocmm_gui.kit import tr

_DESK_SHARE = 0.022
"""Type size over window height at the desk."""


class SimulatedBand(kit.PaintedWidget):
    """One word, vertical, repeated as space permits. Costs only width: height is scarce."""

    def __init__(self) -> None:
        super().__init__(tr("Simulated: not a real part"), (30, 400), (12, 60))
        self._far = False
        self.hide()

    def show_far(self, far: bool) -> None:
        """Set the type for far or near reading."""
        self._far = far
        self._fit()

    def type_pixels(self) -> int:
        if self._far:
            return kit.far_type(self)
        return max(13, round(_DESK_SHARE * self.window().height()))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the width that the type needs."""
        super().resizeEvent(event)
        self._fit()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(self._theme.warn))
        painter.setPen(QColor(self._theme.background))
        painter.setFont(kit.text_font(self.type_pixels(), bold=True))
        text = kit.said_word(SIMULATED)
        word = painter.fontMetrics().horizontalAdvance(text)
        times = max(1, self.height() // (2 * word))
        share = self.height() / times
        painter.translate(0.0, self.height())
        painter.rotate(-90.0)
        # Centre the capitals: the descent is unused.
        base = 0.5 * (self.width() + kit.CAP_HEIGHT * self.type_pixels())
        for index in range(times):
            painter.drawText(QPointF((index + 0.5) * share - 0.5 * word, base), text)

    def _fit(self) -> None:
        self.setFixedWidth(round(1.25 * kit.CAP_HEIGHT * self.type_pixels()))
        self.update()


_NEAR_PX = 14
_CALM_SHARE = 0.35
"""Relative to far type: good order need not be readable at three metres."""


class MarkedLine(kit.Themed, QFrame):
    """A mark with a sentence of its height; `key`: name in the style sheet."""

    def __init__(self, key: str, name: str, sentence: str, spacing: int, margin: int) -> None:
        super().__init__()
        self.setObjectName(key)
        self.setAccessibleName(name)
        self._mark = MarkView()
        self._text = kit.sentence_label(sentence, _NEAR_PX, middle=True)
        kit.hbox(
            self._mark, (self._text, 1), parent=self, spacing=spacing,
            margins=(14, margin, 14, margin),
        )  # fmt: skip

    def text(self) -> str:
        return self._text.text()

    def _show(self, text: str) -> None:
        self._text.setText(text)
        self._text.setToolTip(kit.literal(text))
        self._paint()

    def _use_style(
        self, mark: kit.Mark, pixels: int, colour: str, line: str, *, bold: bool = True
    ) -> None:
        """Use a mark, a size, the colour of the text, and the style of the line below."""
        theme, key = self._theme, self.objectName()
        self._mark.setFixedSize(round(1.1 * pixels), round(1.1 * pixels))
        self._mark.show_mark(mark, kit.mark_colour(theme, mark), theme.panel)
        self.setStyleSheet(
            f"#{key} {{ background: {theme.panel}; border-bottom: {line}; }}"
            f" #{key} QLabel {{ font-size: {pixels}px; color: {colour};"
            f" font-weight: {'bold' if bold else 'normal'}; }}"
        )


class TipLine(MarkedLine):
    """A mark and a sentence about the probe; always visible."""

    turned = Signal(object)
    """Emits the `ProbeView` when the tip starts or stops blocking points."""

    def __init__(self) -> None:
        super().__init__("tipline", tr("Probe and tip"), tr("Status of the tip"), 8, 2)
        self._view: ProbeView | None = None
        self._place = TrustPlace.DESK
        self._pixels = _NEAR_PX
        # Nothing to mark before the first view.
        self._mark.hide()

    def show_probe(self, view: ProbeView, place: TrustPlace) -> None:
        pixels = _NEAR_PX
        if place is TrustPlace.FAR:
            pixels = round((_CALM_SHARE if _is_calm(view) else 1.0) * kit.far_type(self))
        if (view, place, pixels) == (self._view, self._place, self._pixels):
            return
        before, self._view, self._place, self._pixels = self._view, view, place, pixels
        self._mark.show()
        self._show(tip_words(view, place))
        if before is not None and (before.blocking_reason is None) != (
            view.blocking_reason is None
        ):
            self.turned.emit(view)

    def _paint(self) -> None:
        theme, view = self._theme, self._view
        mark = kit.Mark.DONE if view is None else tip_mark(view)
        calm = view is None or _is_calm(view)
        colour = theme.muted if calm else kit.mark_colour(theme, mark)
        self._use_style(mark, self._pixels, colour, f"1px solid {theme.border}", bold=not calm)


def tip_mark(view: ProbeView) -> kit.Mark:
    if view.uncalibrated:
        return kit.Mark.BAD
    return {
        CalibrationStatus.VALID: kit.Mark.GOOD,
        CalibrationStatus.DESIGN: kit.Mark.DONE if view.blocker is None else kit.Mark.DOUBT,
        CalibrationStatus.DUE: kit.Mark.DOUBT,
        CalibrationStatus.SUSPECT: kit.Mark.DOUBT,
    }.get(view.word, kit.Mark.BAD)


def _is_calm(view: ProbeView) -> bool:
    return tip_mark(view) in (kit.Mark.DONE, kit.Mark.GOOD)


def tip_words(view: ProbeView, place: TrustPlace) -> str:
    """Return the probe status; from three metres only the tip name and one word."""
    word = tr("UNCALIBRATED") if view.uncalibrated else kit.said_word(view.word.value)
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
        why = f" {kit.said(view.blocker.what)}"
    elif view.blocker is not None and place is TrustPlace.MAINTAIN:
        why = " " + tr("No points: {blocker}").format(blocker=kit.said(str(view.blocker)))
    warnings = f" {' '.join(map(kit.said, view.warnings))}" if view.warnings else ""
    usable = view.word in (CalibrationStatus.VALID, CalibrationStatus.DUE) and bool(view.due_utc)
    line = tr("Probe {title}: {word}, {ball}.")
    if usable:
        line = tr("Probe {title}: {word} until {until}, {ball}.")
    line = line.format(title=view.title, word=word, until=kit.day_words(view.due_utc), ball=ball)
    return f"{line}{why}{warnings}"


_TRUST_NEAR_PX = 15


class TrustPlace(Enum):
    """Screen of the bar."""

    DESK = "desk"
    """Its status strip shows why no points are recorded."""
    FAR = "far"
    """Readable at three metres; the readout shows why no points are recorded."""
    MAINTAIN = "maintain"


class TrustBar(MarkedLine):
    """A mark with UNCALIBRATED, NO POINTS or a warning; hidden, without text, in good order."""

    def __init__(self) -> None:
        super().__init__("trust", tr("Calibration"), "", 10, 4)
        self._view: CalibrationView | None = None
        self._place = TrustPlace.DESK
        self._beside = ""
        self._pixels = _TRUST_NEAR_PX
        self.hide()

    def show_calibration(self, view: CalibrationView, place: TrustPlace, beside: str = "") -> None:
        """Show the status for a place, with ``beside`` for readers at the screen, or hide."""
        pixels = kit.far_type(self) if place is TrustPlace.FAR else _TRUST_NEAR_PX
        if (view, place, beside, pixels) == (self._view, self._place, self._beside, self._pixels):
            return
        self._view, self._place, self._beside, self._pixels = view, place, beside, pixels
        text = trust_words(view, place)
        if place is not TrustPlace.FAR:
            text = f"{text} {beside}".strip()
        self._show(text)
        self.setVisible(bool(text))

    def _paint(self) -> None:
        view = self._view
        severe = view is not None and (view.uncalibrated or view.blocker is not None)
        mark = kit.Mark.BAD if severe else kit.Mark.DOUBT
        colour = kit.mark_colour(self._theme, mark)
        self._use_style(mark, self._pixels, colour, f"3px solid {colour}")


class MarkView(QWidget):
    """A mark as large as the widget."""

    def __init__(self) -> None:
        super().__init__()
        self._shown = (kit.Mark.DOUBT, "#000000", "#000000")

    def show_mark(self, mark: kit.Mark, colour: str, inside: str) -> None:
        """Show a mark; ``inside`` is the colour of its cut-outs."""
        self._shown = (mark, colour, inside)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        mark, colour, inside = self._shown
        kit.paint_mark(QPainter(self), mark, QRectF(self.rect()), colour, inside)


def trust_words(view: CalibrationView, place: TrustPlace) -> str:
    """Return the text; empty in good order, and if shown elsewhere on the screen."""
    warnings = " ".join(map(kit.said, view.warnings))
    if view.uncalibrated:
        if place is TrustPlace.FAR:
            return tr("UNCALIBRATED: no proof")
        why = kit.said(view.blocker.what) if view.blocker is not None else ""
        return (
            tr("UNCALIBRATED: results are not proven. {why} {warnings}")
            .format(why=why, warnings=warnings)
            .strip()
        )
    if view.blocker is not None:
        return (
            tr("NO POINTS: {blocker}").format(blocker=kit.said(str(view.blocker)))
            if place is TrustPlace.MAINTAIN
            else ""
        )
    # Warnings cannot be resolved three metres away.
    return "" if place is TrustPlace.FAR else warnings
