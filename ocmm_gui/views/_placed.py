"""The part where it is thought to be, for the 3-D view: what it reaches, hides and looks like."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QObject

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import Target
from ocmm_core.part_model import PlacedPart
from ocmm_core.rendering import RenderMode, is_hidden
from ocmm_gui.kit import Theme
from ocmm_gui.views import _shapes as shapes
from ocmm_gui.views._part_scene import PartDrawing, PartScene, blended, part_colour

_ACTIVE_SHARE = 0.55
"""Faces of the feature that is measured have so much of the colour of what is marked."""
_ALIGNED_MM, _ROUGH_MM = 1.0, 8.0
"""So deep in the part a measured point may seem to lie, and is still drawn over it."""
_NO_PLACES = np.empty((0, 3))


class PlacedScene(PartDrawing):
    """Keeps a placed part; without one it reaches nothing, hides nothing and looks like nothing.

    Parameters
    ----------
    parent
        Who shows it.
    """

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._placed: PlacedPart | None = None

    def place(self, placed: PlacedPart | None) -> None:
        """Show a part where it is thought to be; None shows none."""
        before = self._placed
        self.use(None if placed is None else placed.model)
        if before is not None and placed is not None and before.model is placed.model:
            old, new = before.T_world_from_model, placed.T_world_from_model
            alike = np.array_equal(old.rotation, new.rotation) and np.array_equal(
                old.translation, new.translation
            )
            if alike:
                # Another object would have the part painted again.
                placed = PlacedPart(placed.model, old, placed.is_rough)
        self._placed = placed

    def is_rough(self) -> bool:
        """Return whether there is a part and nobody knows where it is."""
        return self._placed is not None and self._placed.is_rough

    def is_there(self) -> bool:
        """Return whether there is a part."""
        return self._placed is not None

    def corners(self) -> Float:
        """Return the corners (n, 3) of the box round the part, mm, world."""
        placed = self._placed
        if placed is None or not len(placed.model.vertices):
            return _NO_PLACES
        corners = np.unique(shapes.box(placed.model.box).reshape(-1, 3), axis=0)
        return placed.T_world_from_model.apply(corners)

    def extent(self, feature: str) -> Float:
        """Return the extent (n, 3) of the faces that belong to a feature, mm, world."""
        placed, faces = self._placed, self._faces(feature)
        if placed is None or not faces:
            return _NO_PLACES
        rows = np.isin(placed.model.triangle_faces, faces)
        places = placed.model.vertices[np.unique(placed.model.triangles[rows])]
        if not len(places):
            return _NO_PLACES
        extent = np.stack([places.min(axis=0), places.max(axis=0)])
        return placed.T_world_from_model.apply(extent)

    def hides(self, target: Target, side: Float) -> bool:
        """Return whether the part stands between a place and an eye in a direction (3,), unit."""
        placed, mesh = self._placed, self.ray_mesh
        if placed is None or mesh is None:
            return False
        place = placed.T_world_from_model
        # Who touches looks at the ball, which lies clear of the surface that it touches.
        point = (target.ball_world - place.translation) @ place.rotation
        return is_hidden(mesh, point, side @ place.rotation, 2.0 * mesh.cell_mm)

    def part(
        self, theme: Theme, mode: RenderMode, active: str, *, moving: bool
    ) -> PartScene | None:
        """Return the part as it is to be painted, the faces of the active feature marked."""
        placed = self._placed
        if placed is None:
            return None
        colour = blended(part_colour(theme), theme.accent, _ACTIVE_SHARE)
        marked = dict.fromkeys(self._faces(active), colour)
        slack = _ROUGH_MM if placed.is_rough else _ALIGNED_MM
        return self.scene(
            placed.T_world_from_model, theme, mode, marked, moving=moving, slack_mm=slack
        )

    def _faces(self, feature: str) -> list[int]:
        if self._placed is None or not feature:
            return []
        faces = self._placed.model.faces
        return [place for place, face in enumerate(faces) if face.feature == feature]
