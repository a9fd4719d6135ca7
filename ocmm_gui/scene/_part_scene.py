"""The part for 3-D views: mesh, coarser mesh for motion, and colours; scenes with it."""

from __future__ import annotations

import contextlib
import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from operator import is_

import numpy as np
from PySide6.QtCore import QObject, QSize, Signal
from PySide6.QtGui import QColor

from ocmm_core.geometry import RigidTransform
from ocmm_core.part_model import PartModel
from ocmm_gui.kit import Theme
from ocmm_gui.rendering import (
    Canvas,
    Colours,
    Rendering,
    RenderMesh,
    RenderMode,
    RenderStyle,
    coarser,
    face_colours,
    mesh_of,
    with_closed,
)
from ocmm_gui.scene._scene import Item, Orbit

MOVING_TRIANGLES = 50_000
"""Maximum triangles painted during motion: some 10 ms."""
_MOVING_PIXELS = 2_200_000
"""Larger pictures are painted at lower resolution during motion: a screen of 1920 x 1080."""
_SMALL_TRIANGLES = 4000
"""Closedness of such small meshes is computed at once."""


@dataclass(frozen=True, slots=True, eq=False)
class PartScene:
    """A part at its pose; immutable, compared by identity."""

    mesh: RenderMesh
    colours: Colours
    style: RenderStyle
    """`mesh`, `colours`, `style`: geometry and appearance."""
    T_world_from_model: RigidTransform
    moving: bool
    """Coarse picture suffices, as the next one follows at once."""
    slack_mm: float = 0.0
    """Depth at which measured items are still drawn over it: no part equals its nominal."""

    def scale(self, size: QSize, ratio: float, share: float) -> float:
        """Return painted pixels per window pixel; ``share``: affordable part in motion, 0 to 1."""
        if not self.moving:
            return ratio
        pixels = size.width() * size.height() * ratio**2
        return ratio * min(share, math.sqrt(_MOVING_PIXELS / max(pixels, 1.0)))

    def rendering(self, orbit: Orbit, size: QSize, canvas: Canvas, scale: float) -> Rendering:
        """Return its pending painting."""
        picture = orbit.projection(size.width(), size.height())
        pixels = np.array([scale, scale, 1.0])
        place = self.T_world_from_model
        matrix = (place.rotation.T @ picture.matrix) * pixels
        offset = ((place.translation - picture.target) @ picture.matrix + picture.middle) * pixels
        style = replace(self.style, half_px=self.style.half_px * scale)
        return Rendering(self.mesh, matrix, offset, canvas, style, self.colours)


@dataclass(frozen=True, slots=True, eq=False)
class StillScene:
    """Immutable scene; compared by identity."""

    items: tuple[Item, ...]
    orbit: Orbit
    size: QSize
    ratio: float
    """`size`, `ratio`: picture, px of the window, and screen pixels per window pixel."""
    background: str
    part: PartScene | None = None
    """Part that may hide items; None for none."""
    below: StillScene | None = None
    """Scene of the same view and part whose lines and dots are cached: its items change less often.
    Faces of both are painted first, then lines of both, then marks. None for none."""

    def is_seen_as(self, other: StillScene) -> bool:
        """Return whether view, picture size and background are equal: labels depend on all."""
        same = self.size == other.size and self.ratio == other.ratio
        return same and self.orbit is other.orbit and self.background == other.background

    def has_part_of(self, other: StillScene) -> bool:
        """Return whether the part looks the same in both."""
        return self.part is not None and self.part is other.part and self.is_seen_as(other)


class SceneCache:
    """Returns the same scene for unchanged inputs, for comparison by identity."""

    def __init__(self) -> None:
        self.scene: StillScene | None = None
        self._made_of: tuple[object, ...] = ()

    def made(
        self, things: tuple[object, ...], values: tuple[object, ...], make: Callable[[], StillScene]
    ) -> StillScene:
        """Return the scene, remade if ``things`` (by identity) or ``values`` have changed."""
        made_of = (*things, *values)
        count = len(things)
        same = len(made_of) == len(self._made_of) and all(map(is_, things, self._made_of[:count]))
        if self.scene is None or not same or values != self._made_of[count:]:
            self.scene = make()
            self._made_of = made_of
        return self.scene


