"""Coach next to the readout: probe, uncertainty ellipse, helpful turn, or remedy."""

from __future__ import annotations

import math

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt, QTimer, Signal
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPaintEvent, QPen, QPolygonF

from ocmm_core.coach import Ellipsoid, Hint, ProbePicture, Turn, Way
from ocmm_core.geometry import Float
from ocmm_core.measuring import Refusal
from ocmm_core.station.coaching import NOTHING, CoachView
from ocmm_gui import kit
from ocmm_gui.kit import tr

_ROOM = 0.76
"""Share of the box for the probe; the rest is for the arrow."""
_STEPS_UM = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000)
_FULL = 16 * 360


def paint_probe(painter: QPainter, picture: ProbePicture, box: QRectF, theme: kit.Theme) -> None:
    """Paint the probe: LEDs with a sector per camera, filled if visible."""
    points = np.vstack([picture.leds, picture.outline, picture.foot, [[0.0, 0.0]]])
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.maximum(high - low, 1e-6)
    scale = _ROOM * min(box.width() / size[0], box.height() / size[1])
    middle = 0.5 * (low + high)

    def at(point: Float) -> QPointF:
        x, y = (point - middle) * scale
        return QPointF(box.center().x() + x, box.center().y() - y)

    small = max(4.0, 0.055 * min(box.width(), box.height()))
    line = QColor(theme.text if picture.known else theme.muted)
    painter.setPen(QPen(line, max(2.0, 0.5 * small), Qt.PenStyle.SolidLine,
                        Qt.PenCapStyle.RoundCap))  # fmt: skip
    ball = at(np.zeros(2))
    painter.drawLine(ball, at(picture.foot))
    body = QColor(theme.muted)
    body.setAlphaF(0.35)
    painter.setPen(QPen(body, 2.6 * small, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap,
                        Qt.PenJoinStyle.RoundJoin))  # fmt: skip
    painter.setBrush(body)
    painter.drawPolygon(QPolygonF([at(point) for point in picture.outline]))
    kit.ink(painter, Qt.PenStyle.NoPen, line)
    radius = max(0.8 * small, picture.ball_radius * scale)
    painter.drawEllipse(ball, radius, radius)
    for number, led in enumerate(picture.leds):
        _paint_led(painter, at(led), small, picture.seen[:, number].tolist(), theme)
    if picture.turn is not None:
        top = at(np.array([picture.leds[:, 0].mean(), high[1]]))
        _paint_turn(painter, picture.turn, ball, top, box, theme)


