"""Readout of the ball centre, as large as possible, with sounds and flashes of touches."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from PySide6.QtCore import QRectF, QSize, Qt, QTimer
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import FeatureState, JobView, LiveView, Target
from ocmm_core.measuring import MeasuredPoint, PathProgress, Refusal, RefusalCode
from ocmm_core.station.coaching import CoachView
from ocmm_core.tolerances.decisions import Verdict
from ocmm_gui import kit
from ocmm_gui.help import CoachPanel
from ocmm_gui.kit import tr

DIGITS_HZ = 12
"""Faster digits are illegible."""

FLASH_MS = 450
_RESERVE = "+0000.000"
_CAPTION_SHARE = 0.08
_REASON_LIMIT_PX, _REASON_SHARE = 100, 100.0 / 1080.0
"""Maximum type of a reason: on a screen of 1080 lines, and relative to the height."""
_LARGE_SHARE = 0.62
"""Height share of the remedy; the rest is the reason."""


class Readout(kit.Themed, QWidget):
    """Three rows of digits, replaced by the reason if the core withholds them."""

    def __init__(self) -> None:
        super().__init__()
        self._values = (kit.DASHES, kit.DASHES, kit.DASHES)
        self._caption = ""
        self._shown_at = 0.0
        self._flash: bool | None = None
        self._end_of_flash = QTimer(self, singleShot=True, interval=FLASH_MS)
        self._end_of_flash.timeout.connect(self._stop_flash)
        self._remedy = ""
        self._refusal: tuple[str, str] | None = None
        self.setAccessibleName(tr("Readout"))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def show_live(self, live: LiveView) -> None:
        """Show the tip or why not; hiding is immediate, new numbers wait for the next update."""
        now = time.monotonic()
        if live.tip_world is None:
            self._show(
                (kit.DASHES, kit.DASHES, kit.DASHES),
                kit.said(live.reason) or tr("no valid position"),
            )
        elif now - self._shown_at >= 0.9 / DIGITS_HZ or kit.DASHES in self._values:
            self._shown_at = now
            x, y, z = (kit.length_number(float(value), signed=True) for value in live.tip_world)
            uncertainty = _known(live.tip_uncertainty)
            frame = (
                tr("world frame")
                if live.reference is None
                else tr("by '{name}'").format(name=live.reference.name)
            )
            self._show(
                (x, y, z),
                tr("ball centre, {unit}, {frame}   ±{uncertainty} (k=2)").format(
                    unit=kit.unit_word(), frame=frame, uncertainty=uncertainty
                ),
            )

    def show_remedy(self, remedy: str) -> None:
        """Show the remedy in large type while there is no number."""
        if remedy != self._remedy:
            self._remedy = remedy
            self.update()

    def show_refusal(self, what: str, remedy: str) -> None:
        """Show refusal and remedy until forgotten."""
        self._refusal = (what, remedy)
        self.update()

    def forget_refusal(self) -> None:
        self._refusal = None
        self.update()

    def trouble(self) -> tuple[str, str]:
        """Return remedy and reason; empty while digits are shown."""
        if kit.DASHES in self._values:
            return self._remedy, self._caption
        if self._refusal is not None:
            what, remedy = self._refusal
            return (remedy or what), (what if remedy else "")
        return "", ""

    def withdraw(self, reason: str) -> None:
        self._show((kit.DASHES, kit.DASHES, kit.DASHES), reason)

    def values(self) -> tuple[str, str, str]:
        """Return the three rows; dashes while the reason is shown."""
        return self._values

    def flash(self, *, good: bool) -> None:
        """Flash the border in the colour of good or bad news."""
        self._flash = good
        self._end_of_flash.start()
        self.update()

    def cap_height(self) -> float:
        """Return the height of the digits, px; for tests."""
        return kit.CAP_HEIGHT * self._type()

    def sizeHint(self) -> QSize:
        """Return a size for the desk view; elsewhere the layout decides."""
        return QSize(300, 150)

    def minimumSizeHint(self) -> QSize:
        """Return the minimum size legible from some steps away."""
        return QSize(180, 150)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(QColor(self._theme.border), self._theme.border_px))
        painter.setBrush(QColor(self._theme.panel))
        painter.drawRoundedRect(QRectF(self.rect()).adjusted(1, 1, -1, -1), 6, 6)
        pixels = self._type()
        box = self._digit_box()
        painter.setFont(kit.digit_font(pixels))
        row = box.height() / 3.0
        large, why = self.trouble()
        for index, (axis, value) in enumerate(zip("XYZ", self._values, strict=True)):
            place = QRectF(box.left(), box.top() + index * row, box.width(), row)
            painter.setPen(QColor(self._theme.accent))
            painter.drawText(place, kit.LEFT, axis)
            if value != kit.DASHES and not large:
                painter.setPen(QColor(self._theme.text))
                painter.drawText(place, kit.RIGHT, value)
        if large:
            self._paint_trouble(painter, large, why)
        elif kit.DASHES in self._values:
            kit.ink(painter, QColor(self._theme.text), font=kit.text_font(self.reason_pixels()))
            painter.drawText(self._reason_box(), kit.WRAPPED, self._caption)
        else:
            painter.setPen(QColor(self._theme.muted))
            caption = QRectF(box.left(), box.bottom(), box.width(), self._caption_height())
            painter.setFont(
                kit.fitted(kit.text_font(10), self._caption, caption.width(), caption.height(), 28)
            )
            painter.drawText(caption, Qt.AlignmentFlag.AlignCenter, self._caption)
        if self._flash is not None:
            thick = max(6.0, 0.02 * self.height())
            news = self._theme.good if self._flash else self._theme.bad
            kit.ink(painter, QPen(QColor(news), thick), Qt.BrushStyle.NoBrush)
            half = 0.5 * thick
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(half, half, -half, -half), 6, 6)

    def _paint_trouble(self, painter: QPainter, large: str, why: str) -> None:
        box = self._reason_box()
        first = QRectF(box)
        if why:
            first.setHeight(_LARGE_SHARE * box.height())
        painter.setPen(QColor(self._theme.bad))
        painter.setFont(
            kit.text_font(kit.wrapped_pixels(large, first, self._limit(), bold=True), bold=True)
        )
        painter.drawText(first, kit.WRAPPED, large)
        if why:
            second = QRectF(box)
            second.setTop(first.bottom())
            painter.setPen(QColor(self._theme.text))
            painter.setFont(kit.text_font(kit.wrapped_pixels(why, second, self._limit() // 2)))
            painter.drawText(second, kit.WRAPPED, why)

    def reason_pixels(self) -> int:
        """Return the pixel size of the sentence shown instead of the digits."""
        return kit.wrapped_pixels(self._caption, self._reason_box(), self._limit())

    def _limit(self) -> int:
        return max(_REASON_LIMIT_PX, round(_REASON_SHARE * self.window().height()))

    def _reason_box(self) -> QRectF:
        margin = max(8.0, 0.02 * self.height())
        box = QRectF(self.rect()).adjusted(margin, margin, -margin, -margin)
        # The axis labels stay in place.
        box.setLeft(self._digit_box().left() + 1.1 * self._type())
        return box

    def _caption_height(self) -> float:
        return max(14.0, _CAPTION_SHARE * self.height())

    def _digit_box(self) -> QRectF:
        margin = max(12.0, 0.04 * self.height())
        return QRectF(self.rect()).adjusted(
            margin, 0.5 * margin, -margin, -self._caption_height() - 0.5 * margin
        )

    def _type(self) -> int:
        box = self._digit_box()
        return kit.fitted(
            kit.digit_font(10), "X " + _RESERVE, box.width(), box.height() / 3.0, 400
        ).pixelSize()

    def _show(self, values: tuple[str, str, str], caption: str) -> None:
        if (values, caption) != (self._values, self._caption):
            self._values, self._caption = values, caption
            spoken = " ".join(map(" ".join, zip("XYZ", values, strict=True)))
            self.setAccessibleDescription(caption if kit.DASHES in values else spoken)
            self.update()

    def _stop_flash(self) -> None:
        self._flash = None
        self.update()


def _known(value: float | None) -> str:
    return kit.DASHES if value is None or not math.isfinite(value) else kit.length_number(value)


class CoachedView(QWidget):
    """A view with a readout and a coach, showing the same trouble and remedy."""

    readout: Readout
    coach: CoachPanel

    def show_coach(self, view: CoachView) -> None:
        self.coach.show_coach(view)
        self.readout.show_remedy(kit.said(view.remedy))
        self.coach_changed()

    def show_refusal(self, refusal: Refusal) -> None:
        """Show for a while why a touch gave no point, and the remedy."""
        self.coach.show_refusal(refusal)
        self.readout.show_refusal(kit.said(refusal.what), kit.said(refusal.remedy))
        self.coach_changed()

    def forget_refusal(self) -> None:
        """Show measured values again, after a recorded point."""
        self.coach.forget_refusal()
        self.readout.forget_refusal()
        self.coach_changed()

    def coach_changed(self) -> None:
        """React to the coach's state; does nothing by default."""


