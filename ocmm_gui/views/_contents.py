"""Contents of the 3-D view: probe, planned and measured features, points, and a grid."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from operator import is_
from typing import TypeAlias

import numpy as np

from ocmm_core.features.shapes import GEOMETRY_SIZE, NominalFeature, make_fit, nominal_geometry
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import (
    FeatureState,
    FeatureView,
    JobView,
    LiveView,
    PlannedFeature,
    Target,
    cue,
)
from ocmm_core.tolerances.decisions import NO_DEVIATIONS, Verdict
from ocmm_core.tracking import ProbeBody
from ocmm_gui.kit import (
    DEFAULT_THEME,
    THEMES,
    Theme,
    led_name,
    reference_led_name,
    tr,
    verdict_colour,
)
from ocmm_gui.scene import Dots, Face, Item, Lines, Tag
from ocmm_gui.views import _shapes as shapes
from ocmm_gui.views._deviations import deviation_items, deviations_of

_PLAIN_MM = 20.0
"""Half size of a plane or line without nominal size."""


def nominal_items(
    nominal: NominalFeature, colour: str, arrow: str
) -> tuple[tuple[Item, ...], Float]:
    """Return a nominal feature as wires with direction, and all its places (n, 3)."""
    geometry = nominal_geometry(nominal)
    ends = _ends(nominal, geometry)
    fit = make_fit(nominal.shape, geometry, np.zeros((GEOMETRY_SIZE, 0)), np.zeros(1))
    lines, corners = shapes.fitted_shape(fit, ends)
    items: list[Item] = [Face(corners, colour, 50)] if len(corners) else []
    items += [Lines(lines, colour, 2.0), Dots(fit.point[None], arrow, 6.0)]
    reach = np.concatenate([lines.reshape(-1, 3), fit.point[None]])
    if nominal.shape.spec.planned_direction:
        size = max(0.5 * float(np.ptp(reach, axis=0).max()), 8.0)
        tip = fit.point + size * np.array(nominal.direction) / np.linalg.norm(nominal.direction)
        items.append(Lines(np.stack([fit.point, tip])[None], arrow, 1.5))
        reach = np.concatenate([reach, tip[None]])
    return tuple(items), reach


def _ends(nominal: NominalFeature, geometry: Float) -> Float:
    """Return the end places of a drawn plane, line or cylinder, (n, 3)."""
    point, direction = geometry[0:3], np.array(nominal.direction)
    direction = direction / np.linalg.norm(direction)
    half = 0.5 * nominal.length or (nominal.diameter or _PLAIN_MM)
    if nominal.shape.spec.spread != "plane":
        return np.stack([point - half * direction, point + half * direction])
    across = np.array(nominal.across) - (direction @ np.array(nominal.across)) * direction
    if np.linalg.norm(across) < 1e-9:
        across = np.roll(direction, 1) - (direction @ np.roll(direction, 1)) * direction
    across = across / np.linalg.norm(across)
    other = np.cross(direction, across)
    wide = 0.5 * nominal.width or half
    steps = ((half, wide), (-half, wide), (-half, -wide), (half, -wide))
    return np.stack([point + a * across + b * other for a, b in steps])


def planned_items(planned: PlannedFeature, theme: Theme) -> tuple[tuple[Item, ...], Float]:
    """Return a feature at its planned pose, with its name, and all its places (n, 3)."""
    nominal, place = planned.nominal, planned.T_world_from_nominal
    geometry = nominal_geometry(nominal)
    fit = make_fit(nominal.shape, geometry, np.zeros((GEOMETRY_SIZE, 0)), np.zeros(1))
    lines, corners = shapes.fitted_shape(fit, _ends(nominal, geometry))
    lines, middle = place.apply(lines.reshape(-1, 3)).reshape(-1, 2, 3), place.apply(fit.point)
    items: list[Item] = []
    if len(corners):
        items.append(Face(place.apply(corners), theme.accent, 50))
    items += [Lines(lines, theme.accent, 2.0), Tag(middle, nominal.name, theme.accent)]
    return tuple(items), np.concatenate([lines.reshape(-1, 3), middle[None]])


_ARROW_MM = 9.0
_STEM_MM = 25.0
_AIM_MM = 3.0
_RING_MM = 40.0
"""Maximum radius of the target ring."""


def probe_places(live: LiveView, body: ProbeBody) -> Float:
    """Return LEDs and ball centre (L + 1, 3), mm, world; empty if not trusted."""
    if (
        live.tip_world is None
        or live.origin_world is None
        or live.rotation_world_from_probe is None
    ):
        return np.empty((0, 3))
    places = np.concatenate([body.leds_probe, body.tip_probe[None]])
    moved: Float = places @ live.rotation_world_from_probe.T + live.origin_world
    return moved


def probe_items(places: Float, body: ProbeBody, theme: Theme, *, named: bool) -> tuple[Item, ...]:
    """Return the probe at ``places`` (L + 1, 3) from `probe_places`."""
    if not len(places):
        return ()
    leds, tip = places[:-1], places[-1]
    base = leds.mean(axis=0)
    frame = np.stack([np.broadcast_to(base, leds.shape), leds], axis=1)
    tags = [Tag(led, led_name(number), theme.muted) for number, led in enumerate(leds)]
    return (
        Lines(frame, theme.muted, 3.0),
        Lines(np.stack([base, tip])[None], theme.text, 3.0),
        Lines(shapes.sphere(tip, body.tip_radius), theme.accent, 1.2),
        Dots(leds, theme.bad, 9.0, theme.panel),
        *(tags if named else ()),
    )


def reference_items(live: LiveView | None, theme: Theme, *, named: bool) -> tuple[Item, ...]:
    """Return the reference body at its fixed pose in the job's world."""
    if live is None or live.reference is None or live.reference.leds_world is None:
        return ()
    leds = live.reference.leds_world
    frame = np.stack([np.broadcast_to(leds.mean(axis=0), leds.shape), leds], axis=1)
    tags = [Tag(led, reference_led_name(number), theme.muted) for number, led in enumerate(leds)]
    return (
        Lines(frame, theme.muted, 2.0),
        Dots(leds, theme.warn, 9.0, theme.panel),
        *(tags if named else ()),
    )


