"""Placed part for the 3-D view: extent, visibility and appearance."""

from __future__ import annotations

import contextlib
import threading

import numpy as np
from PySide6.QtCore import QObject, QTimer, Signal

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import Target
from ocmm_core.part_model import PartModel, PlacedPart
from ocmm_core.tolerances.decisions import DeviationPicture
from ocmm_gui.kit import Theme
from ocmm_gui.rendering import Colours, RenderMesh, RenderMode, ValueField, coarser, is_hidden
from ocmm_gui.scene import MOVING_TRIANGLES, PartDrawing, PartScene, blended, part_colour
from ocmm_gui.views import _shapes as shapes
from ocmm_gui.views._deviations import FieldRequest, field_colours, field_request, make_field

_ACTIVE_SHARE = 0.55
"""Share of highlight colour on faces of the active feature."""
_ALIGNED_MM, _ROUGH_MM = 1.0, 8.0
"""Maximum apparent depth of a measured point that is still drawn over the part."""
_REST_MS = 250
_NO_PLACES = np.empty((0, 3))


class PartPlacement(PartDrawing):
    """Holder of a placed part; empty without one. `parent`: Owner."""

    _field_made = Signal(object, object)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._placed: PlacedPart | None = None
        self._wanted: FieldRequest | None = None
        self._made_for: FieldRequest | None = None
        self._field: tuple[ValueField, RenderMesh] | None = None
        self._shaded: tuple[Colours, Theme, Colours] | None = None
        self._makes = False
        # Points arrive in quick succession: recolour when they pause.
        self._soon = QTimer(self, singleShot=True, interval=_REST_MS)
        self._soon.timeout.connect(self._begin_field)
        self._field_made.connect(self._keep_field)

    def place(self, placed: PlacedPart | None) -> None:
        """Set the part at its pose; None for none."""
        before = self._placed
        self.use(None if placed is None else placed.model)
        if before is not None and placed is not None and before.model is placed.model:
            old, new = before.T_world_from_model, placed.T_world_from_model
            if np.array_equal(old.rotation, new.rotation) and np.array_equal(
                old.translation, new.translation
            ):
                # Another object would repaint the part.
                placed = PlacedPart(placed.model, old, placed.is_rough)
        self._placed = placed

    def show_deviations(self, picture: DeviationPicture) -> None:
        """Colour the part near the touched places, unless unlocated.

        The previous colours stay until the new ones are computed in a thread.
        """
        wanted = field_request(picture, self._placed)
        if wanted is None or self.mesh is None:
            self._wanted = self._field = None
            self._soon.stop()
        elif not wanted.is_like(self._wanted):
            self._wanted = wanted
            self._soon.start()

    def _begin_field(self) -> None:
        """Compute the wanted colours, one thread at a time."""
        whole, placed, wanted = self.mesh, self._placed, self._wanted
        if self._makes or whole is None or placed is None or wanted is None:
            return
        self._makes = True
        threading.Thread(
            target=self._make_field, args=(whole, placed.model, wanted), name="part-colours",
            daemon=True,
        ).start()  # fmt: skip

    @property
    def reach_mm(self) -> float | None:
        """Return the colour reach of a point; None without colours."""
        return None if self._field is None else self._field[0].reach_mm

    def is_coloured(self) -> bool:
        """Return whether the requested colours are ready; for tests and screenshots."""
        return self._wanted is None or self._made_for is self._wanted

    def use(self, model: PartModel | None) -> None:
        """Set another part; None for none."""
        if model is not self._model:
            self._wanted = self._made_for = self._field = None
        super().use(model)

    def _make_field(self, whole: RenderMesh, model: PartModel, wanted: FieldRequest) -> None:
        made = None
        try:
            field = make_field(whole, model, wanted)
            made = None if field is None else (field, coarser(field.mesh, MOVING_TRIANGLES))
        except (MemoryError, ValueError):
            # Without memory, or with invalid places, it stays grey.
            pass
        finally:
            with contextlib.suppress(RuntimeError):
                self._field_made.emit(wanted, made)

    def _keep_field(self, wanted: FieldRequest, made: tuple[ValueField, RenderMesh] | None) -> None:
        self._makes = False
        if wanted is self._wanted:
            self._field, self._made_for = made, wanted
            self._shaded = None
            self.changed.emit()
        else:
            self._begin_field()

    def _dressed(
        self, mesh: RenderMesh, colours: Colours, theme: Theme, mode: RenderMode, *, moving: bool
    ) -> tuple[RenderMesh, Colours]:
        if self._field is None or mode is RenderMode.HIDDEN_LINES:
            return mesh, colours
        field, few = self._field
        known = self._shaded
        if known is None or known[0] is not colours or known[1] is not theme:
            known = self._shaded = (colours, theme, field_colours(field, colours, theme))
        return few if moving else field.mesh, known[2]

    def is_rough(self) -> bool:
        """Return whether there is a part at an unknown pose."""
        return self._placed is not None and self._placed.is_rough

    def is_there(self) -> bool:
        return self._placed is not None

    def corners(self) -> Float:
        """Return the corners (n, 3) of the part's bounding box, mm, world."""
        placed = self._placed
        if placed is None or not len(placed.model.vertices):
            return _NO_PLACES
        corners = np.unique(shapes.box(placed.model.box).reshape(-1, 3), axis=0)
        return placed.T_world_from_model.apply(corners)

    def extent(self, feature: str) -> Float:
        """Return the extent (n, 3) of a feature's faces, mm, world."""
        placed, faces = self._placed, self._faces(feature)
        if placed is None or not faces:
            return _NO_PLACES
        rows = np.isin(placed.model.triangle_faces, faces)
        places = placed.model.vertices[np.unique(placed.model.triangles[rows])]
        if not len(places):
            return _NO_PLACES
        return placed.T_world_from_model.apply(np.stack([places.min(axis=0), places.max(axis=0)]))

    def hides(self, target: Target, side: Float) -> bool:
        """Return whether the part hides a place from an eye in a direction (3,), unit."""
        placed, mesh = self._placed, self.ray_mesh
        if placed is None or mesh is None:
            return False
        place = placed.T_world_from_model
        # Use the ball centre, which is clear of the touched surface.
        point = (target.ball_world - place.translation) @ place.rotation
        return is_hidden(mesh, point, side @ place.rotation, 2.0 * mesh.cell_mm)

    def part(
        self, theme: Theme, mode: RenderMode, active: str, *, moving: bool
    ) -> PartScene | None:
        """Return the part for painting, with the active feature's faces marked."""
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