def _paint_led(
    painter: QPainter, place: QPointF, radius: float, seen: list[bool], theme: kit.Theme
) -> None:
    """Paint a disc with a sector per camera, in their order from left to right."""
    disc = QRectF(place.x() - radius, place.y() - radius, 2.0 * radius, 2.0 * radius)
    kit.ink(painter, Qt.PenStyle.NoPen, QColor(theme.panel))
    painter.drawEllipse(disc)
    share = _FULL // max(len(seen), 1)
    painter.setBrush(QColor(theme.good))
    for number, sees in enumerate(seen):
        if sees:
            # Counter-clockwise from the top: the first camera has the left half.
            painter.drawPie(disc, _FULL // 4 + number * share, share)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(QPen(QColor(theme.good if all(seen) else theme.bad), max(1.5, 0.25 * radius)))
    painter.drawEllipse(disc)


def _paint_turn(
    painter: QPainter, turn: Turn, ball: QPointF, top: QPointF, box: QRectF, theme: kit.Theme
) -> None:
    thick = max(3.0, 0.035 * min(box.width(), box.height()))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    pen = QPen(QColor(theme.accent), thick)
    pen.setCapStyle(Qt.PenCapStyle.FlatCap)
    painter.setPen(pen)
    side = -1.0 if turn.way in (Way.TURN_LEFT, Way.LEAN_LEFT) else 1.0
    if turn.way in (Way.TURN_LEFT, Way.TURN_RIGHT):
        # The far half of a ring about the probe: there the LEDs move to that side.
        wide, high = 0.42 * box.width(), 0.2 * box.height()
        middle = QPointF(top.x(), 0.6 * top.y() + 0.4 * ball.y())
        turns = np.radians(np.linspace(25.0, 155.0, 25))
        arc = [QPointF(middle.x() - side * wide * math.cos(a), middle.y() - high * math.sin(a))
               for a in turns]  # fmt: skip
    elif turn.way in (Way.LEAN_LEFT, Way.LEAN_RIGHT):
        reach = math.hypot(top.x() - ball.x(), top.y() - ball.y()) * 1.08
        begin = math.atan2(ball.y() - top.y(), top.x() - ball.x())
        span = math.radians(34.0)
        arc = [QPointF(ball.x() + reach * math.cos(begin - side * part * span),
                       ball.y() - reach * math.sin(begin - side * part * span))
               for part in np.linspace(-0.3, 0.9, 25)]  # fmt: skip
    else:
        x = box.right() - 2.5 * thick
        ends = (box.top() + 0.2 * box.height(), box.top() + 0.75 * box.height())
        if turn.way is Way.TILT_AWAY:
            ends = (ends[1], ends[0])
        arc = [QPointF(x, y) for y in np.linspace(*ends, 12)]
    _paint_arrow(painter, arc, thick, theme)


def _paint_arrow(painter: QPainter, line: list[QPointF], thick: float, theme: kit.Theme) -> None:
    path = QPainterPath(line[0])
    for point in line[1:-2]:
        path.lineTo(point)
    painter.drawPath(path)
    end, before = line[-1], line[-4]
    length = math.hypot(end.x() - before.x(), end.y() - before.y()) or 1.0
    x, y = (end.x() - before.x()) / length, (end.y() - before.y()) / length
    head = 2.2 * thick
    base = QPointF(end.x() - 0.6 * head * x, end.y() - 0.6 * head * y)
    tip = QPointF(end.x() + 0.9 * head * x, end.y() + 0.9 * head * y)
    kit.ink(painter, Qt.PenStyle.NoPen, QColor(theme.accent))
    painter.drawPolygon(
        QPolygonF([tip, QPointF(base.x() - head * y, base.y() + head * x),
                   QPointF(base.x() + head * y, base.y() - head * x)])
    )  # fmt: skip


def scale_um(ellipsoid: Ellipsoid) -> int:
    """Return the scale length next to an ellipse, um: the whole U, rounded up."""
    wanted = 1e3 * float(ellipsoid.outline_mm[0])
    return next((step for step in _STEPS_UM if step >= wanted), _STEPS_UM[-1])


def paint_ellipse(painter: QPainter, ellipsoid: Ellipsoid, box: QRectF, theme: kit.Theme) -> None:
    """Paint the ellipsoid's outline with rings of the full and half scale."""
    middle, scale = box.center(), scale_um(ellipsoid)
    radius = 0.46 * min(box.width(), box.height())
    kit.ink(painter, QPen(QColor(theme.border), 1.0), Qt.BrushStyle.NoBrush)
    for part in (0.5, 1.0):
        painter.drawEllipse(middle, part * radius, part * radius)
    painter.drawLine(QPointF(middle.x() - radius, middle.y()),
                     QPointF(middle.x() + radius, middle.y()))  # fmt: skip
    painter.drawLine(QPointF(middle.x(), middle.y() - radius),
                     QPointF(middle.x(), middle.y() + radius))  # fmt: skip
    longer, shorter, angle = ellipsoid.outline_mm
    painter.save()
    painter.translate(middle)
    # Screen coordinates point down.
    painter.rotate(-math.degrees(float(angle)))
    fill = QColor(theme.accent)
    fill.setAlphaF(0.35)
    kit.ink(painter, QPen(QColor(theme.accent), 2.0), fill)
    per_mm = 1e3 * radius / scale
    painter.drawEllipse(QPointF(0.0, 0.0), max(per_mm * longer, 1.5), max(per_mm * shorter, 1.5))
    painter.restore()


REFUSED_MS = 4000
"""Display time of a refused touch."""
_LINE_PX = 15
_LEAST_PX = 14
"""Minimum size of the remedy; smaller ones replace the picture."""
_GREATEST_PX = 24
_HARD_BLANK = "\u00a0"
_LOW, _PICTURE_SHARE, _WORDS_SHARE = 1.1, 0.5, 0.4
"""Below this many widths of height the text is next to the picture, otherwise below it."""


class CoachPanel(kit.PaintedWidget):
    """Ellipse and U in good order; the probe with an arrow if a turn would help."""

    refusal_over = Signal()

    def __init__(self, *, far: bool = False) -> None:
        super().__init__(tr("Coach"), (160, 150), (130, 90))
        self._far = far
        self._view = NOTHING
        self._refusal: Refusal | None = None
        self._end = QTimer(self, singleShot=True, interval=REFUSED_MS)
        self._end.timeout.connect(self._on_end)

    def show_coach(self, view: CoachView) -> None:
        self._view = view
        self._show_hint()

    def show_refusal(self, refusal: Refusal) -> None:
        """Show the probe at a refused touch, for a while."""
        self._refusal = refusal
        self._end.start()
        self._show_hint()

    def forget_refusal(self) -> None:
        """Show the coach's current state again."""
        self._refusal = None
        self._end.stop()
        self._show_hint()

    def _on_end(self) -> None:
        self.forget_refusal()
        self.refusal_over.emit()

    def shows_probe(self) -> bool:
        """Return whether the probe is shown instead of the ellipse."""
        view = self._view
        trouble = bool(view.remedy) or self._refusal is not None
        return view.picture is not None and (trouble or view.hint is not None)

    def is_trouble(self) -> bool:
        """Return whether it shows why there is no number or point."""
        return self.shows_probe() and self._view.hint is None

    def hint(self) -> str:
        """Return the hint as a sentence; empty if none is shown."""
        hint = self._view.hint
        return "" if hint is None else f"{hint_words(hint)}."

    def message(self) -> str:
        """Return the text: a hint, a remedy, or U."""
        view = self._view
        if view.remedy:
            return kit.said(view.remedy)
        if view.hint is not None:
            return hint_words(view.hint)
        if view.ellipsoid is not None:
            return tr("U {value} µm").format(value=_um(view.ellipsoid.u_mm))
        return ""

    def _show_hint(self) -> None:
        about = [self.message()]
        if self.shows_probe() and self._view.picture is not None:
            about += [
                tr("Camera {name} sees %n LEDs.", "Camera {name} sees 1 LED.", count).format(
                    name=name
                )
                for name, count in self._view.picture.counts()
            ]
            about.append(_where())
        elif self._view.ellipsoid is not None:
            axes = " × ".join(_um(float(axis)) for axis in self._view.ellipsoid.half_axes_mm)
            about.append(tr("Ellipsoid of the ball, k = 2: {axes} µm.").format(axes=axes))
            about.append(_where())
        text = " ".join(about)
        self.setAccessibleDescription(text)
        self.setToolTip(kit.literal(text))
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        frame = self._paint_panel(painter).adjusted(6, 4, -6, -4)
        view = self._view
        words = "" if self._far else self.message()
        if words and frame.height() < _LOW * frame.width():
            left = QRectF(frame)
            left.setWidth(_PICTURE_SHARE * frame.width())
            room, frame = frame.adjusted(left.width() + 4.0, 0.0, 0.0, 0.0), left
        elif words:
            high = _WORDS_SHARE * frame.height()
            room = QRectF(frame.left(), frame.bottom() - high, frame.width(), high)
            frame = frame.adjusted(0.0, 0.0, 0.0, -high - 2.0)
        if words and self._is_urgent() and self._words_px(room, words) < _LEAST_PX:
            self._paint_words(painter, frame.united(room), words)
            return
        if words:
            self._paint_words(painter, room, words)
        if self.shows_probe() and view.picture is not None:
            high = 0.09 * frame.height() if self._far else float(_LINE_PX) - 2.0
            if self._far:
                place = QRectF(frame)
                place.setTop(frame.bottom() - 1.7 * high)
                # Illegible on the smallest screens.
                if place.height() >= _LINE_PX:
                    self._paint_where(painter, place, 40)
                    frame = frame.adjusted(0.0, 0.0, 0.0, -place.height())
            counts = "  ".join(f"{name} {count}" for name, count in view.picture.counts())
            frame = self._paint_line(painter, frame, counts, self._theme.text, 1.2 * high)
            paint_probe(painter, view.picture, frame, self._theme)
            if view.ellipsoid is not None:
                side = 0.32 * min(frame.width(), frame.height())
                # The ball is below the LEDs; use the opposite corner.
                right = bool(view.picture.leds[:, 0].mean() >= 0.0)
                x = frame.right() - side if right else frame.left()
                corner = QRectF(x, frame.bottom() - side, side, side)
                paint_ellipse(painter, view.ellipsoid, corner, self._theme)
        elif view.ellipsoid is not None:
            scale = tr("ring {scale} µm").format(scale=scale_um(view.ellipsoid))
            frame = self._paint_line(painter, frame, scale, self._theme.muted)
            paint_ellipse(painter, view.ellipsoid, frame, self._theme)

    def _is_urgent(self) -> bool:
        return bool(self._view.remedy) or self._view.hint is not None

    def _lines(self, words: str) -> str:
        if self._view.hint is None:
            return words
        # Keep the numbers together, below the action.
        turns, _, numbers = words.partition(": ")
        return f"{turns}\n{numbers.replace(' ', _HARD_BLANK)}"

    def _words_px(self, frame: QRectF, words: str) -> int:
        box = frame.adjusted(0.0, 0.0, 0.0, -2.0 * _LINE_PX)
        return kit.wrapped_pixels(self._lines(words), box, _GREATEST_PX, bold=self._is_urgent())

    def _paint_words(self, painter: QPainter, frame: QRectF, words: str) -> None:
        where = QRectF(frame)
        where.setTop(frame.bottom() - 2.0 * _LINE_PX)
        self._paint_where(painter, where, 12)
        box = frame.adjusted(0.0, 0.0, 0.0, -where.height())
        painter.setPen(QColor(self._theme.bad if self._view.remedy else self._theme.text))
        painter.setFont(kit.text_font(self._words_px(frame, words), bold=self._is_urgent()))
        painter.drawText(box, kit.WRAPPED, self._lines(words))

    def _paint_where(self, painter: QPainter, box: QRectF, limit: int) -> None:
        painter.setPen(QColor(self._theme.muted))
        painter.setFont(kit.text_font(kit.wrapped_pixels(_where(), box, limit)))
        painter.drawText(box, kit.WRAPPED, _where())

    def _paint_line(
        self, painter: QPainter, frame: QRectF, text: str, colour: str, high: float = _LINE_PX
    ) -> QRectF:
        """Paint a line at the bottom and return the area above it."""
        box = QRectF(frame.left(), frame.bottom() - high, frame.width(), high)
        painter.setPen(QColor(colour))
        painter.setFont(kit.fitted(kit.text_font(10), text, box.width(), box.height(), 64))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)
        return frame.adjusted(0.0, 0.0, 0.0, -high)


def hint_words(hint: Hint) -> str:
    turns = ", ".join(kit.said(turn.instruction) for turn in hint.turns)
    return tr("{turns}: U {now} → {then} µm").format(
        turns=turns, now=_um(hint.now_mm), then=_um(hint.then_mm)
    )


def _where() -> str:
    return tr("as you face the cameras")


def _um(value_mm: float) -> str:
    return kit.localised(f"{1e3 * value_mm:.0f}")
