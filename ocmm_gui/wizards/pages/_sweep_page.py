"""Pages of a sweep and of spheres: directions reached, and directions missing."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen

from ocmm_core.calibration import sweeping
from ocmm_core.calibration.guided import VerificationView
from ocmm_core.camera import Rig
from ocmm_core.geometry import Points3
from ocmm_gui import kit
from ocmm_gui.charts import Bars, Mapped, Row
from ocmm_gui.kit import later, tr
from ocmm_gui.wizards.pages._live_panel import BannerMessage, Score
from ocmm_gui.wizards.pages._pages import CollectPage, HandsPage
from ocmm_gui.wizards.pages._shown import StepSnapshot

_LAYERS = ((0.0, 1, 0.0), (22.5, 4, 0.0), (45.0, 8, 22.5), (67.5, 4, 45.0), (90.0, 8, 67.5))
"""Degrees below the pole, points, and turn of the layer: 25 points over a half sphere."""

_TILT = 0.42
"""Lean of the pole towards the eye, sine."""


class SpherePicture(kit.PaintedWidget):
    """A half sphere with suggested touch points, from pole to equator."""

    def __init__(self) -> None:
        super().__init__(tr("Where to touch the sphere"), kit.SCENE_SIZE, kit.SCENE_LEAST)
        self._taken = 0
        self._title = ""

    def show_taken(self, taken: int, title: str) -> None:
        """Show the number of recorded points; the places are advice only."""
        if (taken, title) != (self._taken, self._title):
            self._taken, self._title = taken, title
            self.setAccessibleDescription(
                tr("{title}: %n points", "{title}: 1 point", taken).format(title=title)
            )
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        theme = self._theme
        frame = self._paint_panel(painter)
        kit.ink(painter, QColor(theme.text), font=kit.text_font(17, bold=True))
        painter.drawText(frame.adjusted(14, 10, -14, -10), Qt.AlignmentFlag.AlignTop, self._title)
        radius = 0.34 * min(frame.width(), frame.height())
        centre = QPointF(frame.center().x(), frame.center().y() - 0.04 * frame.height())
        painter.setPen(QPen(QColor(theme.muted), 0.16 * radius, c=Qt.PenCapStyle.FlatCap))
        painter.drawLine(
            QPointF(centre.x(), centre.y() + radius), QPointF(centre.x(), frame.bottom() - 4.0)
        )
        kit.ink(painter, QPen(QColor(theme.text), 2.0), QColor(theme.background))
        painter.drawEllipse(centre, radius, radius)
        number = 0
        for below, count, turn in _LAYERS:
            for index in range(count):
                around = 2.0 * pi * index / count + turn * pi / 180.0
                self._paint_place(painter, centre, radius, below * pi / 180.0, around, number)
                number += 1

    def _paint_place(
        self,
        painter: QPainter,
        centre: QPointF,
        radius: float,
        below: float,
        around: float,
        number: int,
    ) -> None:
        theme = self._theme
        x, z = sin(below) * cos(around), cos(below)
        toward = sin(below) * sin(around)
        lean = (1.0 - _TILT**2) ** 0.5
        up, depth = lean * z - _TILT * toward, _TILT * z + lean * toward
        place = QPointF(centre.x() + radius * x, centre.y() - radius * up)
        behind = depth < -0.05
        size = 5.0 if behind else 8.0
        done = number < self._taken
        painter.setPen(QPen(QColor(theme.border if behind else theme.text), 1.5))
        painter.setBrush(QColor(theme.good if done else theme.panel))
        if number == self._taken:
            painter.setBrush(QColor(theme.accent))
            size = 11.0
        painter.drawEllipse(place, size, size)


class SpheresPage(CollectPage):
    """Points on the spheres, one sphere after the other."""

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig, tr("Points on spheres"))
        self.sphere = SpherePicture()
        self.beside.replaceWidget(self.picture, self.sphere)
        self.picture.hide()
        self.picture.setParent(self)

    def show_seen(self, seen: StepSnapshot) -> None:
        super().show_seen(seen)
        view = seen.view_as(VerificationView)
        if not view.spheres:
            self.sphere.show_taken(0, tr("No sphere chosen: press Next."))
            return
        open_ones = [i for i, taken in enumerate(view.spheres) if taken < view.sphere_points]
        number = open_ones[0] if open_ones else len(view.spheres) - 1
        taken = view.spheres[number]
        title = tr("Sphere {number} of {count}: {taken} of {sphere_points}").format(
            number=number + 1,
            count=len(view.spheres),
            taken=taken,
            sphere_points=view.sphere_points,
        )
        if view.places[number]:
            title += f", {view.places[number]}"
        self.sphere.show_taken(taken, title)


_TURNS = (later("Leaning"), later("Leaning the other way"), later("Turning the handle"))
_SEATED = later("Ball in the cone: keep it there.")
_SOUNDS = {
    sweeping.SweepPhase.COUNTDOWN: kit.Sound.TICK,
    sweeping.SweepPhase.TAKING: kit.Sound.STARTED,
    sweeping.SweepPhase.LEFT: kit.Sound.REFUSED,
}


class SweepPage(HandsPage):
    """One sweep: starts when the ball rests in the cone, ends when complete."""

    keys = ("back", "drop", "anew", "next")

    def __init__(self, rig: Rig, *, second: bool) -> None:
        super().__init__(rig, tr("Sweep"), tr("Directions of the probe"))
        self._second = second
        self._phase = sweeping.SweepPhase.IDLE
        self._cells: tuple[sweeping.MapCell, ...] = ()
        self._mapped = Mapped()
        self.sigma = Score(tr("Uncertainty of the tip"))
        self.bars = Bars(tr("Rotation of the probe"), 6 if second else 5)
        kit.fill(self.scores, (self.sigma, 2), (self.bars, 6))

    def show_seen(self, seen: StepSnapshot) -> None:
        view = seen.view_as(sweeping.PivotView)
        self.show_cameras(view.base.live)
        sweep = view.second if self._second else view.first
        self.banner.tell(told_of(view, sweep))
        if sweep.phase is not self._phase:
            self._phase = sweep.phase
            if sweep.phase in _SOUNDS:
                self.sounded.emit(_SOUNDS[sweep.phase])
        if sweep.cells is not self._cells or not np.array_equal(
            view.direction_world, self._mapped.now, equal_nan=True
        ):
            self._cells = sweep.cells
            self._mapped = mapped_of(view, sweep)
            self.map.show_map(self._mapped)
        wanted, sigma = sweep.tip_sigma_wanted_mm, sweep.tip_sigma_mm
        known = bool(np.isfinite(sigma)) and sigma > 0.0
        self.sigma.show_score(
            kit.localised(f"{2e3 * sigma:.1f} µm") if known else "–",
            tr("(k = 2); {wanted:.0f} µm is enough").format(wanted=2e3 * wanted)
            if known
            else tr("too early to tell"),
            min(wanted / sigma, 1.0) if known else 0.0,
        )
        self.bars.show_rows(self._rows(view, sweep))

    def _rows(self, view: sweeping.PivotView, sweep: sweeping.SweepView) -> list[Row]:
        rows = [
            Row(name, f"{found:.0f}° / {wanted:.0f}°", found / wanted if wanted else 1.0)
            for name, found, wanted in zip(
                kit.tr_all(_TURNS),
                np.degrees(sweep.ranges),
                np.degrees(sweep.ranges_wanted),
                strict=True,
            )
        ]
        for name, done, wanted in (
            (tr("Attitudes"), sweep.attitudes, sweep.attitudes_wanted),
            (tr("Poses"), sweep.poses, sweep.poses_wanted),
        ):
            rows.append(Row(name, f"{done} / {wanted}", done / max(wanted, 1)))
        if self._second:
            rows.append(_elsewhere(view))
        return rows


class FirstConePage(HandsPage):
    """The ball rests in the first cone again, held as at the start."""

    keys = ("back", "take", "next")

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig, tr("First cone again"), tr("Directions of the first sweep"))
        self.visits = Score(tr("The first cone again"))
        self.scores.addWidget(self.visits)

    def show_seen(self, seen: StepSnapshot) -> None:
        view = seen.view_as(sweeping.PivotView)
        self.show_cameras(view.base.live)
        step = view.base.step
        self.map.show_map(mapped_of(view, view.first))
        if step.gate.open:
            self.banner.tell(
                BannerMessage(tr("COMPLETE"), tr("Nothing is missing."), kit.Mark.GOOD, 1.0)
            )
        else:
            hint = kit.said(view.base.live.hint or step.instruction)
            self.banner.tell(BannerMessage(tr("BACK INTO THE FIRST CONE"), hint, kit.Mark.DOUBT))
        share = 1.0 if step.gate.open else 0.0
        self.visits.show_score(f"{step.done} / {step.wanted}", tr("held as at the start"), share)


def told_of(view: sweeping.PivotView, sweep: sweeping.SweepView) -> BannerMessage:
    hint = kit.said(view.base.live.hint)
    if sweep.phase is sweeping.SweepPhase.COUNTDOWN:
        seconds = max(view.countdown_s or 0.0, 0.0)
        share = 1.0 - seconds / sweeping.COUNTDOWN_S
        return BannerMessage(
            tr("STARTS IN {seconds}").format(seconds=int(np.ceil(seconds))),
            tr(_SEATED),
            kit.Mark.ACTIVE,
            share,
        )
    if sweep.phase is sweeping.SweepPhase.TAKING:
        missing = kit.said(sweep.missing) or hint
        return BannerMessage(tr("SWEEP"), missing, kit.Mark.ACTIVE, min(sweep.covered, 1.0))
    if sweep.phase is sweeping.SweepPhase.LEFT:
        return BannerMessage(tr("BALL LEFT THE CONE"), hint, kit.Mark.BAD, min(sweep.covered, 1.0))
    if sweep.phase is sweeping.SweepPhase.GOOD:
        return BannerMessage(tr("COMPLETE"), tr("Nothing is missing."), kit.Mark.GOOD, 1.0)
    return BannerMessage(tr("BALL INTO THE CONE"), hint, kit.Mark.DOUBT)


def mapped_of(view: sweeping.PivotView, sweep: sweeping.SweepView) -> Mapped:
    wanted = [cell for cell in sweep.cells if cell.wanted]
    groups = (
        [cell for cell in wanted if cell.poses],
        [cell for cell in wanted if not cell.poses],
        [cell for cell in sweep.cells if not cell.wanted],
    )
    done, missing, extra = (_directions(group) for group in groups)
    return Mapped(
        middle=sweep.map_middle_world, done=done, open=missing, extra=extra,
        now=view.direction_world, spacing=sweeping.CELL_RAD,
    )  # fmt: skip


def _directions(cells: list[sweeping.MapCell]) -> Points3:
    return np.array([cell.direction_world for cell in cells]).reshape(-1, 3)


def _elsewhere(view: sweeping.PivotView) -> Row:
    """Return the difference of the second sweep from the first, in place or attitude."""
    place, attitude = view.place_distance_mm, view.attitude_distance
    ways = [
        (place / view.place_wanted_mm, f"{place:.0f} / {view.place_wanted_mm:.0f} mm"),
        (
            attitude / view.attitude_wanted,
            f"{np.degrees(attitude):.0f}° / {np.degrees(view.attitude_wanted):.0f}°",
        ),
    ]
    share, value = max((way for way in ways if np.isfinite(way[0])), default=(0.0, "–"))
    return Row(tr("Away from the first"), value, share)