def job_items(job: JobView, theme: Theme) -> tuple[tuple[Item, ...], Float]:
    """Return points and features of a job, and all places (n, 3) to be in view."""
    return JobDrawing().items(job, theme)


_Look: TypeAlias = tuple[Verdict | None, int, bool]
"""Verdict of a feature, the number of its chosen point or zero, and whether it has the last one."""
_Kept: TypeAlias = tuple[FeatureView, _Look, tuple[Item, ...], Float]
"""A feature, its look, its items, and its places (n, 3)."""

_MOST_BUSY = 10
"""Features drawn apart from those at rest: those that changed last."""


class JobDrawing:
    """Points and features of a growing job; unchanged items are cached."""

    def __init__(self) -> None:
        self._kept: dict[str, _Kept] = {}
        self._theme = THEMES[DEFAULT_THEME]
        self._items: tuple[Item, ...] = ()
        self._busy: list[str] = []
        self.still: tuple[Item, ...] = ()
        self.changing: tuple[Item, ...] = ()
        """`still`, `changing`: the last drawn items, apart: of features at rest, and of others."""
        self._deviations: tuple[Item, ...] = ()
        self._deviations_of: tuple[object, ...] = ()
        self._planned_of: tuple[object, ...] = ()
        self._planned_at = np.empty((0, 0))
        self._planned: tuple[tuple[Item, ...], Float] = ((), np.empty((0, 3)))
        self.deviations = NO_DEVIATIONS
        self._reach: dict[str, Float] = {}

    def reach(self, name: str = "") -> Float:
        """Return places (n, 3) of a feature and its targets in the last drawn job, or of all."""
        places = [part for key, part in self._reach.items() if not name or key == name]
        return np.concatenate([np.empty((0, 3)), *places])

    def items(self, job: JobView, theme: Theme, chosen: int = 0) -> tuple[tuple[Item, ...], Float]:
        """Return `job_items`, the same tuple if unchanged; ``chosen``: highlighted point."""
        items: list[Item] = []
        self._reach = {}
        own_items: dict[str, tuple[Item, ...]] = {}
        touched = [feature for feature in job.features if feature.points]
        last = max((feature.points[-1].number for feature in touched), default=0)
        if theme is not self._theme:
            self._theme, self._kept = theme, {}
        # The active feature first: its label has priority.
        for feature in sorted(touched, key=lambda f: f.state is not FeatureState.ACTIVE):
            verdict = job.verdict_of(feature.name).verdict
            marked = chosen if chosen and any(p.number == chosen for p in feature.points) else 0
            look = (verdict, marked, feature.points[-1].number == last)
            kept = self._kept.get(feature.name)
            if kept is None or kept[0] is not feature or kept[1] != look:
                kept = self._made(feature, look)
            items += kept[2]
            own_items[feature.name] = kept[2]
            self._reach[feature.name] = kept[3]
        others = (*self._planned_items(job, theme), *self._whiskers(job, theme))
        items += others
        if not _are_same(items, self._items):
            self._items = tuple(items)
            self._separate(own_items, others)
        targets = [target.surface_world for target in shown_targets(job)]
        if targets:
            before = self._reach.get(job.active, np.empty((0, 3)))
            self._reach[job.active] = np.concatenate([before, np.stack(targets)])
        return self._items, self.reach()

    def _separate(self, own: dict[str, tuple[Item, ...]], others: tuple[Item, ...]) -> None:
        """Set `still` and `changing`; the same tuple of still items as long as possible."""
        self._busy = [name for name in self._busy if name in own]
        still = [item for name, part in own.items() if name not in self._busy for item in part]
        if not _are_same(still, self.still):
            self.still = tuple(still)
        busy = (item for name in self._busy for item in own[name])
        self.changing = (*busy, *others)

    def _planned_items(self, job: JobView, theme: Theme) -> tuple[Item, ...]:
        """Return the active feature as planned, with its name, before it is measured."""
        planned = job.planned
        if planned is None:
            return ()
        before = self._planned_of
        pose = planned.T_world_from_nominal
        # The pose of an unlocated part is recreated, but equal, for every view.
        at = np.column_stack([pose.rotation, pose.translation])
        look = (planned.nominal, theme)
        same = len(before) == len(look) and all(map(is_, look, before))
        if not (same and np.array_equal(self._planned_at, at)):
            self._planned_of, self._planned_at = look, at
            self._planned = planned_items(planned, theme)
        items, reach = self._planned
        before_it = self._reach.get(job.active, np.empty((0, 3)))
        self._reach[job.active] = np.concatenate([before_it, reach])
        return items

    def _whiskers(self, job: JobView, theme: Theme) -> tuple[Item, ...]:
        made_of = (*job.characteristics, job.held, theme)
        before = self._deviations_of
        if len(made_of) != len(before) or not all(map(is_, made_of, before)):
            self._deviations_of = made_of
            self.deviations = deviations_of(job)
            self._deviations = deviation_items(self.deviations, theme)
        return self._deviations

    def _made(self, feature: FeatureView, look: _Look) -> _Kept:
        kept = self._kept[feature.name] = (
            feature, look, *_feature_items(feature, look, self._theme)
        )  # fmt: skip
        others = [name for name in self._busy if name != feature.name]
        self._busy = [*others, feature.name][-_MOST_BUSY:]
        return kept


