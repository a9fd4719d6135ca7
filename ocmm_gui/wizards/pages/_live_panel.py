"""Live view (score, readiness, small camera pictures), and a banner readable from three metres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPaintEvent, QPen
from PySide6.QtWidgets import QFrame, QWidget

from ocmm_core.calibration.guided import CameraLive, Live
from ocmm_core.camera import CameraModel, Rig
from ocmm_gui import kit
from ocmm_gui.kit import tr

_BAR_PX, _HIGH_PX = 14.0, 112.0


class Score(kit.PaintedWidget):
    """A large number with its caption, and a progress bar."""

    def __init__(self, name: str) -> None:
        super().__init__(name, (200, 110), (120, 76))
        self._name = name
        self._number = ""
        self._note = ""
        self._share = 0.0

    def show_score(self, number: str, note: str, share: float) -> None:
        """Show a number, a caption, and the share done, 0 to 1."""
        if (number, note, share) != (self._number, self._note, self._share):
            self._number, self._note, self._share = number, note, share
            self.setAccessibleDescription(f"{number} {note}".strip())
            self.update()

    def number(self) -> str:
        return self._number

    def note(self) -> str:
        return self._note

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        theme, box = self._theme, QRectF(self.rect())
        done = self._share >= 1.0
        left = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
        head = QRectF(box.left(), 0.0, box.width(), 20.0)
        painter.setFont(kit.fitted(kit.text_font(15), self._name, head.width(), head.height(), 15))
        painter.setPen(QColor(theme.muted))
        painter.drawText(head, left, self._name)
        bar = QRectF(0.5, box.bottom() - _BAR_PX - 1.0, box.width() - 1.0, _BAR_PX)
        # The caption is below the number if there is room, otherwise next to it.
        beside = box.height() < _HIGH_PX and bool(self._note)
        foot = 20.0 if self._note and not beside else 0.0
        wide = 0.42 * box.width() if beside else box.width()
        number = QRectF(0.0, 20.0, wide, bar.top() - 23.0 - foot)
        painter.setFont(
            kit.fitted(kit.digit_font(10), self._number, number.width(), number.height(), 72)
        )
        painter.setPen(QColor(theme.good if done else theme.text))
        painter.drawText(number, left, self._number)
        note = QRectF(0.0, bar.top() - 22.0, box.width(), 20.0)
        if beside:
            note = QRectF(wide + 8.0, number.top(), box.width() - wide - 8.0, number.height())
        kit.ink(painter, QColor(theme.text), font=kit.text_font(14))
        painter.drawText(note, left | Qt.TextFlag.TextWordWrap, self._note)
        kit.ink(painter, QPen(QColor(theme.border), theme.border_px), QColor(theme.background))
        painter.drawRoundedRect(bar, 3, 3)
        filled = QRectF(bar)
        filled.setWidth(bar.width() * min(max(self._share, 0.0), 1.0))
        kit.ink(painter, Qt.PenStyle.NoPen, QColor(theme.good if done else theme.accent))
        painter.drawRoundedRect(filled, 3, 3)


class MiniCamera(kit.PaintedWidget):
    """Spots of one camera on its whole sensor."""

    def __init__(self, camera: CameraModel) -> None:
        super().__init__(tr("Camera {name}").format(name=camera.name), (130, 130), (60, 46))
        self._name = camera.name
        self._size = (float(camera.width), float(camera.height))
        self._live: CameraLive | None = None

    def show_live(self, live: CameraLive | None) -> None:
        self._live = live
        self.setAccessibleDescription(tr("%n spots", "1 spot", 0 if live is None else len(live.uv)))
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        theme = self._theme
        count = 0 if self._live is None else len(self._live.uv)
        head = QRectF(0.0, 0.0, self.width(), 20.0)
        text = f"{self._name}: {count}"
        painter.setFont(kit.fitted(kit.text_font(14, bold=True), text, head.width(), 20.0, 14))
        painter.setPen(QColor(theme.text if count else theme.warn))
        painter.drawText(head, Qt.AlignmentFlag.AlignCenter, text)
        room = QRectF(1.0, 21.0, self.width() - 2.0, self.height() - 22.0)
        wide, high = self._size
        scale = min(room.width() / wide, room.height() / high)
        sensor = QRectF(0.0, room.top(), scale * wide, scale * high)
        sensor.moveLeft(room.center().x() - 0.5 * sensor.width())
        kit.ink(
            painter, QPen(QColor(theme.border), max(theme.border_px, 1)), QColor(theme.background)
        )
        painter.drawRect(sensor)
        if self._live is None:
            return
        for (u, v), led in zip(self._live.uv.tolist(), self._live.labels.tolist(), strict=True):
            place = QPointF(sensor.left() + scale * u, sensor.top() + scale * v)
            kit.ink(painter, Qt.PenStyle.NoPen, QColor(theme.accent if led >= 0 else theme.text))
            painter.drawEllipse(place, 3.5, 3.5)


class CameraRow(QWidget):
    def __init__(self, rig: Rig) -> None:
        super().__init__()
        self.setAccessibleName(tr("Camera view"))
        self.cameras = tuple(MiniCamera(camera) for camera in rig.cameras)
        row = kit.hbox(parent=self, spacing=8, margins=0)
        for camera in self.cameras:
            row.addWidget(camera, 1)

    def show_cameras(self, seen: Sequence[CameraLive]) -> None:
        """Show the camera views; empty before the first frame."""
        views: Sequence[CameraLive | None] = seen or (None,) * len(self.cameras)
        for camera, of_camera in zip(self.cameras, views, strict=True):
            camera.show_live(of_camera)


class LivePanel(kit.Themed, QFrame):
    """Readiness in a word and a sentence, with the cameras below."""

    def __init__(self, rig: Rig) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self._live = Live()
        self._automatic = self._complete = False
        self._word = kit.FitText(tr("Seen now"), limit=30)
        self._word.setFixedHeight(40)
        self._hint = kit.sentence_label(tr("What to do now"), 17)
        self._hint.setMinimumHeight(46)
        self._row = CameraRow(rig)
        kit.vbox(
            self._word, self._hint, (self._row, 1), parent=self, spacing=4, margins=(12, 6, 12, 8)
        )

    def show_live(self, live: Live, *, automatic: bool, complete: bool = False) -> None:
        """Show the current state; nothing is waited for in a complete step."""
        self._live, self._automatic, self._complete = live, automatic, complete
        self._show_word()
        self._row.show_cameras(live.cameras)

    @property
    def cameras(self) -> tuple[MiniCamera, ...]:
        return self._row.cameras

    def word(self) -> str:
        return self._word.text()

    def hint(self) -> str:
        return self._hint.text()

    def set_theme(self, theme: kit.Theme) -> None:
        self._theme = theme
        self._show_word()

    def _show_word(self) -> None:
        live, theme = self._live, self._theme
        if self._complete:
            self._word.show_text(tr("COMPLETE"), theme.good, kit.Mark.GOOD)
            text = tr("Press Return for the next step.")
        elif live.ready:
            self._word.show_text(tr("READY"), theme.good, kit.Mark.GOOD)
            text = tr("Taken automatically.") if self._automatic else tr("Press Space to take it.")
        else:
            self._word.show_text(tr("WAIT"), theme.warn, kit.Mark.DOUBT)
            text = kit.said(live.hint)
            if live.frames < live.wanted and np.isfinite(live.motion_px):
                text = tr("{text} {frames} of {wanted} frames.").format(
                    text=text, frames=live.frames, wanted=live.wanted
                )
        if text != self._hint.text():
            self._hint.setText(text)


_BANNER_BAR_PX = 10.0
_LINE, _MOST_NOTE = 1.17, 0.56
"""Line height over type size, and the maximum share of the sentence."""
_MARK_SHARE, _GAP_SHARE = 0.72, 0.18
"""Relative to the height of the word."""
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter


@dataclass(frozen=True, slots=True)
class BannerMessage:
    word: str = ""
    """One to three words in capitals."""
    note: str = ""
    mark: kit.Mark = kit.Mark.OPEN
    """Determines shape and colour."""
    share: float | None = None
    """Filled share of the bar, 0 to 1; None paints no bar."""


class FarBanner(kit.PaintedWidget):
    """A word as large as its place allows."""

    def __init__(self, name: str) -> None:
        super().__init__(name, (600, 124), (300, 64))
        self._name = name
        self._told = BannerMessage()

    def tell(self, told: BannerMessage) -> None:
        if told != self._told:
            self._told = told
            self.setAccessibleName(f"{self._name}: {told.word}")
            self.setAccessibleDescription(told.note)
            self.update()

    def word(self) -> str:
        return self._told.word

    def note(self) -> str:
        return self._told.note

    def type_pixels(self) -> tuple[int, int]:
        inside = _inside(QRectF(self.rect()))
        note = self._note_box(inside)
        head = QRectF(inside)
        head.setBottom(note.top())
        wide = head.width() - (_MARK_SHARE + _GAP_SHARE) * head.height()
        word = kit.fitted(kit.text_font(10, bold=True), self._told.word, wide, head.height(), 400.0)
        return word.pixelSize(), kit.wrapped_pixels(self._told.note, note, kit.far_type(self))

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        frame, theme, told = self._paint_panel(painter), self._theme, self._told
        colour = QColor(kit.mark_colour(theme, told.mark))
        inside = _inside(frame)
        note = self._note_box(inside)
        head = QRectF(inside)
        head.setBottom(note.top())
        side = _MARK_SHARE * head.height()
        box = QRectF(head.left(), head.center().y() - 0.5 * side, side, side)
        kit.paint_mark(painter, told.mark, box, colour.name(), theme.panel)
        word = QRectF(head)
        word.setLeft(box.right() + _GAP_SHARE * head.height())
        pixels, note_pixels = self.type_pixels()
        kit.ink(painter, colour, font=kit.text_font(pixels, bold=True))
        painter.drawText(word, _LEFT, told.word)
        kit.ink(painter, QColor(theme.text), font=kit.text_font(note_pixels))
        painter.drawText(note, _LEFT | Qt.TextFlag.TextWordWrap, told.note)
        if told.share is not None:
            bar = QRectF(
                inside.left(), frame.bottom() - _BANNER_BAR_PX - 5.0, inside.width(), _BANNER_BAR_PX
            )
            kit.ink(painter, QPen(QColor(theme.border), theme.border_px), QColor(theme.background))
            painter.drawRect(bar)
            bar.setWidth(bar.width() * min(max(told.share, 0.0), 1.0))
            painter.fillRect(bar, colour)

    def _note_box(self, inside: QRectF) -> QRectF:
        """Return the place of the sentence: one line if it fits, otherwise two."""
        pixels = kit.far_type(self)
        metrics = QFontMetricsF(kit.text_font(pixels))
        lines = 1 if metrics.horizontalAdvance(self._told.note) < inside.width() - 2.0 else 2
        note = QRectF(inside)
        high = min(lines * _LINE * pixels + 2.0, _MOST_NOTE * inside.height())
        note.setTop(inside.bottom() - high)
        return note


def _inside(frame: QRectF) -> QRectF:
    return frame.adjusted(14.0, 4.0, -14.0, -_BANNER_BAR_PX - 6.0)
