"""Pages of the relocation: wave the probe, show the bar, touch the world points."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, radians, sin

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy

from ocmm_core.calibration.guided import RelocationView, Tilt
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_gui import kit
from ocmm_gui.kit import later, tr
from ocmm_gui.wizards.pages._live_panel import Score
from ocmm_gui.wizards.pages._pages import CollectPage
from ocmm_gui.wizards.pages._picture import BarPlace, bars, volume_coverage
from ocmm_gui.wizards.pages._shown import StepSnapshot

_TILT_PX, _ROOMY_PX = 86, 112
_LEAN = {"leaning left": -32.0, "leaning right": 32.0}
_EXAMPLES = (
    ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
    ((0.0, 0.0, 0.0), (-1.0, 1.0, 1.0)),
    ((0.0, 0.0, 0.0), (1.0, -1.0, 1.0)),
    ((0.0, 0.5, 0.5), (1.0, 0.0, 0.0)),
    ((0.0, -0.5, -0.5), (1.0, 0.0, 0.0)),
    ((-0.5, 0.5, 0.0), (0.0, 0.0, 1.0)),
    ((0.5, -0.5, 0.0), (0.0, 0.0, 1.0)),
)
"""Middle and direction of placements, in halves of the volume: advice only."""


class TiltRow(kit.PaintedWidget):
    """Probe attitudes used, and those missing."""

    def __init__(self) -> None:
        super().__init__(tr("Probe attitudes"), (400, _TILT_PX), (200, _TILT_PX))
        self._tilts: tuple[Tilt, ...] = ()
        self.setFixedHeight(_TILT_PX)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def show_tilts(self, tilts: Sequence[Tilt]) -> None:
        if tuple(tilts) != self._tilts:
            self._tilts = tuple(tilts)
            words = (
                tr("{name} {poses} of {wanted}").format(
                    name=kit.said_word(one.name), poses=one.poses, wanted=one.wanted
                )
                for one in tilts
            )
            self.setAccessibleDescription(", ".join(words))
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        theme, count = self._theme, max(len(self._tilts), 1)
        wide = (self.width() - 6.0 * (count - 1)) / count
        for index, tilt in enumerate(self._tilts):
            box = QRectF(index * (wide + 6.0) + 1.0, 1.5, wide - 2.0, self.height() - 3.0)
            done = tilt.poses >= tilt.wanted
            kit.ink(painter, QPen(QColor(theme.border), theme.border_px), QColor(theme.panel))
            painter.drawRoundedRect(box, 6, 6)
            share = QRectF(box.left() + 4.0, box.bottom() - 8.0, box.width() - 8.0, 5.0)
            share.setWidth(share.width() * min(tilt.poses / tilt.wanted, 1.0))
            painter.fillRect(share, QColor(theme.good if done else theme.accent))
            colour = theme.good if done else theme.text
            # The picture shows the lean; without room for it the count has priority.
            roomy = box.width() >= _ROOMY_PX
            if roomy:
                tip = QPointF(box.left() + 34.0, box.bottom() - 17.0)
                self._paint_probe(painter, tip, tilt.name)
            word = kit.said_word(tilt.name).removeprefix("leaning ").removesuffix(" geneigt")
            name = QRectF(box.left() + 8.0, box.top() + 4.0, box.width() - 16.0, 22.0)
            painter.setFont(kit.fitted(kit.text_font(14, bold=True), word, name.width(), 22.0, 15))
            painter.setPen(QColor(colour))
            left = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
            painter.drawText(name, left, word)
            text = tr("done") if done else tr("%n more", "", tilt.wanted - tilt.poses)
            indent = 66.0 if roomy else 8.0
            number = QRectF(
                box.left() + indent, name.bottom() + 8.0, box.width() - indent - 4.0, 24.0
            )
            painter.setFont(kit.fitted(kit.text_font(15), text, number.width(), 24.0, 16))
            painter.drawText(number, left, text)

    def _paint_probe(self, painter: QPainter, tip: QPointF, name: str) -> None:
        theme = self._theme
        angle = _LEAN.get(name, 0.0)
        # Towards and away from the cameras a probe looks shorter; its ball shows the direction.
        length = 24.0 if "forward" in name or "back" in name else 34.0
        end = QPointF(
            tip.x() + length * sin(radians(angle)), tip.y() - length * cos(radians(angle))
        )
        painter.setPen(QPen(QColor(theme.text), 4.0, c=Qt.PenCapStyle.RoundCap))
        painter.drawLine(tip, end)
        kit.ink(painter, Qt.PenStyle.NoPen, QColor(theme.bad))
        side = QPointF(10.0 * cos(radians(angle)), 10.0 * sin(radians(angle)))
        for point in (end, end + side, end - side):
            near = 5.5 if "forward" in name else 3.0 if "back" in name else 4.0
            painter.drawEllipse(point, near, near)
        painter.setBrush(QColor(theme.accent))
        painter.drawEllipse(tip, 5.0, 5.0)


class WavePage(CollectPage):
    """Volume cells without enough poses, and the predicted quality of the result."""

    hands_are_full = True

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig, tr("Volume shown"))
        self.length = Score(tr("Uncertainty of a length"))
        self.scores.addWidget(self.length)
        self.side.setStretch(0, 5)
        self.side.setStretch(1, 4)
        self.tilts = TiltRow()
        column = kit.vbox(spacing=8)
        self.beside.removeWidget(self.picture)
        kit.fill(column, (self.picture, 1), self.tilts)
        self.beside.insertLayout(0, column, 1)
        self._shown: object = None

    def show_seen(self, seen: StepSnapshot) -> None:
        super().show_seen(seen)
        view = seen.view_as(RelocationView)
        step, fraction = view.base.step, view.coverage.fraction
        note = tr("%n poses of {wanted}", "1 pose of {wanted}", step.done).format(
            wanted=step.wanted
        )
        share = min(fraction, step.done / step.wanted if step.wanted else 1.0)
        self.score.show_score(f"{100.0 * fraction:.0f} %", note, share)
        show_prediction(self.length, view)
        self.tilts.show_tilts(view.coverage.tilts)
        if view.poses != self._shown:
            self._shown = view.poses
            missing = view.coverage.missing
            words = (
                tr("Missing: {cells}").format(cells=", ".join(map(kit.said_word, missing[:3])))
                if missing
                else tr("Nothing is missing")
            )
            self.picture.show_contents(volume_coverage(view.coverage), words)


class BarPage(CollectPage):
    """Suggested next placement of the bar."""

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig, tr("Bar placements"))
        self._volume = rig.volume_world
        self.length = Score(tr("Uncertainty of a length"))
        self.scores.addWidget(self.length)
        self.side.setStretch(0, 5)
        self.side.setStretch(1, 4)
        self._shown: object = None

    def show_seen(self, seen: StepSnapshot) -> None:
        super().show_seen(seen)
        view = seen.view_as(RelocationView)
        show_prediction(self.length, view)
        if view.bar_placements != self._shown:
            self._shown = view.bar_placements
            places = example_places(self._volume, view.bars_wanted, view.bar_placements)
            current = view.bar_placements if view.bar_placements < view.bars_wanted else None
            places = places[: view.bar_placements + 1]
            words = tr("A suitable next bar placement") if current is not None else tr("All taken")
            self.picture.show_contents(bars(places, current), words)


class SeatPicture(kit.PaintedWidget):
    """Points to put the ball into, in order."""

    def __init__(self) -> None:
        super().__init__(tr("Points of the world frame"), kit.SCENE_SIZE, kit.SCENE_LEAST)
        self._names: tuple[str, ...] = ()
        self._taken = 0

    def show_seats(self, names: Sequence[str], taken: int) -> None:
        """Show the points by name; the first ``taken`` of them are done."""
        if (tuple(names), taken) != (self._names, self._taken):
            self._names, self._taken = tuple(names), taken
            self.setAccessibleDescription(
                tr("{taken} of %n points taken", "{taken} of 1 point taken", len(names)).format(
                    taken=taken
                )
            )
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        theme = self._theme
        inside = self._paint_panel(painter).adjusted(24.0, 16.0, -24.0, -16.0)
        if not self._names:
            kit.ink(painter, QColor(theme.text), font=kit.text_font(22))
            text = tr("The world fixed to the cameras.")
            painter.drawText(inside, Qt.AlignmentFlag.AlignCenter, text)
            return
        row = min(72.0, inside.height() / len(self._names))
        side = 0.6 * row
        for index, name in enumerate(self._names):
            top = inside.top() + index * row
            done, current = index < self._taken, index == self._taken
            mark = kit.Mark.GOOD if done else kit.Mark.ACTIVE if current else kit.Mark.OPEN
            colour = theme.good if done else theme.accent if current else theme.muted
            box = QRectF(inside.left(), top + 0.5 * (row - side), side, side)
            kit.paint_mark(painter, mark, box, colour, theme.panel)
            painter.setFont(kit.text_font(0.42 * row, bold=current))
            painter.setPen(QColor(theme.text if done or current else theme.muted))
            place = QRectF(box.right() + 18.0, top, inside.right() - box.right() - 18.0, row)
            painter.drawText(place, Qt.AlignmentFlag.AlignVCenter, tr(_SEAT_WORDS.get(name, name)))


_SEAT_WORDS = {
    "origin": later("Origin: (0, 0, 0)"),
    "on X": later("On X: the X axis passes through it"),
    "in XY": later("In XY: on the side of positive Y"),
}


class WorldPage(CollectPage):
    """Points that define the world frame."""

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig, tr("Points touched"))
        self.seats = SeatPicture()
        self.beside.replaceWidget(self.picture, self.seats)
        self.picture.hide()

    def show_seen(self, seen: StepSnapshot) -> None:
        super().show_seen(seen)
        view = seen.view_as(RelocationView)
        self.seats.show_seats(view.world_wanted, len(view.world_points))
        if not view.world_wanted:
            self.score.show_score("–", tr("nothing to touch"), 1.0)


def show_prediction(score: Score, view: RelocationView) -> None:
    sigma, limit = view.length_sigma_mm, view.length_limit_mm
    if sigma is None:
        score.show_score(
            "–",
            tr("of {length_mm:.0f} mm; too early to tell").format(length_mm=view.length_mm),
            0.0,
        )
        return
    share = min(limit / sigma, 1.0) if sigma > 0.0 else 1.0
    note = tr("of {length_mm:.0f} mm (k = 2); {limit:.1f} µm is enough").format(
        length_mm=view.length_mm, limit=2e3 * limit
    )
    score.show_score(kit.localised(f"{2e3 * sigma:.1f} µm"), note, share)


def example_places(volume_world: Float, wanted: int, taken: int) -> tuple[BarPlace, ...]:
    """Return bar placements all over a volume (2, 3), mm, in all directions."""
    middle, half = volume_world.mean(axis=0), 0.5 * np.ptp(volume_world, axis=0)
    places = []
    for number in range(wanted):
        at, along = (np.array(one) for one in _EXAMPLES[number % len(_EXAMPLES)])
        centre, reach = middle + at * half, 0.8 * half * along
        ends = np.stack([centre - reach, centre + reach])
        done = 2 if number < taken else 0
        places.append(BarPlace(tr("placement {number}").format(number=number + 1), ends, 2, done))
    return tuple(places)
