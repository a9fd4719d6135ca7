"""Pictures of a step: the volume with the places of probe, bar or target, and the probe."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QPainter, QPaintEvent

from ocmm_core.calibration.guided import KnownPoint, LinePlan, VolumeCoverage
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Points3
from ocmm_gui import kit
from ocmm_gui.kit import tr
from ocmm_gui.scene import Dots, Face, Item, Lines, Orbit, Tag, paint_scene
from ocmm_gui.views import shapes, upright

_ASIDE, _ABOVE = np.radians(28.0), np.radians(24.0)
_CAMERA_REACH = 0.3
"""Length of the arrow to the cameras, in sides of the volume."""

Contents = Callable[[kit.Theme], Sequence[Item]]


class ScenePicture(kit.PaintedWidget):
    """A static 3-D picture, seen from behind the cameras and slightly from above."""

    def __init__(self, name: str, rig: Rig) -> None:
        super().__init__(name, kit.SCENE_SIZE, kit.SCENE_LEAST)
        self._rig = rig
        self._contents: Contents = _nothing
        self._reach = shapes.box(rig.volume_world).reshape(-1, 3)
        up = upright(rig)
        start = Orbit(np.zeros(3), 0.0, 0.0, 200.0, up)
        self._middle = rig.volume_world.mean(axis=0)
        self._seat = np.mean([camera.centre_world for camera in rig.cameras], axis=0) - self._middle
        right, _, outward = start.axes()
        azimuth = float(np.arctan2(self._seat @ right, self._seat @ outward))
        self._orbit = start.turned(azimuth + _ASIDE, _ABOVE)

    def show_contents(self, contents: Contents, description: str) -> None:
        """Show objects in the volume; the description is for screen readers."""
        self._contents = contents
        self.setAccessibleDescription(description)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        theme = self._theme
        inside = self._paint_panel(painter).adjusted(10, 10, -10, -10)
        arrow = self._camera_arrow()
        beyond = arrow[1] + 0.5 * (arrow[1] - arrow[0])
        reach = np.concatenate([self._reach, beyond[None]])
        orbit = self._orbit.fitted(reach, inside.width(), inside.height(), 1.08)
        items = (
            *self._contents(theme),
            Lines(shapes.box(self._rig.volume_world), theme.border, 1.4),
            Lines(_arrow(arrow[0], arrow[1], orbit), theme.muted, 2.4),
            Tag(beyond, tr("cameras"), theme.muted),
        )
        paint_scene(painter, items, orbit, inside, kit.text_font(14, bold=True), theme.panel)

    def _camera_arrow(self) -> Float:
        """Return the arrow (2, 3) on the floor of the volume towards the cameras."""
        size = np.ptp(self._rig.volume_world, axis=0)
        floor = self._middle - 0.5 * (size @ np.abs(self._orbit.up)) * self._orbit.up
        direction = self._seat - (self._seat @ self._orbit.up) * self._orbit.up
        direction /= np.linalg.norm(direction)
        edge = 0.5 * float(np.abs(direction) @ size)
        ends: Float = floor + np.outer([edge, edge + _CAMERA_REACH * np.max(size)], direction)
        return ends


def reference_points(points: Sequence[KnownPoint], aim: int | None) -> Contents:
    """Return the picture of the list: recorded points, open ones, and the next one."""

    def contents(theme: kit.Theme) -> Sequence[Item]:
        groups: dict[str, list[Float]] = {"open": [], "taken": [], "skipped": []}
        for index, point in enumerate(points):
            if index != aim:
                kind = "open" if point.views is None else "taken" if point.views else "skipped"
                groups[kind].append(point.position_world)
        items: list[Item] = []
        if aim is not None:
            place = points[aim].position_world
            items.append(Tag(place, points[aim].name, theme.accent))
            items.append(Dots(place[None], theme.accent, 20.0, theme.text))
        for kind, colour, size, outline in (
            ("open", theme.panel, 8.0, theme.muted),
            ("taken", theme.good, 8.0, theme.panel),
            ("skipped", theme.warn, 8.0, theme.panel),
        ):
            if groups[kind]:
                items.append(Dots(np.array(groups[kind]), colour, size, outline))
        return items

    return contents


def volume_coverage(coverage: VolumeCoverage) -> Contents:
    """Return the picture of the cells: those without enough poses, the emptiest named."""
    missing = [cell for cell in coverage.cells if cell.poses < cell.wanted]
    first = min(missing, key=lambda cell: cell.poses / cell.wanted, default=None)

    def contents(theme: kit.Theme) -> Sequence[Item]:
        items: list[Item] = []
        for cell in coverage.cells:
            middle = 0.5 * (cell.low_world + cell.high_world)[None]
            share = min(cell.poses / cell.wanted, 1.0)
            if share >= 1.0:
                items.append(Dots(middle, theme.good, 18.0, theme.panel))
                continue
            items.append(Dots(middle, theme.panel, 18.0, theme.warn))
            if share > 0.0:
                items.append(Dots(middle, theme.warn, 4.0 + 12.0 * share))
        if first is not None:
            corners = np.stack([first.low_world, first.high_world])
            items += [Face(face, theme.accent, 50) for face in _faces(corners)]
            items.append(Lines(shapes.box(corners), theme.accent, 2.4))
            items.append(Tag(corners.mean(axis=0), kit.said_word(first.name), theme.accent))
        return items

    return contents


@dataclass(frozen=True, slots=True)
class BarPlace:
    """A bar in the volume."""

    name: str
    ends_world: Float
    """(2, 3), mm."""
    nests: int
    done: int
    shares: tuple[float, ...] = ()
    """Relative positions along it, 0 to 1; evenly spaced if empty."""


def bar_places(lines: Sequence[LinePlan]) -> tuple[BarPlace, ...]:
    return tuple(
        BarPlace(one.name, one.ends_world, one.wanted, one.taken, one.shares) for one in lines
    )


def bars(places: Sequence[BarPlace], current: int | None) -> Contents:
    """Return the picture of all placements: the current one thick, with its nests."""

    def contents(theme: kit.Theme) -> Sequence[Item]:
        items: list[Item] = []
        for index, place in enumerate(places):
            done = place.done >= place.nests
            if index != current:
                colour = theme.good if done else theme.muted
                items.append(Lines(place.ends_world[None], colour, 3.0 if done else 1.6))
                if done:
                    items.append(Dots(place.ends_world, theme.good, 8.0, theme.panel))
        if current is not None:
            place = places[current]
            share = np.array(place.shares or np.linspace(0.0, 1.0, place.nests))[:, None]
            nests = place.ends_world[0] + share * (place.ends_world[1] - place.ends_world[0])
            items.append(Lines(place.ends_world[None], theme.accent, 6.0))
            items.append(Dots(nests[place.done :], theme.panel, 13.0, theme.accent))
            items.append(Dots(nests[: place.done], theme.good, 13.0, theme.panel))
            if place.done < place.nests and place.nests > 2:
                items.append(Dots(nests[place.done][None], theme.warn, 19.0, theme.text))
                items.append(
                    Tag(
                        nests[place.done], tr("nest {done}").format(done=place.done + 1), theme.warn
                    )
                )
            middle = place.ends_world.mean(axis=0)
            items.append(Tag(middle, kit.said_word(place.name), theme.accent))
        return items

    return contents


def seats(places_world: Sequence[Float], aim: int | None) -> Contents:
    """Return the picture of visited seats (3,), mm; the next one highlighted."""

    def contents(theme: kit.Theme) -> Sequence[Item]:
        items: list[Item] = []
        for number, place in enumerate(places_world):
            wanted = number == aim
            items.append(Dots(place[None], theme.warn if wanted else theme.good, 16.0, theme.text))
            items.append(
                Tag(
                    place,
                    tr("seat {number}").format(number=number + 1),
                    theme.warn if wanted else theme.text,
                )
            )
        return items

    return contents


def _nothing(theme: kit.Theme) -> Sequence[Item]:
    return ()


def _faces(corners: Float) -> Iterator[Float]:
    """Yield the six faces (4, 3) of a box between two corners (2, 3)."""
    for axis in range(3):
        first, second = (one for one in range(3) if one != axis)
        for side in range(2):
            face = np.empty((4, 3))
            face[:, axis] = corners[side, axis]
            face[:, first] = corners[[0, 1, 1, 0], first]
            face[:, second] = corners[[0, 0, 1, 1], second]
            yield face


def _arrow(start: Float, end: Float, orbit: Orbit) -> Float:
    """Return an arrow (3, 2, 3) whose head lies in the plane of the picture."""
    shaft = end - start
    side = np.cross(shaft, orbit.axes()[2])
    side *= np.linalg.norm(shaft) / max(float(np.linalg.norm(side)), 1e-9)
    barbs = [end - 0.35 * shaft + sign * 0.2 * side for sign in (-1.0, 1.0)]
    return np.stack([np.stack([start, end]), *(np.stack([end, barb]) for barb in barbs)])


_RAY_MM = 25.0
_AZIMUTH, _ELEVATION = np.radians(60.0), np.radians(20.0)
_UP = np.array([0.0, 0.0, 1.0])


class ProbeDrawing(kit.PaintedWidget):
    """The probe as defined; undefined parts are omitted."""

    def __init__(self) -> None:
        super().__init__(tr("Picture of the probe"), kit.SCENE_SIZE, kit.SCENE_LEAST)
        self._leds: Points3 = np.empty((0, 3))
        self._directions: Points3 = np.empty((0, 3))
        self._tip: Float = np.zeros(3)

    def show_probe(self, leds_probe: Points3, directions_probe: Points3, tip_probe: Float) -> None:
        """Show LEDs (n, 3), mm, with their directions (n, 3), and the ball (3,)."""
        self._leds, self._directions, self._tip = leds_probe, directions_probe, tip_probe
        self.setAccessibleDescription(tr("%n LEDs", "1 LED", len(leds_probe)))
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        inside = self._paint_panel(painter).adjusted(10.0, 10.0, -10.0, -10.0)
        theme = self._theme
        if not len(self._leds):
            painter.drawText(inside, Qt.AlignmentFlag.AlignCenter, tr("no LEDs yet"))
            return
        length = np.linalg.norm(self._directions, axis=1, keepdims=True)
        rays = self._leds + _RAY_MM * self._directions / np.maximum(length, 1e-9)
        everything = np.concatenate([self._leds, rays, self._tip[None]])
        orbit = Orbit(np.zeros(3), _AZIMUTH, _ELEVATION, 100.0, _UP)
        orbit = orbit.fitted(everything, inside.width(), inside.height(), 1.2)
        middle = self._leds.mean(axis=0)
        arms = np.stack([np.broadcast_to(middle, self._leds.shape), self._leds], axis=1)
        items: list[Item] = [
            Lines(np.stack([self._tip, middle])[None], theme.text, 5.0),
            Lines(arms, theme.muted, 2.0),
            Lines(np.stack([self._leds, rays], axis=1), theme.warn, 2.0),
            Dots(self._tip[None], theme.accent, 14.0, theme.text),
            Dots(self._leds, theme.bad, 11.0, theme.text),
            Tag(self._tip, tr("ball"), theme.text),
        ]
        items += [Tag(led, kit.led_name(n), theme.text) for n, led in enumerate(self._leds)]
        paint_scene(painter, items, orbit, inside, kit.text_font(15, bold=True), theme.panel)
