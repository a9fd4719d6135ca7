"""Pages of tip qualification and check: touching the sphere, resting in the cone."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen

from ocmm_core.calibration.tip import ConeProgress, Phase, SphereProgress, TouchView
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Points3, unit
from ocmm_gui.charts import Bars, Mapped, Plot, Row
from ocmm_gui.kit import Mark, digit_font, fill, ink, localised, said, said_word, text_font, tr
from ocmm_gui.views import upright
from ocmm_gui.wizards.pages._live_panel import BannerMessage, Score
from ocmm_gui.wizards.pages._pages import HandsPage
from ocmm_gui.wizards.pages._shown import StepSnapshot

_SPHERE_SPACING, _CONE_SPACING = float(np.radians(16.0)), float(np.radians(14.0))
_KEYS = ("back", "drop", "automatic", "take", "next")


class SpherePage(HandsPage):
    """The sphere is touched all around; the map shows where."""

    keys = _KEYS

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig, tr("Touch"), tr("Places on the sphere, seen from its pole"))
        self.ball = Score(tr("Diameter of the ball"))
        self.bars = Bars(tr("Coverage of the sphere"), 3)
        fill(self.scores, (self.ball, 3), (self.bars, 3))

    def show_seen(self, seen: StepSnapshot) -> None:
        view = seen.view_as(TouchView)
        self.show_cameras(view.base.live)
        sphere = view.sphere
        self.banner.tell(told_of(view, tr("TOUCH"), _next_place(sphere), automatic=seen.automatic))
        self.map.show_map(_sphere_map(sphere))
        sigma, limit = sphere.diameter_sigma_mm, sphere.diameter_sigma_limit_mm
        known = bool(np.isfinite(sigma)) and sigma > 0.0
        self.ball.show_score(
            localised(f"{sphere.diameter_mm:.4f} mm") if np.isfinite(sphere.diameter_mm) else "–",
            tr("{nominal_mm:.4f} expected").format(nominal_mm=view.nominal_mm),
            min(limit / sigma, 1.0) if known else 0.0,
        )
        places = len(sphere.places)
        touched = places - len(sphere.missing)
        end = sphere.diameter_sigma_end_mm
        rows = [
            Row(tr("Places"), f"{touched} / {places}", touched / max(places, 1)),
            Row(
                tr("U of the diameter (k = 2)"),
                localised(f"{2e3 * sigma:.1f} / {2e3 * limit:.1f} µm") if known else "–",
                min(limit / sigma, 1.0) if known else 0.0,
            ),
        ]
        if np.isfinite(end) and sphere.missing and end > 0.0:
            rows.append(
                Row(
                    tr("… with all places"), localised(f"{2e3 * end:.1f} µm"), min(limit / end, 1.0)
                )
            )
        self.bars.show_rows(rows)


class ConePage(HandsPage):
    """The ball rests in the cone in several attitudes; the tip must stay in place."""

    keys = _KEYS

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig, tr("Hold"), tr("Probe attitudes"))
        self._up = upright(rig)
        self.spread = Score(tr("Spread of the tip (2 s)"))
        self.tips = TipScatter(rig)
        fill(self.scores, (self.spread, 2), (self.tips, 4))

    def show_seen(self, seen: StepSnapshot) -> None:
        view = seen.view_as(TouchView)
        self.show_cameras(view.base.live)
        cone = view.cone
        where = _next_attitude(cone)
        self.banner.tell(told_of(view, where.upper(), where, automatic=seen.automatic))
        self.map.show_map(_cone_map(cone, self._up))
        spread, limit = cone.spread_2s_mm, cone.spread_limit_mm
        known = bool(np.isfinite(spread)) and bool(np.isfinite(limit))
        self.spread.show_score(
            localised(f"{1e3 * spread:.1f} µm") if known else "–",
            tr("at most {limit:.1f} µm").format(limit=1e3 * limit)
            if known
            else tr("after two attitudes"),
            min(limit / spread, 1.0) if known and spread > 0.0 else 0.0,
        )
        self.tips.show_tips(cone)


class TipScatter(Plot):
    """Tips of all attitudes about their mean, from the front and from above."""

    def __init__(self, rig: Rig) -> None:
        super().__init__(tr("Tips about their mean"))
        self._up = int(np.argmax(np.abs(upright(rig))))
        self._raised = float(upright(rig)[self._up])
        self._off_um: Points3 = np.empty((0, 3))
        self._limit_um = float("nan")

    def show_tips(self, cone: ConeProgress) -> None:
        """Show the deviations of the tips of all attitudes from their mean."""
        self.show_off(cone.off_world, cone.largest_limit_mm)

    def show_off(self, off_world: Points3, limit_mm: float) -> None:
        """Show deviations (n, 3), mm, in a circle of the limit; NaN draws none."""
        self._off_um, self._limit_um = 1e3 * off_world, 1e3 * limit_mm
        self._off_um = self._off_um[np.isfinite(self._off_um).all(axis=1)]
        largest = float(np.linalg.norm(self._off_um, axis=1).max(initial=0.0))
        self._show_message(
            tr("largest {largest:.1f} µm").format(largest=largest)
            if len(self._off_um) > 1
            else tr("none yet")
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        box = self._paint_head(painter)
        across = [axis for axis in range(3) if axis != self._up]
        half = QRectF(box.left(), box.top(), 0.5 * box.width() - 4.0, box.height())
        other = half.translated(0.5 * box.width() + 4.0, 0.0)
        largest = float(np.linalg.norm(self._off_um, axis=1).max(initial=0.0))
        limit = self._limit_um if np.isfinite(self._limit_um) else 0.0
        reach = 1.15 * max(limit, largest, 1.0)
        for part, axes, sign in (
            (half, (across[0], self._up), self._raised),
            (other, (across[0], across[1]), 1.0),
        ):
            self._paint_side(painter, part, axes, sign, reach)

    def _paint_side(
        self, painter: QPainter, part: QRectF, axes: tuple[int, int], sign: float, reach: float
    ) -> None:
        theme = self._theme
        radius = 0.5 * min(part.width(), part.height() - 20.0) - 2.0
        centre = QPointF(part.center().x(), part.top() + radius + 2.0)
        ink(painter, QPen(QColor(theme.border), max(theme.border_px, 1)), QColor(theme.background))
        side = QRectF(centre.x() - radius, centre.y() - radius, 2.0 * radius, 2.0 * radius)
        painter.drawRect(side)
        painter.drawLine(QPointF(side.left(), centre.y()), QPointF(side.right(), centre.y()))
        painter.drawLine(QPointF(centre.x(), side.top()), QPointF(centre.x(), side.bottom()))
        if np.isfinite(self._limit_um):
            allowed = radius * self._limit_um / reach
            ink(painter, QPen(QColor(theme.warn), 1.5, Qt.PenStyle.DashLine), Qt.BrushStyle.NoBrush)
            painter.drawEllipse(centre, allowed, allowed)
        ink(painter, QPen(QColor(theme.panel), 1.0), QColor(theme.accent))
        for off in self._off_um:
            x, y = radius * off[axes[0]] / reach, -sign * radius * off[axes[1]] / reach
            painter.drawEllipse(centre + QPointF(x, y), 5.0, 5.0)
        ink(painter, QColor(theme.muted), font=digit_font(12, bold=False))
        names = f"{'XYZ'[axes[0]]} → {'XYZ'[axes[1]]} {'↑' if sign > 0 else '↓'}  ±{reach:.0f} µm"
        foot = QRectF(part.left(), side.bottom() + 1.0, part.width(), 18.0)
        painter.setFont(text_font(12))
        painter.drawText(foot, Qt.AlignmentFlag.AlignCenter, names)


def told_of(view: TouchView, word: str, where: str, *, automatic: bool) -> BannerMessage:
    """Return the banner before an observation: ``word`` until the ball is near."""
    countdown, hint = view.countdown, said(view.base.live.hint)
    if not where:
        return BannerMessage(tr("COMPLETE"), tr("Nothing is missing."), Mark.GOOD, 1.0)
    if countdown.phase is Phase.RESTING:
        still = tr("HOLD STILL  {seconds_left:.1f}").format(seconds_left=countdown.seconds_left)
        return BannerMessage(still, _sentence(where), Mark.ACTIVE, countdown.fraction)
    if countdown.phase is Phase.READY:
        note = tr("Taken automatically.") if automatic else tr("Press Space to take it.")
        return BannerMessage(tr("READY"), note, Mark.GOOD, 1.0)
    if countdown.phase is Phase.TAKEN:
        return BannerMessage(tr("TAKEN"), tr("Next: {where}").format(where=where), Mark.GOOD, 0.0)
    note = hint if word == where.upper() else f"{_sentence(where)} {hint}"
    return BannerMessage(word, note, Mark.ACTIVE, 0.0)


def _sentence(where: str) -> str:
    return f"{where[:1].upper()}{where[1:]}."


def _next_place(sphere: SphereProgress) -> str:
    if sphere.next_place is not None:
        return said(sphere.places[sphere.next_place].name)
    return tr("one more point, as shown on the map") if sphere.also_world is not None else ""


def _next_attitude(cone: ConeProgress) -> str:
    if cone.next_attitude is None:
        return ""
    return said_word(cone.attitudes[cone.next_attitude].name)


def _sphere_map(sphere: SphereProgress) -> Mapped:
    directions = np.array([place.direction_world for place in sphere.places]).reshape(-1, 3)
    taken = np.array([place.point is not None for place in sphere.places], dtype=np.bool_)
    aim: Float = np.full(3, np.nan)
    if sphere.next_place is not None:
        aim = directions[sphere.next_place]
    elif sphere.also_world is not None:
        aim = sphere.also_world
    return Mapped(
        middle=unit(directions.mean(axis=0)), done=directions[taken], open=directions[~taken],
        extra=sphere.directions_world, aim=aim, spacing=_SPHERE_SPACING,
    )  # fmt: skip


def _cone_map(cone: ConeProgress, up: Float) -> Mapped:
    directions = np.array([one.handle_world for one in cone.attitudes]).reshape(-1, 3)
    taken = np.array([one.point is not None for one in cone.attitudes], dtype=np.bool_)
    aim: Float = np.full(3, np.nan)
    if cone.next_attitude is not None:
        aim = directions[cone.next_attitude]
    mean = directions.mean(axis=0)
    return Mapped(
        middle=unit(mean) if float(np.linalg.norm(mean)) > 0.1 else up, done=directions[taken],
        open=directions[~taken], extra=cone.handles_world, aim=aim, spacing=_CONE_SPACING,
    )  # fmt: skip