def _are_same(items: Sequence[Item], others: Sequence[Item]) -> bool:
    return len(items) == len(others) and all(map(is_, items, others))


def _feature_items(
    feature: FeatureView, look: _Look, theme: Theme
) -> tuple[tuple[Item, ...], Float]:
    """Return a feature with points, and the places (n, 3) that it covers."""
    items: list[Item] = []
    verdict, chosen, has_last = look
    active = feature.state is FeatureState.ACTIVE
    colour = theme.accent if active else verdict_colour(theme, verdict)
    surface = np.stack([point.surface_world for point in feature.points])
    reach = surface
    if feature.fit is not None:
        lines, corners = shapes.fitted_shape(feature.fit, surface)
        if len(corners):
            items.append(Face(corners, colour, 36))
        items.append(Lines(lines, colour, 2.2 if active else 1.4))
        items.append(Tag(feature.fit.point, feature.name, colour))
        # Segment ends are shared with neighbours, and a ring has 48 of them.
        reach = np.concatenate([surface, lines.reshape(-1, 3)[:: 4 if len(lines) > 40 else 1]])
    items += _sides(feature, surface, theme, active=active, has_last=has_last)
    items.append(
        Dots(surface, theme.text if active else colour, 8.0 if active else 5.0, theme.panel)
    )
    items += _marked_points(feature, theme, chosen)
    return tuple(items), reach


