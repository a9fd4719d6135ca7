"""Small 3-D scene in software: points, lines, faces, labels, and a part mesh.

In: items in mm, and the part. Out: a picture of them from a view; no graphics card is needed.

Start with `_scene` (items and projection); then `_scene_painter` (drawing by QPainter),
`_part_scene` (the part), `_scene_layer` (cached static picture), `_orbit_view` (mouse and keys).
It must not import jobs: their display is in `views`.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.scene._labels import StandingLabels
    from ocmm_gui.scene._orbit_view import OrbitView
    from ocmm_gui.scene._part_scene import (
        MOVING_TRIANGLES, PartDrawing, PartScene, SceneCache, StillScene, blended, edge_colour,
        part_colour,
    )  # fmt: skip
    from ocmm_gui.scene._scene import Diamonds, Dots, Face, Item, Lines, Orbit, Tag
    from ocmm_gui.scene._scene_layer import SceneLayer, painted_still
    from ocmm_gui.scene._scene_painter import ScenePainter, paint_scene
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "MOVING_TRIANGLES", "Diamonds", "Dots", "Face", "Item", "Lines", "Orbit", "OrbitView",
    "PartDrawing", "PartScene", "SceneCache", "SceneLayer", "ScenePainter", "StandingLabels",
    "StillScene", "Tag", "blended", "edge_colour", "paint_scene", "painted_still", "part_colour",
]  # fmt: skip
