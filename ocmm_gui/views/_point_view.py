"""3-D view: part, measurements, probe and target."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from PySide6.QtCore import QRectF
from PySide6.QtGui import QPaintEvent

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import JobView, LiveView, Target
from ocmm_core.part_model import PlacedPart
from ocmm_core.tracking import ProbeBody
from ocmm_gui.kit import text_font, tr
from ocmm_gui.rendering import RenderMode
from ocmm_gui.scene import (
    Item,
    Lines,
    Orbit,
    OrbitView,
    SceneCache,
    SceneLayer,
    ScenePainter,
    StandingLabels,
    StillScene,
    Tag,
)
from ocmm_gui.views import _contents as contents
from ocmm_gui.views import _shapes as shapes
from ocmm_gui.views._deviations import paint_scale, scale_place
from ocmm_gui.views._following import (
    OVERVIEW_ASPECT,
    Easing,
    Overview,
    ViewedPlaces,
    WorkExtent,
    following,
    grid_items,
    grid_place,
    paint_triad,
    paint_words,
    side_for,
    triad_place,
    words_place,
)
from ocmm_gui.views._placed import PartPlacement
from ocmm_gui.views._shapes import mean_distance, seen_from, upright

_NAMED_MM = 250.0
"""In a wider view LED labels would overlap."""
_BALL_PX = 13.0
"""Minimum label-free radius round ball and target."""
_GHOST = 0.4
_LED_ELEVATION = float(np.radians(46.0))
"""Steep enough to see into bores, flat enough for upright objects."""
_NO_PLACES = np.empty((0, 3))


class PointView(OrbitView):
    """Keeps the work visible until the user turns the view; F resumes.

    Orbit with the left button or the arrow keys, pan with the right one, zoom with the wheel.
    ``animated``: view changes take some tenths of a second.
    """

    def __init__(self, rig: Rig, body: ProbeBody, *, animated: bool = False) -> None:
        start = seen_from(rig, upright(rig))
        super().__init__(
            tr("3-D view"), (600, 420), (240, 160), start.fitted(rig.volume_world, 1.0, 1.0)
        )
        self.setAccessibleDescription(
            tr("Arrow keys rotate the view, plus and minus zoom, F fits it to the part")
        )
        self._body = body
        self._live: LiveView | None = None
        self._probe = _NO_PLACES
        self._job: JobView | None = None
        self._chosen = 0
        self._drawing = contents.JobDrawing()
        self._job_items: tuple[Item, ...] = ()
        self._labels = StandingLabels()
        self._job_low: float | None = None
        self._part = PartPlacement(self)
        self._part.changed.connect(self._look_again)
        self._mode = RenderMode.SHADED
        self._layer = SceneLayer(self)
        self._layer.changed.connect(self.update)
        self._ground, self.still = SceneCache(), SceneCache()
        self._whole = self._active = ViewedPlaces()
        self.work = WorkExtent()
        """Contents kept in view."""
        self._seen_target: Target | None = None
        self._follows = True
        self._led = False
        self._own_part: PlacedPart | None = None
        self._aim: tuple[Float, Float] | None = None
        self.easing = Easing(self, animated=animated)
        self.easing.moved.connect(self._ease)
        self._words: list[tuple[str, QRectF]] = []
        self.kept_free: list[QRectF] = []
        """Regions without labels, px, of the last painting."""
        depth = 0.18 * mean_distance(rig)
        pyramids = [shapes.camera_pyramid(camera, depth) for camera in rig.cameras]
        self._rig_lines = np.concatenate(pyramids)
        reach = np.concatenate([self._rig_lines.reshape(-1, 3), rig.volume_world])
        self._overview = Overview(rig, start.fitted(reach, OVERVIEW_ASPECT, 1.0), self._rig_lines)

    def show_live(self, live: LiveView) -> None:
        """Show the probe; not drawn without a trusted pose."""
        self._live = live
        self._probe = contents.probe_places(live, self._body)
        if len(self._probe):
            self._look_for_work()
        self.update()

    def show_job(self, job: JobView) -> None:
        if self._own_part is not None and job.placed_part is None:
            # Supposed places would float off the virtual part that is drawn.
            job = replace(job, planned=None)
        self._job = job
        self._part.place(job.placed_part or self._own_part)
        self._draw_job(job)
        self._part.show_deviations(self._drawing.deviations)
        self._look_for_work()
        self.update()

    def choose(self, number: int) -> None:
        self._chosen = number
        if self._job is not None:
            self.show_job(self._job)

    def fit(self) -> None:
        """Fit and follow the whole work."""
        self._follows = True
        self._seen_target = None
        self.work = self._work_now()
        orbit, _ = self._turned()
        box = self._inside()
        self.easing.stop()
        self._orbit = following(orbit, self.work, box.width(), box.height(), turned=True)
        self.update()

    def close_up(self) -> None:
        """Zoom to the active feature, until F."""
        feature = None if self._job is None else self._job.shown
        if feature is not None and feature.points:
            self._follows = False
            tips = np.stack([point.tip_world for point in feature.points])
            surface = np.stack([point.surface_world for point in feature.points])
            places, box = np.concatenate([tips, surface]), self._inside()
            wanted = self._orbit.fitted(places, box.width(), box.height(), margin=1.6)
            self.easing.start(self._orbit, wanted)

    def lead(self, *, led: bool, part: PlacedPart | None) -> None:
        """Hold the view still while the user leads the ball, and show the touched part.

        A following view would move the part under the mouse.
        """
        self._led, self._own_part, self._aim = led, part, None
        if self._job is not None:
            self.show_job(self._job)
        self.fit()
        if led:
            self._orbit = replace(self._orbit, elevation=_LED_ELEVATION)
            self.fit()

    def show_aim(self, place: Float | None, normal: Float | None) -> None:
        """Show the aim on the part: a place (3,), mm, and the way out; None hides it."""
        self._aim = None if place is None or normal is None else (place, normal)
        self.update()

    def next_mode(self) -> None:
        """Switch to the next mode: shaded, hidden lines, transparent."""
        self._mode = self._mode.following
        self.update()

    def mode(self) -> RenderMode:
        return self._mode

    def _paint(self) -> None:
        if self._job is not None:
            self._draw_job(self._job)
        self.update()

    def sees(self, target: Target) -> bool:
        """Return whether a target's side of the part is visible; for tests."""
        toward = self._orbit.axes()[2]
        facing = float(toward @ target.normal_world)
        return (facing > 0.0 or not np.any(target.normal_world)) and not self._part.hides(
            target, toward
        )

    def painted_labels(self) -> list[tuple[str, QRectF]]:
        """Return the painted labels with their places, px; for tests."""
        return list(self._words)

    def is_painted(self) -> bool:
        """Return whether painting is complete; for tests and screenshots."""
        if self.easing.is_running() or not self._part.is_coloured():
            return False
        return self._layer.shows(self._still_scene(self._inside()))

    def rough_words(self) -> str:
        """Return the note on an unlocated part; empty if located."""
        if self._part.is_rough():
            return self._supposed_words() or tr("Part placed roughly: not aligned yet")
        job = self._job
        if job is None or not job.active or job.target is not None or self._part.is_there():
            return ""
        if words := self._supposed_words():
            return words
        return tr("Part not located yet. Touch {feature}.").format(feature=job.active)

    def _supposed_words(self) -> str:
        """Return the note on a supposed part pose; empty if known better."""
        planned = None if self._job is None else self._job.planned
        if planned is None or not planned.supposed:
            return ""
        words = tr("Part not located yet, placed roughly. Touch {feature} on the real part.")
        return words.format(feature=planned.nominal.name)

    def _draw_job(self, job: JobView) -> None:
        items, reach = self._drawing.items(job, self._theme, self._chosen)
        if items is not self._job_items:
            self._job_items = items
            tags = [item for item in items if isinstance(item, Tag)]
            # What asks for attention first: outliers, the chosen point, the active feature.
            first = (self._theme.bad, self._theme.text, self._theme.accent)
            tags.sort(key=lambda tag: tag.colour not in first)
            self._labels.tags = tuple(tags)
        self._whole = ViewedPlaces(np.concatenate([reach, self._part.corners()]))
        own = self._drawing.reach(job.active) if job.active else _NO_PLACES
        self._active = ViewedPlaces(np.concatenate([own, self._part.extent(job.active)]))
        heights = self._whole.all @ self._orbit.up
        self._job_low = float(heights.min()) if len(heights) else None

    def _work_now(self) -> WorkExtent:
        whole = self._whole if len(self._whole.all) else ViewedPlaces(self._probe)
        return WorkExtent(self._probe[-1:], contents.shown_target(self._job), self._active, whole)

    def _look_for_work(self) -> None:
        """Keep the work in view: calmly, but at once if the ball has left it."""
        self.work = self._work_now()
        if not self._follows or self._led:
            return
        goal = self.easing.goal or self._orbit
        orbit, turned = self._turned(goal)
        box = self._inside()
        wanted = following(orbit, self.work, box.width(), box.height(), turned=turned)
        if wanted is not goal:
            self.easing.start(self._orbit, wanted)
        if len(self.work.ball) and not self.shows(self.work.ball):
            self.easing.finish()

    def _turned(self, start: Orbit | None = None) -> tuple[Orbit, bool]:
        """Return the view of the next place, and whether it is another side."""
        orbit = self._orbit if start is None else start
        target = self.work.target
        if target is None or _is_same(target, self._seen_target):
            return orbit, False
        self._seen_target = target
        later = () if self._job is None else contents.shown_targets(self._job)
        turned = side_for(orbit, target, later, lambda side: self._part.hides(target, side))
        return turned, turned is not orbit

    def _look_again(self) -> None:
        """Check the visibility of the next place again, with the mesh available."""
        self._seen_target = None
        self._look_for_work()
        self.update()

    def _ease(self, orbit: Orbit) -> None:
        self._moved_to(orbit)
        if len(self.work.ball) and self._follows and not self.shows(self.work.ball):
            self.easing.finish()

    def _moved(self, orbit: Orbit) -> None:
        self._follows = False
        self.easing.stop()
        super()._moved(orbit)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        theme, orbit = self._theme, self._orbit
        self._paint_panel(painter)
        inside = self._inside()
        font = text_font(12)
        seen = self._layer.picture(self._still_scene(inside), font)
        painter.drawImage(inside.topLeft(), seen.image)
        named = orbit.radius < _NAMED_MM
        tip = None if self._live is None else self._live.tip_world
        next_place = contents.target_items(self._job, tip, theme, orbit.up)
        moving = (
            *next_place,
            *contents.reference_items(self._live, theme, named=named),
            *contents.probe_items(self._probe, self._body, theme, named=named),
            *contents.aim_items(self._aim, self._probe, theme),
        )
        corner = self._overview.place(inside, self.projected(self.work.needed()))
        free = self._free_of_words(inside, corner)
        scene = ScenePainter(
            moving, orbit, inside, font, theme.panel,
            taken=[one.translated(-inside.topLeft()) for one in free],
            depth=seen.depth, ghost=_GHOST, standing=self._labels,
        )  # fmt: skip
        scene.paint(painter)
        paint_triad(painter, inside, orbit, theme)
        reach = None if self._mode is RenderMode.HIDDEN_LINES else self._part.reach_mm
        paint_scale(painter, scale_place(inside), self._drawing.deviations, theme, reach_mm=reach)
        if corner is not None:
            self._overview.paint(painter, corner, self._probe, theme)
        words = self.rough_words()
        if words:
            paint_words(painter, words_place(inside, words), words, theme)
        self.kept_free = free
        self._words = [(text, rect.translated(inside.topLeft())) for text, rect in scene.words]

    def _free_of_words(self, inside: QRectF, corner: QRectF | None) -> list[QRectF]:
        """Return label-free regions: ball, target, and overlays."""
        free = [triad_place(inside), grid_place(inside)]
        if self._drawing.deviations.whiskers:
            free.append(scale_place(inside))
        if corner is not None:
            free.append(corner)
        if words := self.rough_words():
            free.append(words_place(inside, words))
        scale = 0.5 * min(inside.width(), inside.height()) / self._orbit.radius
        ball = max(_BALL_PX, scale * self._body.tip_radius)
        target = self.work.target
        places = [(self.work.ball, ball)]
        if target is not None:
            places.append((target.surface_world[None], _BALL_PX))
        for where, half in places:
            for x, y in self.projected(where).tolist():
                free.append(QRectF(x - half, y - half, 2.0 * half, 2.0 * half))
        return free

    def _still_scene(self, inside: QRectF) -> StillScene:
        """Return what does not move with the probe; cached."""
        theme, orbit, size = self._theme, self._orbit, inside.size().toSize()
        ratio = self.devicePixelRatioF()
        active = "" if self._job is None else self._job.active
        part = self._part.part(theme, self._mode, active, moving=self.is_moving())

        def make(items: tuple[Item, ...], below: StillScene | None = None) -> StillScene:
            plain = tuple(item for item in items if not isinstance(item, Tag))
            return StillScene(plain, orbit, size, ratio, theme.panel, part, below)

        def ground() -> StillScene:
            # With a part the wires would be confusing: the overview has them.
            rig = () if part is not None else (Lines(self._rig_lines, theme.muted, 1.0),)
            return make((*grid_items(orbit, self._job_low, theme), *rig, *drawing.still))

        drawing = self._drawing
        values = (theme.name, self._job_low, size, ratio)
        below = self._ground.made((drawing.still, orbit, part), values, ground)
        changing = drawing.changing
        return self.still.made((below, changing), (), lambda: make(changing, below))


def _is_same(target: Target, other: Target | None) -> bool:
    """Return whether two targets are equal: re-evaluated jobs have new objects."""
    return other is not None and (
        np.array_equal(target.surface_world, other.surface_world)
        and np.array_equal(target.normal_world, other.normal_world)
    )