class PartDrawing(QObject):
    """Cache of a part's drawing data; returns the same scene until something changes."""

    changed = Signal()
    _made = Signal(object, object)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._model: PartModel | None = None
        self._whole: RenderMesh | None = None
        self._coarse: RenderMesh | None = None
        self._colours: Colours | None = None
        self._of_mesh: tuple[RenderMesh, Colours, Colours] | None = None
        self._coloured: tuple[object, ...] = ()
        self._scene: PartScene | None = None
        self._made.connect(self._keep)

    @property
    def mesh(self) -> RenderMesh | None:
        return self._whole

    @property
    def ray_mesh(self) -> RenderMesh | None:
        """Return the (coarser) mesh for ray tests; None without a part or while computed."""
        whole = self._whole
        if whole is None or len(whole.triangles) <= MOVING_TRIANGLES:
            return whole
        return self._coarse

    def use(self, model: PartModel | None) -> None:
        """Set another part; None for none."""
        if model is self._model:
            return
        self._model, self._coarse, self._scene, self._coloured = model, None, None, ()
        self._whole = None
        if model is None or not len(model.triangles):
            return
        self._whole = whole = mesh_of(model)
        if len(whole.triangles) <= _SMALL_TRIANGLES:
            self._whole = with_closed(whole)
        else:
            # Some tenths of a second: too long for the window, not worth a process.
            threading.Thread(
                target=self._make, args=(model, whole), name="part-mesh", daemon=True
            ).start()

    def scene(
        self, place: RigidTransform, theme: Theme, mode: RenderMode,
        marked: Mapping[int, str] | None = None, colours: Colours | None = None,
        *, moving: bool = False, slack_mm: float = 0.0,
    ) -> PartScene | None:  # fmt: skip
        """Return the part for painting, or None.

        ``place``: world from model; ``marked``: ``#rrggbb`` by face; ``colours`` (n, 3).
        """
        if self._model is None or self._whole is None:
            return None
        coloured = (theme.name, tuple(sorted((marked or {}).items())), id(colours))
        if coloured != self._coloured or self._colours is None:
            base = part_colour(theme)
            self._colours = (
                face_colours(self._model, base, marked)
                if colours is None
                else np.require(colours, np.uint8, ["C", "W"])
            )
            self._coloured = coloured
        mesh = self._coarse if moving and self._coarse is not None else self._whole
        mesh, shown = self._dressed(mesh, self._colours, theme, mode, moving=moving)
        known = self._of_mesh
        if known is None or known[0] is not mesh or known[1] is not shown:
            known = self._of_mesh = (mesh, shown, mesh.vertex_colours(shown))
        own = known[2]
        style = RenderStyle(mode, edge_colour(theme), theme.panel, ground=theme.panel)
        before = self._scene
        if (
            before is None
            or before.mesh is not mesh
            or before.colours is not own
            or before.style != style
            or before.T_world_from_model is not place
            or before.moving != moving
            or before.slack_mm != slack_mm
        ):
            self._scene = PartScene(mesh, own, style, place, moving, slack_mm)
        return self._scene

    def _dressed(
        self, mesh: RenderMesh, colours: Colours, theme: Theme, mode: RenderMode, *, moving: bool
    ) -> tuple[RenderMesh, Colours]:
        """Return the mesh for painting, and its vertex colours."""
        return mesh, colours

    def _make(self, model: PartModel, whole: RenderMesh) -> None:
        try:
            closed = with_closed(whole)
            made = (closed, coarser(closed, MOVING_TRIANGLES))
        except (MemoryError, ValueError):
            # The whole mesh is used during motion: slower, same picture.
            return
        # The view may have been deleted without waiting for the result.
        with contextlib.suppress(RuntimeError):
            self._made.emit(model, made)

    def _keep(self, model: PartModel, made: tuple[RenderMesh, RenderMesh]) -> None:
        if model is self._model:
            self._whole, self._coarse = made
            self.changed.emit()


def part_colour(theme: Theme) -> str:
    """Return the default colour of faces: lit metal."""
    light = QColor(theme.panel).lightness() > 128
    return "#b9c4ce" if light else "#8795a3"


def edge_colour(theme: Theme) -> str:
    """Return the colour of edges, visible on faces and background."""
    return theme.text if QColor(theme.panel).lightness() > 128 else "#e8eef4"


def blended(first: str, second: str, share: float) -> str:
    """Return a mixture of two colours with ``share`` of the second, 0 to 1."""
    one, two = QColor(first), QColor(second)
    channels = (
        (one.red(), two.red()), (one.green(), two.green()), (one.blue(), two.blue())
    )  # fmt: skip
    return "#" + "".join(f"{round(a + share * (b - a)):02x}" for a, b in channels)