def _sides(
    feature: FeatureView, surface: Float, theme: Theme, *, active: bool, has_last: bool
) -> Iterator[Item]:
    """Yield touch directions of the active feature, and of the last point."""
    tails = surface + _ARROW_MM * np.stack([point.direction for point in feature.points])
    if active:
        yield Lines(_arrows(tails, surface), theme.text, 1.4)
    if has_last:
        # A flip reverses this one.
        yield Lines(_arrows(tails[-1:], surface[-1:]), theme.warn, 2.6)


def _marked_points(feature: FeatureView, theme: Theme, chosen: int) -> Iterator[Item]:
    """Yield outliers in red, and the selected point large and named."""
    for point in feature.points:
        place = point.surface_world
        if point.number in feature.outliers:
            yield Dots(place[None], theme.bad, 11.0, theme.panel)
            yield Tag(place, tr("{number} outlier").format(number=point.number), theme.bad)
        if point.number == chosen:
            yield Dots(place[None], theme.warn, 14.0, theme.text)
            yield Tag(place, tr("point {chosen}").format(chosen=chosen), theme.text)


def active_targets(job: JobView) -> tuple[Target, ...]:
    """Return the missing points of the active feature."""
    return next((item.targets for item in job.features if item.name == job.active), ())


def shown_targets(job: JobView) -> tuple[Target, ...]:
    """Return `active_targets`, or supposed ones until the pose is known."""
    known = active_targets(job)
    return known if known or job.planned is None else job.planned.targets


def shown_target(job: JobView | None) -> Target | None:
    """Return the next target, possibly supposed, or None."""
    if job is None:
        return None
    return job.target or next(iter(shown_targets(job)), None)


def target_items(
    job: JobView | None, tip_world: Float | None, theme: Theme, up: Float
) -> tuple[Item, ...]:
    """Return targets, and a ring that shrinks round the next one.

    The ring closes when the ball, ``tip_world`` (3,), is there; None shows none. It is horizontal,
    perpendicular to ``up`` (3,), if the plan has no touch direction.
    """
    if job is None:
        return ()
    others = [target.surface_world for target in shown_targets(job)]
    items: list[Item] = []
    if others:
        items.append(Dots(np.stack(others), theme.panel, 9.0, theme.accent))
    target = shown_target(job)
    if target is None:
        return tuple(items)
    place, normal = target.surface_world, target.normal_world
    items.append(Dots(place[None], theme.accent, 13.0, theme.text))
    if np.any(normal):
        items.append(Lines(np.stack([place + _STEM_MM * normal, place])[None], theme.accent, 2.0))
    if tip_world is not None and job.target is not None:
        radius = _RING_MM * cue(target.distance(tip_world)).ring_px_fraction
        corners = shapes.ring(place, normal if np.any(normal) else up, radius)
        items.append(Lines(shapes.polyline(corners, closed=True), theme.accent, 3.0))
    where = tr("next, roughly") if target.approximate else tr("next")
    if job.target is None:
        # Supposed part pose: no ring leads there.
        where = tr("touch here first, roughly")
    items.append(Tag(place, where, theme.accent))
    return tuple(items)


def aim_items(aim: tuple[Float, Float] | None, probe: Float, theme: Theme) -> tuple[Item, ...]:
    """Return the place aimed at on the part, and the path of the ball."""
    if aim is None:
        return ()
    place, normal = aim
    items: list[Item] = [
        Lines(shapes.polyline(shapes.ring(place, normal, _AIM_MM), closed=True), theme.warn, 2.0),
        Dots(place[None], theme.warn, 6.0, theme.panel),
    ]
    if len(probe):
        items.append(Lines(np.stack([probe[-1], place])[None], theme.warn, 1.2))
    return tuple(items)


def _arrows(tails: Float, heads: Float) -> Float:
    """Return arrows (3 n segments, 2, 3) from tails to heads, both (n, 3)."""
    shaft = tails - heads
    # Not parallel to any usual nominal direction.
    side = np.cross(shaft, np.array([0.31, 0.52, 0.79]))
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9)
    length = np.linalg.norm(shaft, axis=1, keepdims=True)
    barbs = [heads + 0.28 * shaft + sign * 0.14 * length * side for sign in (-1.0, 1.0)]
    return np.concatenate([np.stack([start, heads], axis=1) for start in (tails, *barbs)])