class Feedback:
    """Sounds, also shown as flashes of the readout."""

    def __init__(
        self,
        sounds: kit.SoundPlayer | None,
        notices: kit.NoticeCentre,
        readout: Callable[[], Readout],
    ) -> None:
        self._sounds, self._notices, self._readout = sounds, notices, readout
        self._approach = kit.Approach(sounds)
        self._sounded: set[kit.Sound] = set()

    def play(self, sound: kit.Sound) -> None:
        if self._sounds is not None:
            self._sounds.play(sound)

    def taken(self, point: MeasuredPoint) -> None:
        self.play(kit.Sound.TAKEN)
        self._readout().flash(good=True)

    def refused(self, refusal: Refusal) -> None:
        wrong = refusal.code is RefusalCode.WRONG_FACE
        self.play(kit.Sound.WRONG_FACE if wrong else kit.Sound.REFUSED)
        self._readout().flash(good=False)

    def announce(self, previous: JobView, job: JobView) -> None:
        """Signal newly completed parts of the same job."""
        if previous.job != job.job:
            return
        if job.complete and not previous.complete:
            # The part verdict includes the last feature.
            self._signal(job.part_verdict.shown_as)
            return
        before = {feature.name: feature.state for feature in previous.features}
        for feature in job.features:
            state = before.get(feature.name)
            if feature.state is FeatureState.DONE and state is not FeatureState.DONE:
                self._signal(job.verdict_of(feature.name).verdict)

    def _signal(self, verdict: Verdict | None) -> None:
        self.play(kit.verdict_sound(verdict))
        self._readout().flash(good=verdict in (None, Verdict.CONFORM))

    def slide(self, path: PathProgress | None) -> None:
        """Sound once when the ball of an open path is too fast or lifted, or the scan covered."""
        states = {
            kit.Sound.TOO_FAST: path is not None and path.fast,
            kit.Sound.LOST_CONTACT: path is not None and path.lifted,
            kit.Sound.SCAN_DONE: path is not None and (path.covered or 0.0) >= 1.0,
        }
        for sound, holds in states.items():
            if holds and sound not in self._sounded:
                self.play(sound)
        self._sounded = {sound for sound, holds in states.items() if holds}

    def way(self, target: Target | None, tip_world: Float | None) -> None:
        """Play the approach of the ball, (3,) mm, to the target."""
        self._approach.update(target, tip_world)

    def toggle_tone(self) -> None:
        self._approach.enabled = not self._approach.enabled
        self._notices.inform(
            tr("Approach tone on.") if self._approach.enabled else tr("Approach tone off.")
        )

    def close(self) -> None:
        if self._sounds is not None:
            self._sounds.close()
